// The live picture of a simulation, in device pixels, and the mouse, fingers and keys on it. Touches the DOM.

import { CameraInput } from './camera_input.js';
import { say } from './texts.js';

const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 8000;
const RESIZE_REST_MS = 200;
const MAX_PIXELS = 1920 * 1200; // More costs the simulator and the network much, and shows little.

export class Picture {
  #container;
  #surface = document.createElement('div');
  #image = document.createElement('img');
  #input;
  #url = '';
  #failures = 0;
  #retry = 0;

  // Makes an element in `container`, whose size the picture takes. `resized` is called with {width, height} when that has changed.
  constructor(container, { resized = () => {} } = {}) {
    this.#container = container;
    this.#surface.hidden = true;
    Object.assign(this.#surface.style, { width: '100%', height: '100%', touchAction: 'none', userSelect: 'none' });
    Object.assign(this.#image.style, { display: 'block', width: '100%', height: '100%', objectFit: 'contain' });
    this.#image.alt = '';
    this.#image.draggable = false;
    this.#image.onerror = () => this.#tryAgain();
    this.#image.onload = () => this.#arrive();
    this.#surface.append(this.#image);
    this.#input = new CameraInput(this.#surface, () => this.#pixels());
    container.prepend(this.#surface);
    this.#watchSize(resized);
  }

  // The element that shows the picture: for an id, a class or a description. It has data-source, the address of the pictures, and
  // data-live once the first one is there.
  get element() { return this.#surface; }

  // The size to ask the simulator for, in device pixels.
  get size() {
    const { width, height } = this.#pixels();
    return { width, height };
  }

  // `source` is {url, viewOnly}; `send` gets the messages that move the camera, but not those of a spectator (`viewOnly`).
  show({ url, viewOnly = false }, send) {
    this.#forgetSource();
    this.#url = url;
    this.#input.send = viewOnly ? null : send;
    this.#describe(viewOnly);
    this.sayName();
    this.#surface.dataset.source = url;
    this.#image.src = url;
    this.#surface.hidden = false;
  }

  // Says what the picture is, in the language of the page.
  sayName() {
    this.#surface.setAttribute('aria-label', say('picture.name'));
  }

  hide() {
    this.#forgetSource();
    this.#surface.hidden = true;
    delete this.#surface.dataset.live;
    this.#image.removeAttribute('src');
  }

  #forgetSource() {
    clearTimeout(this.#retry);
    this.#url = '';
    this.#failures = 0;
    this.#input.send = null;
  }

  // Who can move the camera must reach the picture with the keyboard, and screen readers must leave its keys to it.
  #describe(viewOnly) {
    this.#surface.setAttribute('role', viewOnly ? 'img' : 'application');
    if (viewOnly)
      this.#surface.removeAttribute('tabindex');
    else
      this.#surface.tabIndex = 0;
  }

  #arrive() {
    this.#failures = 0;
    this.#surface.dataset.live = '';
  }

  #tryAgain() {
    if (this.#url === '')
      return;
    const delay = Math.min(LONGEST_RETRY_MS, FIRST_RETRY_MS * 2 ** this.#failures++);
    this.#retry = setTimeout(() => { this.#image.src = this.#url; }, delay);
  }

  #pixels() {
    const { clientWidth, clientHeight } = this.#container;
    const scale = Math.min(devicePixelRatio, Math.sqrt(MAX_PIXELS / Math.max(1, clientWidth * clientHeight)));
    return { scale, width: Math.max(1, Math.round(clientWidth * scale)), height: Math.max(1, Math.round(clientHeight * scale)) };
  }

  #watchSize(resized) {
    let timer = 0;
    let last = JSON.stringify(this.size);
    const look = () => {
      clearTimeout(timer);
      timer = setTimeout(() => {
        const now = JSON.stringify(this.size);
        if (now !== last && this.#container.clientWidth > 0)
          resized(this.size);
        last = now;
      }, RESIZE_REST_MS);
    };
    new ResizeObserver(look).observe(this.#container);
    watchPixelRatio(look);
  }
}

// Calls `changed` when the window moves to another screen, or the page is zoomed.
function watchPixelRatio(changed) {
  matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener('change', () => {
    changed();
    watchPixelRatio(changed);
  }, { once: true });
}
