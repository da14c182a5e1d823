// A student's part of the class page: a name, then a simulation, which the teacher sees small and may pause, reset or end. Touches the DOM.

import { Availability, siteText } from './view/availability.js';
import { webToSocket } from './view/address.js';
import { TabMemory } from './view/memory.js';
import { say } from './view/texts.js';
import { icon } from './view/toolbar.js';
import { placeText, returningText, SlowVoice, waitingTitle } from './view/waiting.js';
import { View } from './view/webots_view.js';
import { ClassSocket } from './class_socket.js';
import { classSocket, defaults, element, explainCode, ownServer, setText, setTrouble, show, showEnd } from './page.js';
import { Thumbnails } from './thumbnails.js';

const LONGEST_REASON = 200; // characters that the server takes
const REPORT_MS = 600; // the server drops what comes more often than every 500 ms
const TIME_MS = 1000;
const FIRST_RETRY_MS = 3000;
const LONGEST_RETRY_MS = 20000;
const SETTLING_MS = 2000; // in which those who wait ask for a seat, when one is free

const oneLine = (text) => text.replace(/\s+/g, ' ').slice(0, LONGEST_REASON);

export class Student {
  #code;
  #socket = null;
  #class = null; // {id, token, seat, name, world, mode}
  #isChecking = false; // whether there is a class with this code
  #returns = false; // to a place that the class may have given up
  #memory = new TabMemory('webots.class');
  #view = new View(element('simulation'));
  #thumbnails = new Thumbnails(this.#view, (picture) => this.#socket?.send({ picture }));
  #availability = new Availability((value, state) => this.#takeSite(value, state));
  #site = 'unknown'; // what the site is, where this page asks again and again
  #ticket = null;
  #ticketOf = ''; // the world that it returns to
  #began = false; // a simulation, at some time
  #waits = false; // for a seat, where nobody else keeps a line: this page asks again and again
  #place = null; // in the line of a session server that keeps one: what the event "progress" tells of it
  #voice = new SlowVoice((text) => setText('place-said', text));
  #startedUnseen = false; // the page was hidden
  #attempts = 0;
  #retry = 0;
  #reported = { text: '', at: -Infinity };
  #reporting = 0;
  #saidStatus = () => '';
  #pauseHidden = 0; // seconds
  #resting = 0; // the timer that pauses the simulation of a hidden page
  #interrupted = ''; // its mode before that
  #sign = 'none'; // what the teacher sees: 'hand', 'done' or 'none'
  #refusal = ''; // of the last start: 'none' (no machine is free), or what was said
  #step = ''; // of the start, as the view says it
  #problem = ''; // with which the last simulation has ended

