// What a session does when its connections are silent or break: minutes of it, with a clock that does not wait. No browser is
// needed: view_test.sh runs it.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, beforeEach, test } from 'node:test';

const VIEW = new URL('../../src/web/view/', import.meta.url);

// --- the clock ---

let now = 0;
let timers = [];
let lastTimer = 0;

const addTimer = (action, delay, period) => {
  timers.push({ id: ++lastTimer, due: now + delay, action, period });
  return lastTimer;
};
const removeTimer = (id) => { timers = timers.filter((timer) => timer.id !== id); };

// Lets `milliseconds` pass, in the order of what is due.
async function pass(milliseconds) {
  const end = now + milliseconds;
  for (;;) {
    await settle();
    const next = timers.filter(({ due }) => due <= end).sort((a, b) => a.due - b.due || a.id - b.id)[0];
    if (next === undefined)
      break;
    now = Math.max(now, next.due);
    if (next.period === undefined)
      removeTimer(next.id);
    else
      next.due = now + next.period;
    next.action();
  }
  now = end;
  await settle();
}

async function settle() {
  for (let i = 0; i < 20; ++i)
    await null;
}

// --- the network and what is behind it ---

let up = true; // the link
let sockets = [];
let answer = 'ws://machine:2000'; // of the session server

class FakeSocket {
  static CONNECTING = 0;
  static OPEN = 1;
  static CLOSED = 3;

  constructor(url) {
    this.url = url;
    this.readyState = FakeSocket.CONNECTING;
    this.sent = [];
    sockets.push(this);
    this.tryToOpen();
  }

  // As TCP does: again and again, while nobody answers.
  tryToOpen() {
    if (this.readyState !== FakeSocket.CONNECTING)
      return;
    if (!up) {
      addTimer(() => this.tryToOpen(), 1000);
      return;
    }
    addTimer(() => {
      if (this.readyState !== FakeSocket.CONNECTING)
        return;
      this.readyState = FakeSocket.OPEN;
      this.onopen?.();
    }, 10);
  }

  send(text) {
    this.sent.push(text);
    if (up)
      addTimer(() => server.hears(this, text), 5);
  }

  says(text) {
    if (up && this.readyState === FakeSocket.OPEN)
      this.onmessage?.({ data: text });
  }

  // With a link that is down nobody hears of it.
  close(code) {
    this.readyState = FakeSocket.CLOSED;
    this.farewell = code;
    if (up)
      server.loses(this, code);
  }

  breaks(code = 1006, reason = '') {
    this.readyState = FakeSocket.CLOSED;
    this.onclose?.({ code, reason });
  }

  // As Firefox does before the page hears that it is left.
  goesAway() {
    server.loses(this, 1001);
    this.breaks(1001);
  }
}

// A simulation server and its simulator, as docs/protocol.md describes them.
class Server {
  constructor({ grace = 30000, promises = true, running = true } = {}) {
    Object.assign(this, { grace, promises, mode: running ? 'real-time' : 'pause', lease: null, ended: false, quiet: false, time: 0 });
    this.simulators = new Set();
    addTimer(() => this.beat(), 1000, 1000);
    addTimer(() => this.draw(), 100, 100);
    this.heard = now; // from the browser, which answers pings
    this.ending = 0;
  }

  hears(socket, text) {
    if (socket.url.endsWith('/client'))
      return this.serve(socket, JSON.parse(text));
    this.simulators.add(socket);
    if (text.startsWith('mjpeg: ')) {
      for (const line of [`multimedia: mjpeg ${this.mode} `, this.mode === 'pause' ? `pause: ${this.time}` : this.mode, 'scene load completed'])
        socket.says(line);
    } else if (text.startsWith('real-time')) {
      this.mode = 'real-time';
      socket.says('real-time');
    } else if (text.startsWith('resize')) {
      socket.says('resize: 1 1');
    }
  }

  serve(socket, message) {
    if ('extend' in message)
      return; // tests answer it
    if ('reconnect' in message && this.ended)
      return this.refuse(socket);
    if (this.lease !== null && this.lease !== socket && this.lease.readyState === FakeSocket.OPEN)
      this.lease.readyState = FakeSocket.CLOSED;
    removeTimer(this.ending);
    this.lease = socket;
    this.heard = now;
    const lines = [...(this.promises ? ['heartbeat: 1'] : []), 'shutdownTimeout: 7200', 'webots:ws://machine:2001', 'reconnectToken: secret'];
    lines.forEach((line) => socket.says(line));
  }

  refuse(socket) {
    socket.says('loading: Error: This simulation has ended. Please start it again.');
    socket.breaks(1005);
  }

  loses(socket, code) {
    this.simulators.delete(socket);
    if (socket !== this.lease)
      return;
    this.lease = null;
    if (code === 1000)
      this.ended = true;
    else
      this.wait();
  }

  wait() {
    this.ending = addTimer(() => { this.ended = true; }, this.grace);
  }

  beat() {
    if (up)
      this.heard = now;
    if (this.lease !== null && this.promises && !this.quiet)
      this.lease.says('.');
    if (this.lease !== null && now - this.heard >= 60000) { // pingTimeout
      this.lease = null;
      this.wait();
    }
  }

