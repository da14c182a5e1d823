// One session, from pressing Start to the end: ask the session server for a machine, hold the lease on it, show its
// progress, and connect to the simulator when it is ready. No DOM.
//
// Events (CustomEvents): those of Simulator except "silent", "heard" and "closed", and
//   progress {text, percent, ahead, least, most, why, wantsRoom, returning}  `percent` is null where it is not known. The others are there
//                            only while the session waits in a line: so many are before it, for so many seconds, or null where there
//                            is no estimate, and for this reason (waiting.js); or, while a broken
//                            connection is restored, the place is kept for so many seconds
//   notice {text}            something to tell while the session goes on
//   problem {text}           an error that the server reported; the session may or may not end after it
//   lost {text, connected}   nothing arrives, or a connection broke: what is shown is old. `text` says why; `connected` when it is
//                            the simulator that is silent, which still may hear. A connection is restored where the simulation
//                            server allows it; then come "picture" and "ready"
//   deadline {ends, extendable}  when the simulation will be ended, as Date.now() counts, and by how many seconds extend() can
//                            put that off
//   picture {url, viewOnly, early}  `early`: its source says later who this page is; then it comes once more
//   rest                     the page is hidden: show no picture; "picture" comes when it is seen again
//   ticket (ticket)          with which another session, also of a reloaded page, can return to the simulation, or to the place in the line;
//                            null: there is nothing to return to any more
//   message {from, text}     a message as it came, `from` the 'server' of simulations or the 'simulator'
//   ended {text, failed, full, busy}  the last event; `failed` when the simulation never became ready, `full` when no machine was free,
//                            `busy` when that is so, or the session server is asked too often: it may be asked again later

import { socketToWeb, webToSocket } from './address.js';
import { Lease, prepareLease } from './lease.js';
import { isBehindGateway } from './picture_stream.js';
import { explain, parseReason } from './refusals.js';
import { Simulator, sizeText } from './simulator.js';
import { say } from './texts.js';
import { placeText, returningText } from './waiting.js';
import { SILENT_MS } from './watch.js';

const SESSION_ANSWER_MS = 30000;
const LAST_WORD_MS = 1000;
const MUTE_MS = 10000; // a simulator says something as soon as it is connected
const SHUTDOWN_WARNING_S = 300;
const LONGEST_TIMER_S = 2 ** 31 / 1000;
const LOSSES = 60;
const EXTENSION_S = 900; // at once
const PATIENCE_MS = 10000; // with a simulator that is silent; doubled each time
const MOST_SAID = 100; // messages of a simulator that are kept for us
const PLACE_KEPT_S = 60;
const PLACE_KEPT_AFTER_SILENCE_S = 35; // by then it has been lost for a while
const PROBE_MS = 5000;
const SERVER_STOPS = 1001;
const BROKEN = 1006;
const TAKEN_OVER = 4001;
const RELAYED = ['message', 'scene', 'model', 'update', 'label', 'node', 'delete', 'mode', 'time', 'progress', 'world', 'output'];

export class Session extends EventTarget {
  #target;
  #size;
  #over = false;
  #ready = false;
  #problem = '';
  #refusal = {}; // whether `#problem` was that no machine is free
  #reason = null; // the server's, of the sentence that follows
  #hasLine = false; // the server tells the place in it, by `waiting:`
  #countdown = 0; // the timer of a return to the line
  #abort = new AbortController();
  #lease = null;
  #simulator = null;
  #lastWord = '';
  #losses = 0; // of the connection to the simulator, since it was last ready
  #patience = PATIENCE_MS;
  #silence = 0;
  #mute = 0; // the timer of a simulator that was never heard
  #url = '';
  #picture = null;
  #hasPictures = false; // the server has asked the simulator for them
  #said = []; // what the simulator has said to the server meanwhile
  #controls = false; // this page was the simulator's first, and controls the view
  #lost = false;
  #hidden = false;
  #ends = Infinity;
  #extendable = 0;
  #warning = 0;
  #warned = false;
  #ticket;
  #returns;
  #timers = [];

