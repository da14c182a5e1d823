// The WebSocket to /client of a simulation server: the simulation runs as long as it is open. If the connection breaks, or
// nothing arrives any more, and the server gave a token, the lease returns to the simulation, which goes on meanwhile. No DOM.
//
// Events (CustomEvents):
//   message {text}                  a message of the server
//   lost {silent}                   the connection broke, or is `silent`; it is being restored
//   restored                        it is: the server has sent `webots:` again
//   closed {opened, code, silent}   the last event; `opened` when the server was ever reached

import { Watch, whenBack } from './watch.js';

const RETURN_MS = 300000; // how long to try to return; the server has its own limit, and says when that is over
const RETRY_MS = 1000;
const FIRST_OPENING_MS = 30000;
const RETURN_ANSWER_MS = 5000;
const BROKEN = [1006, 1012, 1013, 1014]; // the others mean that a server has closed the connection on purpose
const GONE = 1000;
const GIVEN_UP = 4000; // a code with which we return

export class Lease extends EventTarget {
  #url;
  #socket;
  #watch = new Watch(() => this.#giveUp());
  #opened = false;
  #token;
  #lostSince = null;
  #timer = 0;
  #stopListening = whenBack(() => this.#hurry());

  // Connects at once, and then sends `start`: an object, or the text of one. With the `token` of an earlier lease it returns to
  // its simulation instead.
  constructor(url, start, token = '') {
    super();
    this.#url = url;
    this.#token = token;
    if (token !== '')
      this.#lostSince = performance.now();
    this.#connect(token === '' ? start : { reconnect: token });
  }

  // With which another lease can return to the simulation; empty: the server gave none.
  get token() { return this.#token; }

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

  #connect(opening) {
    this.#socket = new WebSocket(this.#url);
    this.#socket.onopen = () => {
      this.#opened = true;
      if (this.#lostSince === null)
        clearTimeout(this.#timer); // what the start takes is the server's business
      this.#socket.send(typeof opening === 'string' ? opening : JSON.stringify(opening));
    };
    this.#socket.onmessage = ({ data }) => typeof data === 'string' && this.#receive(data);
    this.#socket.onclose = ({ code }) => this.#lose(code, false);
    this.#timer = setTimeout(() => this.#giveUp(), this.#lostSince === null ? FIRST_OPENING_MS : RETURN_ANSWER_MS);
  }

  #forget() {
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
  }

  #receive(text) {
    this.#watch.heard();
    const [, name, value] = /^(heartbeat|reconnectToken):\s?(.+)/.exec(text) ?? [];
    if (name === 'heartbeat')
      return this.#watch.start();
    if (name !== 'reconnectToken')
      return text !== '.' && this.#tell('message', { text });
    this.#token = value.trim();
    this.#tell('token');
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
    if (!BROKEN.includes(code) || !this.lasting || now - (this.#lostSince ?? now) > RETURN_MS) {
      this.#stop();
      return this.#tell('closed', { opened: this.#opened, code, silent });
    }
    if (this.#lostSince === null) {
      this.#lostSince = now;
      this.#tell('lost', { silent });
    }
    this.#timer = setTimeout(() => this.#return(), RETRY_MS * (1 + Math.random() / 2));
  }

  #return() {
    this.#connect({ reconnect: this.#token });
  }

  // Does not wait for the next attempt, or for one that may hang in a network that is no longer there.
  #hurry() {
    if (this.#lostSince === null)
      return;
    clearTimeout(this.#timer);
    this.#forget();
    this.#socket.close(GIVEN_UP, 'nothing arrives');
    this.#return();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
