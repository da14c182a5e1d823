// Keeps the screen on while a simulation runs, where the browser can (pages by https: or of this machine). Touches the DOM.

export class WakeLock {
  #wanted = false;
  #lock = null;
  #asking = false;

  constructor() {
    // The browser lets go of the lock when the page is hidden.
    document.addEventListener('visibilitychange', () => this.#update());
  }

  // Whether the screen is to stay on.
  set wanted(wanted) {
    this.#wanted = wanted;
    this.#update();
  }

  async #update() {
    if (!this.#wanted) {
      this.#lock?.release();
      this.#lock = null;
      return;
    }
    if (this.#asking || document.hidden || this.#lock?.released === false)
      return;
    this.#asking = true;
    try {
      this.#lock = await navigator.wakeLock?.request('screen') ?? null;
    } catch { /* Saving power is the browser's right. */ }
    this.#asking = false;
    if (!this.#wanted)
      this.#update(); // It was given back meanwhile.
  }
}