  draw() {
    if (this.mode !== 'real-time' || this.quiet)
      return;
    this.time += 100;
    for (const socket of this.simulators)
      socket.says(`time: ${this.time}`);
  }
}

let server = null;

// --- the pages' modules, in this world ---

const real = { fetch: globalThis.fetch, setTimeout: globalThis.setTimeout, clearTimeout: globalThis.clearTimeout };
globalThis.CustomEvent ??= class extends Event {
  constructor(type, { detail = null } = {}) {
    super(type);
    this.detail = detail;
  }
};
globalThis.fetch = async (address) => ({
  ok: true,
  headers: new Headers(),
  json: async () => JSON.parse(readFileSync(new URL(address), 'utf-8')),
  text: async () => answer
});
globalThis.WebSocket = FakeSocket;
Object.defineProperty(globalThis, 'performance', { value: { now: () => now }, configurable: true, writable: true });
const listeners = new Map();
globalThis.addEventListener = (type, action) => listeners.set(type, action);
globalThis.removeEventListener = (type) => listeners.delete(type);

const { loadTexts, say } = await import(new URL('texts.js', VIEW));
const { folderIn } = await import(new URL('address.js', VIEW));
const { worldsOf } = await import(new URL('world_lists.js', VIEW));
const { Session } = await import(new URL('session.js', VIEW));
const { SlowVoice } = await import(new URL('waiting.js', VIEW));
await loadTexts(['en']);

const TARGET = { kind: 'session', server: 'http://s/', request: 'http://s/session?url=w', world: 'w' };
let events = [];
let session = null;

// A session server that relays: it has a line, and is the simulation server to whom it lets in.
class Relay extends Server {
  place = '- -'; // what comes after `waiting: `; null: a machine is free
  tickets = 0;

  serve(socket, message) {
    if (this.place === null || 'reconnect' in message)
      return super.serve(socket, message);
    this.lease = socket;
    this.heard = now;
    this.tickets += 1;
    socket.says(`waitingTicket: ticket-${this.tickets}`);
    socket.says(`waiting: ${this.place}`);
  }

  move(place) {
    this.place = place;
    this.lease.says(`waiting: ${place}`);
  }

  takeTurn() {
    this.place = null;
    this.lease.says('loading: A machine is free.');
    super.serve(this.lease, {});
  }

  beat() {
    if (this.place === null)
      super.beat();
    else if (this.lease !== null && now % 10000 < 1000)
      this.lease.says(`waiting: ${this.place}`);
  }
}

beforeEach(() => {
  now = 1000;
  timers = [];
  sockets = [];
  events = [];
  up = true;
  answer = 'ws://machine:2000';
  globalThis.setTimeout = (action, delay = 0) => addTimer(action, delay);
  globalThis.setInterval = (action, delay) => addTimer(action, delay, delay);
  globalThis.clearTimeout = globalThis.clearInterval = removeTimer;
});

after(() => Object.assign(globalThis, real));

async function run(options, ticket = null) {
  server ??= new Server(options);
  session = new Session(TARGET, { width: 1, height: 1 }, ticket);
  for (const type of ['ready', 'lost', 'ended', 'picture', 'ticket'])
    session.addEventListener(type, ({ detail }) => events.push([type, detail, now]));
  session.start();
  await pass(2000);
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
}

const last = (...types) => events.filter(([type]) => types.includes(type)).at(-1);
const count = (type) => events.filter(([other]) => other === type).length;

function fresh(options) {
  server = new Server(options);
}

for (const seconds of [10, 40, 90]) {
  test(`a link that is down for ${seconds} s is told within 3 s, and what follows is true`, async () => {
    fresh();
    await run();
    const down = now;
    up = false;
    await pass(3000);
    assert.equal(last('ready', 'lost', 'ended')[0], 'lost');
    assert.ok(last('lost')[2] - down <= 3000);
    assert.equal(last('lost')[1].text, say('lease.silent'));
    await pass(seconds * 1000 - 3000);
    assert.equal(last('ready', 'lost', 'ended')[0], 'lost');
    up = true;
    await pass(10000);
    const [state, detail] = last('ready', 'lost', 'ended');
    if (server.ended)
      assert.match(detail.text, /^This simulation has ended/);
    else
      assert.equal(state, 'ready');
    assert.equal(server.ended, seconds > 60 + 30 - 1);
    assert.equal(count('ended'), server.ended ? 1 : 0);
  });
}

test('a link that is down for two minutes is survived where the operator lets simulations wait longer', async () => {
  fresh({ grace: 600000 });
  await run();
  up = false;
  await pass(120000);
  up = true;
  await pass(10000);
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
});

test('a paused simulation is not missed, and is found again after the link was down', async () => {
  fresh({ running: false });
  await run();
  server.mode = 'pause';
  sockets.at(-1).says('paused by client');
  await pass(60000);
  assert.equal(count('lost'), 0);
  up = false;
  await pass(10000);
  assert.equal(last('ready', 'lost')[0], 'lost');
  up = true;
  await pass(10000);
  assert.equal(last('ready', 'lost')[0], 'ready');
});

