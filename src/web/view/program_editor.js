// An editor for the programs of a simulation, beside it: which file, its text with line numbers, and Run. It needs no library, so that it is
// there at once and works without npm; its style is editor.css. Touches the DOM.

import { complaint } from './programs.js';
import { say } from './texts.js';

const KEEP_MS = 400; // after the last key
const INDENTATION = '    ';

export class ProgramEditor {
  #programs;
  #kept;
  #run;
  #element = make('div', { className: 'program-editor' });
  #files = make('select');
  #text = make('textarea', { spellcheck: false, wrap: 'off', autocapitalize: 'none', autocomplete: 'off' });
  #numbers = make('div', { className: 'numbers', ariaHidden: 'true' });
  #status = make('p', { className: 'said' });
  #runs = make('button', { type: 'button', className: 'primary' });
  #undoes = make('button', { type: 'button' });
  #saves = make('button', { type: 'button' });
  #path = '';
  #originals = new Map(); // of files that were opened
  #texts = new Map(); // as the simulation has them
  #drafts = new Map(); // as they are here
  #keeping = 0;
  #wrong = new Map(); // path -> line
  #saidStatus = () => '';

  // `kept`: KeptPrograms of the world. `run()` has the simulation begin anew.
  constructor(programs, kept, run) {
    this.#programs = programs;
    this.#kept = kept;
    this.#run = run;
    this.#build();
    this.sayAll();
    this.#offerFiles();
  }

