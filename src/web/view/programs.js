// The programs of a simulation that the page may change (docs/protocol.md, 13.19), and what this browser keeps of them: people find what they
// have written at the next start of the same world. No DOM, but for the storage of the browser.

import { withoutColours } from './console.js';
import { explain } from './refusals.js';

const KEY = 'webots-cloud.programs';
const MOST_KEPT = 1_000_000; // characters of all worlds together; what was changed longest ago goes first

// Fires "list" when the server has told which programs there are, and "change" when the simulation has another text of one.
export class Programs extends EventTarget {
  #send;
  #list = [];
  #questions = []; // {path, kind, message, answer, refuse}, in the order in which they were asked; `path` is a folder for "compiled"
  #known = new Map(); // path -> {text, original, given}, as far as they are known: `text` is the simulation's
  #compiles = new Set(); // folders of the controllers that the server can compile
  #compiled = new Map(); // folder -> whether that was after its last change; without those that this page has neither compiled nor changed
  #wrong = null;

  // `send` takes a text for the server.
  constructor(send) {
    super();
    this.#send = send;
  }

  // [{path, changed}]; empty: there is nothing to change, or it is not allowed.
  get list() { return this.#list; }

  // What the compiler complained of, when something was compiled last: {path, line}, or null.
  get wrong() { return this.#wrong; }

  // Takes a message of the server, of any kind.
  receive(message) {
    const [, kind, rest] = /^(files|file|compiles|compiled|reset controller):\s?([^]*)$/.exec(message) ?? [];
    switch (kind) {
      case 'files': return this.#takeList(parse(rest) ?? []);
      case 'compiles': return void (this.#compiles = new Set(parse(rest) ?? []));
      case 'compiled': return this.#takeCompiled(parse(rest) ?? {});
      case 'reset controller': return this.#settle(rest.trim(), 'reset', true);
      case 'file': return this.#takeFile(parse(rest) ?? {});
    }
  }

  // Also after a return: what was asked before, and perhaps not heard, is asked again.
  #takeList(list) {
    this.#list = list;
    this.#compiles.clear();
    for (const { message } of this.#questions)
      this.#send(JSON.stringify(message));
    this.dispatchEvent(new Event('list'));
  }

  #takeFile({ path, error, code, values, ...told }) {
    if (error !== undefined)
      return this.#refuse(path, new Error(inOurWords(error, code, values)));
    for (const [name, value] of Object.entries(told))
      this.#settle(path, name, value);
  }

  #takeCompiled({ controller, output, error, code, values }) {
    const text = withoutColours(String(output ?? ''));
    if (error === undefined)
      return this.#settle(controller, 'compiled', text);
    const sources = this.#list.map(({ path }) => path).filter((path) => folderOf(path) === controller);
    const complaints = text.split('\n').map((line) => complaint(line, sources));
    this.#refuse(controller, Object.assign(new Error(inOurWords(error, code, values)), { output: text, wrong: complaints.find((each) => each !== null) ?? null }));
  }

  // The promises are rejected with what the server says.
  async text(path) { return this.#note(path, { text: await this.#ask(path, 'text', { read: path }) }).text; }
  async original(path) { return this.#note(path, { original: await this.#ask(path, 'original', { original: path }) }).original; }

  async save(path, text) {
    await this.#ask(path, 'saved', { write: { path, text } });
    this.#outdate(path);
    this.#note(path, { text });
  }

  async reset(path) {
    await this.#ask(path, 'reset', { 'reset controller': path });
    this.#outdate(path);
    this.#note(path, { text: this.#known.get(path)?.original ?? await this.original(path) });
  }

  // Whether the controller of this source, or of another file of its folder, can be compiled where it runs.
  canCompile(path) { return this.#compiles.has(folderOf(path)); }

  // The folders to compile before the simulation begins anew: whose sources were changed, and that of `path`, the program that somebody looks
  // at, which may never have been compiled.
  toCompile(path) {
    const isWanted = (folder) => this.#list.some((each) => folderOf(each.path) === folder && isSource(each.path) && (each.changed || folder === folderOf(path)));
    return [...this.#compiles].filter((folder) => (this.#compiled.has(folder) ? !this.#compiled.get(folder) : isWanted(folder)));
  }

  // Resolves to what make and the compiler print. Where that fails, the error has it too, `output`, and its first complaint of a line, `wrong`.
  async compile(folder) {
    this.#wrong = null;
    this.#compiled.set(folder, false);
    try {
      const output = await this.#ask(folder, 'compiled', { compile: folder });
      this.#compiled.set(folder, true);
      return output;
    } catch (error) {
      this.#wrong = error.wrong ?? null;
      throw error;
    } finally {
      this.dispatchEvent(new Event('change'));
    }
  }

  #outdate(path) {
    if (isSource(path))
      this.#compiled.set(folderOf(path), false);
  }

  // Somebody has handed this text out, in place of the project's.
  give(path, given) { this.#note(path, { given }); }

  // Whether the simulation has another text than the one that was handed out.
  isChanged(path) {
    const { text, original, given } = this.#known.get(path) ?? {};
    if (text === undefined || original === undefined)
      return this.#list.some((each) => each.path === path && each.changed === true);
    return text !== original && text !== given;
  }

  // The one that people mean by "the program": what was changed, or else the first controller. The server tells of those of the world first.
  get main() {
    const paths = this.#list.map(({ path }) => path);
    return paths.find((path) => this.isChanged(path)) ?? mainOf(paths);
  }

  #note(path, told) {
    const known = { ...this.#known.get(path), ...told };
    this.#known.set(path, known);
    this.dispatchEvent(new Event('change'));
    return known;
  }

  #ask(path, kind, message) {
    return new Promise((answer, refuse) => {
      this.#questions.push({ path, kind, message, answer, refuse });
      this.#send(JSON.stringify(message));
    });
  }

  #take(isMeant) {
    const index = this.#questions.findIndex(isMeant);
    return index < 0 ? undefined : this.#questions.splice(index, 1)[0];
  }

  #settle(path, kind, value) {
    this.#take((asked) => asked.path === path && asked.kind === kind)?.answer(value);
  }

  // The server answers in the order in which it was asked.
  #refuse(path, error) {
    this.#take((asked) => asked.path === path)?.refuse(error);
  }
}

// As `drive/drive.py`, which people call `drive.py`.
const isMain = (path) => /^([^/]+)\/\1\.\w+$/.test(path);
export const mainOf = (paths) => paths.find(isMain) ?? paths[0];
export const nameOf = (path) => (isMain(path) ? path.split('/').pop() : path);

// What has an effect once somebody has compiled it.
export const isSource = (path) => /\.(c|cc|cpp|cxx|h|hh|hpp|java)$|\/Makefile$/.test(path);
const folderOf = (path) => path.split('/')[0];

const inOurWords = (error, code, values) => explain(String(error), typeof code === 'string' ? { code, values: values ?? {} } : null).text;

function parse(text) {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}

// What people have written into the programs of a world, in this browser alone: {text, original} by path. `original` is the project's, from
// which they started.
export class KeptPrograms {
  #world;