  constructor(code) {
    this.#code = code;
    this.#view.runOnLoad = true;
    this.#view.showQuit = false; // the page has a button of its own, which says what it does
    this.#view.offersStart = false;
    this.#view.setTimeout(-1);
    this.#view.onstate = () => this.#takeState();
    this.#view.onclose = (end) => this.#takeEnd(end);
    this.#view.onerror = (text) => this.#takeProblem(text);
    this.#view.onprogress = (told) => {
      this.#step = oneLine(told.text ?? '');
      this.#takePlace(told);
      this.#report();
    };
    this.#view.onprogram = () => this.#report();
    this.#view.onready = () => {
      this.#startedUnseen = document.hidden;
      this.#sayTitle();
    };
    this.#view.onticket = (ticket) => {
      this.#ticket = ticket;
      if (ticket?.token !== undefined)
        this.#stopWaiting();
      this.#keep();
    };
    element('name-form').addEventListener('submit', (event) => this.#join(event));
    element('again').addEventListener('click', () => this.#start());
    element('leave').addEventListener('click', () => this.#leave());
    for (const button of element('signs').querySelectorAll('[data-sign]')) {
      button.prepend(icon(button.dataset.icon));
      button.addEventListener('click', () => this.#socket?.send({ sign: button.dataset.sign === this.#sign ? 'none' : button.dataset.sign }));
    }
    element('told-close').addEventListener('click', () => { element('told').hidden = true; });
    element('over-next').href = './';
    document.addEventListener('visibilitychange', () => {
      this.#startedUnseen &&= document.hidden;
      this.#sayTitle();
      this.#rest();
      this.#sayState();
      this.#report();
    });
    addEventListener('pageshow', ({ persisted }) => persisted && location.reload());
    setInterval(() => this.#report(), TIME_MS);
  }

  // What scripts say, in the language of the page.
  sayAll() {
    setText('name-title', say('class.joinTitle', { code: this.#code }));
    setText('where', this.#class === null ? this.#code : `${this.#code} · ${this.#class.name}`);
    setText('seat-status', this.#saidStatus());
    setText('place', this.#placeText);
    setText('waiting-why', this.#waitingText);
    this.#sayTitle();
  }

  // After a reload. Whether there was something to come back to.
  async comeBack() {
    this.#readDefaults();
    const kept = await this.#memory.recall();
    if (typeof kept?.token !== 'string')
      return false;
    this.#ticket = kept.ticket ?? null;
    this.#ticketOf = kept.world;
    this.#returns = true;
    this.#connect(() => ({ join: { token: kept.token } }));
    show('nothing');
    return true;
  }

  // The code first, so that nobody enters a name for a class that is not there.
  ask() {
    show('nothing');
    this.#isChecking = true;
    this.#connect(() => ({ check: this.#code }));
  }

  #askName(problem = '') {
    show('name');
    this.sayAll();
    setText('name-problem', problem);
    element('name').focus();
  }

  #askCode(problem) {
    show('doors');
    element('code').value = this.#code;
    setText('code-problem', problem);
    element('code').select();
  }

  async #readDefaults() {
    const { pauseHidden } = await defaults();
    this.#pauseHidden = Number.isFinite(pauseHidden) ? pauseHidden : 0;
  }

  #join(event) {
    event.preventDefault();
    const name = element('name').value.trim().replace(/\s+/g, ' ');
    if (name === '')
      return element('name').focus();
    setText('name-problem', '');
    element('join').disabled = true;
    this.#socket?.close();
    this.#connect(() => ({ join: { code: this.#code, name } }));
  }

  // `greet()` makes the first message, until the class has given a token.
  #connect(greet) {
    const socket = this.#socket = new ClassSocket(classSocket, () => (this.#class === null ? greet() : { join: { token: this.#class.token } }));
    const on = (type, handler) => socket.addEventListener(type, ({ detail }) => socket === this.#socket && handler(detail));
    on('told', (message) => this.#hear(message));
    on('lost', ({ opened }) => setTrouble(opened ? say('class.lostStudent') : say('class.unreachable')));
    on('closed', ({ why }) => this.#end(why));
  }

  #hear(message) {
    setTrouble('');
    if (message.checked)
      this.#takeCode();
    else if (message.joined)
      this.#enter(message.joined);
    else if (message.world)
      this.#changeWorld(message.world);
    else if (message.sign)
      this.#showSign(message.sign);
    else if (message.pictures !== undefined)
      this.#thumbnails.wanted = message.pictures;
    else if (message.do)
      this.#obey(message.do, message.text, message.file);
    else if (message.error)
      this.#takeError(message);
  }

  #takeCode() {
    this.#isChecking = false;
    this.#socket.close();
    this.#socket = null;
    this.#askName();
  }

  #enter(joined) {
    const before = this.#class;
    this.#class = joined;
    this.#isChecking = this.#returns = false;
    this.#reported = { text: '', at: -Infinity };
    this.sayAll();
    this.#showSign(joined.sign ?? 'none');
    if (before !== null) {
      this.#keep();
      return before.world === joined.world && before.mode === joined.mode ? this.#report() : this.#changeWorld(joined);
    }
    element('join').disabled = false;
    show('seat');
    this.#start(this.#ticketOf === joined.world ? this.#ticket : null);
  }

  #changeWorld({ world, mode }) {
    this.#class = { ...this.#class, world, mode };
    this.#stopWaiting();
    this.#start();
  }

  // As the class has it.
  #showSign(sign) {
    this.#sign = sign;
    for (const button of element('signs').querySelectorAll('[data-sign]'))
      button.setAttribute('aria-pressed', String(button.dataset.sign === sign));
  }

  // Before somebody is in, it is his entry that was refused. Afterwards: the class that he returns to is no longer there.
  #takeError({ error, text }) {
    if (error === 'message') {
      console.warn(text);
      return this.#isChecking ? this.#takeCode() : undefined; // a server from before that question
    }
    if (this.#class !== null)
      return ['code', 'tries', 'full'].includes(error) ? this.#end('server') : undefined;
    this.#socket.close();
    this.#socket = null;
    element('join').disabled = false;
    const hadPlace = this.#returns;
    this.#returns = false;
    this.#memory.forget();
    if (hadPlace && error === 'code') // it was given up, though the class may be there
      return this.ask();
    if (this.#isChecking || error === 'code')
      this.#askCode(explainCode(error, text));
    else
      this.#askName(explainCode(error, text));
    this.#isChecking = false;
  }

  // `ticket`: to return to a simulation, or to a place in the line.
  #start(ticket = null) {
    clearTimeout(this.#retry);
    element('again').hidden = true;
    this.#step = this.#problem = '';
    this.#ticket = ticket;
    this.#ticketOf = this.#class.world;
    this.#keep();
    const request = `${ownServer}session?class=${encodeURIComponent(this.#class.seat)}`;
    this.#view.open(this.#class.world, this.#class.mode, { request, ticket });
  }

  #takeState() {
    this.#began ||= this.#view.state === 'starting';
    if (['waiting', 'paused', 'running', 'fast'].includes(this.#view.state))
      this.#stopWaiting();
    if (this.#view.state !== 'waiting')
      this.#takePlace({});
    this.#sayState();
    this.#report();
  }

  #takeProblem(text) {
    console.warn(text);
    if (!['failed', 'ended'].includes(this.#view.state))
      return;
    this.#problem = oneLine(text);
    this.#report();
  }

  #takePlace(told) {
    const inLine = told.ahead !== undefined || told.returning !== undefined;
    if (!inLine && this.#place === null)
      return;
    this.#place = inLine ? told : null;
    if (inLine)
      this.#voice.tell(this.#placeText);
    else
      this.#voice.stop();
    setText('place', this.#placeText);
    element('place').hidden = !inLine;
    setText('waiting-why', this.#waitingText);
    this.#sayTitle();
    this.#report();
  }

  get #placeText() {
    if (this.#place === null)
      return '';
    return this.#place.ahead === undefined ? returningText(this.#place.returning) : placeText(this.#place);
  }

  // People look at other tabs meanwhile.
  #sayTitle() {
    const title = say('class.title');
    const place = this.#place ?? (this.#waits ? {} : null);
    document.title = this.#startedUnseen ? say('waiting.titleStarted', { title }) : waitingTitle(title, place);
  }

  get #isWaiting() { return this.#waits || this.#view.state === 'waiting'; }

  // Nobody else knows which simulations this class has room for, so those who wait ask, now and then, and when any seat is free.
  #takeEnd(end) {
    this.#ticket = null;
    this.#keep();
    if (end?.busy) {
      this.#waits = true;
      this.#refusal = end.full ? 'none' : oneLine(end.text);
      this.#availability.follow(webToSocket(ownServer));
      const delay = Math.min(LONGEST_RETRY_MS, FIRST_RETRY_MS * 1.5 ** this.#attempts++);
      this.#retryIn(delay * (0.5 + Math.random() / 2));
    } else
      this.#stopWaiting();
    element('again').hidden = this.#waits;
    this.#sayState();
    this.#report();
  }

  #takeSite(value, state) {
    this.#site = state;
    this.#sayState();
    this.#report();
    if (value === 'available')
      this.#hurry();
  }

  // In the line the place tells the reason, unless it is a seat. Elsewhere the site does, unless there is room for others.
  get #waitingText() {
    if (this.#place !== null)
      return ''; // which is said with the place
    if (['free', 'unknown'].includes(this.#site))
      return this.#refusal === 'none' ? siteText('none') : this.#refusal;
    return siteText(this.#site);
  }

  #hurry() {
    if (this.#waits && this.#view.state !== 'starting')
      this.#retryIn(Math.random() * SETTLING_MS);
  }

  #retryIn(milliseconds) {
    clearTimeout(this.#retry);
    this.#retry = setTimeout(() => this.#start(), milliseconds);
  }

  #stopWaiting() {
    this.#waits = false;
    this.#attempts = 0;
    clearTimeout(this.#retry);
    this.#availability.follow(null);
    this.#sayState();
  }

  // As the teacher is told.
  get #state() {
    if (this.#isWaiting)
      return 'waiting';
    const state = { fast: 'running', failed: 'ended', idle: this.#began ? 'ended' : 'joined' }[this.#view.state] ?? this.#view.state;
    return document.hidden && ['running', 'paused'].includes(state) ? 'hidden' : state;
  }

  // What the teacher's tile says beside the state: for a student who waits a word, otherwise what this page says.
  get #why() {
    if (!this.#isWaiting)
      return this.#view.state === 'starting' ? this.#step : this.#problem;
    if (this.#place !== null)
      return this.#place.ahead === undefined ? '' : this.#place.why || 'full';
    return ['free', 'unknown'].includes(this.#site) ? this.#refusal : this.#site;
  }

  #sayState() {
    element('waiting').hidden = !this.#isWaiting;
    element('simulation').hidden = this.#isWaiting;
    setText('waiting-why', this.#waitingText);
    this.#sayTitle();
    document.body.dataset.state = this.#state;
    this.#saidStatus = () => {
      switch (this.#isWaiting ? 'waiting' : this.#view.state) {
        case 'waiting': return say('class.waitingTitle');
        case 'starting': return say('class.statusStarting');
        case 'running': return say('viewer.running');
        case 'fast': return say('viewer.runningFast');
        case 'paused': return say('viewer.paused');
        case 'lost': return say('class.statusLost');
        default: return say('class.statusEnded');
      }
    };
    setText('seat-status', this.#saidStatus());
  }

  // Tells the teacher, but not more often than the server takes it.
  #report() {
    if (this.#class === null)
      return;
    const state = { state: this.#state, time: Math.round(this.#view.time) };
    if (this.#view.simulator !== '')
      state.simulator = this.#view.simulator;
    if (this.#why !== '')
      state.why = this.#why;
    if (this.#place?.ahead !== undefined)
      state.ahead = this.#place.ahead;
    if (this.#view.running !== null)
      state.program = this.#view.running;
    const text = JSON.stringify(state);
    if (text === this.#reported.text || !this.#socket.connected)
      return;
    clearTimeout(this.#reporting);
    const early = this.#reported.at + REPORT_MS - performance.now();
    if (early > 0) {
      this.#reporting = setTimeout(() => this.#report(), early);
      return;
    }
    this.#reported = { text, at: performance.now() };
    this.#socket.send({ state });
  }

  // With `pauseHidden` in the server's configuration, a simulation does not run for long while nobody sees its page.
  #rest() {
    clearTimeout(this.#resting);
    const mode = this.#view.state;
    if (document.hidden && this.#pauseHidden > 0 && ['running', 'fast'].includes(mode)) {
      this.#resting = setTimeout(() => {
        this.#interrupted = mode;
        this.#view.pause();
      }, this.#pauseHidden * 1000);
    }
    if (document.hidden || this.#interrupted === '')
      return;
    this.#view[this.#interrupted === 'fast' ? 'fast' : 'play']();
    this.#interrupted = '';
  }

  // What the teacher wants counts for more than what a page did that was hidden.
  #obey(action, text, file) {
    if (!['message', 'program', 'take'].includes(action)) {
      clearTimeout(this.#resting);
      this.#interrupted = '';
    }
    switch (action) {
      case 'pause': return this.#view.pause();
      case 'run': return this.#view.play();
      case 'reset': return this.#view.reset();
      case 'end': return this.#view.close();
      case 'start': return this.#startAgain();
      case 'program': return this.#sendProgram();
      case 'take': return this.#view.takeProgram(String(file ?? ''), String(text ?? ''));
      case 'message':
        setText('told-text', String(text ?? ''));
        element('told').hidden = false;
    }
  }

  // Of those who wait or run already, nothing is lost.
  #startAgain() {
    if (!this.#waits && ['idle', 'ended', 'failed'].includes(this.#view.state))
      this.#start();
  }

  // The teacher reads along; what is there to read may be nothing.
  async #sendProgram() {
    const program = await this.#view.program();
    if (program !== null)
      this.#socket?.send({ program });
  }

  #keep() {
    if (this.#class !== null)
      this.#memory.remember({ token: this.#class.token, ticket: this.#ticket, world: this.#class.world }, this.#class.token);
  }

  #leave() {
    this.#socket.send({ leave: true });
    this.#finish();
    location.assign('./');
  }

  // What stops when the class does: everything, unless it was the server, whose end takes no simulation away.
  #end(why) {
    if (this.#class === null || why !== 'server')
      this.#finish();
    this.#memory.forget();
    if (this.#class !== null && why === 'server') {
      this.#socket?.close();
      this.#thumbnails.wanted = null;
      return setTrouble(say('class.overServerStudent'));
    }
    showEnd(why);
  }

  #finish() {
    this.#memory.forget();
    this.#thumbnails.wanted = null;
    this.#stopWaiting();
    this.#view.onclose = null;
    this.#view.close();
    this.#view.onstate = null;
    this.#socket?.close();
    this.#class = null;
  }
}
