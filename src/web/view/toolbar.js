// The toolbar of a simulation, the same in the viewer, in embedded views and in a class: buttons with an icon above a word, one look for what
// is pressed, one place for the time. Its style is simulation.css. Touches the DOM.

import { say } from './texts.js';

const SVG = 'http://www.w3.org/2000/svg';
const ICONS = {
  play: 'M4 2.5v11l9-5.5z',
  pause: 'M4 3h3v10H4zm5 0h3v10H9z',
  step: 'M3 3v10l7-5zm8 0h2v10h-2z',
  fast: 'M2 3v10l6-5zm6 0v10l6-5z',
  reset: 'M3 3h2v10H3zm10 0v10L6 8z',
  reload: 'M8 3a5 5 0 1 0 5 5h-2a3 3 0 1 1-3-3v2.5L12 4 8 .5z',
  extend: 'M8 1.5a6.5 6.5 0 1 0 0 13 6.5 6.5 0 0 0 0-13zm0 2a4.5 4.5 0 1 1 0 9 4.5 4.5 0 0 1 0-9zM7.2 5v3.6l2.6 1.7.8-1.3-1.8-1.2V5z',
  code: 'M5.2 3.5 6.6 4.9 3.5 8l3.1 3.1-1.4 1.4L.7 8zm5.6 0L15.3 8l-4.5 4.5-1.4-1.4L12.5 8 9.4 4.9z',
  console: 'M1.5 2.5h13v11h-13zm1.6 1.6v7.8h9.8V4.1zM4.4 6l1-1 2.6 2.6-2.6 2.6-1-1L6 7.6zm3.8 3.4h3.4v1.4H8.2z',
  share: 'M11.8 1a2.7 2.7 0 0 1 .2 5.4 2.7 2.7 0 0 1-2-.9L6.3 7.4a2.7 2.7 0 0 1 0 1.2L10 10.5a2.7 2.7 0 1 1-.7 1.4L5.6 10a2.7 2.7 0 1 1 0-4l3.7-1.9A2.7 2.7 0 0 1 11.8 1z',
  screenshot: 'M5.5 3 6.5 1.5h3l1 1.5h4v10.5h-13V3zM8 4.8a3.2 3.2 0 1 0 0 6.4 3.2 3.2 0 0 0 0-6.4zm0 1.5a1.7 1.7 0 1 1 0 3.4 1.7 1.7 0 0 1 0-3.4z',
  fullscreen: 'M2 2h5v2H4v3H2zm7 0h5v5h-2V4H9zM2 9h2v3h3v2H2zm10 0h2v5H9v-2h3z',
  help: 'M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1zm0 1.7a5.3 5.3 0 1 1 0 10.6A5.3 5.3 0 0 1 8 2.7zM8 4a2.5 2.5 0 0 0-2.6 2.5h1.6c0-.6.4-1 1-1s1 .4 1 .9c0 1-1.8 1.2-1.8 3.1h1.6c0-1.1 1.8-1.4 1.8-3.1C10.6 5 9.5 4 8 4zm-.9 6.4V12h1.8v-1.6z',
  message: 'M1.5 2.5h13v8.8H8l-3.6 3v-3H1.5zM3.2 4.2v5.4h9.6V4.2z',
  window: 'M1.5 2.5h13v11h-13zM3 6v6h10V6z',
  quit: 'M3 3h10v10H3z',
  hand: 'M4.6 8.6V3.4a.95.95 0 0 1 1.9 0V7h.5V2a.95.95 0 0 1 1.9 0v5h.5V2.8a.95.95 0 0 1 1.9 0V7.6h.5V4.9a.95.95 0 0 1 1.9 0v5.2c0 3-2 5.2-4.8 5.2-2.1 0-3.4-1-4.4-2.7L1.9 9.6c-.6-1.1.7-2 1.5-1.2z',
  check: 'M6.3 13.2 1.6 8.5l1.7-1.7 3 3 6.4-6.4 1.7 1.7z',
};
const COMMANDS = ['play', 'pause', 'step', 'fast', 'reset', 'reload'];
const STATES = { play: 'running', pause: 'paused', fast: 'fast' }; // in which a button is pressed

