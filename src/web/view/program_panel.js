// The programs of a page's simulation and their editor, which is loaded when it is opened first: most people only look. Touches the DOM.

import { KeptPrograms, Programs } from './programs.js';

export class ProgramPanel {
  #programs;
  #kept;
  #run;
  #editor = null;

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
    this.#editor ??= new ProgramEditor(this.#programs, this.#kept, this.#run);
    return this.#editor.element;
  }

  focus() { this.#editor?.focus(); }

  // In the language of the page.
  sayAll() { this.#editor?.sayAll(); }
}
