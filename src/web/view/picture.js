// The live picture: a multipart image in an <img>, and the mouse and fingers on it.

const FIRST_RETRY_MS = 500;
const LONGEST_RETRY_MS = 8000;
const RESIZE_REST_MS = 200;
const ZOOM_PER_SQUARE_PIXEL = 0.015; // The unit in which simulators expect a pinch.

export class Picture {
  #image;
  #frame;
  #url = '';
  #failures = 0;
  #retry = 0;
  #send = () => {};
  #fingers = [];
  #pressed = 0;

  // `frame` is the box whose size the picture takes; `resized` is called with {width, height} when that has changed.
  constructor(image, frame, resized) {
    this.#image = image;
    this.#frame = frame;
    image.onerror = () => this.#tryAgain();
    image.onload = () => { this.#failures = 0; };
    this.#watchSize(resized);
    this.#watchMouse();
    this.#watchTouch();
  }

  get size() {
    return { width: Math.round(this.#frame.clientWidth), height: Math.round(this.#frame.clientHeight) };
  }

  // `send` gets the input messages; null for a spectator, whose input is not wanted.
  show(url, send) {
    this.hide();
    this.#url = url;
    this.#send = send ?? (() => {});
    this.#image.src = url;
    this.#image.hidden = false;
  }

  hide() {
    clearTimeout(this.#retry);
    this.#url = '';
    this.#failures = 0;
    this.#send = () => {};
    this.#image.hidden = true;
    this.#image.removeAttribute('src');
  }

  #tryAgain() {
    if (this.#url === '')
      return;
    const delay = Math.min(LONGEST_RETRY_MS, FIRST_RETRY_MS * 2 ** this.#failures++);
    this.#retry = setTimeout(() => { this.#image.src = this.#url; }, delay);
  }

  #watchSize(resized) {
    let timer = 0;
    let last = JSON.stringify(this.size);
    new ResizeObserver(() => {
      clearTimeout(timer);
      timer = setTimeout(() => {
        const now = JSON.stringify(this.size);
        if (now !== last)
          resized(this.size);
        last = now;
      }, RESIZE_REST_MS);
    }).observe(this.#frame);
  }

  #watchMouse() {
    const image = this.#image;
    const mouse = (handler) => (event) => {
      if (event.pointerType !== 'touch')
        handler(event);
    };
    image.addEventListener('pointerdown', mouse((event) => {
      image.setPointerCapture(event.pointerId); // A drag goes on outside the picture.
      this.#pressed = event.buttons;
      this.#sendMouse(-1, event, 0);
    }));
    image.addEventListener('pointermove', mouse((event) => event.buttons !== 0 && this.#sendMouse(0, event, 0)));
    image.addEventListener('pointerup', mouse((event) => this.#sendMouse(1, event, 0)));
    image.addEventListener('pointercancel', mouse((event) => this.#sendMouse(1, event, 0)));
    image.addEventListener('contextmenu', (event) => event.preventDefault());
    image.addEventListener('dragstart', (event) => event.preventDefault());
    image.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.#sendMouse(2, event, Math.sign(event.deltaY));
    }, { passive: false });
  }

  // mouse <press -1, move 0, release 1, wheel 2> <button> <buttons> <x> <y> <modifiers> <wheel>
  // A release still names the buttons that were held, as simulators know it from other clients.
  #sendMouse(type, event, wheel) {
    const { x, y } = this.#position(event);
    const modifiers = (event.shiftKey ? 1 : 0) + (event.ctrlKey ? 2 : 0) + (event.altKey ? 4 : 0);
    const button = Math.max(0, event.button); // The browser says -1 for "no change".
    const buttons = event.buttons || (type === 1 ? this.#pressed : 0);
    this.#send(`mouse ${type} ${button} ${buttons} ${x} ${y} ${modifiers} ${wheel}`);
  }

  #watchTouch() {
    const listen = (type, handler) => this.#image.addEventListener(type, (event) => {
      event.preventDefault();
      handler([...event.targetTouches].slice(0, 2).map((touch) => this.#position(touch)));
    }, { passive: false });
    listen('touchstart', (fingers) => this.#touch(fingers));
    listen('touchend', (fingers) => { this.#fingers = fingers; });
    listen('touchcancel', (fingers) => { this.#fingers = fingers; });
    listen('touchmove', (fingers) => this.#moveFingers(fingers));
  }

  #touch(fingers) {
    this.#fingers = fingers;
    const { x, y } = middle(fingers);
    this.#send(`touch -1 ${fingers.length} ${x} ${y}`);
  }

  // One finger rotates the view; two zoom it by moving apart and tilt it (radians) by turning around each other.
  #moveFingers(fingers) {
    const before = this.#fingers;
    this.#fingers = fingers;
    if (before.length !== fingers.length)
      return;
    if (fingers.length === 1)
      this.#send(`touch 0 1 ${fingers[0].x - before[0].x} ${fingers[0].y - before[0].y}`);
    else
      this.#send(`touch 0 2 ${turn(before, fingers)} ${pinch(before, fingers)}`);
  }

  #position({ clientX, clientY }) {
    const box = this.#image.getBoundingClientRect();
    return { x: Math.round(clientX - box.left), y: Math.round(clientY - box.top) };
  }
}

const mean = (numbers) => Math.round(numbers.reduce((sum, number) => sum + number, 0) / numbers.length);
const middle = (fingers) => ({ x: mean(fingers.map(({ x }) => x)), y: mean(fingers.map(({ y }) => y)) });
const squaredDistance = ([a, b]) => (a.x - b.x) ** 2 + (a.y - b.y) ** 2;
const angle = ([a, b]) => Math.atan2(b.y - a.y, b.x - a.x);
const pinch = (before, after) => decimal(ZOOM_PER_SQUARE_PIXEL * (squaredDistance(before) - squaredDistance(after)));

function turn(before, after) {
  const difference = angle(after) - angle(before);
  return decimal(Math.atan2(Math.sin(difference), Math.cos(difference)));
}

const decimal = (number) => Number(number.toFixed(4));
