// The wall: a tile for each student, sorted by name. Touches the DOM.

import { say, textLanguage } from './view/texts.js';
import { duration, element, setText } from './page.js';

const NO_PICTURE_MS = 12000; // Students' pages send one at least every five seconds, if they can.
const ON = ['running', 'paused'];

// The sign of each state, beside its words. Those that need somebody stand out in other ways as well: see class.css.
const SIGNS = {
  running: 'M4 2.5v11l9-5.5z',
  paused: 'M4 3h3v10H4zm5 0h3v10H9z',
  joined: 'M8 2a3 3 0 1 1 0 6 3 3 0 0 1 0-6zM2 14c0-3 3-5 6-5s6 2 6 5z',
  starting: 'M8 2a6 6 0 1 0 6 6h-2a4 4 0 1 1-4-4z',
  hidden: 'M2 2h12v9H2zm2 2v5h8V4zM5 13h6v1.5H5z',
  waiting: 'M3 1h10v2l-3.5 5L13 13v2H3v-2l3.5-5L3 3z',
  lost: 'M8 1l7.5 14H.5zM7.2 6v4.5h1.6V6zm0 5.8v1.6h1.6v-1.6z',
  away: 'M8 1l7.5 14H.5zM7.2 6v4.5h1.6V6zm0 5.8v1.6h1.6v-1.6z',
  ended: 'M3 3h10v10H3z',
};

export function wordsFor(state) {
  switch (state) {
    case 'joined': return say('class.stateJoined');
    case 'starting': return say('class.stateStarting');
    case 'running': return say('class.stateRunning');
    case 'paused': return say('class.statePaused');
    case 'waiting': return say('class.stateWaiting');
    case 'hidden': return say('class.stateHidden');
    case 'lost': return say('class.stateLost');
    case 'away': return say('class.stateAway');
    default: return say('class.stateEnded');
  }
}

export class Wall {
  #list = element('wall');
  #act;
  #tiles = new Map(); // by the students' numbers
  #watched = false;

