// One student's simulation, large, only to watch: also for a projector. Touches the DOM.

import { parseViewAddress } from './view/address.js';
import { say } from './view/texts.js';
import { icon } from './view/toolbar.js';
import { View } from './view/webots_view.js';
import { duration, element, offerFullscreen, ownServer, setText } from './page.js';
import { programText, wordsFor } from './wall.js';

const RETRY_MS = 3000;
const LONG_MS = 10000; // what was shown for less ended at once
const MOST_RETRIES = 3;

export class Look {
  #view = new View(element('look-view'));
  #student = null;
  #mode = '';
  #address = '';
  #retry = 0;
  #retries = 0; // since something was shown
  #opened = 0;
  #program = null; // of the student, as it was when somebody asked: {file, text}

  // `act(action, student)` as of Wall; `back()` when the wall is wanted again.
  constructor(act, back) {
    this.#view.broadcast = true;
    this.#view.setToolbar(false); // its commands would do nothing
    this.#view.showRobotWindow = false; // nor do pages of a student's project belong into the teacher's
    this.#view.onclose = () => this.#again();
    element('look-back').addEventListener('click', back);
    element('look-program-close').addEventListener('click', () => this.#hideProgram());
    for (const button of element('look').querySelectorAll('[data-do]'))
      button.addEventListener('click', () => act(button.dataset.do, this.#student, this.#program));
    for (const button of element('look').querySelectorAll('[data-icon]'))
      button.prepend(icon(button.dataset.icon));
    offerFullscreen(element('look-full'), element('look'));
    document.addEventListener('keydown', ({ key, target }) =>
      key === 'Escape' && this.#student !== null && document.fullscreenElement === null && target.closest('dialog') === null && back());
  }

  // The student being looked at, or null.
  get student() { return this.#student; }

  open(student, mode) {
    this.#student = student;
    this.#mode = mode;
    this.#retries = 0;
    this.#show();
    element('look-back').focus();
  }

  // What the class has told of its students: his simulation may be another one now.
  follow(students) {
    if (this.#student === null)
      return;
    const now = students.find(({ id }) => id === this.#student.id);
    this.#student = now ?? { ...this.#student, state: 'ended', simulator: undefined };
    if ((this.#student.simulator ?? '') !== this.#address)
      this.#show();
    this.sayAll();
  }

  // A program that was asked for.
  showProgram({ id, file, text }) {
    if (id !== this.#student?.id)
      return;
    this.#program = { file, text };
    setText('look-file', file);
    setText('look-text', text);
    element('look-program').hidden = false;
  }

  close() {
    this.#hideProgram();
    clearTimeout(this.#retry);
    this.#student = null;
    this.#address = '';
    if (document.fullscreenElement === element('look'))
      document.exitFullscreen();
    this.#view.remove();
  }

  sayAll() {
    if (this.#student === null)
      return;
    const { name, state, time, simulator } = this.#student;
    setText('look-name', name);
    setText('look-state', [wordsFor(state), duration(time ?? 0), programText(this.#student)].filter((part) => part !== '').join(' · '));
    element('look-lower').hidden = this.#student.sign !== 'hand';
    element('look').classList.toggle('gone', simulator === undefined);
  }

  #hideProgram() {
    this.#program = null;
    element('look-program').hidden = true;
  }

  // Not for ever: somebody has to ask again for what ends at once.
  #again() {
    if (performance.now() - this.#opened > LONG_MS)
      this.#retries = 0;
    if (this.#retries++ < MOST_RETRIES)
      this.#retry = setTimeout(() => this.#show(), RETRY_MS);
  }

  #show() {
    clearTimeout(this.#retry);
    if (this.#student === null)
      return;
    const address = this.#student.simulator ?? '';
    if (address !== this.#address)
      this.#retries = 0;
    this.#address = address;
    this.#opened = performance.now();
    this.sayAll();
    if (isSimulator(address))
      this.#view.open(address, this.#mode);
    else
      this.#view.close();
  }
}

// The student's page has named it: nothing else may be opened, least of all what would start a simulation of the teacher's.
function isSimulator(address) {
  try {
    return address !== '' && parseViewAddress(address, ownServer, location).kind === 'simulator';
  } catch {
    return false;
  }
}