  get element() { return this.#element; }

  focus() { this.#text.focus(); }

  // The list of programs is new: after the start, or a return.
  #offerFiles() {
    const paths = [...new Set([...this.#programs.list.map(({ path }) => path), ...this.#drafts.keys()])];
    this.#files.replaceChildren(...paths.map((path) => make('option', { value: path, textContent: path })));
    this.#files.hidden = paths.length < 2;
    // The server tells of the world's own controllers first.
    const first = this.#kept.paths.find((path) => paths.includes(path)) ?? paths.find(isMainFile) ?? paths[0];
    if (!paths.includes(this.#path) && first !== undefined)
      this.open(first);
  }

  async open(path) {
    this.#path = path;
    this.#files.value = path;
    this.#text.readOnly = true; // until it is there: what is typed before would be lost
    try {
      if (!this.#drafts.has(path))
        await this.#fetch(path);
    } catch (error) {
      return this.#tell(() => error.message, true);
    }
    if (this.#path !== path)
      return;
    this.#text.value = this.#drafts.get(path);
    this.#text.readOnly = false;
    this.#text.scrollTo(0, 0);
    this.#number();
  }

  // What was written at an earlier start is taken up again, and said so.
  async #fetch(path) {
    const [text, original] = await Promise.all([this.#programs.text(path), this.#programs.original(path)]);
    const kept = this.#kept.get(path);
    this.#texts.set(path, text);
    this.#originals.set(path, original);
    this.#drafts.set(path, kept?.text ?? text);
    if (kept === null || kept.text === text)
      return;
    this.#tell(() => (kept.original === original ? say('code.kept') : say('code.projectChanged')));
  }

  // Saves what was changed, and has the simulation begin anew with it.
  async run() {
    this.#keep();
    this.#wrong.clear();
    this.#number();
    this.#runs.disabled = true;
    try {
      for (const [path, draft] of this.#drafts) {
        if (this.#texts.get(path) === draft)
          continue;
        await this.#programs.save(path, draft);
        this.#texts.set(path, draft);
      }
      this.#run();
      this.#tell(() => say('code.runs'));
    } catch (error) {
      this.#tell(() => error.message, true);
    } finally {
      this.#runs.disabled = false;
    }
  }

  // Every program is as the project has it, here and in the simulation.
  async undoAll() {
    if (!confirm(say('code.undoSure')))
      return;
    clearTimeout(this.#keeping);
    try {
      for (const path of new Set([...this.#drafts.keys(), ...this.#programs.list.map(({ path }) => path)])) {
        this.#kept.remove(path);
        const isOurs = this.#drafts.has(path) && this.#texts.get(path) !== this.#originals.get(path);
        if (isOurs || this.#programs.list.some((each) => each.path === path && each.changed))
          await this.#programs.reset(path);
      }
      this.#drafts.clear();
      await this.open(this.#path);
      this.#run();
      this.#tell(() => say('code.undone'));
    } catch (error) {
      this.#tell(() => error.message, true);
    }
  }

  // What is in the editor: {file, text}, or null.
  get current() { return this.#drafts.has(this.#path) ? { file: this.#path, text: this.#drafts.get(this.#path) } : null; }

  // A program from somebody else, in place of what is here.
  async take(path, text) {
    await this.open(path);
    this.#drafts.set(path, text);
    this.#originals.set(path, this.#originals.get(path) ?? '');
    this.#keep();
    await this.open(path);
    this.#offerFiles();
    this.#tell(() => say('code.given'));
  }

  // A line of the console: what it says about a program is shown at its line.
  read(line) {
    const found = complaint(line, this.#programs.list.map(({ path }) => path));
    if (found === null)
      return;
    this.#wrong.set(found.path, found.line);
    this.#tell(() => say('code.wrong', { file: found.path.split('/').pop(), line: found.line }), true);
    if (found.path === this.#path)
      this.#number();
  }

  // In the language of the page.
  sayAll() {
    this.#files.setAttribute('aria-label', say('code.file'));
    this.#text.setAttribute('aria-label', say('code.text'));
    this.#runs.textContent = say('code.run');
    this.#runs.title = say('code.runKeys');
    this.#undoes.textContent = say('code.undo');
    this.#saves.textContent = say('code.download');
    this.#status.textContent = this.#saidStatus();
  }

  #build() {
    const head = make('div', { className: 'head' });
    head.append(this.#files, this.#runs, this.#undoes, this.#saves);
    const body = make('div', { className: 'body' });
    body.append(this.#numbers, this.#text);
    this.#status.setAttribute('role', 'status');
    this.#element.append(head, body, this.#status);
    this.#files.addEventListener('change', () => this.open(this.#files.value));
    this.#runs.addEventListener('click', () => this.run());
    this.#undoes.addEventListener('click', () => this.undoAll());
    this.#saves.addEventListener('click', () => this.#download());
    this.#text.addEventListener('input', () => this.#changed());
    this.#text.addEventListener('scroll', () => { this.#numbers.scrollTop = this.#text.scrollTop; });
    this.#text.addEventListener('keydown', (event) => this.#press(event));
    this.#programs.addEventListener('list', () => this.#offerFiles());
  }

  // Tab indents; Escape, then Tab leaves the text, as in other editors.
  #press(event) {
    const { key, ctrlKey, metaKey, shiftKey } = event;
    const escaped = this.#text.dataset.escaped !== undefined;
    delete this.#text.dataset.escaped;
    if ((ctrlKey || metaKey) && (key === 's' || key === 'Enter'))
      this.run();
    else if (key === 'Escape')
      return void (this.#text.dataset.escaped = '');
    else if (key === 'Tab' && !escaped)
      this.#indent(shiftKey);
    else if (key === 'Enter' && !ctrlKey && !metaKey)
      this.#breakLine();
    else
      return;
    event.preventDefault();
  }

  // By an edit command, so that the browser's own Undo knows of it.
  #insert(text) {
    if (!document.execCommand('insertText', false, text))
      this.#text.setRangeText(text, this.#text.selectionStart, this.#text.selectionEnd, 'end');
    this.#changed();
  }

  #breakLine() {
    const { value, selectionStart } = this.#text;
    const line = value.slice(value.lastIndexOf('\n', selectionStart - 1) + 1, selectionStart);
    const [indentation] = /^[ \t]*/.exec(line);
    this.#insert(`\n${indentation}${/:\s*(#.*)?$/.test(line) ? INDENTATION : ''}`);
  }

  #indent(back) {
    const { value, selectionStart, selectionEnd } = this.#text;
    const begin = value.lastIndexOf('\n', selectionStart - 1) + 1;
    const lines = value.slice(begin, selectionEnd);
    if (!back && !lines.includes('\n'))
      return this.#insert(INDENTATION);
    const moved = lines.split('\n').map((line) => (back ? line.replace(/^( {1,4}|\t)/, '') : INDENTATION + line)).join('\n');
    this.#text.setSelectionRange(begin, selectionEnd);
    this.#insert(moved);
    this.#text.setSelectionRange(begin, begin + moved.length);
  }

  #changed() {
    this.#drafts.set(this.#path, this.#text.value);
    this.#number();
    clearTimeout(this.#keeping);
    this.#keeping = setTimeout(() => this.#keep(), KEEP_MS);
  }

  #keep() {
    clearTimeout(this.#keeping);
    for (const [path, draft] of this.#drafts) {
      if (draft === this.#originals.get(path))
        this.#kept.remove(path);
      else
        this.#kept.put(path, draft, this.#originals.get(path));
    }
  }

  #number() {
    const count = this.#text.value.split('\n').length;
    const wrong = this.#wrong.get(this.#path);
    this.#numbers.replaceChildren(...Array.from({ length: count }, (_, i) => {
      const number = make('span', { textContent: i + 1 });
      number.classList.toggle('wrong', i + 1 === wrong);
      return number;
    }));
    this.#numbers.scrollTop = this.#text.scrollTop;
  }

  #download() {
    const link = make('a', { href: URL.createObjectURL(new Blob([this.#text.value], { type: 'text/plain' })), download: this.#path.split('/').pop() });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href));
  }

  #tell(text, problem = false) {
    this.#saidStatus = text;
    this.#status.textContent = text();
    this.#status.classList.toggle('problem', problem);
  }
}

function make(name, properties = {}) {
  return Object.assign(document.createElement(name), properties);
}

// As `drive/drive.py`.
const isMainFile = (path) => /^([^/]+)\/\1\.\w+$/.test(path);