test('the event that the network is back shortens the wait', async () => {
  fresh();
  await run();
  up = false;
  await pass(20000);
  up = true;
  listeners.get('online')();
  await pass(200);
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
});

test('a computer that wakes up handles what has arrived before it judges', async () => {
  fresh();
  await run();
  now += 3600000; // timers did not run, and are late all at once
  await pass(100);
  assert.equal(count('lost'), 0);
});

test('a simulator that is silent while its server is not is told, and connected to anew', async () => {
  fresh();
  await run();
  const before = sockets.length;
  server.mode = 'busy';
  await pass(3000);
  assert.equal(last('ready', 'lost')[1].text, say('simulator.silent'));
  await pass(10000);
  assert.equal(sockets.length, before + 1);
  server.mode = 'real-time';
  await pass(30000);
  assert.equal(last('ready', 'lost')[0], 'ready');
  assert.equal(server.ended, false);
});

test('what a simulator prints, or answers, is no picture', async () => {
  fresh();
  await run();
  const simulator = sockets.at(-1);
  server.mode = 'busy';
  for (let second = 0; second < 4; ++second) {
    simulator.says(second % 2 ? 'stdout:hello' : 'resize: 1 1');
    await pass(1000);
  }
  assert.equal(last('ready', 'lost')[1].text, say('simulator.silent'));
  simulator.says('paused by client'); // then nothing need come
  assert.equal(last('ready', 'lost')[0], 'ready');
  await pass(60000);
  assert.equal(last('ready', 'lost')[0], 'ready');
});

test('a connection to the simulator that died with the link is replaced, though it seems to be open', async () => {
  fresh();
  await run();
  const simulator = sockets.at(-1);
  up = false;
  await pass(5000);
  server.simulators.delete(simulator); // what it says is lost from now on
  simulator.send = () => {};
  up = true;
  await pass(15000);
  assert.equal(last('ready', 'lost')[0], 'ready');
  assert.equal(simulator.readyState, FakeSocket.CLOSED);
  assert.equal(last('picture')[2] >= last('ready')[2] - 100, true); // with a picture of the new connection
});

test('a proxy that is restarted breaks everything, and the page is back in a few seconds with one new connection of each kind', async () => {
  fresh();
  await run();
  const [lease, simulator] = [server.lease, sockets.at(-1)];
  server.simulators.delete(simulator);
  server.loses(lease, 1006);
  lease.breaks();
  simulator.breaks();
  await pass(5000);
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
  await pass(60000);
  assert.equal(sockets.length, 4);
  assert.equal(count('lost'), 1);
});

test('a server that promised no heartbeats may be silent', async () => {
  fresh({ promises: false, running: false });
  await run();
  sockets.at(-1).says('paused by client');
  await pass(600000);
  assert.equal(count('lost'), 0);
});

test('the old connection is closed with a code that lets the simulation wait, and Disconnect with one that ends it', async () => {
  fresh();
  await run();
  const first = server.lease;
  server.quiet = true;
  await pass(4000);
  assert.equal(first.farewell, 4000);
  server.quiet = false;
  await pass(10000);
  assert.equal(last('ready', 'lost')[0], 'ready');
  session.stop();
  assert.equal(server.ended, true);
});

test('a session of a reloaded page returns with the ticket, and does not press play', async () => {
  fresh({ running: false });
  await run();
  const ticket = last('ticket')[1];
  assert.deepEqual(ticket, { machine: 'ws://machine:2000', token: 'secret' });
  session.leave();
  server.loses(server.lease, 1001); // the browser does that
  sockets = [];
  server.mode = 'pause';
  await run({}, ticket);
  assert.deepEqual(sockets[0].sent, ['{"reconnect":"secret"}']);
  assert.ok(!sockets[1].sent.some((text) => text.startsWith('real-time')));
});

// Chromium closes them after that.
test('a session of a page that Firefox reloads is not over when its connections close, and returns with the ticket', async () => {
  fresh({ running: false });
  await run();
  const ticket = last('ticket')[1];
  for (const socket of [...sockets])
    socket.goesAway();
  assert.deepEqual(last('ticket')[1], ticket, 'the page remembers it');
  session.leave();
  assert.equal(count('ended'), 0);
  sockets = [];
  await pass(5000);
  assert.equal(sockets.length, 0);
  await run({}, ticket);
  assert.deepEqual(sockets[0].sent, ['{"reconnect":"secret"}']);
});

test('a proxy that reloads does not end the simulation, and a server that stops does', async () => {
  fresh();
  await run();
  for (const socket of [...sockets])
    socket.goesAway();
  await pass(5000);
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
  server.lease.breaks(1001, 'the server is stopping');
  await pass(100);
  assert.equal(last('ended')[1].text, say('lease.serverStops'));
});

// --- the line of a session server ---

const OWN = 'ws://s';
const WAITING = { url: 'w', mode: 'mjpeg', reconnect: true, heartbeat: true, extend: true, reasons: true, size: '1x1', run: true, waiting: true };

