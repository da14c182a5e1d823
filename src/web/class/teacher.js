// The teacher's part of the class page: opens a class, has the project fetched, shows how to come in, and the wall. Touches the DOM.

import { folderIn, parseAddress, webToSocket } from './view/address.js';
import { Availability, siteText } from './view/availability.js';
import { TabMemory } from './view/memory.js';
import { Scene } from './view/scene.js';
import { say, textLanguage } from './view/texts.js';
import { worldsOf } from './view/world_lists.js';
import { ClassSocket } from './class_socket.js';
import { FetchAhead } from './fetch_ahead.js';
import { foldOnce, invite, prepareInvitation, showLobby } from './invitation.js';
import { Look } from './look.js';
import { answerOf, classSocket, confirmed, defaults, element, explainCode, ownServer, setText, setTrouble, show, showEnd, written } from './page.js';
import { offerWorlds, sayPicks, showPicks } from './pick_world.js';
import { Wall } from './wall.js';

const WORLDS = 'webots_cloud.worlds'; // that were used on this browser
const MOST_WORLDS = 10;
const SILENT_MS = 10000; // Students whose time goes on tell it every second.
const AT_A_GLANCE = ['running', 'paused', 'starting', 'waiting', 'lost', 'away', 'hidden', 'ended', 'joined'];

