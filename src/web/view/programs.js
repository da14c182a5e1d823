// The programs of a simulation that the page may change (docs/protocol.md, 13.19), and what this browser keeps of them: people find what they
// have written at the next start of the same world. No DOM, but for the storage of the browser.

const KEY = 'webots-cloud.programs';
const MOST_KEPT = 1_000_000; // characters of all worlds together; what was changed longest ago goes first

// Fires "list" when the server has told which programs there are, and "change" when the simulation has another text of one.
export class Programs extends EventTarget {
  #send;
  #list = [];
  #questions = []; // {path, kind, answer, refuse}, in the order in which they were asked
  #known = new Map(); // path -> {text, original, given}, as far as they are known: `text` is the simulation's

  // `send` takes a text for the server.
  constructor(send) {
    super();
    this.#send = send;
  }

  // [{path, changed}]; empty: there is nothing to change, or it is not allowed.
  get list() { return this.#list; }

  // Takes a message of the server, of any kind.
  receive(message) {
    const [, kind, rest] = /^(files|file|reset controller):\s?([^]*)$/.exec(message) ?? [];
    if (kind === 'files') {
      this.#list = parse(rest) ?? [];
      this.dispatchEvent(new Event('list'));
    } else if (kind === 'reset controller') {
      this.#settle(rest.trim(), 'reset', true);
    } else if (kind === 'file') {
      const { path, error, ...told } = parse(rest) ?? {};
      if (error !== undefined)
        this.#refuse(path, error);
      else
        for (const [name, value] of Object.entries(told))
          this.#settle(path, name, value);
    }
  }

  // The promises are rejected with the server's sentence.
  async text(path) { return this.#note(path, { text: await this.#ask(path, 'text', { read: path }) }).text; }
  async original(path) { return this.#note(path, { original: await this.#ask(path, 'original', { original: path }) }).original; }

  async save(path, text) {
    await this.#ask(path, 'saved', { write: { path, text } });
    this.#note(path, { text });
  }

  async reset(path) {
    await this.#ask(path, 'reset', { 'reset controller': path });
    this.#note(path, { text: this.#known.get(path)?.original ?? await this.original(path) });
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
      this.#questions.push({ path, kind, answer, refuse: (text) => refuse(new Error(text)) });
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
  #refuse(path, text) {
    this.#take((asked) => asked.path === path)?.refuse(text);
  }
}

// As `drive/drive.py`, which people call `drive.py`.
const isMain = (path) => /^([^/]+)\/\1\.\w+$/.test(path);
export const mainOf = (paths) => paths.find(isMain) ?? paths[0];
export const nameOf = (path) => (isMain(path) ? path.split('/').pop() : path);

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

// The program and line that a line of the console complains of, as Python and compilers do; or null.
export function complaint(line, paths) {
  const [, file, number] = /File "([^"]+)", line (\d+)/.exec(line) ?? /^(\S+):(\d+):(?:\d+:)? (?:fatal )?error\b/.exec(line) ?? [];
  const path = file === undefined ? undefined : paths.find((path) => file === path || file.endsWith(`/controllers/${path}`) || path.endsWith(`/${file}`));
  return path === undefined ? null : { path, line: Number(number) };
}
