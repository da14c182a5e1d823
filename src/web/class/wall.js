// The wall: a tile for each student; who needs somebody comes first. Touches the DOM.

import { siteText } from './view/availability.js';
import { secondsText } from './view/lesson.js';
import { say, textLanguage } from './view/texts.js';
import { icon } from './view/toolbar.js';
import { duration, element, setText } from './page.js';

const NO_PICTURE_MS = 12000; // Students' pages send one at least every five seconds, if they can.
const STILL_MS = 3000; // Nothing moves under a pointer that has just moved.
const ON = ['running', 'paused'];
const NEEDS = ['hand', 'lost', 'away', 'waiting', 'ended', '', 'done']; // '': all that goes on

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

// Which program a student runs, and how that goes; '' where nothing is known of one.
export function programText({ program }) {
  if (typeof program?.file !== 'string')
    return '';
  const { line, goal } = program;
  const file = program.file.split('/').pop();
  const which = program.changed === true ? say('class.programChanged', { file }) : say('class.programGiven', { file });
  if (Number.isFinite(goal))
    return `${which} · ${say('class.programGoal', { seconds: secondsText(goal) })}`;
  return Number.isInteger(line) ? `${which} · ${say('class.programWrong', { line })}` : which;
}

export class Wall {
  #list = element('wall');
  #act;
  #tiles = new Map(); // by the students' numbers
  #watched = false;
  #stillUntil = 0;
  #isUnsorted = false;

