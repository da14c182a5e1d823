// The live picture of a simulation, in device pixels, and the mouse, fingers and keys on it. Touches the DOM.
//
// Pictures are read by fetch(), where that is allowed: then their size follows the network (picture_pace.js). Otherwise the browser
// shows the stream by itself, in an <img>, and nobody notices how old it is: then pixels of the page have to do.

import { CameraInput } from './camera_input.js';
import { PicturePace } from './picture_pace.js';
import { PictureStream } from './picture_stream.js';
import { shrink } from './snapshot.js';
import { say } from './texts.js';

const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 8000;
const RESIZE_REST_MS = 200;
const PACE_MS = 250;
const MAX_WIDTH = 1920; // More costs the simulator and the network much, and shows little.
const MAX_HEIGHT = 1200;

export class Picture {
  #container;
  #resized;
  #surface = document.createElement('div');
  #canvas = document.createElement('canvas');
  #image = document.createElement('img');
  #input;
  #stream = null;
  #pace = new PicturePace();
  #pacing = 0;
  #source = null; // {url, viewOnly} while it is shown
  #next = null; // the last picture that arrived while another was decoded
  #decoding = false;
  #unreadable = new Set(); // origins whose pictures the browser shows, but scripts may not read
  #forGood = false;
  #failures = 0;
  #retry = 0;

