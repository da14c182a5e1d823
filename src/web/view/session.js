// One session, from pressing Start to the end: ask the session server for a machine, hold the lease on it, show its
// progress, and connect to the simulator when it is ready. No DOM.
//
// Events (CustomEvents): those of Simulator except "closed", and
//   notice {text}            something to tell while the session goes on
//   problem {text}           an error that the server reported; the session may or may not end after it
//   message {from, text}     a message as it came, `from` the 'server' of simulations or the 'simulator'
//   ended {text, failed, full}  the last event; `failed` when the simulation never became ready, `full` when no machine was free
// A connection that broke is restored where the simulation server allows it: "progress" tells so, and "ready" when it is.

import { Lease } from './lease.js';
import { Simulator } from './simulator.js';

const SESSION_ANSWER_MS = 30000;
const LAST_WORD_MS = 1000;
const SHUTDOWN_WARNING_S = 300;
const LOSSES = 60;
const NO_MACHINE = /no simulation server available/i; // part of the session server's message
const RETURNING = 'The connection was lost. Returning to the simulation';
const RELAYED = ['message', 'picture', 'ready', 'mode', 'time', 'progress', 'world', 'output'];

export class Session extends EventTarget {
  #target;
  #size;
  #over = false;
  #ready = false;
  #problem = '';
  #abort = new AbortController();
  #lease = null;
  #simulator = null;
  #lastWord = '';
  #losses = 0; // of the connection to the simulator, since it was last ready
  #timers = [];

  // `target` comes from parseAddress() or parseViewAddress(); pages may add to it
  //   opening    the text to start the simulation with, instead of a `start` message (a website's project)
  //   paused     true: a simulation that is started here waits for play(), instead of running at once
  //   broadcast  true: only watches, and sends the simulator nothing but the line that says so
  // `size` is {width, height} of the picture in pixels.
  constructor(target, size) {
    super();
    this.#target = target;
    this.#size = size;
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
    if (this.#ready)
      this.#simulator.resize(size);
  }

  async start() {
    if (this.#target.kind === 'simulator')
      return this.#connect(this.#target.url);
    try {
      const machine = await this.#askForMachine();
      if (!this.#over)
        this.#takeLease(machine);
    } catch (error) {
      this.#end(error.message, NO_MACHINE.test(error.message));
    }
  }

  // Ends the session for the user: no "ended" event follows.
  stop() {
    this.#over = true;
    this.#abort.abort();
    this.#timers.forEach(clearTimeout);
    this.#simulator?.close();
    this.#lease?.close();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #end(text, full = false) {
    if (this.#over)
      return;
    this.stop();
    this.#tell('ended', { text: this.#problem || text, failed: !this.#ready, full });
  }

  #after(milliseconds, action) {
    this.#timers.push(setTimeout(action, milliseconds));
  }

  async #askForMachine() {
    const { server, request } = this.#target;
    this.#tell('progress', { text: 'Asking the session server for a machine', percent: null });
    this.#after(SESSION_ANSWER_MS, () => this.#end(`The session server at ${server} does not answer.`));
    const response = await fetch(request, { cache: 'no-store', signal: this.#abort.signal }).catch(() => {
      throw new Error(`The session server at ${server} cannot be reached. Is it running?`);
    });
    const answer = (await response.text()).trim();
    this.#timers.splice(0).forEach(clearTimeout);
    if (!response.ok)
      throw new Error(`The session server at ${server} answered with HTTP status ${response.status}.`);
    if (answer.startsWith('Error:'))
      throw new Error(sentence(answer.slice('Error:'.length)));
    if (!/^wss?:\/\/./.test(answer))
      throw new Error(`The session server at ${server} did not answer with the address of a machine.`);
    return answer.replace(/\/+$/, '');
  }

  #takeLease(machine) {
    this.#tell('progress', { text: 'Connecting to the simulation server', percent: null });
    try {
      this.#lease = new Lease(`${machine}/client`, this.#target.opening ?? { start: { url: this.#target.world, mode: 'mjpeg' } });
    } catch {
      throw new Error(refusedSocket(machine));
    }
    this.#lease.addEventListener('message', ({ detail }) => this.#receive(detail.text));
    this.#lease.addEventListener('broken', () => this.#tell('progress', { text: RETURNING, percent: null }));
    this.#lease.addEventListener('closed', ({ detail }) =>
      this.#end(this.#lastWord || leaseLoss(detail.opened, this.#ready, detail.code, machine)));
  }

  #receive(message) {
    this.#tell('message', { from: 'server', text: message });
    const [, prefix, rest] = /^([a-zA-Z]+):\s?([^]*)/.exec(message) ?? [null, '', ''];
    switch (prefix) {
      case 'loading': case 'docker': return this.#load(rest.trim());
      case 'Error': case 'error': return this.#report(rest);
      case 'shutdownTimeout': return this.#planShutdown(Number(rest));
      case 'queue': return this.#tell('progress', { text: `Waiting: ${Number(rest)} before you`, percent: null });
      case 'webots': return this.#connect(rest.trim());
    }
  }

