// Moves the simulator's camera: mouse, fingers and keys on a picture become messages (`mouse`, `touch`). Touches the DOM.

const ZOOM_PER_SQUARE_PIXEL = 0.015; // The unit in which simulators expect a pinch.
const KEY_STEP = 20; // picture pixels that one press of an arrow key drags
const LEFT = [0, 1]; // button, buttons: rotates
const RIGHT = [2, 2]; // moves sideways
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const WHEEL = { '+': -1, '=': -1, '-': 1, '_': 1 };

export class CameraInput {
  #element;
  #pixels;
  #send = null;
  #fingers = [];
  #pressed = 0;

  // Listens on `element`. `pixels` is a function that returns the number of picture pixels on each pixel of the page, and the
  // picture's size in pixels: {scale, width, height}.
  constructor(element, pixels) {
    this.#element = element;
    this.#pixels = pixels;
    this.#watchMouse();
    this.#watchTouch();
    element.addEventListener('keydown', (event) => this.#press(event));
  }

  // Where the messages go; null: nowhere, as for spectators.
  set send(send) { this.#send = send; }

  #tell(message) {
    this.#send?.(message);
  }

  #watchMouse() {
    const element = this.#element;
    const mouse = (handler) => (event) => {
      if (event.pointerType !== 'touch')
        handler(event);
    };
    element.addEventListener('pointerdown', mouse((event) => {
      element.setPointerCapture(event.pointerId); // A drag goes on outside the picture.
      this.#pressed = event.buttons;
      this.#sendMouse(-1, event, 0);
    }));
    element.addEventListener('pointermove', mouse((event) => event.buttons !== 0 && this.#sendMouse(0, event, 0)));
    element.addEventListener('pointerup', mouse((event) => this.#sendMouse(1, event, 0)));
    element.addEventListener('pointercancel', mouse((event) => this.#sendMouse(1, event, 0)));
    element.addEventListener('contextmenu', (event) => event.preventDefault());
    element.addEventListener('dragstart', (event) => event.preventDefault());
    element.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.#sendMouse(2, event, Math.sign(event.deltaY));
    }, { passive: false });
  }

  // mouse <press -1, move 0, release 1, wheel 2> <button> <buttons> <x> <y> <modifiers> <wheel>
  // A release still names the buttons that were held, as simulators know it from other clients.
  #sendMouse(type, event, wheel) {
    const { x, y } = this.#inPicture(this.#position(event));
    const modifiers = (event.shiftKey ? 1 : 0) + (event.ctrlKey ? 2 : 0) + (event.altKey ? 4 : 0);
    const button = Math.max(0, event.button); // The browser says -1 for "no change".
    const buttons = event.buttons || (type === 1 ? this.#pressed : 0);
    this.#tell(`mouse ${type} ${button} ${buttons} ${x} ${y} ${modifiers} ${wheel}`);
  }

  // Arrows drag the picture from its middle, with Shift sideways; + and - turn the wheel. Keys with Ctrl, Alt or Meta are the browser's.
  #press(event) {
    if (this.#send === null || event.ctrlKey || event.altKey || event.metaKey)
      return;
    const arrow = ARROWS[event.key];
    const wheel = WHEEL[event.key];
    if (arrow === undefined && wheel === undefined)
      return;
    event.preventDefault(); // The page stays where it is.
    const { width, height } = this.#pixels();
    const x = Math.round(width / 2);
    const y = Math.round(height / 2);
    if (wheel !== undefined)
      return this.#tell(`mouse 2 0 0 ${x} ${y} 0 ${wheel}`);
    const [button, buttons] = event.shiftKey ? RIGHT : LEFT;
    const end = `${x + KEY_STEP * arrow[0]} ${y + KEY_STEP * arrow[1]} 0 0`;
    this.#tell(`mouse -1 ${button} ${buttons} ${x} ${y} 0 0`);
    this.#tell(`mouse 0 ${button} ${buttons} ${end}`);
    this.#tell(`mouse 1 ${button} ${buttons} ${end}`);
  }

  #watchTouch() {
    const listen = (type, handler) => this.#element.addEventListener(type, (event) => {
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
    const { x, y } = this.#inPicture(middle(fingers));
    this.#tell(`touch -1 ${fingers.length} ${x} ${y}`);
  }

  // One finger rotates the view; two zoom it by moving apart and tilt it (radians) by turning around each other. Distances stay in
  // pixels of the page: the same movement of a hand turns the view as far on every screen.
  #moveFingers(fingers) {
    const before = this.#fingers;
    this.#fingers = fingers;
    if (before.length !== fingers.length)
      return;
    if (fingers.length === 1)
      this.#tell(`touch 0 1 ${fingers[0].x - before[0].x} ${fingers[0].y - before[0].y}`);
    else
      this.#tell(`touch 0 2 ${turn(before, fingers)} ${pinch(before, fingers)}`);
  }

  #position({ clientX, clientY }) {
    const box = this.#element.getBoundingClientRect();
    return { x: Math.round(clientX - box.left), y: Math.round(clientY - box.top) };
  }

  #inPicture({ x, y }) {
    const { scale } = this.#pixels();
    return { x: Math.round(x * scale), y: Math.round(y * scale) };
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
