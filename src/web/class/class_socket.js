// The WebSocket /class of a session server, with JSON both ways; it is opened again when it breaks. No DOM.
//
// Events (CustomEvents):
//   told (object)   a message of the server
//   lost {opened}   it broke, or could not be opened, and is being opened again; `opened` when the server was ever reached
//   closed {why}    the last event: 'teacher', 'idle', 'removed' or 'server'

import { whenBack } from './view/watch.js';

const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 10000;
const OPENING_MS = 10000;
const CHECK_MS = 1000;
const GIVEN_UP = 4000;

export class ClassSocket extends EventTarget {
  #url;
  #greet;
  #socket = null;
  #opened = false;
  #failures = 0;
  #timer = 0;
  #silence = 0;
  #heard = 0;
  #checking = 0;
  #stopListening = whenBack(() => this.#hurry());

  // `greet()` returns the message that is sent first, on each new connection.
  constructor(url, greet) {
    super();
    this.#url = url;
    this.#greet = greet;
    this.#connect();
  }

  get connected() { return this.#socket?.readyState === WebSocket.OPEN; }

  // Messages for a connection that is not there are lost: after the greeting the server knows what counts.
  send(message) {
    if (this.connected)
      this.#socket.send(JSON.stringify(message));
  }

  // Whether something should arrive at least once in this many milliseconds: then a connection that is silent is given up. 0: no.
  expect(milliseconds) {
    this.#silence = milliseconds;
    this.#heard = Date.now();
    clearInterval(this.#checking);
    if (milliseconds > 0)
      this.#checking = setInterval(() => this.#check(), CHECK_MS);
  }

  // No event follows.
  close() {
    clearTimeout(this.#timer);
    clearInterval(this.#checking);
    this.#stopListening();
    this.#drop();
  }

  #connect() {
    const socket = this.#socket = new WebSocket(this.#url);
    this.#timer = setTimeout(() => this.#giveUp(), OPENING_MS);
    socket.onopen = () => {
      clearTimeout(this.#timer);
      this.#opened = true;
      this.#heard = Date.now();
      this.send(this.#greet());
    };
    socket.onmessage = ({ data }) => this.#receive(data);
    socket.onclose = () => this.#lose();
  }

  #receive(data) {
    this.#failures = 0;
    this.#heard = Date.now();
    let message;
    try {
      message = JSON.parse(data);
    } catch {
      return;
    }
    if (typeof message !== 'object' || message === null)
      return;
    if (typeof message.closed === 'string') {
      this.close();
      this.#tell('closed', { why: message.closed });
    } else
      this.#tell('told', message);
  }

  #check() {
    if (this.connected && Date.now() - this.#heard > this.#silence)
      this.#giveUp();
  }

  #giveUp() {
    this.#drop();
    this.#lose();
  }

  #drop() {
    const socket = this.#socket;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close(GIVEN_UP);
  }

  // A random part, so that the pages of a class do not all come back to a restarted server at once.
  #lose() {
    clearTimeout(this.#timer);
    const delay = Math.min(LONGEST_DELAY_MS, FIRST_DELAY_MS * 2 ** this.#failures++) * (0.5 + Math.random() / 2);
    this.#timer = setTimeout(() => this.#connect(), delay);
    this.#tell('lost', { opened: this.#opened });
  }

  #hurry() {
    if (this.connected)
      return;
    clearTimeout(this.#timer);
    this.#drop();
    this.#connect();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