  constructor(world) {
    this.#world = world;
  }

  get(path) {
    const kept = read()[this.#world]?.files?.[path];
    return typeof kept?.text === 'string' && typeof kept.original === 'string' ? kept : null;
  }

  get paths() { return Object.keys(read()[this.#world]?.files ?? {}); }

  // False: the browser keeps nothing.
  put(path, text, original) {
    const all = read();
    all[this.#world] = { at: Date.now(), files: { ...all[this.#world]?.files, [path]: { text, original } } };
    return write(all, this.#world);
  }

  remove(path) {
    const all = read();
    delete all[this.#world]?.files?.[path];
    if (Object.keys(all[this.#world]?.files ?? {}).length === 0)
      delete all[this.#world];
    write(all, this.#world);
  }
}

function read() {
  try {
    const all = JSON.parse(localStorage.getItem(KEY) ?? '{}');
    return typeof all === 'object' && all !== null ? all : {};
  } catch {
    return {};
  }
}

function write(all, current) {
  const oldest = () => Object.keys(all).filter((world) => world !== current).sort((a, b) => (all[a]?.at ?? 0) - (all[b]?.at ?? 0))[0];
  for (let world = oldest(); JSON.stringify(all).length > MOST_KEPT && world !== undefined; world = oldest())
    delete all[world];
  try {
    localStorage.setItem(KEY, JSON.stringify(all));
    return true;
  } catch {
    return false;
  }
}

// The program and line that a line of the console complains of, as Python, compilers and make do; or null.
export function complaint(line, paths) {
  const [, file, number] = /File "([^"]+)", line (\d+)/.exec(line) ?? /^(?:\.\/)?(\S+?):(\d+):(?:\d+:)? (?:(?:fatal )?error\b|\*\*\* )/.exec(line) ?? [];
  const path = file === undefined ? undefined : paths.find((path) => file === path || file.endsWith(`/controllers/${path}`) || path.endsWith(`/${file}`));
  return path === undefined ? null : { path, line: Number(number) };
}