  #load(line) {
    if (line.startsWith('Error:'))
      return this.#report(line.slice('Error:'.length));
    this.#tell('progress', { text: line, percent: percentOf(line) });
  }

  #report(text) {
    this.#problem = sentence(text);
    this.#tell('problem', { text: this.#problem });
  }

  #planShutdown(seconds) {
    if (!(seconds > 0) || seconds > 2 ** 31 / 1000)
      return;
    const left = Math.min(seconds, SHUTDOWN_WARNING_S);
    this.#after((seconds - left) * 1000, () => this.#tell('notice', { text: shutdownWarning(left) }));
  }

  #connect(url) {
    if (this.#simulator !== null) { // the lease is restored; the connection to the simulator had not broken
      if (this.#ready)
        this.#tell('ready');
      return;
    }
    this.#tell('progress', { text: this.#ready ? RETURNING : 'Connecting to the simulator', percent: null });
    try {
      this.#simulator = new Simulator(url.replace(/\/+$/, ''), this.#size);
      this.#simulator.silent = this.#target.broadcast === true;
    } catch {
      return this.#end(refusedSocket(url));
    }
    for (const type of RELAYED)
      this.#simulator.addEventListener(type, ({ detail }) => this.#tell(type, detail));
    this.#simulator.addEventListener('ready', () => this.#becomeReady());
    this.#simulator.addEventListener('closed', () => this.#loseSimulator(url));
  }

  #becomeReady() {
    // A simulation that was started for this page runs at once; somebody else's is left as it is.
    if (!this.#ready && this.owned && !this.#target.paused)
      this.#simulator.play();
    this.#ready = true;
    this.#problem = this.#lastWord = '';
    this.#losses = 0;
  }

  // The simulation server knows why the simulator ended, and gets a moment to say so. If it says nothing and the simulation
  // outlives lost connections, only our connection to the simulator was lost.
  #loseSimulator(url) {
    this.#lastWord = this.#ready ? 'The simulator has closed the connection.' : `The simulator at ${url} cannot be reached.`;
    if (this.#lease === null)
      return this.#end(this.#lastWord);
    this.#after(LAST_WORD_MS, () => {
      if (!this.#lease.lasting || ++this.#losses > LOSSES)
        return this.#end(this.#lastWord);
      this.#simulator = null;
      this.#lastWord = '';
      if (this.#lease.connected)
        this.#connect(url);
    });
  }
}

const refusedSocket = (url) =>
  `The browser refuses to connect to ${url}. A page loaded by https: can only use wss: addresses.`;

function leaseLoss(opened, ready, code, machine) {
  if (!opened)
    return `The simulation server at ${machine} cannot be reached.`;
  if (!ready)
    return 'The simulation server closed the connection before the simulation was ready.';
  return code === 1006 ? 'The connection to the simulation server was lost.' : 'The simulation server ended the session.';
}

const shutdownWarning = (seconds) =>
  `The server will stop this simulation in ${seconds >= 120 ? `${Math.round(seconds / 60)} minutes` : `${seconds} seconds`}.`;

// With a capital letter, unless the first word is a file name or an address.
export const sentence = (text) => text.trim().replace(/^[a-z]+(?= |$)/, (word) => word[0].toUpperCase() + word.slice(1));

// A percentage written in the line, or an estimate from what docker compose prints; null when there is none.
export function percentOf(line) {
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
