// What session and simulation servers say on /monitor (protocol 13.9) in the states that their pages have, with a past that looks like one.

const NOW = 1795946400; // 2026-11-29 10:00 UTC
const MINUTE = 60;

const wave = (count, middle, width, step = 7) => Array.from({ length: count }, (_, index) =>
  Math.round(10 * Math.max(0, middle + width * Math.sin(index / step) + width / 3 * Math.sin(index / 2.3))) / 10);

const machine = (address, load, more = {}) => ({ address, load, placed: 3, age: 1.2, state: 'free', history: load === null ? Array(120).fill(null) : wave(120, load, load / 4), ...more });

const DAY = { last: 12, spacing: 180, series: [
  { name: 'load', history: wave(480, 35, 20, 60) },
  { name: 'taken', history: wave(480, 14, 9, 60).map(Math.round) },
  { name: 'seats', history: Array(480).fill(32) },
  { name: 'waiting', history: wave(480, 0.4, 1.5, 30).map(Math.floor) }] };

const session = (servers, more) => ({ now: NOW, threshold: 95, last: 1, spacing: 5,
  about: { started: NOW - 90 * MINUTE, version: '1.0.0', tls: false, gateway: false, decisions: false }, state: 'free', stateText: 'A machine is free.', day: DAY, ...more, servers });

export const SESSION = {
  none: session([], { state: 'down', stateText: 'No machine is running.', day: { last: 2, spacing: 60, series: DAY.series.map(({ name }) => ({ name, history: [null] })) } }),
  one: session([machine('localhost:2000', 12.4, { sessions: 1, seats: 4 })], { waiting: 0, longestWait: 0, relayed: 1 }),
  waiting: session([machine('localhost:2000', 71, { sessions: 4, seats: 4, state: 'full' })],
    { state: 'full', waiting: 3, longestWait: 95, relayed: 4, waitingFor: { seat: 2, room: 1 } }),
  five: session([
    machine('sim1.example.org:2000', 32, { sessions: 5, seats: 8, placed: 212 }),
    machine('sim2.example.org:2000', 97, { sessions: 6, seats: 8, state: 'busy', placed: 340 }),
    machine('sim3.example.org:2000', 64, { sessions: 8, seats: 8, state: 'full', placed: 301, foundBy: 'dns:sim.example.org:2000' }),
    machine('sim4.example.org:2000', 8, { sessions: 1, seats: 8, state: 'draining', drained: 'operator' }),
    machine('sim5.example.org:2000', null, { state: 'down', age: undefined, problem: 'Connection refused', placed: 0 })],
  { waiting: 0, longestWait: 0, relayed: 20 }),
  many: session(Array.from({ length: 60 }, (_, index) => machine(`10.0.0.${index + 1}:2000`, 10 + index, { sessions: index % 9, seats: 8, state: index % 9 === 8 ? 'full' : 'free' })), {}),
  plain: session([machine('old.example.org:2000', 20)], {}), // a server of Python's, which has no seats
};

export const DECISIONS = [
  { decision: 3, secondsAgo: 12.1, chosen: 'sim1.example.org:2000', offered: 1, refused: { load: 1, full: 1, draining: 1, lost: 1 },
    machines: [{ server: 'sim1.example.org:2000', load: 32, sessions: 5 }] },
  { decision: 2, secondsAgo: 80, chosen: null, offered: 0, refused: { full: 4, lost: 1 }, machines: [] },
  { decision: 1, secondsAgo: 95, chosen: null, offered: 0, refused: { full: 4, lost: 1 }, machines: [] }];

const COLUMNS = ['Webots running', 'Webots idle', 'CPU load', 'CPU memory', 'GPU load compute', 'GPU load memory', 'GPU memory', 'Swap', 'Disk', 'Network sent', 'Network received'];
const levels = (figures) => COLUMNS.map((name, index) => [name, figures[index]]);
const history = (figures, count) => levels(figures).map(([name, level]) => ({ name,
  history: name.startsWith('Webots') ? Array(count).fill(level) : ['Disk', 'Swap'].includes(name) ? Array(count).fill(level) : wave(count, level, level / 4, count / 12) }));

function simulation(figures, simulations, { about = {}, ...more } = {}) {
  return { now: NOW, load: figures[2], count: simulations.length, capacity: 4, simulations,
    about: { version: '1.0.0', title: '', description: '', notices: [], sandbox: 'bubblewrap; no network', display: 'private (Xvfb)',
      host: { system: 'Debian GNU/Linux 12', name: 'lab7', processor: 'Intel Xeon E5-2680', threads: 16, cores: 8, memory: 32 * 2 ** 30 },
      allowed: ['https://github.com/cyberbotics', 'local:/demo_projects'], blocked: [], registries: ['https://webots.cloud'], shareIdleTime: 50, ...about },
    day: { last: 20, spacing: 180, series: history(figures, 480) }, spacing: 1, series: history(figures, 600), ...more };
}

const WORLD = 'https://github.com/cyberbotics/webots/blob/master/projects/robots/softbank/nao/worlds/nao_demo.wbt';

export const SIMULATION = {
  idle: simulation([0, 0, 2.4, 11, 0, 0, 0, 0, 41, 0.002, 0.001], [], {
    about: { notices: ['The demo simulator runs in place of Webots: it is not Webots.', 'Simulations run without a sandbox: what they do, they do as the user of this server.'], sandbox: '', display: '' } }),
  running: simulation([2, 1, 46, 38, 0, 0, 0, 0, 41, 2.4, 0.12], [
    { id: 7, world: WORLD, state: 'running', age: 3725, log: 'log/simulation/simulations/7.log', process: 8063, cpu: 112.5, memory: 1310.2, processes: 24 },
    { id: 9, world: 'local:/demo_projects/robots/blob/main/worlds/arena.wbt', state: 'idle', age: 61, log: 'log/simulation/simulations/9.log', process: 8200, cpu: 3.1, memory: 210.4, processes: 12, more: 1 },
    { id: 10, world: 'local:/demo_projects/robots/blob/main/worlds/corridor.wbt', state: 'fetching the project', age: 2 }]),
  graphics: simulation([4, 0, 81, 62, 55, 20, 70, 8, 92, 12, 0.4], Array.from({ length: 4 }, (_, index) =>
    ({ id: index + 1, world: WORLD, state: 'running', age: 600 + index, process: 900 + index, cpu: 95.2, graphics: 12.4, memory: 900, processes: 20 })), {
    about: { title: 'Lab 7', description: 'Ask Ada in room 12 for more seats.', host: { system: 'Debian GNU/Linux 12', name: 'lab7', processor: 'AMD EPYC 7302', threads: 32, cores: 16, memory: 64 * 2 ** 30, gpu: '2x NVIDIA T4 (15.8GB)' } } }),
  draining: simulation([0, 0, 2.4, 11, 0, 0, 0, 0, 41, 0, 0], [], { draining: true }),
};
