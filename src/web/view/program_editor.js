// An editor for the programs of a simulation, beside it: which file, its text (text_editor.js), and Run; its style is editor.css. Touches the DOM.

import { difference } from './difference.js';
import { complaint, isSource, mainOf, nameOf } from './programs.js';
import { createTextEditor } from './text_editor.js';
import { say } from './texts.js';

const KEEP_MS = 400; // after the last key
const MOST_UPLOADED = 1 << 20; // bytes; servers take less

export class ProgramEditor {
  #programs;
  #kept;
  #run;
  #element = make('div', { className: 'program-editor' });
  #files = make('select');
  #text; // of createTextEditor
  #status = make('p', { className: 'said' });
  #changes = make('details', { className: 'changes', open: true, hidden: true }); // of what is here, to the project's program
  #changesTitle = make('summary');
  #changesText = make('pre', { tabIndex: 0 });
  #messages = make('details', { className: 'messages', hidden: true }); // of the compiler
  #messagesTitle = make('summary');
  #messagesText = make('pre', { tabIndex: 0 });
  #runs = make('button', { type: 'button', className: 'primary' });
  #undoes = make('button', { type: 'button' });
  #saves = make('button', { type: 'button' });
  #brings = make('button', { type: 'button' });
  #picker = make('input', { type: 'file', hidden: true });
  #path = '';
  #originals = new Map(); // of files that were opened
  #texts = new Map(); // as the simulation has them
  #drafts = new Map(); // as they are here
  #keeping = 0;
  #wrong = new Map(); // path -> line
  #outdated = new Set(); // paths whose original is another one than when they were written
  #isBusy = false;
  #saidStatus = () => '';

  // `kept`: KeptPrograms of the world. `run()` has the simulation begin anew. `lesson`: the element above the text.
  static async create(programs, kept, run, lesson) {
    const editor = new ProgramEditor(programs, kept, run);
    editor.#text = await createTextEditor({ change: () => editor.#changed(), run: () => editor.run(), phrases });
    editor.#build(lesson);
    editor.sayAll();
    editor.#offerFiles();
    return editor;
  }

  // By create().
  constructor(programs, kept, run) {
    this.#programs = programs;
    this.#kept = kept;
    this.#run = run;
  }