  // Makes an element in `container`, whose size the picture takes. `resized` is called with {width, height} when that has changed,
  // or the network asks for another.
  constructor(container, { resized = () => {} } = {}) {
    this.#container = container;
    this.#resized = resized;
    this.#surface.hidden = true;
    Object.assign(this.#surface.style, { width: '100%', height: '100%', touchAction: 'none', userSelect: 'none' });
    for (const element of [this.#canvas, this.#image])
      Object.assign(element.style, { display: 'block', width: '100%', height: '100%', objectFit: 'contain' });
    this.#image.alt = '';
    this.#image.draggable = false;
    this.#image.onerror = () => this.#tryAgain();
    this.#image.onload = () => {
      if (this.#source === null)
        return; // forgotten while the event was on its way
      if (this.#forGood)
        this.#unreadable.add(new URL(this.#source.url).origin);
      this.#arrive();
    };
    this.#surface.append(this.#canvas);
    this.#input = new CameraInput(this.#surface, () => this.#pixels());
    container.prepend(this.#surface);
    this.#watchSize();
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
  // The last picture stays until the first of the source is there. The pictures of a source that is `early` go on when it is shown again.
  show(source, send) {
    const goesOn = this.#source?.early === true && this.#source.url === source.url && this.#stream !== null;
    if (!goesOn)
      this.#forgetSource();
    this.#source = source;
    this.#input.send = source.viewOnly ? null : send;
    this.#describe(source.viewOnly);
    this.sayName();
    this.#surface.dataset.source = source.url;
    this.#surface.hidden = false;
    if (goesOn)
      return;
    this.#open();
    this.#pacing = setInterval(() => this.#keepPace(), PACE_MS);
  }

  // Says what the picture is, in the language of the page.
  sayName() {
    this.#surface.setAttribute('aria-label', say('picture.name'));
  }

  // The picture in at most this many pixels, as an OffscreenCanvas; null while there is none. Throws where scripts may not read it.
  snapshot(limits) {
    if (this.#surface.dataset.live === undefined)
      return null;
    return shrink(this.#isLeftToBrowser ? this.#image : this.#canvas, limits);
  }

  // What the session tells: "time" announces a picture.
  receive(type) {
    if (type === 'time')
      this.#pace.announce(performance.now());
  }

  hide() {
    this.#forgetSource();
    this.#surface.hidden = true;
    delete this.#surface.dataset.live;
    this.#canvas.width = this.#canvas.height = 0;
    this.#pace = new PicturePace();
  }

  #forgetSource() {
    clearTimeout(this.#retry);
    clearInterval(this.#pacing);
    this.#stream?.close();
    this.#stream = this.#source = this.#next = null;
    this.#image.removeAttribute('src');
    this.#failures = 0;
    this.#input.send = null;
  }

  // A person who can move the camera must reach the picture with the keyboard, and screen readers must leave its keys to it.
  #describe(viewOnly) {
    this.#surface.setAttribute('role', viewOnly ? 'img' : 'application');
    if (viewOnly)
      this.#surface.removeAttribute('tabindex');
    else
      this.#surface.tabIndex = 0;
  }

  #open() {
    const { url } = this.#source;
    if (this.#unreadable.has(new URL(url).origin)) {
      // In a task of its own: an image that gets the same address back at once keeps its connection, which may be dead.
      this.#retry = setTimeout(() => this.#leaveToBrowser(true));
      return;
    }
    this.#stream?.close();
    this.#next = null;
    this.#pace.begin(performance.now());
    this.#stream = new PictureStream(url, {
      early: this.#source.early,
      arrived: (part) => this.#take(part),
      // An <img> may be let in where fetch() is not: browsers send credentials with it to other origins, too.
      ended: ({ status }) => (status === 200 ? this.#tryAgain() : this.#leaveToBrowser(status === null)),
    });
  }

  // `forGood`, if it shows them: their origin does not let scripts read pictures.
  #leaveToBrowser(forGood) {
    this.#stream = null;
    this.#forGood = forGood;
    if (!this.#isLeftToBrowser) {
      this.#surface.replaceChildren(this.#image);
      this.#resized(this.size);
    }
    this.#image.src = this.#source.url;
  }

  get #isLeftToBrowser() { return this.#surface.firstChild === this.#image; }

  #tryAgain() {
    if (this.#source === null)
      return;
    const delay = Math.min(LONGEST_RETRY_MS, FIRST_RETRY_MS * 2 ** this.#failures++);
    this.#retry = setTimeout(() => this.#open(), delay);
  }

  #arrive() {
    this.#failures = 0;
    this.#surface.dataset.live = '';
  }

  // Only the last picture is decoded: the others of a burst would be replaced before anybody saw them.
  #take(part) {
    this.#pace.arrive(performance.now());
    this.#next = part;
    if (!this.#decoding)
      this.#decode();
  }

  async #decode() {
    this.#decoding = true;
    while (this.#next !== null) {
      const { type, bytes } = this.#next;
      this.#next = null;
      const bitmap = await createImageBitmap(new Blob([bytes], { type })).catch(() => null); // A broken one is left out.
      if (bitmap !== null && this.#stream !== null)
        this.#draw(bitmap);
    }
    this.#decoding = false;
  }

  #draw(bitmap) {
    if (this.#canvas.width !== bitmap.width || this.#canvas.height !== bitmap.height)
      Object.assign(this.#canvas, { width: bitmap.width, height: bitmap.height });
    this.#canvas.getContext('bitmaprenderer').transferFromImageBitmap(bitmap);
    if (this.#isLeftToBrowser) {
      this.#surface.replaceChildren(this.#canvas);
      this.#resized(this.size);
    }
    this.#arrive();
  }

  #keepPace() {
    if (this.#stream === null || document.hidden)
      return;
    const decision = this.#pace.decide(performance.now(), this.#source.viewOnly);
    if (decision === 'shrink' || decision === 'grow')
      this.#resized(this.size);
    if (decision === 'shrink' || decision === 'renew')
      this.#open();
  }

  #pixels() {
    const { clientWidth, clientHeight } = this.#container;
    const largest = Math.min(this.#isLeftToBrowser ? 1 : devicePixelRatio, MAX_WIDTH / Math.max(1, clientWidth), MAX_HEIGHT / Math.max(1, clientHeight));
    const scale = largest * this.#pace.scale;
    return { scale, width: Math.max(1, Math.round(clientWidth * scale)), height: Math.max(1, Math.round(clientHeight * scale)) };
  }

  #watchSize() {
    let timer = 0;
    let last = JSON.stringify(this.size);
    const look = () => {
      clearTimeout(timer);
      timer = setTimeout(() => {
        const now = JSON.stringify(this.size);
        if (now !== last && this.#container.clientWidth > 0)
          this.#resized(this.size);
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