  // `act(action, student)`: 'look', 'pause', 'run', 'reset', 'message', 'end' or 'remove' was pressed.
  constructor(act) {
    this.#act = act;
    document.addEventListener('click', ({ target }) => this.#closeMenus(target));
    document.addEventListener('keydown', ({ key }) => key === 'Escape' && this.#closeMenus(null));
    setInterval(() => this.#tiles.forEach((tile) => this.#sayPicture(tile)), 1000);
  }

  // Sorted by name, as they stand on the wall.
  get students() { return [...this.#tiles.values()].map(({ student }) => student).sort(byName); }

  // Whether pictures are being asked for.
  set watched(watched) {
    if (watched && !this.#watched)
      this.#tiles.forEach((tile) => { tile.since = Date.now(); });
    this.#watched = watched;
  }

  // All of them, in place of those before.
  set(students) {
    const there = new Set(students.map(({ id }) => id));
    for (const id of [...this.#tiles.keys()])
      if (!there.has(id))
        this.drop(id);
    students.forEach((student) => this.take(student));
  }

  // Somebody new, or somebody who has changed.
  take(student) {
    const known = this.#tiles.get(student.id);
    const tile = known ?? this.#make(student);
    if (tile.student.state !== student.state && !ON.includes(tile.student.state))
      tile.since = Date.now();
    const moved = known === undefined || known.student.name !== student.name;
    tile.student = student;
    this.#tiles.set(student.id, tile);
    this.#say(tile);
    if (moved)
      this.#place(tile);
  }

  drop(id) {
    this.#tiles.get(id)?.item.remove();
    this.#tiles.delete(id);
  }

  // A JPEG in base64. Only the last one that has come is decoded.
  async picture(id, jpeg) {
    const tile = this.#tiles.get(id);
    if (tile === undefined)
      return;
    tile.next = jpeg;
    if (tile.decoding)
      return;
    tile.decoding = true;
    while (tile.next !== null) {
      const text = tile.next;
      tile.next = null;
      const bitmap = await createImageBitmap(new Blob([bytesOf(text)], { type: 'image/jpeg' })).catch(() => null); // A broken one is left out.
      if (bitmap !== null)
        this.#draw(tile, bitmap);
    }
    tile.decoding = false;
  }

  // In another language.
  sayAll() {
    this.#tiles.forEach((tile) => this.#say(tile));
    this.students.forEach(({ id }) => this.#list.append(this.#tiles.get(id).item));
  }

  focus(id) { this.#tiles.get(id)?.item.querySelector('.look').focus(); }

  #draw(tile, bitmap) {
    tile.pictured = Date.now();
    const { canvas } = tile;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height)
      Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
    canvas.getContext('bitmaprenderer').transferFromImageBitmap(bitmap);
    tile.item.dataset.pictured = '';
    this.#sayPicture(tile);
  }

  #make(student) {
    const item = element('tile').content.cloneNode(true).firstElementChild;
    const tile = { item, student, canvas: item.querySelector('canvas'), since: Date.now(), pictured: 0, next: null, decoding: false };
    item.querySelector('.look').addEventListener('click', () => this.#act('look', tile.student));
    item.querySelector('.toggle').addEventListener('click', () => this.#act(isOn(tile.student) ? 'pause' : 'run', tile.student));
    for (const button of item.querySelectorAll('[data-do]'))
      button.addEventListener('click', () => this.#act(button.dataset.do, tile.student));
    return tile;
  }

  #place(tile) {
    const next = this.students.find((student) => student.id !== tile.student.id && byName(tile.student, student) < 0);
    this.#list.insertBefore(tile.item, next === undefined ? null : this.#tiles.get(next.id).item);
  }

  #say(tile) {
    const { item, student } = tile;
    const part = (name) => item.querySelector(name);
    item.dataset.student = student.id;
    item.dataset.state = student.state;
    setText(part('.name'), student.name);
    setText(part('.time'), duration(student.time ?? 0));
    setText(part('.words'), wordsFor(student.state));
    part('path').setAttribute('d', SIGNS[student.state] ?? SIGNS.ended);
    const runs = isOn(student);
    setText(part('.toggle'), runs ? say('class.pause') : say('class.run'));
    part('.toggle').setAttribute('aria-label', named(runs ? say('class.pause') : say('class.run'), student));
    part('.toggle').disabled = !['running', 'paused', 'hidden', 'starting'].includes(student.state);
    part('.look').setAttribute('aria-label', say('class.lookAt', { name: student.name }));
    part('.look').disabled = student.simulator === undefined;
    setText(part('summary'), say('class.more'));
    part('summary').setAttribute('aria-label', named(say('class.more'), student));
    for (const [action, words] of [['reset', say('class.reset')], ['message', say('class.message')], ['end', say('class.end')], ['remove', say('class.remove')]])
      setText(part(`[data-do="${action}"]`), words);
    this.#sayPicture(tile);
  }

  // Why there is no picture, or only an old one.
  #sayPicture(tile) {
    const { item, student } = tile;
    const silent = this.#watched && ON.includes(student.state) && Date.now() - Math.max(tile.since, tile.pictured) > NO_PICTURE_MS;
    const words = item.querySelector('.no-picture');
    if (silent)
      setText(words, say('class.noPicture'));
    else if (student.state === 'hidden')
      setText(words, say('class.pictureHidden'));
    else
      setText(words, item.dataset.pictured === undefined && ON.includes(student.state) ? say('class.pictureComes') : '');
  }

  #closeMenus(target) {
    for (const menu of this.#list.querySelectorAll('details[open]')) {
      if (target !== null && menu.contains(target) && target.closest('button') === null)
        continue;
      const inside = menu.contains(document.activeElement);
      menu.open = false;
      if (inside)
        menu.querySelector('summary').focus();
    }
  }
}

const isOn = ({ state }) => ['running', 'hidden', 'starting'].includes(state);

const named = (action, { name }) => `${action}: ${name}`;

const byName = (a, b) => a.name.localeCompare(b.name, textLanguage(), { numeric: true, sensitivity: 'base' }) || a.id - b.id;

function bytesOf(base64) {
  try {
    return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
  } catch {
    return new Uint8Array();
  }
}