  // `target` comes from parseAddress() or parseViewAddress(); pages may add to it
  //   machine    where starts are taken, if that is known: `wss://host`. The session server is not asked for it
  //   opening    the text to start the simulation with, instead of a `start` message (a website's project)
  //   paused     true: a simulation that is started here waits for play(), instead of running at once
  //   broadcast  true: only watches, and sends the simulator nothing but the line that says so
  //   edit       true: the page has an editor for programs
  //   mode       'mjpeg' (pictures, unless given), 'w3d' or 'x3d' (the scene)
  // `size` is {width, height} of the picture in pixels. `ticket`: of an earlier session, to whose simulation, or place in the line,
  // this one returns.
  constructor(target, size, ticket = null) {
    super();
    this.#target = target;
    this.#size = size;
    this.#ticket = ticket;
    this.#returns = ticket?.token !== undefined;
  }

  // Connects to the machine, if it is known, before somebody starts there: hands rest on a button for a moment.
  static prepare({ machine }) {
    if (machine !== undefined)
      prepareLease(`${machine}/client`);
  }

  // Null until the simulator's address is known.
  get simulator() { return this.#simulator; }

  // Whether the simulation was started for this session, and ends with it.
  get owned() { return this.#lease !== null; }

  // To the simulation server, which holds the lease; ignored when there is none.
  sendToServer(text) { this.#lease?.send(text); }

  // The picture's size, used when connecting and told to a simulator that is already there.
  resize(size) {
    this.#size = size;
    this.#simulator?.resize(size);
  }

  get target() { return this.#target; }

  // Whether nothing arrives at the moment.
  get lost() { return this.#lost; }

  // Whether the simulation goes on for a while without this page, which can return to it with the ticket.
  get lasting() { return this.#lease?.lasting ?? false; }

  // Whether the page can return, to the simulation or to the line.
  get #canReturn() { return this.lasting || (this.#lease?.waitingTicket ?? '') !== ''; }

  // Whether nobody sees the page: then there is no picture.
  set hidden(hidden) {
    if (hidden === this.#hidden)
      return;
    this.#hidden = hidden;
    if (this.#simulator !== null)
      this.#simulator.hidden = hidden;
    if (hidden)
      this.#tell('rest');
    else
      this.#tellPicture();
  }

  // Asks for more time, as far as the operator allows it: the event "deadline" answers.
  extend() {
    if (this.#extendable > 0)
      this.sendToServer(JSON.stringify({ extend: Math.min(this.#extendable, EXTENSION_S) }));
  }

  async start() {
    if (this.#target.kind === 'simulator')
      return this.#connect(this.#target.url);
    try {
      const machine = this.#ticket?.machine ?? this.#target.machine ?? await this.#askForMachine();
      if (!this.#over)
        this.#takeLease(machine);
    } catch (error) {
      this.#end(error.message, error);
    }
  }

  // Ends the session, or gives its place in the line up, for the user: no "ended" event follows.
  stop() {
    this.#finish();
    this.#lease?.close();
  }

  // The page goes away, and may return with the ticket. No event follows.
  leave() {
    if (!this.#canReturn)
      return this.stop();
    this.#finish();
    this.#lease.leave();
  }

  #finish() {
    this.#over = true;
    this.#abort.abort();
    clearTimeout(this.#silence);
    clearTimeout(this.#mute);
    clearTimeout(this.#warning);
    clearInterval(this.#countdown);
    this.#timers.forEach(clearTimeout);
    this.#simulator?.close();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #end(text, { full = false, busy = false } = {}) {
    if (this.#over)
      return;
    this.stop();
    this.#tell('ended', { text: this.#problem || text, failed: !this.#ready, full, busy });
  }

  #after(milliseconds, action) {
    this.#timers.push(setTimeout(action, milliseconds));
  }

  async #askForMachine() {
    const { server, request } = this.#target;
    this.#tell('progress', { text: say('session.asking'), percent: null });
    this.#after(SESSION_ANSWER_MS, () => this.#end(say('session.silent', { server })));
    const response = await fetch(request, { cache: 'no-store', signal: this.#abort.signal }).catch(() => {
      throw new Error(say('session.unreachable', { server }));
    });
    const answer = (await response.text()).trim();
    this.#timers.splice(0).forEach(clearTimeout);
    if (!response.ok)
      throw new Error(say('session.status', { server, status: response.status }));
    if (answer.startsWith('Error:')) {
      const code = response.headers.get('Webots-Reason');
      const { text, ...refusal } = explain(answer.slice('Error:'.length), code && { code, values: {} });
      throw Object.assign(new Error(text), refusal);
    }
    if (!/^wss?:\/\/./.test(answer))
      throw new Error(say('session.noAddress', { server }));
    return answer.replace(/\/+$/, '');
  }

  #takeLease(machine) {
    const waitingTicket = this.#ticket?.waiting;
    if (waitingTicket !== undefined)
      this.#returnToLine(PLACE_KEPT_S);
    else
      this.#tell('progress', { text: this.#returns ? say('lease.returning') : say('session.connecting'), percent: null });
    try {
      this.#lease = new Lease(`${machine}/client`, this.#openingAt(machine), { token: this.#ticket?.token, waitingTicket });
    } catch {
      throw new Error(refusedSocket(machine));
    }
    this.#lease.addEventListener('message', ({ detail }) => this.#receive(detail.text));
    this.#lease.addEventListener('token', () => {
      const { token, waitingTicket: waiting } = this.#lease;
      if (token !== '')
        this.#ticket = { machine, token };
      else
        this.#ticket = waiting === '' ? null : { machine, waiting };
      this.#tell('ticket', this.#ticket);
    });
    this.#lease.addEventListener('lost', ({ detail: { silent, waiting } }) => {
      if (waiting)
        this.#returnToLine(silent ? PLACE_KEPT_AFTER_SILENCE_S : PLACE_KEPT_S);
      else
        this.#lose(silent ? say('lease.silent') : say('lease.returning'));
    });
    this.#lease.addEventListener('restored', () => {
      clearInterval(this.#countdown);
      this.#verifySimulator();
    });
    this.#lease.addEventListener('closed', async ({ detail }) => {
      if (!detail.opened && this.#target.machine === machine && this.#ticket === null) {
        this.#target = { ...this.#target, machine: undefined }; // It may take no starts any more, and knows who does.
        return this.start();
      }
      const why = this.#lastWord || this.#problem || (detail.opened ? leaseLoss(detail, this.#ready) : await this.#whyClosed(machine));
      this.#end(why, this.#refusal);
    });
  }

  // Of a server that was never reached by a WebSocket. Browsers don't say why; plain requests go where proxies lack rules for others.
  async #whyClosed(machine) {
    const options = { mode: 'no-cors', cache: 'no-store', signal: AbortSignal.timeout(PROBE_MS) };
    const answers = await fetch(`${socketToWeb(machine)}/livez`, options).then(() => true, () => false);
    return answers ? say('lease.noUpgrade', { machine }) : say('lease.unreachable', { machine });
  }

  // A session server that answers with its own address takes the start itself: then it may make the page wait, and gives students
  // the seats of their class.
  #openingAt(machine) {
    const { opening, mode, request, server, world, edit } = this.#target;
    const start = { url: world, mode: mode ?? 'mjpeg', reconnect: true, heartbeat: true, extend: true, reasons: true,
      ...(edit === true ? { edit } : {}), ...this.#greeting };
    if (!isSame(machine, webToSocket(server)))
      return opening ?? { start };
    const student = new URL(request).searchParams.get('class');
    const asked = { waiting: true, ...(student === null ? {} : { class: student }) };
    return opening === undefined ? { start: { ...start, ...asked } } : { ...JSON.parse(opening), ...asked };
  }

  // What we shall say to the simulator as soon as we are connected to it. A server that knows how says it before, as it is beside the simulator.
  get #greeting() {
    const { broadcast, paused } = this.#target;
    if (!this.#showsPictures || broadcast === true)
      return {};
    return { size: sizeText(this.#size), ...(paused === true ? {} : { run: true }) };
  }

  get #showsPictures() { return (this.#target.mode ?? 'mjpeg') === 'mjpeg'; }

  // Nobody needs to do anything: the lease returns by itself.
  #returnToLine(seconds) {
    const until = performance.now() + seconds * 1000;
    const tell = () => {
      const returning = Math.max(0, Math.round((until - performance.now()) / 1000));
      this.#tell('progress', { text: returningText(returning), percent: null, returning });
    };
    clearInterval(this.#countdown);
    this.#countdown = setInterval(tell, 1000);
    tell();
  }

  #receive(message) {
    this.#tell('message', { from: 'server', text: message });
    const [, prefix, rest] = /^([a-zA-Z]+):\s?([^]*)/.exec(message) ?? [null, '', ''];
    switch (prefix) {
      case 'reason': return void (this.#reason = parseReason(rest));
      case 'loading': case 'docker': return this.#load(rest.trim());
      case 'Error': case 'error': return this.#report(rest);
      case 'shutdownTimeout': return this.#planShutdown(Number(rest));
      case 'extendable': return this.#setExtendable(Number(rest));
      case 'stdout': case 'stderr': return this.#tell('output', { stream: prefix, line: rest }); // for the author of the project
      case 'waiting': return this.#wait(rest.trim());
      case 'queue': return this.#hasLine || this.#tell('progress', { text: say('session.queue', { count: Number(rest) }), percent: null });
      case 'pictures': return void (this.#hasPictures = true);
      case 'said': return void (this.#said.length < MOST_SAID && this.#said.push(rest));
      case 'webots': return this.#connect(rest.trim());
    }
  }

  #load(line) {
    if (line.startsWith('Error:'))
      return this.#report(line.slice('Error:'.length));
    this.#tell('progress', { text: inOurWords(line), percent: percentOf(line) });
  }

  // "3 60 240" or, without an estimate, "3 - -"; then perhaps for what it waits, as in " room"
  #wait(rest) {
    const words = rest.split(' ');
    const [ahead, least, most] = words.map((word) => (/^\d+$/.test(word) ? Number(word) : null));
    if (ahead === null)
      return;
    this.#hasLine = true;
    const place = { ahead, least: least ?? null, most: most ?? null, why: words[3] ?? '', wantsRoom: words[3] === 'room' };
    this.#tell('progress', { text: placeText(place), percent: null, ...place });
  }

  #report(text) {
    ({ text: this.#problem, ...this.#refusal } = explain(text, this.#reason));
    this.#reason = null;
    this.#tell('problem', { text: this.#problem });
  }

  // A new limit takes back the warning of the one before.
  #planShutdown(seconds) {
    if (!(seconds > 0))
      return;
    this.#ends = Date.now() + seconds * 1000;
    this.#tellDeadline();
    clearTimeout(this.#warning);
    if (this.#warned && seconds > SHUTDOWN_WARNING_S)
      this.#tell('notice', { text: '' });
    this.#warned = false;
    const left = Math.min(seconds, SHUTDOWN_WARNING_S);
    if (seconds <= LONGEST_TIMER_S)
      this.#warning = setTimeout(() => this.#warn(left), (seconds - left) * 1000);
  }

  #warn(seconds) {
    this.#warned = true;
    const text = seconds >= 120 ? say('session.endsInMinutes', { minutes: Math.round(seconds / 60) }) : say('session.endsInSeconds', { seconds });
    this.#tell('notice', { text });
  }

  #setExtendable(seconds) {
    this.#extendable = seconds > 0 ? seconds : 0;
    this.#tellDeadline();
  }

  #tellDeadline() {
    this.#tell('deadline', { ends: this.#ends, extendable: this.#extendable });
  }

  #connect(url) {
    this.#url = url;
    if (this.#simulator !== null)
      return; // the lease is restored; the connection to the simulator had not broken
    clearTimeout(this.#silence);
    this.#tell('progress', { text: this.#ready ? say('lease.returning') : say('simulator.connecting'), percent: null });
    try {
      this.#simulator = new Simulator(url.replace(/\/+$/, ''), this.#size, this.#target.mode);
      this.#simulator.silent = this.#target.broadcast === true;
      this.#simulator.hidden = this.#hidden;
    } catch {
      return this.#end(refusedSocket(url));
    }
    this.#askForPictures(url);
    clearTimeout(this.#mute);
    if (!this.#ready)
      this.#mute = setTimeout(() => this.#tell('problem', { text: say('simulator.mute') }), MUTE_MS);
    this.#simulator.addEventListener('message', () => clearTimeout(this.#mute));
    for (const type of RELAYED)
      this.#simulator.addEventListener(type, ({ detail }) => this.#tell(type, detail));
    this.#simulator.addEventListener('picture', ({ detail }) => this.#showPicture(detail));
    this.#simulator.addEventListener('joined', () => {
      this.#said.splice(0).forEach((message) => this.#simulator.hear(message));
      this.#runAtFirst();
    });
    this.#simulator.addEventListener('ready', () => this.#becomeReady());
    this.#simulator.addEventListener('silent', () => this.#noteSilence());
    this.#simulator.addEventListener('heard', () => this.#noteSound());
    this.#simulator.addEventListener('closed', () => this.#loseSimulator(url));
  }

  // Behind a gateway of ours their address is known before the simulator says it: a round trip less until the first one is there. But Webots
  // ends by a fault where pictures are fetched that nobody has asked for on a WebSocket.
  #askForPictures(url) {
    const pictures = `${socketToWeb(url.replace(/\/+$/, ''))}/mjpeg`;
    const isWanted = this.#showsPictures && this.#picture === null && !this.#hidden;
    if (isWanted && this.#hasPictures && isBehindGateway(pictures))
      this.#tell('picture', { url: pictures, viewOnly: true, early: true });
  }

  // A simulation that was started for this page runs at once; one that was there before is left as it is.
  #runAtFirst() {
    if (!this.#ready && this.owned && !this.#returns && !this.#target.paused)
      this.#simulator.play();
  }

  // After a return the simulator may still take the connection that was lost for its first page.
  #showPicture(picture) {
    this.#controls ||= this.owned && (!picture.viewOnly || this.#returns);
    this.#picture = this.#controls ? { ...picture, viewOnly: false } : picture;
    this.#tellPicture();
  }

  #tellPicture() {
    if (this.#picture !== null && !this.#hidden)
      this.#tell('picture', this.#picture);
  }

  #becomeReady() {
    this.#runAtFirst(); // again: one whose world was being loaded has not heard it
    this.#ready = true;
    this.#lost = false;
    this.#problem = this.#lastWord = '';
    this.#refusal = {};
    this.#losses = 0;
    this.#tell('ready');
  }

  // What is shown is old from now on.
  #lose(text, connected = false) {
    this.#lost = true;
    this.#tell('progress', { text, percent: null });
    this.#tell('lost', { text, connected });
  }

  // The simulator has something else to do, or the connection to it is dead although it seems to be open.
  #noteSilence() {
    if (this.#lost)
      return;
    this.#lose(say('simulator.silent'), true);
    if (this.lasting)
      this.#replaceSimulatorIn(this.#patience);
    this.#patience *= 2;
  }

  #noteSound() {
    clearTimeout(this.#silence);
    if (!this.#lost || !this.#ready || (this.owned && !this.#lease.connected))
      return;
    this.#lost = false;
    if (this.#picture !== null)
      this.#tellPicture(); // that of a broken connection stands still
    this.#tell('ready');
  }

  // The lease is restored. Whether the connection to the simulator is alive as well only its answer can tell.
  #verifySimulator() {
    if (!this.#simulator?.loaded)
      return; // it is being connected anew
    this.#simulator.probe();
    this.#replaceSimulatorIn(SILENT_MS);
  }

  #replaceSimulatorIn(milliseconds) {
    clearTimeout(this.#silence);
    this.#silence = setTimeout(() => {
      this.#simulator?.close();
      this.#simulator = null;
      if (this.#lease.connected)
        this.#connect(this.#url);
    }, milliseconds);
  }

  // The simulation server knows why the simulator ended, and gets a moment to say so. If it says nothing and the simulation
  // outlives lost connections, only our connection to the simulator was lost.
  #loseSimulator(url) {
    clearTimeout(this.#silence);
    clearTimeout(this.#mute);
    this.#lastWord = this.#ready ? say('simulator.closed') : say('simulator.unreachable', { url });
    if (this.#lease === null)
      return this.#end(this.#lastWord);
    this.#after(LAST_WORD_MS, () => {
      if (!this.#lease.lasting || ++this.#losses > LOSSES)
        return this.#end(this.#lastWord);
      this.#simulator = null;
      this.#lastWord = '';
      if (!this.#lost)
        this.#lose(say('lease.returning'));
      if (this.#lease.connected)
        this.#connect(url);
    });
  }
}

const refusedSocket = (url) => say('session.refusedSocket', { url });

function leaseLoss({ code }, ready) {
  if (code === TAKEN_OVER)
    return say('lease.takenOver');
  if (code === SERVER_STOPS)
    return say('lease.serverStops');
  if (!ready)
    return say('lease.closedEarly');
  return code === BROKEN ? say('lease.lost') : say('lease.closed');
}

// Of WebSockets.
function isSame(address, other) {
  try {
    return new URL(`${address}/`).href === new URL(other).href;
  } catch {
    return false;
  }
}

// Sentences about a project that is on its way (docs/protocol.md, 4.1.3); how far it is follows. What docker prints stays as it is.
const PROGRESS = [
  [/^Receiving objects(.*)$/, ([, how]) => say('session.receiving') + how],
  [/^Receiving large files(.*)$/, ([, how]) => say('session.receivingLarge') + how],
  [/^Waiting for other projects to be fetched(.*)$/, ([, how]) => say('session.fetchWaits') + how],
  [/^Copying the project to its node of the cluster(.*)$/, ([, how]) => say('session.copying') + how],
  [/^Waiting for a free node of the cluster: position (\d+) of (\d+)\.$/, ([, place, count]) => say('session.clusterQueue', { place, count })],
];

// What servers say themselves, of which there are few sentences.
function inOurWords(line) {
  switch (line) {
    case 'A machine is free.': return say('waiting.turn');
    case 'Trying another machine.': return say('session.otherMachine');
  }
  for (const [pattern, words] of PROGRESS) {
    const match = pattern.exec(line);
    if (match !== null)
      return words(match);
  }
  return line;
}

// A percentage written in the line, or an estimate from what docker compose prints; null when there is none.
function percentOf(line) {
  const written = /(\d+(?:\.\d+)?)\s*%/.exec(line) ?? /:(\d+(?:\.\d+)?)$/.exec(line);
  if (written !== null)
    return Math.min(100, Number(written[1]));
  if (line.startsWith('Creating network'))
    return 20;
  const step = /^Step (\d+)\/(\d+)/.exec(line);
  if (step !== null)
    return 20 + 65 * Math.min(1, Number(step[1]) / Math.max(1, Number(step[2])));
  if (line.endsWith('done'))
    return 85;
  return line.startsWith('webots') ? 90 : null;
}