export class Toolbar {
  #element;
  #buttons = new Map();
  #time = document.createElement('time');
  #caption = document.createElement('span');

  // Takes an empty element, or makes one.
  constructor(element = document.createElement('div')) {
    this.#element = element;
    element.classList.add('toolbar');
    element.setAttribute('role', 'toolbar');
    this.#time.setAttribute('role', 'timer');
    this.#time.setAttribute('aria-live', 'off');
    this.#caption.className = 'caption';
    this.sayAll();
  }

  get element() { return this.#element; }

  button(name) { return this.#buttons.get(name); }

  // Commands of a simulation have no effect before setState().
  add(name, pressed, { id = '', shown = true } = {}) {
    const button = toolButton(name, pressed);
    button.id = id;
    button.hidden = !shown;
    button.disabled = COMMANDS.includes(name);
    if (name in STATES)
      button.setAttribute('aria-pressed', 'false');
    this.#buttons.set(name, button);
    this.#element.append(button);
    return button;
  }

  addCommands(obey, options = () => ({})) {
    for (const name of COMMANDS)
      this.add(name, () => obey(name), options(name));
  }

  // The simulated time, with what else belongs there before it: it takes the room that is left.
  addTime(...before) {
    const clock = Object.assign(document.createElement('span'), { className: 'clock' });
    clock.append(this.#caption, this.#time);
    const place = Object.assign(document.createElement('span'), { className: 'clocks' });
    place.append(...before, clock);
    this.#element.append(place);
    return this.#time;
  }

  setTime(milliseconds) { this.#time.textContent = timeText(milliseconds); }

  setState(state, hasCommands) {
    for (const name of COMMANDS) {
      const button = this.#buttons.get(name);
      button.disabled = !hasCommands;
      if (name in STATES)
        button.setAttribute('aria-pressed', String(STATES[name] === state));
    }
  }

  // What has no commands shows none.
  hideCommands() {
    for (const name of COMMANDS)
      this.#buttons.get(name).hidden = true;
  }

  // In the language of the page.
  sayAll() {
    this.#element.setAttribute('aria-label', say('viewer.controls'));
    this.#caption.textContent = say('viewer.simulatedTime');
    for (const [name, button] of this.#buttons)
      button.lastChild.textContent = nameOf(name);
  }
}

// A button of a toolbar; `text` where it has no word of its own.
export function toolButton(name, pressed, text = nameOf(name)) {
  const button = Object.assign(document.createElement('button'), { type: 'button', className: 'tool' });
  const word = document.createElement('span');
  word.textContent = text;
  button.append(icon(name), word);
  button.addEventListener('click', pressed);
  return button;
}

export function icon(name) {
  const picture = document.createElementNS(SVG, 'svg');
  picture.setAttribute('viewBox', '0 0 16 16');
  picture.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS(SVG, 'path');
  path.setAttribute('d', ICONS[name]);
  path.setAttribute('fill-rule', 'evenodd');
  picture.append(path);
  return picture;
}

function timeText(milliseconds) {
  const total = Math.max(0, Math.round(milliseconds));
  const part = (unit, count, digits) => String(Math.floor(total / unit) % count).padStart(digits, '0');
  return `${Math.floor(total / 3600000)}:${part(60000, 60, 2)}:${part(1000, 60, 2)}.${part(1, 1000, 3)}`;
}

function nameOf(name) {
  switch (name) {
    case 'play': return say('viewer.play');
    case 'pause': return say('viewer.pause');
    case 'step': return say('viewer.step');
    case 'fast': return say('viewer.fast');
    case 'reset': return say('viewer.reset');
    case 'reload': return say('viewer.reload');
    case 'extend': return say('lease.extend');
    case 'code': return say('code.title');
    case 'console': return say('viewer.console');
    case 'share': return say('viewer.share');
    case 'screenshot': return say('viewer.screenshot');
    case 'fullscreen': return say('viewer.fullscreen');
    case 'help': return say('viewer.help');
    default: return say('view.quit');
  }
}
