// The programs of a page's simulation and their editor, which is loaded when it is opened first: most people only look. Touches the DOM.

import { KeptPrograms, Programs } from './programs.js';

export class ProgramPanel {
  #programs;
  #kept;
  #run;
  #editor = null;
  #created = null; // promises it

  // `session` is one whose target has `edit`; `world` is what the browser keeps programs by. offered(whether there is something to change) is
  // called when the server has told; run() has the simulation begin anew.
  constructor(session, world, { offered, run }) {
    this.#programs = new Programs((text) => session.sendToServer(text));
    this.#kept = new KeptPrograms(world);
    this.#run = run;
    this.#programs.addEventListener('list', () => offered(this.#programs.list.length > 0));
    session.addEventListener('message', ({ detail: { from, text } }) => from === 'server' && this.#programs.receive(text));
    session.addEventListener('output', ({ detail: { line } }) => this.#editor?.read(line));
  }

  // The editor's element. Rejects where the editor cannot be loaded.
  async open() {
    const { ProgramEditor } = await import('./program_editor.js');
    this.#created ??= ProgramEditor.create(this.#programs, this.#kept, this.#run);
    this.#editor = await this.#created;
    return this.#editor.element;
  }

  // What is in the editor, or what the simulation has: {file, text}, or null where there is nothing.
  async current() {
    const path = this.#kept.paths[0] ?? this.#programs.list[0]?.path;
    if (this.#editor?.current || path === undefined)
      return this.#editor?.current ?? null;
    return { file: path, text: this.#kept.get(path)?.text ?? await this.#programs.text(path) };
  }

  // Puts somebody else's program into the editor.
  async take(file, text) {
    await this.open();
    await this.#editor.take(file, text);
  }

  focus() { this.#editor?.focus(); }

  // In the language of the page.
  sayAll() { this.#editor?.sayAll(); }
}