export class Teacher {
  #memory = new TabMemory('webots.teacher');
  #socket = null;
  #class = null; // {code, key, world, mode, seats, reserved, staged, machines}
  #fetched = false; // the machines have the project
  #isFetchedAgain = false;
  #fetching = null;
  #times = new Map(); // Of students: {time, at}, `at` when it went on.
  #wall = new Wall((action, student) => this.#act(action, student));
  #look = new Look((action, student, program) => this.#act(action, student, program), () => this.#backToWall());
  #saidProblem = () => '';
  #changesWorld = false; // asked by this window
  #site = 'unknown'; // what the site is: why students wait
  #availability = new Availability((_, state) => {
    this.#site = state;
    this.#sayClass();
  });

  constructor() {
    prepareInvitation();
    element('open-form').addEventListener('submit', (event) => this.#open(event));
    element('seats-form').addEventListener('submit', (event) => this.#changeSeats(event));
    element('fetch-again').addEventListener('click', () => this.#fetchAgain());
    element('new-code').addEventListener('click', () => this.#socket?.send({ code: 'new' }));
    element('another').querySelector('form').addEventListener('submit', (event) => this.#checkWorld(event));
    element('close-class').addEventListener('click', () => this.#close());
    for (const button of element('for-all').querySelectorAll('[data-do]'))
      button.addEventListener('click', () => this.#actOnAll(button.dataset.do));
    document.addEventListener('visibilitychange', () => this.#watch());
    addEventListener('pageshow', ({ persisted }) => persisted && location.reload());
  }

  // No class is open on this page.
  get idle() { return this.#socket === null; }

  // What scripts say, in the language of the page.
  sayAll() {
    setText('open-problem', this.#saidProblem());
    sayPicks();
    if (this.#class === null)
      return;
    this.#sayClass();
    this.#sayFetching();
    this.#saySummary();
    this.#wall.sayAll();
    this.#look.sayAll();
  }

  // After a reload. Whether there was a class to come back to.
  async comeBack() {
    const kept = await this.#memory.recall();
    if (typeof kept?.key !== 'string')
      return false;
    this.#fetched = kept.fetched === true;
    this.#connect(() => ({ teach: { key: kept.key } }));
    show('nothing');
    return true;
  }

  async ask() {
    show('open');
    element(element('password').value === '' ? 'password' : 'world').focus();
    await offerModes(element('mode'));
    const suggestions = worldsUsed();
    const { url } = await defaults();
    if (typeof url === 'string' && url !== '' && !suggestions.includes(url))
      suggestions.push(url);
    element('worlds').replaceChildren(...suggestions.map((world) => new Option(world, world)));
    if (element('world').value === '')
      element('world').value = suggestions[0] ?? '';
    await offerWorlds(element('pick'), element('world'));
  }

  #open(event) {
    event.preventDefault();
    this.#problem(() => '');
    const world = worldIn(element('world'), element('pick'), (says) => this.#problem(says));
    if (world === null)
      return;
    const message = { password: element('password').value, world, mode: element('mode').value, seats: Number(element('seats').value) };
    element('open-class').disabled = true;
    this.#fetched = false;
    this.#connect(() => ({ teach: message }));
  }

  #problem(says) {
    this.#saidProblem = says;
    setText('open-problem', says());
  }

  // `greet()` makes the first message, until the class has given its key.
  #connect(greet) {
    const socket = this.#socket = new ClassSocket(classSocket, () => (this.#class === null ? greet() : { teach: { key: this.#class.key } }));
    const on = (type, handler) => socket.addEventListener(type, ({ detail }) => socket === this.#socket && handler(detail));
    on('told', (message) => this.#hear(message));
    on('lost', ({ opened }) => {
      setTrouble(opened && this.#class !== null ? say('class.lostTeacher') : say('class.unreachable'));
      document.body.classList.toggle('stale', this.#class !== null);
    });
    on('closed', ({ why }) => this.#end(why));
  }

  #hear(message) {
    setTrouble('');
    document.body.classList.remove('stale');
    if (message.class)
      this.#enter(message.class);
    else if (message.student) {
      this.#wall.take(message.student);
      this.#take();
    } else if (message.gone !== undefined) {
      this.#wall.drop(message.gone);
      this.#take();
    } else if (message.program)
      this.#look.showProgram(message.program);
    else if (message.picture)
      this.#wall.picture(message.picture.id, message.picture.jpeg);
    else if (message.reserved !== undefined) {
      this.#class.reserved = message.reserved;
      this.#sayClass();
    } else if (message.staged !== undefined) {
      this.#class.staged = message.staged;
      this.#sayClass();
    } else if (message.world)
      this.#takeWorld(message.world);
    else if (message.code) {
      this.#class.code = message.code;
      this.#sayClass();
    } else if (message.error)
      this.#takeError(message);
  }

  #enter(opened) {
    const isNew = this.#class === null;
    this.#class = opened;
    element('open-class').disabled = false;
    element('password').value = '';
    element('class-seats').value = opened.seats;
    this.#keep();
    this.#wall.set(opened.students);
    if (isNew || this.#isFetchedAgain)
      this.#prepare();
    if (isNew) {
      rememberWorld(opened.world);
      this.#availability.follow(webToSocket(ownServer));
      show('lesson');
    }
    this.#sayClass();
    this.#take();
    this.#watch();
  }

  #takeError({ error, text }) {
    if (this.#class === null) {
      this.#socket.close();
      this.#socket = null;
      this.#memory.forget();
      element('open-class').disabled = false;
      this.#problem(() => explainCode(error, text));
      this.ask();
      if (error === 'password')
        element('password').focus();
    } else if (['code', 'password', 'tries', 'off'].includes(error)) // the class is no longer there
      this.#end('server');
    else {
      element('class-seats').value = this.#class.seats;
      setTrouble(explainCode(error, text));
    }
  }

  // --- the project

  #prepare() {
    const { machines, world, mode } = this.#class;
    this.#isFetchedAgain = false;
    this.#fetching?.stop();
    this.#fetching = new FetchAhead(this.#fetched ? [] : machines, world, mode, () => this.#sayFetching());
    this.#sayFetching();
  }

  // Tickets in the addresses of machines are good for a minute: a teacher who returns to the class gets new ones.
  #fetchAgain() {
    this.#isFetchedAgain = true;
    this.#socket.close();
    this.#connect();
  }

  #sayFetching() {
    if (this.#fetching === null)
      return;
    const { count, done, busy, faults } = this.#fetching;
    const machines = this.#class.machines.length;
    if (!this.#fetched && count > 0 && done === count) {
      this.#fetched = true;
      this.#keep();
    }
    setText('fetch-status', machines === 0 ? say('class.noMachines') : say('class.fetched', { done: this.#fetched ? machines : done, count: machines }));
    element('fetch-progress').hidden = !busy;
    element('fetch-progress').max = Math.max(1, count);
    element('fetch-progress').value = done;
    element('fetch-faults').hidden = faults.length === 0;
    element('fetch-faults').replaceChildren(...faults.map((fault) => Object.assign(document.createElement('li'), { textContent: fault })));
    element('fetch-again').hidden = busy || faults.length === 0;
    this.#sayNeeds();
  }

  // --- the students

  // Somebody came, went or changed.
  #take() {
    const { students } = this.#wall;
    element('nobody').hidden = students.length > 0;
    for (const button of element('for-all').querySelectorAll('button'))
      button.disabled = students.length === 0 && button.dataset.do !== 'world';
    element('for-all').querySelector('[data-do="start"]').disabled = !students.some(({ state }) => state === 'ended');
    if (students.some(({ state }) => ['running', 'paused'].includes(state)))
      foldOnce();
    this.#noteTimes(students);
    this.#sayClass();
    this.#socket?.expect(this.#watches && students.some((student) => this.#goesOn(student)) ? SILENT_MS : 0);
    this.#saySummary();
    this.#look.follow(students);
  }

  #noteTimes(students) {
    const before = this.#times;
    this.#times = new Map(students.map(({ id, time }) => {
      const known = before.get(id);
      return [id, known?.time === time ? known : { time, at: known === undefined ? -Infinity : Date.now() }];
    }));
  }

  // Not one that says it runs while its time stands still, as at a breakpoint of a controller: nothing is told of that.
  #goesOn({ id, state }) { return state === 'running' && Date.now() - this.#times.get(id).at < SILENT_MS; }

  #saySummary() {
    const { students } = this.#wall;
    showLobby(students);
    const count = (key, value) => students.filter((student) => student[key] === value).length;
    const listed = (key, values) => values.map((value) => [count(key, value), value]).filter(([some]) => some > 0).map(([some, value]) => countText(some, value));
    const states = sentence(listed('state', AT_A_GLANCE));
    const signs = sentence(listed('sign', ['hand', 'done']));
    const words = students.length === 1 ? say('class.summaryOne', { states }) : say('class.summary', { count: students.length, states });
    setText('summary', students.length === 0 ? '' : [words, signs].filter((part) => part !== '').join(' · '));
  }

  // What the teacher can do something about is seen also where the preparation is folded.
  #sayNeeds() {
    const isNeeded = this.#fetching?.busy || this.#fetching?.faults.length > 0 || this.#waiting > 0;
    element('preparation').classList.toggle('needed', isNeeded === true);
  }

  get #waiting() { return this.#wall.count('waiting'); }

  #sayClass() {
    if (this.#class === null)
      return;
    const { code, world, seats, reserved, staged, network } = this.#class;
    invite(code, network);
    setText('where', code);
    setText('class-world', world);
    const waiting = this.#waiting;
    this.#sayNeeds();
    setText('reserved', waiting > 0 ? this.#waitingText(waiting) : reserved >= seats ? say('class.reservedAll', { seats }) : say('class.reserved', { seats, reserved }));
    setText('staged', staged ? say('class.staged', staged) : '');
  }

  // Seats may be reserved, and somebody waits all the same: then why is what counts.
  #waitingText(waiting) {
    const why = ['free', 'unknown'].includes(this.#site) ? '' : siteText(this.#site);
    return say('class.waitingStudents', { waiting, why }).trim();
  }

  async #act(action, student, program) {
    const students = [student.id];
    const { name } = student;
    switch (action) {
      case 'look': return this.#showLook(student);
      case 'message': return this.#write(students, say('class.messageTo', { name }));
      case 'give': return this.#give(program);
      case 'end':
        if (!await confirmed(say('class.endSure', { name }), say('class.end')))
          return;
        break;
      case 'remove':
        if (!await confirmed(say('class.removeSure', { name }), say('class.remove')))
          return;
    }
    this.#socket?.send({ tell: { students, do: action } });
  }

  async #actOnAll(action) {
    switch (action) {
      case 'message': return this.#write(null, say('class.messageAll'));
      case 'world': return this.#askWorld();
      case 'end':
        if (!await confirmed(say('class.endAllSure'), say('class.endAll')))
          return;
        break;
      case 'remove':
        if (!await confirmed(say('class.removeAllSure'), say('class.removeAll')))
          return;
    }
    this.#socket?.send({ tell: { students: null, do: action } });
  }

  // Another world takes the place of the class's; an address that is none is answered in the dialog.
  async #askWorld() {
    const { world, mode } = this.#class;
    element('another-world').value = world;
    element('another-mode').value = mode === 'mjpeg' ? 'mjpeg' : 'w3d';
    setText('another-problem', '');
    offerWorlds(element('another-pick'), element('another-world'));
    offerModes(element('another-mode'));
    if (await answerOf(element('another')) !== 'yes')
      return;
    this.#changesWorld = true;
    this.#socket?.send({ world: { world: worldIn(element('another-world'), element('another-pick')), mode: element('another-mode').value } });
  }

  #checkWorld(event) {
    if (event.submitter?.value === 'yes' && worldIn(element('another-world'), element('another-pick'), (says) => setText('another-problem', says())) === null)
      event.preventDefault();
  }

  // Machines fetch it before it is started, if they can: the window that asked for it has them do so.
  #takeWorld(chosen) {
    Object.assign(this.#class, chosen);
    this.#sayClass();
    rememberWorld(chosen.world);
    if (!this.#changesWorld)
      return;
    this.#changesWorld = false;
    this.#fetched = false;
    this.#keep();
    this.#fetchAgain();
  }

  // Everybody gets this program, in place of what is in their editors.
  async #give(program) {
    if (await confirmed(say('class.giveSure', { file: program.file }), say('class.give')))
      this.#socket?.send({ tell: { students: null, do: 'take', ...program } });
  }

  async #write(students, title) {
    const text = await written(title);
    if (text !== '')
      this.#socket?.send({ tell: { students, do: 'message', text } });
  }

  #changeSeats(event) {
    event.preventDefault();
    this.#class.seats = Number(element('class-seats').value);
    this.#socket?.send({ seats: this.#class.seats });
    this.#sayClass();
  }

  #showLook(student) {
    show('look');
    this.#look.open(student, this.#class.mode);
    this.#watch();
  }

  #backToWall() {
    const student = this.#look.student;
    this.#look.close();
    show('lesson');
    this.#watch();
    this.#wall.focus(student?.id);
  }

  // Pictures are wanted while somebody sees them.
  get #watches() { return !document.hidden && this.#look.student === null; }

  #watch() {
    if (this.#class === null)
      return;
    this.#wall.watched = this.#watches;
    this.#socket.send({ watch: this.#watches });
    this.#take();
  }

  async #close() {
    if (await confirmed(say('class.closeSure'), say('class.close')))
      this.#socket?.send({ close: true });
  }

  #keep() {
    this.#memory.remember({ key: this.#class.key, fetched: this.#fetched }, this.#class.key);
  }

  #end(why) {
    this.#memory.forget();
    this.#socket?.close();
    this.#socket = this.#class = null;
    this.#availability.follow(null);
    this.#fetching?.stop();
    this.#look.close();
    this.#wall.set([]);
    document.body.classList.remove('stale');
    if (document.fullscreenElement !== null)
      document.exitFullscreen();
    element('question').close();
    element('writing').close();
    element('another').close();
    setText('where', '');
    showEnd(why);
  }
}

