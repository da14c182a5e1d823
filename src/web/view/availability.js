// Follows a session server's availability socket: "1" (a machine is free) or "0" (none is, or none answers). No DOM.

const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 30000;

export class Availability {
  #report;
  #url = null;
  #socket = null;
  #timer = 0;
  #failures = 0;

  // `report` is called with 'available', 'full' or 'unknown' whenever a new value is known.
  constructor(report) {
    this.#report = report;
    for (const type of ['offline', 'online'])
      globalThis.addEventListener?.(type, () => this.recheck());
  }

  // Follows the socket at `url`; null follows none. The same address again changes nothing.
  follow(url) {
    if (url === this.#url)
      return;
    this.#url = url;
    this.#failures = 0;
    this.#disconnect();
    this.#report('unknown');
    if (url !== null)
      this.#connect();
  }

  // Nothing else arrives from the network, or it has come back: what was reported may be old, and the socket dead without a word.
  recheck() {
    if (this.#url === null)
      return;
    this.#disconnect();
    this.#report('unknown');
    this.#connect();
  }

  #connect() {
    let socket;
    try {
      socket = new WebSocket(this.#url);
    } catch {
      return; // The browser refuses this address for good, for instance plain ws: from an https: page.
    }
    this.#socket = socket;
    socket.onmessage = ({ data }) => {
      this.#failures = 0;
      this.#report(data === '1' ? 'available' : data === '0' ? 'full' : 'unknown');
    };
    socket.onclose = () => {
      this.#report('unknown');
      this.#timer = setTimeout(() => this.#connect(), this.#nextDelay());
    };
  }

  #disconnect() {
    clearTimeout(this.#timer);
    if (this.#socket === null)
      return;
    this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
    this.#socket = null;
  }

  // A random part of up to a half, so that the pages of many visitors do not all reconnect to a restarted server at once.
  #nextDelay() {
    const delay = Math.min(LONGEST_DELAY_MS, FIRST_DELAY_MS * 2 ** this.#failures++);
    return delay * (0.5 + Math.random() / 2);
  }
}