async function waitInLine(place = '3 60 240', { target = TARGET, ticket = null } = {}) {
  answer = OWN;
  server = new Relay();
  server.place = place;
  return comeToTheLine(target, ticket);
}

async function comeToTheLine(target = TARGET, ticket = null) {
  session = new Session(target, { width: 1, height: 1 }, ticket);
  for (const type of ['ready', 'lost', 'ended', 'ticket', 'progress', 'problem'])
    session.addEventListener(type, ({ detail }) => events.push([type, detail, now]));
  session.start();
  await pass(100);
}

const told = () => last('progress')[1];
const opening = (socket) => JSON.parse(socket.sent[0]);

test('a start waits in the line of the session server, and starts by itself when its turn comes', async () => {
  await waitInLine('3 - -');
  assert.equal(sockets[0].url, 'ws://s/client');
  assert.deepEqual(opening(sockets[0]), { start: WAITING });
  assert.deepEqual(told(), { text: 'You are number 4 in line. Every seat is taken. There is no estimate of the wait yet.', percent: null, ahead: 3, least: null, most: null, why: '', wantsRoom: false });
  server.move('3 60 240');
  assert.deepEqual(told(), { text: 'You are number 4 in line. Every seat is taken. About 1 to 4 minutes.', percent: null, ahead: 3, least: 60, most: 240, why: '', wantsRoom: false });
  server.move('3 0 90 room');
  assert.equal(told().text, 'You are number 4 in line. There are free seats, but the machines are too busy for this world. Up to about 2 minutes.');
  server.lease.says('queue:3'); // for others
  assert.equal(told().ahead, 3);
  server.move('0 - -');
  assert.equal(told().text, 'You are next. Every seat is taken.');
  await pass(60000);
  assert.equal(sockets.length, 1, 'the connection is not given up');
  server.takeTurn();
  await pass(100);
  assert.ok(events.some(([type, detail]) => type === 'progress' && detail.text === say('waiting.turn') && detail.ahead === undefined));
  assert.equal(last('ready', 'ended')[0], 'ready');
  assert.ok(sockets[1].sent.some((text) => text.startsWith('real-time')), 'it runs');
  assert.deepEqual(last('ticket')[1], { machine: OWN, token: 'secret' });
  assert.equal(count('lost') + count('problem'), 0);
});

test('an estimate is said as people say it, and is never narrower than what the server says', async () => {
  await waitInLine();
  const texts = {
    '1 0 20': 'Up to about 20 seconds.', '1 15 60': 'About 15 to 60 seconds.', '1 30 90': 'Up to about 2 minutes.', '1 90 150': 'About 1 to 3 minutes.',
    '1 300 300': 'About 5 minutes.', '1 600 7200': 'This may take more than an hour.', '0 60 240': 'You are next. Every seat is taken. About 1 to 4 minutes.'
  };
  for (const [place, text] of Object.entries(texts)) {
    server.move(place);
    assert.ok(told().text.endsWith(text), `${place}: ${told().text}`);
  }
  const before = count('progress');
  for (const nonsense of ['', '- - -', 'x 1 2', '-1 1 2'])
    server.lease.says(`waiting: ${nonsense}`);
  assert.equal(count('progress'), before);
});

test('only a session server that answers with its own address may make the page wait', async () => {
  server = new Server();
  await comeToTheLine();
  assert.equal('waiting' in opening(sockets[0]).start, false);
  for (const [own, from] of [['wss://s', 'https://s:443/'], ['ws://S:80/', 'http://s/'], ['wss://s/1999', 'https://s/1999/']]) {
    sockets = [];
    answer = own;
    server = new Relay();
    await comeToTheLine({ ...TARGET, server: from });
    assert.deepEqual(opening(sockets[0]), { start: WAITING }, own);
    session.stop();
  }
});

test('a student waits with the token of the class', async () => {
  await waitInLine('3 - -', { target: { ...TARGET, request: 'http://s/session?class=seat-of-ada' } });
  assert.deepEqual(opening(sockets[0]), { start: { ...WAITING, class: 'seat-of-ada' } });
});

test("a website's project waits in the line, too, and keeps its place", async () => {
  const project = { init: ['https://website', 'p', 'w.wbt'], mode: 'mjpeg' };
  await waitInLine('3 60 240', { target: { ...TARGET, opening: JSON.stringify(project) } });
  assert.deepEqual(opening(sockets[0]), { ...project, waiting: true });
  assert.equal(told().ahead, 3);
  server.lease.breaks(1012);
  await pass(3000);
  assert.deepEqual(opening(sockets.at(-1)), { ...project, waiting: true, waitingTicket: 'ticket-1' });
});