// What was entered is the address of a world that this server starts; otherwise null, and it is said why. The worlds of a repository take the
// place of the site's.
function worldIn(field, place, problem = () => {}) {
  try {
    const target = parseAddress(field.value, ownServer);
    if (target.kind === 'session')
      return target.world;
    problem(() => say('class.errorWorld'));
  } catch (error) {
    problem(() => error.message);
  }
  field.focus();
  const folder = folderIn(field.value);
  if (folder !== '')
    listWorlds(folder, field, place, problem);
  return null;
}

async function listWorlds(folder, field, place, problem) {
  problem(() => say('gallery.looking', { address: folder }));
  const { worlds, trouble } = await worldsOf(ownServer, folder);
  problem(() => trouble || say('class.chooseWorld'));
  showPicks(place, field, worlds);
  place.querySelector('button')?.focus();
}

async function offerModes(field) {
  field.querySelector('[value="w3d"]').disabled = await Scene.missing() !== '';
}

const sentence = (parts) => new Intl.ListFormat(textLanguage()).format(parts);

// So many students of a class.
function countText(count, what) {
  switch (what) {
    case 'joined': return say('class.countJoined', { count });
    case 'starting': return say('class.countStarting', { count });
    case 'running': return say('class.countRunning', { count });
    case 'paused': return say('class.countPaused', { count });
    case 'waiting': return say('class.countWaiting', { count });
    case 'hidden': return say('class.countHidden', { count });
    case 'lost': return say('class.countLost', { count });
    case 'away': return say('class.countAway', { count });
    case 'hand': return say('class.countHand', { count });
    case 'done': return say('class.countDone', { count });
    default: return say('class.countEnded', { count });
  }
}

// Browsers may keep nothing, for instance in a private window.
function worldsUsed() {
  try {
    const worlds = JSON.parse(localStorage.getItem(WORLDS) ?? '[]');
    return Array.isArray(worlds) ? worlds.filter((world) => typeof world === 'string') : [];
  } catch {
    return [];
  }
}

function rememberWorld(world) {
  const worlds = [world, ...worldsUsed().filter((other) => other !== world)].slice(0, MOST_WORLDS);
  try {
    localStorage.setItem(WORLDS, JSON.stringify(worlds));
  } catch { /* See above. */ }
}
