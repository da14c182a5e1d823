// The WebSocket to /client of a simulation server: the simulation runs as long as it is open. If the connection breaks and
// the server gave a token, the lease reconnects to the simulation, which goes on meanwhile. No DOM.
//
// Events (CustomEvents):
//   message {text}          a message of the server
//   broken                  the connection broke and is being restored; then the server sends `webots:` again
//   closed {opened, code}   the last event; `opened` when the server was ever reached

const RETURN_MS = 300000; // how long to try to reconnect; the server has its own limit, and says when that is over
const RETRY_MS = 2000;
const BROKEN = 1006;

export class Lease extends EventTarget {
  #url;
  #socket;
  #opened = false;
  #token = '';
  #brokenSince = null;
  #retry = 0;

  // Connects at once, and then sends `start`: an object, or the text of one.
  constructor(url, start) {
    super();
    this.#url = url;
    this.#connect(start);
  }

  // Whether the simulation outlives a broken connection.
  get lasting() { return this.#token !== ''; }

  get connected() { return this.#socket.readyState === WebSocket.OPEN; }

  send(text) {
    if (this.connected)
      this.#socket.send(text);
  }

  // Ends the simulation. No event follows.
  close() {
    clearTimeout(this.#retry);
    this.#forget();
    this.#socket.close();
  }

  #connect(opening) {
    this.#socket = new WebSocket(this.#url);
    this.#socket.onopen = () => {
      this.#opened = true;
      this.#socket.send(typeof opening === 'string' ? opening : JSON.stringify(opening));
    };
    this.#socket.onmessage = ({ data }) => typeof data === 'string' && this.#receive(data);
    this.#socket.onclose = ({ code }) => this.#lose(code);
  }

  #forget() {
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
  }

  #receive(text) {
    const token = /^reconnectToken:\s?(.+)/.exec(text);
    if (token === null)
      return this.#tell('message', { text });
    this.#token = token[1].trim();
    this.#brokenSince = null;
  }

  #lose(code) {
    this.#forget();
    const now = Date.now();
    if (code !== BROKEN || !this.lasting || now - (this.#brokenSince ?? now) > RETURN_MS)
      return this.#tell('closed', { opened: this.#opened, code });
    if (this.#brokenSince === null) {
      this.#brokenSince = now;
      this.#tell('broken');
    }
    this.#retry = setTimeout(() => this.#connect({ reconnect: this.#token }), RETRY_MS);
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
