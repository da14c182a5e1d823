// The WebSocket to /client of a simulation server, or of a session server that relays: the simulation runs as long as it is
// open. If the connection breaks, or nothing arrives any more, and the server gave a token, the lease returns to the simulation,
// which goes on meanwhile. If that happens while it waits in the line of a session server, it returns there, and takes its place
// with the server's ticket. No DOM.
//
// Events (CustomEvents):
//   message {text}                  a message of the server
//   token                           another `token` or `waitingTicket`, or none any more
//   lost {silent, waiting}          the connection broke, or is `silent`; it is being restored; `waiting` in the line
//   restored                        it is: the server has sent `webots:` again, or in the line anything
//   closed {opened, code, silent}   the last event; `opened` when the server was ever reached

import { SILENT_MS, Watch, whenBack } from './watch.js';

const RETURN_MS = 300000; // how long to try to return; the server has its own limit, and says when that is over
const RETRY_MS = 1000;
const LINE_SILENT_MS = 25000; // a page that waits hears something every 10 s
const FIRST_OPENING_MS = 30000;
const RETURN_ANSWER_MS = 5000;
const BROKEN = [1006, 1012, 1013, 1014]; // the others mean that a server has closed the connection on purpose
const GOING_AWAY = 1001; // of a server that stops, which says so; of Firefox, before it tells the page that it is left; of a proxy that reloads
const STOPPING = 'the server is stopping';
const GONE = 1000;
const GIVEN_UP = 4000; // a code with which we return
const PREPARED_MS = 20000; // servers close the connections of those who ask for nothing within 30 s

let prepared = null; // {url, socket, timer}: for the next lease

// Connects for the next lease at this address, before it is wanted: that need not wait for a connection then.
export function prepareLease(url) {
  if (prepared?.url === url)
    return;
  takePrepared()?.close();
  let socket;
  try {
    socket = new WebSocket(url);
  } catch {
    return; // The lease will say why.
  }
  prepared = { url, socket, timer: setTimeout(() => takePrepared()?.close(), PREPARED_MS) };
  socket.onclose = () => takePrepared(url);
}

// Null: there is none at this address.
function takePrepared(url = prepared?.url) {
  if (prepared === null || prepared.url !== url)
    return null;
  const { socket, timer } = prepared;
  clearTimeout(timer);
  socket.onclose = prepared = null;
  return socket;
}

export class Lease extends EventTarget {
  #url;
  #socket;
  #watch = new Watch(() => this.#giveUp());
  #opened = false;
  #start;
  #token;
  #ticket; // of a place in the line
  #waits = false; // since the server said so, until there is a simulation
  #isLast = false; // what was heard last is the place in the line
  #lostSince = null;
  #timer = 0;
  #stopListening = whenBack(() => this.#hurry());

