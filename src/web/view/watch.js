// Notices when nothing arrives although something should. No DOM, but for the events of whenBack().

const CHECK_MS = 500;
const LATE_MS = 3 * CHECK_MS;

// How long a connection on which something arrives all the time may be silent.
export const SILENT_MS = 2500;

export class Watch {
  #silent;
  #limit = SILENT_MS;
  #timer = 0;
  #heard = 0;
  #checked = 0;

  // `silent` is called, once, when nothing has arrived for the limit.
  constructor(silent) {
    this.#silent = silent;
  }

  // Begins to watch, or goes on with another limit.
  start(limit = SILENT_MS) {
    this.#limit = limit;
    if (this.#timer !== 0)
      return;
    this.#heard = this.#checked = performance.now();
    this.#timer = setInterval(() => this.#check(), CHECK_MS);
  }

  stop() {
    clearInterval(this.#timer);
    this.#timer = 0;
  }

  // Something has arrived.
  heard() {
    this.#heard = performance.now();
  }

  // After a sleep, or in a hidden tab, this runs late, and before the messages that have arrived meanwhile are handled:
  // they get one more interval.
  #check() {
    const now = performance.now();
    if (now - this.#checked > LATE_MS)
      this.#heard = Math.max(this.#heard, now - this.#limit + CHECK_MS);
    this.#checked = now;
    if (now - this.#heard < this.#limit)
      return;
    this.stop();
    this.#silent();
  }
}

// Calls `action` when the network is back, or the page is seen again: timers of hidden pages may be a minute late. Returns
// a function that ends this.
export function whenBack(action) {
  const seen = () => globalThis.document?.visibilityState === 'visible' && action();
  globalThis.addEventListener?.('online', action);
  globalThis.document?.addEventListener('visibilitychange', seen);
  return () => {
    globalThis.removeEventListener?.('online', action);
    globalThis.document?.removeEventListener('visibilitychange', seen);
  };
}
