// The programs of a page's simulation, their editor, which is loaded when it is opened first (most people only look), and the lesson of its
// world. Touches the DOM.

import { Lesson, goalIn } from './lesson.js';
import { complaint, KeptPrograms, Programs } from './programs.js';

export class ProgramPanel {
  #programs;
  #kept;
  #run;
  #changed;
  #lesson = new Lesson();
  #editor = null;
  #created = null; // promises it
  #wrong = null; // what the console has complained of last: {path, line}
  #time = 0;

  // `session` is one whose target has `edit`; `world` is what the browser keeps programs by. offered(whether there is something to change) is
  // called when the server has told; run() has the simulation begin anew; changed() is called when `running` has changed.
  constructor(session, world, { offered, run, changed = () => {} }) {
    this.#programs = new Programs((text) => session.sendToServer(text));
    this.#kept = new KeptPrograms(world);
    this.#changed = changed;
    this.#run = () => {
      this.#wrong = null;
      run();
      changed();
    };
    this.#programs.addEventListener('list', () => offered(this.#programs.list.length > 0));
    for (const type of ['list', 'change'])
      this.#programs.addEventListener(type, () => changed());
    session.addEventListener('message', ({ detail: { from, text } }) => from === 'server' && this.#receive(text));
    session.addEventListener('output', ({ detail: { line } }) => this.#read(line));
    session.addEventListener('time', ({ detail }) => this.#takeTime(detail));
  }

  // The world has texts for those who program its robots.
  get hasLesson() { return this.#lesson.isThere && this.#programs.list.length > 0; }

  // What the simulation runs: {file, changed, line, goal}, where Python or a compiler complains of a line, and the goal of a lesson was reached
  // after so many milliseconds; or null, where there is nothing to change.
  get running() {
    const wrong = this.#programs.wrong ?? this.#wrong;
    const file = wrong?.path ?? this.#programs.main;
    if (file === undefined)
      return null;
    return { file, changed: this.#programs.isChanged(file), line: wrong?.line, goal: this.#lesson.goal ?? undefined };
  }

  // The editor's element. Rejects where the editor cannot be loaded.
  async open() {
    const { ProgramEditor } = await import('./program_editor.js');
    this.#created ??= ProgramEditor.create(this.#programs, this.#kept, this.#run, this.#lesson.element);
    this.#editor = await this.#created;
    return this.#editor.element;
  }

  // What is in the editor, or what the simulation has: {file, text}, or null where there is nothing.
  async current() {
    const path = this.#kept.paths[0] ?? this.#programs.main;
    if (this.#editor?.current || path === undefined)
      return this.#editor?.current ?? null;
    return { file: path, text: this.#kept.get(path)?.text ?? await this.#programs.text(path) };
  }

  // Puts somebody else's program into the editor.
  async take(file, text) {
    this.#programs.give(file, text);
    await this.open();
    await this.#editor.take(file, text);
  }

  focus() { this.#editor?.focus(); }

  // In the language of the page.
  sayAll() {
    this.#lesson.sayAll();
    this.#editor?.sayAll();
  }

  #receive(text) {
    if (text.startsWith('lesson:'))
      this.#lesson.take(text.slice('lesson:'.length));
    else
      this.#programs.receive(text);
  }

  #read(line) {
    const goal = goalIn(line);
    const wrong = complaint(line, this.#programs.list.map(({ path }) => path));
    if (goal !== null)
      this.#lesson.reach(goal);
    if (wrong !== null) {
      this.#wrong = wrong;
      this.#editor?.complain(wrong);
    }
    if (goal !== null || wrong !== null)
      this.#changed();
  }

  // Whose time begins again has its goal before it. Not so a mistake: it is made again.
  #takeTime(time) {
    const isAnew = time < this.#time;
    this.#time = time;
    if (!isAnew || this.#lesson.goal === null)
      return;
    this.#lesson.reach(null);
    this.#changed();
  }
}