for (const code of [1001, 1006, 1012]) {
  test(`a place in the line is kept when the connection closes with ${code}`, async () => {
    await waitInLine();
    assert.deepEqual(last('ticket')[1], { machine: OWN, waiting: 'ticket-1' });
    up = false;
    server.lease.breaks(code);
    assert.equal(told().returning, 60);
    await pass(20000);
    assert.equal(told().text, 'Returning to the line: your place is kept for 40 seconds.');
    up = true;
    await pass(3000);
    assert.equal(told().ahead, 3);
    assert.deepEqual(opening(sockets.at(-1)), { start: { ...WAITING, waitingTicket: 'ticket-1' } });
    const returns = sockets.length;
    await pass(60000);
    assert.equal(sockets.length, returns);
    assert.equal(told().ahead, 3, 'nothing counts down any more');
    server.takeTurn();
    await pass(100);
    assert.equal(last('ready', 'ended')[0], 'ready');
    assert.equal(count('lost') + count('problem') + count('ended'), 0);
  });
}

test('a place that is no longer kept is said to be lost, and the page waits again all the same', async () => {
  await waitInLine();
  up = false;
  server.lease.breaks();
  await pass(90000);
  assert.equal(told().text, say('waiting.returningLate'));
  up = true;
  await pass(35000); // what opens a socket waits longer and longer
  assert.equal(told().ahead, 3);
  assert.equal(count('ended'), 0);
});

test('a connection in the line on which nothing comes any more is given up, and the place taken again', async () => {
  await waitInLine();
  const first = server.lease;
  up = false;
  await pass(27000);
  assert.equal(first.farewell, 4000);
  assert.ok(told().returning <= 35, `${told().returning} s`);
  up = true;
  await pass(6000);
  assert.equal(opening(sockets.at(-1)).start.waitingTicket, 'ticket-1');
  assert.equal(told().ahead, 3);
});

test('a machine that has the turn may be silent for minutes, and one that was tried before has promised nothing', async () => {
  await waitInLine();
  server.lease.says('loading: A machine is free.');
  server.place = null;
  server.promises = false;
  const { lease } = server;
  server.lease = null; // says nothing
  await pass(120000);
  assert.equal(sockets.length, 1);
  server.lease = lease;
  lease.says('heartbeat: 1');
  lease.says('loading: Trying another machine.');
  assert.equal(told().text, say('session.otherMachine'));
  await pass(60000);
  assert.equal(sockets.length, 1);
  server.place = '2 - -';
  lease.says('waiting: 2 - -');
  await pass(60000);
  assert.equal(sockets.length, 1);
  assert.equal(told().ahead, 2);
});

test('a reloaded page takes its place again, and runs the simulation that it has waited for', async () => {
  await waitInLine();
  const ticket = last('ticket')[1];
  session.leave();
  assert.equal(server.farewell ?? sockets[0].farewell, 4000);
  sockets = [];
  await comeToTheLine(TARGET, ticket);
  assert.deepEqual(sockets.map((socket) => opening(socket)), [{ start: { ...WAITING, waitingTicket: 'ticket-1' } }]);
  server.takeTurn();
  await pass(100);
  assert.ok(sockets[1].sent.some((text) => text.startsWith('real-time')), 'it runs');
});

test('without a grace there is nothing to return to once the simulation runs', async () => {
  await waitInLine();
  server.lease.says('webots:ws://machine:2001');
  assert.equal(last('ticket')[1], null);
  await pass(100);
  server.lease.breaks();
  assert.equal(last('ready', 'ended')[0], 'ended');
});

test('who gives the place up closes the connection for good', async () => {
  await waitInLine();
  const { lease } = server;
  session.stop();
  assert.equal(lease.farewell, 1000);
  await pass(10000);
  assert.equal(sockets.length, 1);
});

test('a start that is refused on /client because everything is full is refused as by /session', async () => {
  await waitInLine();
  server.lease.says('loading: Error: No simulation server available at the moment.');
  server.lease.breaks(1006);
  assert.deepEqual(last('ended')[1], { text: say('refusal.noMachine'), failed: true, full: true, busy: true });
  assert.equal(sockets.length, 1, 'an error is no reason to return');
});

test('a machine that is full refuses as a site that is full', async () => {
  server = new Server();
  server.serve = (socket) => {
    socket.says('reason: {"code":"full","values":{"max":"100"}}');
    socket.says('loading: Error: Too many open connections (>100): this simulation server is full. Please try again later.');
  };
  await comeToTheLine();
  sockets[0].breaks(1000);
  const { full, busy } = last('ended')[1];
  assert.deepEqual([full, busy], [true, true]);
});

test('a start that was sent on the way back to the line is not sent again when the page is seen', async () => {
  await waitInLine();
  server.lease.breaks();
  server.serve = () => {}; // it looks for a machine
  await pass(2000);
  const returns = sockets.length;
  listeners.get('online')();
  await pass(10000);
  assert.equal(sockets.length, returns);
});

test('the line of another server, which tells the number alone, is shown as ever', async () => {
  server = new Server();
  server.serve = (socket) => socket.says('queue:3');
  await comeToTheLine();
  assert.deepEqual(told(), { text: say('session.queue', { count: 3 }), percent: null });
});

test('a screen reader is told at once, and then every ten seconds the last that there was', async () => {
  const heard = [];
  const voice = new SlowVoice((text) => heard.push([text, now]));
  const begin = now;
  for (const text of ['a', 'b', 'c']) {
    voice.tell(text);
    await pass(2000);
  }
  assert.deepEqual(heard, [['a', begin]]);
  await pass(10000);
  assert.deepEqual(heard, [['a', begin], ['c', begin + 10000]]);
  voice.tell('d');
  voice.stop();
  await pass(20000);
  assert.deepEqual(heard.slice(2).map(([text]) => text), ['']);
});

