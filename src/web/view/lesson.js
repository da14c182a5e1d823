// What the lesson of a world says (docs/lessons.md), in the language of the page, and in which time its goal was reached. Touches the DOM.

import { inOurLanguage, say, textLanguage } from './texts.js';

// The time in a line of the console that says that the goal is reached, in milliseconds; or null.
export function goalIn(line) {
  const [, seconds] = /^You did it: (\d{1,9}(?:\.\d{1,3})?) s\b/.exec(line) ?? [];
  return seconds === undefined ? null : Math.round(Number(seconds) * 1000);
}

export const secondsText = (milliseconds) => new Intl.NumberFormat(textLanguage(), { minimumFractionDigits: 1, maximumFractionDigits: 1 }).format(milliseconds / 1000);

export class Lesson {
  #element = make('div', 'lesson');
  #fold = make('details');
  #title = make('summary');
  #steps = make('ol');
  #reached = make('p', 'reached');
  #texts = null; // {title, steps}, each text by language
  #goal = null; // milliseconds

  constructor() {
    this.#fold.open = true;
    this.#fold.append(this.#title, this.#steps);
    this.#reached.setAttribute('role', 'status');
    this.#element.append(this.#reached, this.#fold);
    this.sayAll();
  }

  get element() { return this.#element; }

  // A world has texts, not only a goal.
  get isThere() { return this.#texts !== null; }

  get goal() { return this.#goal; }

  // As the server sends it, of a file of the project.
  take(text) {
    const { title, steps } = parse(text);
    this.#texts = { title, steps: Array.isArray(steps) ? steps : [] };
    this.sayAll();
  }

  // `milliseconds`: null, when the simulation begins anew.
  reach(milliseconds) {
    this.#goal = milliseconds;
    this.#sayGoal();
  }

  sayAll() {
    const { title, steps } = this.#texts ?? { steps: [] };
    this.#fold.hidden = this.#texts === null;
    this.#title.textContent = inOurLanguage(title) || say('lesson.title');
    this.#steps.replaceChildren(...steps.map((step) => Object.assign(make('li'), { textContent: inOurLanguage(step) })));
    this.#sayGoal();
  }

  #sayGoal() {
    this.#reached.textContent = this.#goal === null ? '' : say('lesson.reached', { seconds: secondsText(this.#goal) });
  }
}

function parse(text) {
  try {
    return JSON.parse(text) ?? {};
  } catch {
    return {};
  }
}

function make(name, className = '') {
  return Object.assign(document.createElement(name), { className });
}
