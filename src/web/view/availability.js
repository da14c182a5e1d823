// Follows a session server's availability socket: what its site is for somebody who comes now. Ours say it in a word, as "busy";
// others only "1" (a machine is free) or "0" (none is, or none answers). No DOM.

import { say } from './texts.js';

const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 30000;
const STATES = { 1: 'free', 0: 'none', free: 'free', busy: 'busy', full: 'full', draining: 'draining', down: 'down' };

// The same words wherever people read it. `state`: free | busy | full | draining | down | none | unknown.
export function siteText(state) {
  switch (state) {
    case 'free': return say('site.free');
    case 'busy': return say('site.busy');
    case 'full': return say('site.full');
    case 'draining': return say('site.draining');
    case 'down': return say('site.down');
    case 'none': return say('site.none');
    default: return say('site.unknown');
  }
}

// The same beside the lamp. `hasRoom`: there is a line, so where a seat or room is missing, one may wait.
export function lightText(state, hasRoom) {
  const text = siteText(state);
  return hasRoom && ['busy', 'full', 'none'].includes(state) ? `${text} ${say('site.mayWait')}` : text;
}

// In short: only a visitor who finds a free machine is served at once.
function shortOf(state) {
  switch (state) {
    case 'free': return 'available';
    case 'unknown': return 'unknown';
    default: return 'full';
  }
}

export class Availability {
  #report;
  #url = null;
  #socket = null;
  #timer = 0;
  #failures = 0;

  // `report` is called with 'available', 'full' or 'unknown' whenever a new value is known, and with the state, as for siteText().
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
    this.#tell('unknown');
    if (url !== null)
      this.#connect();
  }

  // Nothing else arrives from the network, or it has come back: what was reported may be old, and the socket dead without a word.
  recheck() {
    if (this.#url === null)
      return;
    this.#disconnect();
    this.#tell('unknown');
    this.#connect();
  }

  #tell(state) { this.#report(shortOf(state), state); }

  #connect() {
    let socket;
    try {
      socket = new WebSocket(`${this.#url}?state`); // other servers take no notice
    } catch {
      return; // The browser refuses this address for good, for instance plain ws: from an https: page.
    }
    this.#socket = socket;
    socket.onmessage = ({ data }) => {
      this.#failures = 0;
      this.#tell(Object.hasOwn(STATES, data) ? STATES[data] : 'unknown');
    };
    socket.onclose = () => {
      this.#tell('unknown');
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