// --- what people are told ---

const { explain, parseReason } = await import(new URL('refusals.js', VIEW));
const explained = (...told) => explain(...told).text;

test('the sentences of Python servers, which have no codes, are said in the words of people', () => {
  const sentences = JSON.parse(readFileSync(new URL('../support/python_refusals.json', import.meta.url), 'utf-8'));
  assert.ok(sentences.length > 10);
  for (const { code, sentence } of sentences)
    assert.equal(explained(sentence), explained(sentence, { code, values: { file: 'nope.wbt', why: sentence.replace(/^.*?: /, '') } }), sentence);
  assert.equal(explained('nope.wbt does not exist.'), say('refusal.noWorld', { file: 'nope.wbt' }));
  assert.deepEqual(explain('no simulation server available at the moment.'), { text: say('refusal.noMachine'), full: true, busy: true });
});

test('a code is said in the words of people, whatever the sentence says', () => {
  const reason = parseReason('{"code":"no-repository","values":{"name":"a/b"}}');
  assert.equal(explained('Some words of a later version.', reason), say('refusal.noRepository', { name: 'a/b' }));
  assert.equal(explained(' The disk is gone. ', { code: 'server-fault', values: {} }), say('refusal.serverFault', { why: 'The disk is gone.' }));
  assert.equal(explained('It failed: why', { code: 'not-started', values: { why: 'why' } }), say('refusal.notStarted', { why: 'why' }));
  assert.deepEqual(explain('Slowly.', { code: 'too-fast', values: {} }), { text: say('refusal.tooFast'), full: false, busy: true });
});

test('what has no code that the page knows is shown as it is', () => {
  assert.equal(explained('a new sentence.', { code: 'of-a-later-version', values: {} }), 'A new sentence.');
  assert.equal(explained('no such world.'), 'No such world.'); // of another server
  assert.equal(explained('my_world is empty.'), 'my_world is empty.');
  for (const text of ['', '{', 'null', '{"code":7}', '[]'])
    assert.equal(parseReason(text), null, text);
});

test('the address of a repository, or of a folder in one, is told from those of worlds and of other pages', () => {
  const folder = 'https://github.com/o/r/tree/main/worlds';
  for (const text of [folder, ` ${folder} `, 'github.com/o/r', 'https://gitlab.com/group/sub/r/-/tree/main?ref_type=heads', 'https://github.com/o/r.git',
    'local:/school/week_1', `[the robots](${folder})`, `<a href="${folder}">robots</a>`])
    assert.notEqual(folderIn(text), '', text);
  assert.equal(folderIn(`see [the robots](${folder}) here`), folder);
  assert.equal(folderIn('github.com/o/r'), 'https://github.com/o/r');
  for (const text of ['', 'robots', 'https://github.com/o', `${folder}/a.wbt`, 'ws://host:1999/o/r', 'https://host/x/session', 'ftp://host/o/r',
    'https://webots.cloud/run?url=https://github.com/o/r', 'https://webots.cloud/ScExample', 'wss://host/2000', 'mailto:a/b/c'])
    assert.equal(folderIn(text), '', text);
});

test('of a list of worlds people are told why it is empty, or not there', async (t) => {
  const fetched = globalThis.fetch;
  t.after(() => { globalThis.fetch = fetched; });
  const asked = [];
  const answered = (reply) => {
    globalThis.fetch = async (...request) => {
      asked.push(request);
      return { json: async () => reply };
    };
    return worldsOf('https://host/1999/', 'https://github.com/o/r');
  };
  const worlds = [{ url: 'https://github.com/o/r/blob/main/worlds/a.wbt', title: 'A' }];
  assert.deepEqual(await answered({ worlds }), { worlds, trouble: '' });
  assert.deepEqual(asked, [['https://host/1999/viewer/worlds/list', { method: 'POST', body: 'https://github.com/o/r' }]]);
  assert.deepEqual(await answered({ worlds: [] }), { worlds: [], trouble: say('gallery.noneIn', { address: 'https://github.com/o/r' }) });
  const trouble = async (reply) => (await answered(reply)).trouble;
  assert.equal(await trouble({ error: 'Words.', code: 'no-repository', values: { name: 'o/r' } }), say('refusal.noRepository', { name: 'o/r' }));
  assert.equal(await trouble({ error: 'Words of a later version.', code: 'later' }), 'Words of a later version.');
  assert.equal(await trouble({ error: 'Words without a code.' }), 'Words without a code.');
  globalThis.fetch = async () => { throw new TypeError('Failed to fetch'); };
  assert.deepEqual(await worldsOf('https://host/', 'x'), { worlds: [], trouble: say('gallery.unanswered') });
});