  get element() { return this.#element; }

  focus() { this.#text.focus(); }

  // The list of programs is new: after the start, or a return.
  #offerFiles() {
    const paths = [...new Set([...this.#programs.list.map(({ path }) => path), ...this.#drafts.keys()])];
    this.#files.replaceChildren(...paths.map((path) => make('option', { value: path, textContent: nameOf(path) })));
    this.#files.hidden = paths.length < 2;
    const first = this.#kept.paths.find((path) => paths.includes(path)) ?? mainOf(paths);
    if (!paths.includes(this.#path) && first !== undefined)
      this.open(first);
  }

  async open(path) {
    this.#path = path;
    this.#files.value = this.#files.title = path;
    this.#text.readOnly = true; // until it is there: what is typed before would be lost
    try {
      if (!this.#drafts.has(path))
        await this.#fetch(path);
    } catch (error) {
      return this.#tell(() => error.message, true);
    }
    if (this.#path !== path)
      return;
    this.#text.show(this.#drafts.get(path), path);
    this.#text.readOnly = false;
    this.#mark();
    this.#showChanges();
    this.#warnOf([path]);
  }

  // Of files that have no effect, since nobody compiles them.
  #warnOf(paths) {
    const path = paths.find((each) => isSource(each) && !this.#programs.canCompile(each));
    if (path !== undefined)
      this.#tell(() => say('code.notCompiled', { file: path.split('/').pop() }), true);
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
    if (kept.original !== original)
      this.#outdated.add(path);
  }

  // Where the project has changed since somebody wrote his own: people see what is different.
  #showChanges() {
    this.#changes.hidden = !this.#outdated.has(this.#path);
    if (this.#changes.hidden)
      return;
    this.#changesText.replaceChildren(...difference(this.#originals.get(this.#path), this.#drafts.get(this.#path)).map((each) => {
      const { sign, line } = each ?? { sign: '…', line: '' };
      return make('span', { className: { '+': 'added', '-': 'removed' }[sign] ?? '', textContent: `${sign} ${line}\n` });
    }));
  }

  // Saves what was changed, compiles it where that is needed, and has the simulation begin anew with it.
  run() {
    return this.#alone(async () => {
      this.#keep();
      const saved = [];
      for (const [path, draft] of this.#drafts) {
        if (this.#texts.get(path) === draft)
          continue;
        await this.#programs.save(path, draft);
        this.#texts.set(path, draft);
        saved.push(path);
      }
      await this.#begin();
      this.#tell(() => say('code.runs'));
      this.#warnOf(saved);
    });
  }

  // What does not compile leaves the simulation as it is.
  async #begin() {
    let printed = '';
    for (const folder of this.#programs.toCompile(this.#path)) {
      this.#tell(() => say('code.compiling', { controller: folder }));
      printed += await this.#programs.compile(folder);
    }
    if (/\bwarning\b/.test(printed))
      this.#showMessages(printed, false);
    this.#run();
  }

  // One thing at a time: what is pressed meanwhile has no effect.
  async #alone(action) {
    if (this.#isBusy)
      return;
    const hadFocus = this.#runs.matches(':focus');
    this.#isBusy = this.#runs.disabled = this.#undoes.disabled = true;
    this.#wrong.clear();
    this.#mark();
    this.#messages.hidden = true;
    try {
      await action();
    } catch (error) {
      this.#tellFailure(error);
    } finally {
      this.#isBusy = this.#runs.disabled = this.#undoes.disabled = false;
      if (hadFocus && (this.#runs.getRootNode().activeElement ?? document.body) === document.body)
        this.#runs.focus();
    }
  }

  #tellFailure({ message, output, wrong }) {
    this.#tell(() => message, true);
    if (output)
      this.#showMessages(output, true);
    if (wrong)
      this.#showWrong(wrong, () => say('code.doesNotCompile', { file: wrong.path.split('/').pop(), line: wrong.line }));
    if (wrong?.path === this.#path)
      this.#text.reveal(wrong.line);
    this.#status.scrollIntoView({ block: 'nearest' }); // on a telephone it may be below
  }

  // What make and the compiler have printed, from where they complain first.
  #showMessages(text, open) {
    const paths = this.#programs.list.map(({ path }) => path);
    const kindOf = (line) => (complaint(line, paths) ? 'wrong' : /^ *\d* \|/.test(line) ? 'source' : ''); // "source": with an arrow below it
    const lines = text.trimEnd().split('\n').map((line) => make('span', { className: kindOf(line), textContent: `${line}\n` }));
    this.#messagesText.replaceChildren(...lines);
    Object.assign(this.#messages, { open, hidden: false });
    this.#messagesText.scrollTop = (lines.find(({ className }) => className === 'wrong')?.offsetTop ?? 0) - this.#messagesText.offsetTop;
  }

  // Every program is as the project has it, here and in the simulation.
  async undoAll() {
    if (!confirm(say('code.undoSure')))
      return;
    await this.#alone(async () => {
      clearTimeout(this.#keeping);
      for (const path of new Set([...this.#drafts.keys(), ...this.#programs.list.map(({ path }) => path)])) {
        this.#kept.remove(path);
        const isOurs = this.#drafts.has(path) && this.#texts.get(path) !== this.#originals.get(path);
        if (isOurs || this.#programs.list.some((each) => each.path === path && each.changed))
          await this.#programs.reset(path);
      }
      this.#drafts.clear();
      this.#outdated.clear();
      await this.open(this.#path);
      await this.#begin();
      this.#tell(() => say('code.undone'));
    });
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

  // What the console complains of is shown at its line.
  complain(found) {
    this.#showWrong(found, () => say('code.wrong', { file: found.path.split('/').pop(), line: found.line }));
  }

  #showWrong({ path, line }, text) {
    this.#wrong.set(path, line);
    this.#tell(text, true);
    if (path === this.#path)
      this.#mark();
  }

  // In the language of the page.
  sayAll() {
    this.#files.setAttribute('aria-label', say('code.file'));
    this.#text.label = say('code.text');
    this.#runs.textContent = say('code.run');
    this.#runs.title = say('code.runKeys');
    this.#undoes.textContent = say('code.undo');
    this.#saves.textContent = say('code.download');
    this.#brings.textContent = say('code.upload');
    this.#brings.title = say('code.uploadWhat');
    this.#changesTitle.textContent = say('code.changes');
    this.#messagesTitle.textContent = say('code.messages');
    this.#status.textContent = this.#saidStatus();
  }

  #build(lesson) {
    const head = make('div', { className: 'head' });
    head.append(this.#files, this.#runs, this.#undoes, this.#brings, this.#saves, this.#picker);
    this.#status.setAttribute('role', 'status');
    this.#changes.append(this.#changesTitle, this.#changesText);
    this.#messages.append(this.#messagesTitle, this.#messagesText);
    this.#element.append(lesson, head, this.#text.element, this.#status, this.#messages, this.#changes);
    this.#files.addEventListener('change', () => {
      this.#tell(() => '');
      this.open(this.#files.value);
    });
    this.#runs.addEventListener('click', () => this.run());
    this.#undoes.addEventListener('click', () => this.undoAll());
    this.#saves.addEventListener('click', () => this.#download());
    this.#brings.addEventListener('click', () => this.#picker.click());
    this.#picker.addEventListener('change', () => this.#upload(this.#picker.files[0]));
    this.#programs.addEventListener('list', () => this.#offerFiles());
  }

  #changed() {
    this.#drafts.set(this.#path, this.#text.text);
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

  #mark() { this.#text.mark(this.#wrong.get(this.#path) ?? null); }

  // A file of this computer takes the place of the program with its name, or else of what is in the editor.
  async #upload(file) {
    this.#picker.value = ''; // so that the same one can be chosen again
    if (file === undefined)
      return;
    if (file.size > MOST_UPLOADED)
      return this.#tell(() => say('code.uploadTooLarge'), true);
    const text = await file.text();
    const path = this.#programs.list.map((each) => each.path).find((each) => each.endsWith(`/${file.name}`)) ?? this.#path;
    await this.open(path);
    this.#drafts.set(path, text);
    this.#keep();
    await this.open(path);
    this.#tell(() => say('code.uploaded', { file: path }));
  }

  // All programs as an archive, or the one that there is.
  async #download() {
    const paths = [...this.#files.options].map(({ value }) => value);
    if (paths.length > 1) {
      try {
        const { archive } = await import(new URL('archive.js', import.meta.url).href);
        return offer(archive(await Promise.all(paths.map(async (path) => [path, this.#drafts.get(path) ?? await this.#programs.text(path)]))), 'controllers.zip');
      } catch (error) {
        console.info(`Only what is in the editor is downloaded: ${error.message}`);
      }
    }
    offer(new Blob([this.#text.text], { type: 'text/plain' }), this.#path.split('/').pop());
  }

  #tell(text, problem = false) {
    this.#saidStatus = text;
    this.#status.textContent = text();
    this.#status.classList.toggle('problem', problem);
  }
}

function offer(blob, download) {
  const link = make('a', { href: URL.createObjectURL(blob), download });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href));
}

function make(name, properties = {}) {
  return Object.assign(document.createElement(name), properties);
}

// What CodeMirror calls by its English names.
const phrases = () => ({
  Find: say('search.find'), Replace: say('search.with'), next: say('search.next'), previous: say('search.previous'), all: say('search.all'),
  'match case': say('search.case'), 'by word': say('search.words'), regexp: say('search.expression'), replace: say('search.replace'),
  'replace all': say('search.replaceAll'), close: say('search.close'), 'Go to line': say('search.line'), go: say('search.go'),
});