  // `act(action, student)`: 'look', 'pause', 'run', 'reset', 'start', 'lower', 'message', 'end' or 'remove' was pressed.
  constructor(act) {
    this.#act = act;
    document.addEventListener('click', ({ target }) => this.#closeMenus(target));
    document.addEventListener('keydown', ({ key }) => key === 'Escape' && this.#closeMenus(null));
    for (const type of ['pointermove', 'pointerdown', 'keydown'])
      this.#list.addEventListener(type, () => { this.#stillUntil = Date.now() + STILL_MS; });
    setInterval(() => {
      this.#tiles.forEach((tile) => this.#sayPicture(tile));
      if (this.#isUnsorted)
        this.#sort();
    }, 1000);
  }

  count(state) { return [...this.#tiles.values()].filter(({ student }) => student.state === state).length; }

  // Sorted by name.
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
    const moves = known === undefined || byNeed(tile.student, student) !== 0;
    tile.student = student;
    this.#tiles.set(student.id, tile);
    this.#say(tile);
    if (known === undefined)
      this.#list.append(tile.item);
    if (moves)
      this.#sort();
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
    this.#sort();
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
    item.querySelector('.toggle').addEventListener('click', () => this.#act(toggleOf(tile.student), tile.student));
    for (const button of item.querySelectorAll('[data-do]'))
      button.addEventListener('click', () => this.#act(button.dataset.do, tile.student));
    return tile;
  }

  // Not while somebody is about to press something here.
  #sort() {
    this.#isUnsorted = Date.now() < this.#stillUntil || this.#list.querySelector('details[open]') !== null;
    if (this.#isUnsorted)
      return;
    const focused = this.#list.contains(document.activeElement) ? document.activeElement : null;
    const sorted = [...this.#tiles.values()].sort((a, b) => byNeed(a.student, b.student));
    sorted.forEach(({ item }, place) => {
      if (this.#list.children[place] !== item)
        this.#list.insertBefore(item, this.#list.children[place] ?? null);
    });
    focused?.focus({ preventScroll: true });
  }

  #say(tile) {
    const { item, student } = tile;
    const part = (name) => item.querySelector(name);
    item.dataset.student = student.id;
    item.dataset.state = student.state;
    setText(part('.name'), student.name);
    setText(part('.time'), duration(student.time ?? 0));
    setText(part('.words'), wordsFor(student.state));
    part('.state path').setAttribute('d', SIGNS[student.state] ?? SIGNS.ended);
    setText(part('.why'), whyText(student));
    setText(part('.program'), programText(student));
    part('.program').dataset.goes = howItGoes(student);
    this.#saySign(tile);
    const toggle = wordsOfToggle(toggleOf(student));
    setText(part('.toggle'), toggle);
    part('.toggle').setAttribute('aria-label', named(toggle, student));
    part('.toggle').disabled = !['running', 'paused', 'hidden', 'starting', 'ended'].includes(student.state);
    part('.look').disabled = student.simulator === undefined;
    setText(part('summary'), say('class.more'));
    part('summary').setAttribute('aria-label', named(say('class.more'), student));
    for (const [action, words] of [['lower', say('class.lower')], ['reset', say('class.reset')], ['message', say('class.message')], ['end', say('class.end')], ['remove', say('class.remove')]])
      setText(part(`[data-do="${action}"]`), words);
    this.#sayPicture(tile);
  }

  #saySign({ item, student: { sign } }) {
    const place = item.querySelector('.sign');
    item.dataset.sign = sign ?? 'none';
    item.querySelector('[data-do="lower"]').hidden = sign !== 'hand';
    place.hidden = sign === undefined;
    if (sign !== undefined)
      place.replaceChildren(icon(sign === 'hand' ? 'hand' : 'check'), sign === 'hand' ? say('class.signHand') : say('class.signDone'));
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
    const parts = [say('class.lookAt', { name: student.name }), words.textContent];
    item.querySelector('.look').setAttribute('aria-label', parts.filter((part) => part !== '').join(': '));
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

// What the first button of a tile does.
function toggleOf({ state }) {
  if (state === 'ended')
    return 'start';
  return ['running', 'hidden', 'starting'].includes(state) ? 'pause' : 'run';
}

function wordsOfToggle(action) {
  switch (action) {
    case 'start': return say('viewer.startAgain');
    case 'pause': return say('class.pause');
    default: return say('class.run');
  }
}

// For what a student waits, how far a start is, or why the simulation has ended: the last two in the words of the student's page.
function whyText({ state, why = '', ahead }) {
  if (['starting', 'ended'].includes(state))
    return why;
  if (state !== 'waiting')
    return '';
  const place = ahead === undefined ? '' : say('class.inLine', { number: ahead + 1 });
  return [place, waitText(why)].filter((part) => part !== '').join(' ');
}

function waitText(why) {
  switch (why) {
    case 'room': return say('waiting.room');
    case 'suitable': return say('waiting.suitable');
    case 'full': case 'busy': case 'draining': case 'down': case 'none': return siteText(why);
    default: return /^[a-z-]*$/.test(why) ? '' : why; // a sentence; words of later pages say nothing here
  }
}

function howItGoes({ program }) {
  if (Number.isFinite(program?.goal))
    return 'well';
  return Number.isInteger(program?.line) ? 'wrong' : '';
}

const named = (action, { name }) => `${action}: ${name}`;

// Names are compared often, and the rules of a language take long to find.
let names = { language: '', compare: null };

function byName(a, b) {
  if (names.language !== textLanguage())
    names = { language: textLanguage(), compare: new Intl.Collator(textLanguage(), { numeric: true, sensitivity: 'base' }).compare };
  return names.compare(a.name, b.name) || a.id - b.id;
}

// A sign counts for more than the state, but for that of a student who can't go on.
function needOf({ state, sign }) {
  if (sign === 'hand')
    return sign;
  if (['lost', 'away', 'waiting'].includes(state))
    return state;
  if (sign === 'done')
    return sign;
  return state === 'ended' ? state : '';
}

const byNeed = (a, b) => NEEDS.indexOf(needOf(a)) - NEEDS.indexOf(needOf(b)) || byName(a, b);

function bytesOf(base64) {
  try {
    return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
  } catch {
    return new Uint8Array();
  }
}