test('a reason is of the sentence that follows it, and of no other', async () => {
  fresh();
  await run();
  const told = [];
  session.addEventListener('problem', ({ detail: { text } }) => told.push(text));
  server.lease.says('reason: {"code":"time-limit","values":{"seconds":"600","minutes":"10"}}');
  server.lease.says('loading: Error: The simulation reached its time limit of 600 s.');
  server.lease.says('loading: Error: Something else.');
  assert.deepEqual(told, [say('refusal.timeLimit', { minutes: 10 }), 'Something else.']);
});

test('how far a project is on its way is said in the language of the page', async () => {
  fresh();
  await run();
  const told = [];
  session.addEventListener('progress', ({ detail }) => told.push(detail));
  await loadTexts(['de']);
  for (const line of ['Receiving objects 42% (12.3 MB)', 'Receiving large files 7% (1.0 MB)', 'Waiting for other projects to be fetched (0.5 MB)',
    'Copying the project to its node of the cluster (2.0 MB)', 'Waiting for a free node of the cluster: position 2 of 5.', 'Step 3/7 : RUN make'])
    server.lease.says(`loading: ${line}`);
  const texts = ['session.receiving', 'session.receivingLarge', 'session.fetchWaits', 'session.copying'].map((key) => say(key));
  const place = say('session.clusterQueue', { place: 2, count: 5 });
  await loadTexts(['en']);
  assert.equal(texts[0], 'Das Projekt wird geholt');
  assert.deepEqual(told.map(({ text }) => text), [`${texts[0]} 42% (12.3 MB)`, `${texts[1]} 7% (1.0 MB)`, `${texts[2]} (0.5 MB)`, `${texts[3]} (2.0 MB)`,
    place, 'Step 3/7 : RUN make']);
  assert.deepEqual(told.slice(0, 2).map(({ percent }) => percent), [42, 7]);
});

test('what the server says to the author of the project goes to the console', async () => {
  fresh();
  await run();
  const told = [];
  session.addEventListener('output', ({ detail }) => told.push(detail));
  server.lease.says('stderr:"a: b/.GIT" of the project is left out.');
  server.lease.says('stdout:Robot "a" waits, with WEBOTS_CONTROLLER_URL=tcp://h:2900/k/a');
  assert.deepEqual(told, [{ stream: 'stderr', line: '"a: b/.GIT" of the project is left out.' },
    { stream: 'stdout', line: 'Robot "a" waits, with WEBOTS_CONTROLLER_URL=tcp://h:2900/k/a' }]);
});

test('the end is announced, and put off where the operator allows it', async () => {
  fresh();
  await run();
  const told = [];
  session.addEventListener('notice', ({ detail }) => told.push(detail.text));
  session.addEventListener('deadline', ({ detail }) => told.push(detail.extendable));
  const { lease } = server;
  session.extend(); // there is nothing to extend yet
  lease.says('shutdownTimeout: 400');
  lease.says('extendable: 1200');
  await pass(101000);
  assert.deepEqual(told, [0, 1200, say('session.endsInMinutes', { minutes: 5 })]);
  session.extend();
  assert.deepEqual(lease.sent.slice(1), ['{"extend":900}']);
  lease.says('shutdownTimeout: 1199');
  lease.says('extendable: 300');
  assert.deepEqual(told.slice(3), [1200, '', 300]); // the warning is taken back
  await pass(898000);
  assert.deepEqual(told.slice(6), []);
  await pass(2000);
  assert.equal(told.at(-1), say('session.endsInMinutes', { minutes: 5 }));
  session.extend();
  assert.equal(lease.sent.at(-1), '{"extend":300}');
});

test('a hidden page gets no pictures, is missed by nobody, and has one at once when it is seen again', async () => {
  fresh();
  await run();
  let rests = 0;
  session.addEventListener('rest', () => { rests += 1; });
  session.hidden = true;
  assert.equal(rests, 1);
  server.simulators.clear(); // simulators tell the time of pictures, and draw none that nobody gets
  const pictures = count('picture');
  await pass(60000);
  assert.equal(count('lost'), 0);
  session.hidden = false;
  assert.equal(count('picture'), pictures + 1);
});

// --- what is done before it is asked for ---

const GATEWAY = `ws://machine:2000/simulation/${'a'.repeat(28)}/2001`;

// A session server that takes starts itself, with its machine behind the gateway.
async function runAt(machine) {
  session = new Session({ ...TARGET, machine }, { width: 1, height: 1 });
  for (const type of ['ready', 'lost', 'ended', 'picture'])
    session.addEventListener(type, ({ detail }) => events.push([type, detail, now]));
  session.start();
  await pass(2000);
}

test('where the machine is known nobody is asked for it', async () => {
  fresh();
  let asked = 0;
  const { fetch } = globalThis;
  globalThis.fetch = (...what) => {
    asked += 1;
    return fetch(...what);
  };
  await runAt('ws://s');
  globalThis.fetch = fetch;
  assert.equal(asked, 0);
  assert.equal(sockets[0].url, 'ws://s/client');
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
});