  // Connects at once, and then sends `start`: an object, or the text of one. With the `token` of an earlier lease it returns to
  // its simulation instead, with its `waitingTicket` to its place in the line.
  constructor(url, start, { token = '', waitingTicket = '' } = {}) {
    super();
    this.#url = url;
    this.#start = start;
    this.#token = token;
    this.#ticket = waitingTicket;
    this.#waits = waitingTicket !== '';
    if (this.lasting || this.#waits)
      this.#lostSince = performance.now();
    this.#connect();
  }

  // With which another lease can return to the simulation; empty: the server gave none.
  get token() { return this.#token; }

  // With which another lease can take this one's place in the line; empty: there is none.
  get waitingTicket() { return this.#ticket; }

  // Whether the simulation outlives a broken connection.
  get lasting() { return this.#token !== ''; }

  get connected() { return this.#lostSince === null && this.#socket.readyState === WebSocket.OPEN; }

  send(text) {
    if (this.connected)
      this.#socket.send(text);
  }

  // Ends the simulation. No event follows.
  close() {
    this.#stop();
    this.#socket.close(GONE);
  }

  // The page goes away, and may return. A page that the browser keeps for the button Back would keep the connection open. No
  // event follows.
  leave() {
    this.#stop();
    this.#socket.close(GIVEN_UP, 'the page is left');
  }

  #stop() {
    clearTimeout(this.#timer);
    this.#watch.stop();
    this.#stopListening();
    this.#forget();
  }

  #opening() {
    if (this.lasting)
      return JSON.stringify({ reconnect: this.#token });
    if (typeof this.#start === 'string')
      return this.#start;
    const place = this.#ticket === '' ? {} : { waitingTicket: this.#ticket };
    const { start } = this.#start;
    return JSON.stringify(start === undefined ? { ...this.#start, ...place } : { ...this.#start, start: { ...start, ...place } });
  }

  #connect() {
    this.#socket = takePrepared(this.#url) ?? new WebSocket(this.#url);
    this.#socket.onopen = () => {
      this.#opened = true;
      if (!this.lasting)
        clearTimeout(this.#timer); // what the start takes is the server's business
      this.#socket.send(this.#opening());
    };
    this.#socket.onmessage = ({ data }) => typeof data === 'string' && this.#receive(data);
    this.#socket.onclose = ({ code, reason }) => this.#lose(code === GOING_AWAY && reason !== STOPPING ? BROKEN[0] : code, false);
    this.#timer = setTimeout(() => this.#giveUp(), this.#lostSince === null ? FIRST_OPENING_MS : RETURN_ANSWER_MS);
    if (this.#socket.readyState === WebSocket.OPEN)
      this.#socket.onopen();
  }

  #forget() {
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
  }

  #receive(text) {
    this.#watch.heard();
    if (!this.lasting)
      this.#restore();
    const [, name, value] = /^(heartbeat|reconnectToken|waitingTicket|waiting|queue|webots|loading|error|Error):\s?(.+)/.exec(text) ?? [];
    switch (name) {
      case 'heartbeat':
        this.#isLast = false;
        return this.#watch.start(SILENT_MS);
      case 'reconnectToken':
        this.#token = value.trim();
        this.#tell('token');
        return this.#restore();
      case 'waitingTicket':
        this.#waits = true;
        this.#ticket = value.trim();
        return this.#tell('token');
      case 'waiting':
        this.#waits = this.#isLast = true;
        this.#watch.start(LINE_SILENT_MS);
        break;
      case 'webots': case 'error': case 'Error': case 'loading':
        this.#leaveLine(name, value);
    }
    if (text !== '.')
      this.#tell('message', { text });
  }

  // The turn has come: from now on the server is as silent as a machine. A machine that refuses is silent, too, whatever it has promised.
  #leaveLine(name, value) {
    if (this.#isLast || value.startsWith('Trying another machine'))
      this.#watch.stop();
    this.#isLast = false;
    if (name === 'loading' && !value.startsWith('Error'))
      return;
    this.#waits = false;
    if (this.#ticket === '')
      return;
    this.#ticket = '';
    this.#tell('token');
  }

  #restore() {
    if (this.#lostSince === null)
      return;
    clearTimeout(this.#timer);
    this.#lostSince = null;
    this.#tell('restored');
  }

  // The server does not answer, or nothing arrives any more. The old connection may still work in the other direction: the
  // code tells the server that we return.
  #giveUp() {
    this.#socket.onclose = null;
    this.#socket.close(GIVEN_UP, 'nothing arrives');
    this.#lose(BROKEN[0], true);
  }

  #lose(code, silent) {
    clearTimeout(this.#timer);
    this.#watch.stop();
    this.#forget();
    const now = performance.now();
    if (!BROKEN.includes(code) || !(this.lasting || this.#waits) || now - (this.#lostSince ?? now) > RETURN_MS) {
      this.#stop();
      return this.#tell('closed', { opened: this.#opened, code, silent });
    }
    if (this.#lostSince === null) {
      this.#lostSince = now;
      this.#tell('lost', { silent, waiting: !this.lasting });
    }
    this.#timer = setTimeout(() => this.#connect(), RETRY_MS * (1 + Math.random() / 2));
  }

  // Does not wait for the next attempt, or for one that may hang in a network that is no longer there.
  #hurry() {
    const isOpen = this.#socket.readyState === WebSocket.OPEN;
    if (this.#lostSince === null || (isOpen && !this.lasting)) // a start that has been sent is not sent twice
      return;
    clearTimeout(this.#timer);
    this.#forget();
    this.#socket.close(GIVEN_UP, 'nothing arrives');
    this.#connect();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
