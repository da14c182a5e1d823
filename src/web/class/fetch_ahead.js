// Has the project of a class fetched by the machines before the first student starts. No DOM.

import { explain, parseReason } from './view/refusals.js';
import { say } from './view/texts.js';

const ANSWER_MS = 120000; // between two lines

export class FetchAhead {
  #start;
  #changed;
  #machines;
  #working = new Set(); // sockets

  // Asks all machines, of which there are 64 at most, at once: tickets in their addresses are good for a minute only. `changed` is
  // called when `done`, `busy` or `faults` are others.
  constructor(machines, url, mode, changed) {
    this.#start = JSON.stringify({ start: { url, mode, fetch_only: true, reasons: true } });
    this.#changed = changed;
    this.#machines = new Map(machines.map((machine) => [machine, { done: false, fault: '' }]));
    machines.forEach((machine) => this.#ask(machine));
  }

  get count() { return this.#machines.size; }
  get done() { return [...this.#machines.values()].filter(({ done }) => done).length; }
  get busy() { return this.#working.size > 0; }

  // Sentences, each with the name of its machine.
  get faults() {
    return [...this.#machines].filter(([, { fault }]) => fault !== '').map(([machine, { fault }]) => `${nameOf(machine)}: ${fault}`);
  }

  stop() {
    for (const socket of this.#working)
      forget(socket);
    this.#working.clear();
  }

  #ask(machine) {
    let socket;
    try {
      socket = new WebSocket(`${machine.replace(/\/+$/, '')}/client`);
    } catch { // A page loaded by https: may not use ws:.
      return this.#finish(machine, null, say('session.refusedSocket', { url: machine }));
    }
    this.#working.add(socket);
    let [timer, opened, reason] = [0, false, null];
    const end = (fault) => {
      clearTimeout(timer);
      this.#finish(machine, socket, fault);
    };
    const wait = () => {
      clearTimeout(timer);
      timer = setTimeout(() => end(say('class.machineSilent')), ANSWER_MS);
    };
    socket.onopen = () => {
      opened = true;
      socket.send(this.#start);
      wait();
    };
    socket.onmessage = ({ data }) => {
      const text = String(data);
      const [, why] = /^(?:loading:\s*)?error:\s*(.*)/is.exec(text) ?? [];
      wait();
      if (text.startsWith('reason:'))
        reason = parseReason(text.slice('reason:'.length));
      else if (why !== undefined)
        end(explain(why, reason).text);
      else if (/^(fetched|webots):/.test(data)) // "webots": an older server has started it, which takes the project as well
        end('');
    };
    socket.onclose = () => end(opened ? say('class.machineClosed') : say('class.machineUnreachable'));
    wait();
  }

  #finish(machine, socket, fault) {
    Object.assign(this.#machines.get(machine), { done: fault === '', fault });
    if (socket !== null) {
      forget(socket);
      this.#working.delete(socket);
    }
    this.#changed();
  }
}

function forget(socket) {
  socket.onopen = socket.onmessage = socket.onclose = null;
  socket.close(1000);
}

// Its path may hold a ticket, and is nobody's business.
const nameOf = (machine) => new URL(machine).host;