test('a machine that takes no starts any more is not the end: then the session server is asked', async () => {
  fresh();
  session = new Session({ ...TARGET, machine: 'ws://s' }, { width: 1, height: 1 });
  session.addEventListener('ready', () => events.push(['ready']));
  session.start();
  await settle();
  sockets[0].breaks();
  await pass(2000);
  assert.equal(sockets[1].url, 'ws://machine:2000/client');
  assert.equal(count('ready'), 1);
});

test('a connection that was prepared is used, and closed where nobody starts', async () => {
  fresh();
  Session.prepare({ machine: 'ws://s' });
  Session.prepare({ machine: 'ws://s' });
  await pass(1000);
  assert.equal(sockets.length, 1);
  assert.deepEqual(sockets[0].sent, []);
  await runAt('ws://s');
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
  assert.equal(sockets.filter(({ url }) => url === 'ws://s/client').length, 1);
  assert.equal(sockets[0].sent.length, 1);

  Session.prepare({ machine: 'ws://other' });
  await pass(25000);
  assert.equal(sockets.at(-1).readyState, FakeSocket.CLOSED);
  Session.prepare({ machine: 'ws://other' });
  sockets.at(-1).breaks(); // the server closes it: the next start opens its own
  await runAt('ws://other');
  assert.equal(last('ready', 'lost', 'ended')[0], 'ready');
});

// A machine whose gateway its simulators are behind, and which says so much before it says where.
function behindGateway(...messages) {
  fresh({ running: false });
  const { serve } = server;
  server.serve = (socket, message) => {
    server.asked ??= message;
    const says = (text) => {
      if (text.startsWith('webots:'))
        messages.forEach((each) => socket.says(each));
      socket.says(text.replace('ws://machine:2001', GATEWAY));
    };
    serve.call(server, { says, readyState: FakeSocket.OPEN }, message);
    server.lease = socket;
  };
}

const picturesTold = () => events.filter(([type]) => type === 'picture').map(([, { url, viewOnly, early }]) => ({ url, viewOnly, early }));
const PICTURES = `${GATEWAY.replace('ws', 'http')}/mjpeg`;

test('pictures that the server has asked for are fetched before the simulator has said anything', async () => {
  behindGateway('pictures: 1x1');
  await runAt('ws://s');
  assert.deepEqual(picturesTold(), [{ url: PICTURES, viewOnly: true, early: true }, { url: PICTURES, viewOnly: false, early: undefined }]);
  const { sent } = sockets.find((socket) => socket.url === `${GATEWAY}/`);
  assert.deepEqual(sent.slice(0, 2), ['mjpeg: 1x1', 'real-time:-1']);
});

test('pictures that nobody has asked for are not fetched before the simulator offers them', async () => {
  behindGateway();
  await runAt('ws://s');
  assert.deepEqual(picturesTold(), [{ url: PICTURES, viewOnly: false, early: undefined }]);
});

test('a start says what the page will want at once, and nothing that it would not do itself', async () => {
  const asked = async (more) => {
    behindGateway();
    session = new Session({ ...TARGET, machine: 'ws://s', ...more }, { width: 640, height: 480 });
    session.start();
    await pass(1000);
    const { size, run } = server.asked.start;
    session.stop();
    return { size, run };
  };
  assert.deepEqual(await asked({}), { size: '640x480', run: true });
  assert.deepEqual(await asked({ paused: true }), { size: '640x480', run: undefined });
  assert.deepEqual(await asked({ broadcast: true }), { size: undefined, run: undefined });
  assert.deepEqual(await asked({ mode: 'w3d' }), { size: undefined, run: undefined });
});

test('what the simulator has said to the server comes as if the page had heard it', async () => {
  behindGateway('said: stdout:hello\nstderr:oh', 'said: robot: {"name":"blue","message":"m"}');
  const heard = [];
  session = new Session({ ...TARGET, machine: 'ws://s' }, { width: 1, height: 1 });
  session.addEventListener('output', ({ detail: { stream, line } }) => heard.push(`${stream} ${line}`));
  session.addEventListener('message', ({ detail: { from, text } }) => from === 'simulator' && text.startsWith('robot:') && heard.push(text));
  session.start();
  await pass(1000);
  assert.deepEqual(heard, ['stdout hello', 'stderr oh', 'robot: {"name":"blue","message":"m"}']);
});

test('the times of pictures that were fetched before are no lines of the console', async () => {
  behindGateway('pictures: 1x1');
  const { hears } = server;
  server.hears = (socket, text) => {
    hears.call(server, socket, text);
    if (text.startsWith('mjpeg:'))
      socket.says('time: 32\nstdout:hello\ntime: 64\nrobot: {}\nstderr:oh\ntime: 1.024e+06');
  };
  const lines = [];
  session = new Session({ ...TARGET, machine: 'ws://s' }, { width: 1, height: 1 });
  session.addEventListener('output', ({ detail: { stream, line } }) => lines.push(`${stream} ${line}`));
  session.start();
  await pass(1000);
  assert.deepEqual(lines, ['stdout hello', 'stderr oh']);
  server.simulators.forEach((socket) => socket.says('stdout:a\ntime: 5')); // of a program that prints this
  assert.deepEqual(lines.slice(2), ['stdout a', 'stdout time: 5']);
});
