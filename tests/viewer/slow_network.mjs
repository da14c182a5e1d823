// Measures how old pictures are, and how many arrive, when a simulation is watched through a slow network:
//
//   node tests/viewer/slow_network.mjs [Mbit/s [seconds [phone|desktop]]]        after ./test.sh, or what it installs
//
// The demo simulator is reached through a proxy that passes so much on, and no more. Every picture is announced (`time:`); a second
// page, which is not slowed down, notes when. A picture's age is how long after its announcement its first byte leaves the proxy.

import { connect, createServer } from 'node:net';
import { after, test } from 'node:test';
import { startDemoSimulator } from './demo_simulator.mjs';
import { FakeCloud } from './fake_cloud.mjs';
import { openBrowser, openPage, until } from './page.mjs';

const [megabits = '2', seconds = '60', device = 'phone'] = process.argv.slice(2);
const DEVICES = {
  phone: { viewport: { width: 360, height: 740 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true },
  desktop: { viewport: { width: 1280, height: 800 } },
};
const MARK = Buffer.from('--WebotsFrame');
const BUFFER = 64 * 1024; // bytes that wait on the way, as in a router
const TICK_MS = 10;

// Passes connections on to `target`; what comes back shares `rate` bytes a second. `passed` gets each piece with its connection.
class SlowNetwork {
  #waiting = []; // pieces of all connections, in the order of their arrival
  #size = 0;
  #left = 0;
  #server;
  #sources = new Set();

  constructor(target, rate, passed) {
    this.#server = createServer((near) => this.#connect(near, connect(target, '127.0.0.1'), passed));
    let last = performance.now();
    this.timer = setInterval(() => {
      const now = performance.now();
      this.#left = Math.min(rate * 0.05, this.#left + rate * (now - last) / 1000);
      last = now;
      this.#pass(passed);
    }, TICK_MS);
  }

  listen() {
    return new Promise((resolve) => this.#server.listen(0, '127.0.0.1', () => resolve(this.#server.address().port)));
  }

  close() {
    clearInterval(this.timer);
    this.#server.close();
    this.#sources.forEach((source) => source.destroy());
  }

  #connect(near, far, passed) {
    this.#sources.add(far).add(near);
    near.on('data', (data) => far.write(data));
    far.on('data', (data) => {
      for (let start = 0; start < data.length; start += 1460)
        this.#waiting.push({ near, data: data.subarray(start, start + 1460) });
      this.#size += data.length;
      if (this.#size > BUFFER)
        this.#sources.forEach((source) => source.pause());
    });
    const end = () => {
      near.destroy();
      far.destroy();
      this.#sources.delete(far);
      this.#sources.delete(near);
      passed(near, null);
    };
    for (const socket of [near, far])
      socket.on('close', end).on('error', end);
  }

  #pass(passed) {
    while (this.#waiting.length > 0 && this.#left >= this.#waiting[0].data.length) {
      const { near, data } = this.#waiting.shift();
      this.#size -= data.length;
      if (near.destroyed)
        continue;
      this.#left -= data.length;
      passed(near, data);
      near.write(data);
    }
    if (this.#size <= BUFFER)
      this.#sources.forEach((source) => source.resume());
  }
}

const rank = (numbers, part) => [...numbers].sort((a, b) => a - b)[Math.floor(part * (numbers.length - 1))] ?? NaN;

const browser = await openBrowser();
const cloud = new FakeCloud();
const port = await startDemoSimulator();
after(() => cloud.close());

test('pictures through a slow network', async (t) => {
  let announced = []; // when each picture was
  const streams = new Map(); // connection -> the number of its last picture
  const pictures = []; // of those that left the proxy: {at, age}
  let bytes = 0;
  const network = new SlowNetwork(port, Number(megabits) * 1e6 / 8, (connection, data) => {
    const now = performance.now();
    if (data === null)
      return streams.delete(connection);
    bytes += data.length;
    for (let found = data.indexOf(MARK); found >= 0; found = data.indexOf(MARK, found + 1)) {
      const number = streams.has(connection) ? streams.get(connection) + 1 : Math.max(0, announced.length - 1);
      streams.set(connection, number);
      pictures.push({ at: now, age: now - (announced[number] ?? now) });
    }
  });
  t.after(() => network.close());
  const slow = await network.listen();

  const page = await openPage(t, browser, DEVICES[device]);
  await page.goto(`${await cloud.get('page')}?url=ws://127.0.0.1:${slow}`);
  await page.click('#start');
  await page.waitForSelector('body[data-state="paused"]');
  const observer = await openPage(t, browser);
  await observer.goto(await cloud.get('page'));
  await observer.exposeFunction('announce', () => announced.push(performance.now()));
  await observer.evaluate((address) => {
    const socket = new WebSocket(address);
    socket.onopen = () => socket.send('mjpeg: 100x100');
    socket.onmessage = ({ data }) => /^time/.test(data) && window.announce();
  }, `ws://127.0.0.1:${port}/`);
  await new Promise((resolve) => setTimeout(resolve, 1000));
  announced = [];
  await page.click('#play');
  await page.waitForSelector('body[data-state="running"]');
  for (let second = 5; second <= Number(seconds); second += 5) {
    const from = performance.now();
    bytes = 0;
    await new Promise((resolve) => setTimeout(resolve, 5000));
    const last = pictures.filter(({ at }) => at >= from);
    const ages = last.map(({ age }) => age);
    const size = await page.evaluate(() => {
      const shown = document.querySelector('#picture canvas, #picture img') ?? document.getElementById('picture');
      return `${shown.naturalWidth ?? shown.width}x${shown.naturalHeight ?? shown.height}`;
    });
    console.log(`${String(second).padStart(4)} s  ${(last.length / 5).toFixed(1).padStart(5)} pictures/s  age ${rank(ages, 0.5).toFixed(0).padStart(5)} ms median ` +
      `${rank(ages, 0.99).toFixed(0).padStart(5)} ms 99th  ${size.padStart(9)}  ${(bytes * 8 / 5e6).toFixed(2)} Mbit/s`);
  }
  await until(() => pictures.length > 0, 'a picture');
});
