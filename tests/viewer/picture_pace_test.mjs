// How large pictures may be (src/web/view/picture_pace.js), with networks of numbers, and how their stream is read (multipart.js).

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { MultipartReader } from '../../src/web/view/multipart.js';
import { PicturePace } from '../../src/web/view/picture_pace.js';

// A simulator that makes 20 pictures a second, and a network that brings `bytes` a second of them, one after the other.
class Network {
  now = 0;
  bytes;
  pace = new PicturePace();
  decisions = [];
  age = 0; // of the last picture that arrived
  #queue = [];
  #left = 0;
  #full = 20000; // bytes of a picture of full size

  constructor(bytes) {
    this.bytes = bytes;
    this.pace.begin(0);
  }

  run(seconds, { fixed = false } = {}) {
    for (const end = this.now + 1000 * seconds; this.now < end; this.now += 50) {
      this.pace.announce(this.now);
      this.#queue.push({ made: this.now, bytes: this.#full * this.pace.scale ** 2 });
      for (this.#left += this.bytes / 20; this.#queue.length > 0 && this.#queue[0].bytes <= this.#left;) {
        const { made, bytes } = this.#queue.shift();
        this.#left -= bytes;
        this.age = this.now - made;
        this.pace.arrive(this.now);
      }
      if (this.#queue.length === 0)
        this.#left = 0;
      const decision = this.now % 250 === 0 ? this.pace.decide(this.now, fixed) : 'keep';
      if (decision !== 'keep')
        this.decisions.push(decision);
      if (decision === 'shrink' || decision === 'renew') {
        this.#queue = [];
        this.pace.begin(this.now);
      }
    }
    return this;
  }
}

test('a network that is fast enough is left alone', () => {
  const network = new Network(500000).run(60);
  assert.deepEqual([network.decisions, network.pace.scale], [[], 1]);
});

test('a slow network gets pictures that it can bring, and none is old', () => {
  const network = new Network(100000).run(20);
  assert.ok(network.pace.scale < Math.sqrt(0.25) && network.pace.scale > 0.25, `${network.pace.scale}`);
  assert.ok(network.age <= 100, `${network.age}`);
});

test('a network that becomes faster gets larger pictures again', () => {
  const network = new Network(100000).run(20);
  network.bytes = 500000;
  assert.equal(network.run(120).pace.scale, 1);
});

test('a network that stays slow is tried less and less often', () => {
  const network = new Network(100000).run(60);
  const trials = () => network.decisions.filter((decision) => decision === 'grow').length;
  const first = trials();
  network.run(60);
  network.run(240);
  assert.ok(trials() - first <= 6, `${trials()} trials`);
});

test('the smallest picture is a quarter as wide, and a stalled network makes no smaller one', () => {
  const network = new Network(0).run(60);
  assert.equal(network.pace.scale, 0.25);
});

test('a spectator, who can not choose the size, begins new streams, but fewer and fewer', () => {
  const network = new Network(100000).run(120, { fixed: true });
  assert.equal(network.pace.scale, 1);
  assert.deepEqual([...new Set(network.decisions)], ['renew']);
  assert.ok(network.decisions.length <= 8, `${network.decisions.length}`);
});

test('pictures of a simulation that is paused tell nothing', () => {
  const pace = new PicturePace();
  pace.begin(0);
  for (let now = 0; now < 10000; now += 50) {
    pace.arrive(now);
    assert.equal(pace.decide(now), 'keep');
  }
  pace.announce(10000);
  pace.arrive(10020);
  assert.equal(pace.decide(10020), 'keep');
});

const bytes = (text) => new TextEncoder().encode(text);
const PART = '--WebotsFrame\r\nContent-Type: image/png\r\nContent-Length: 4\r\n\r\nab\r\n\r\n';

test('parts are found however the stream is cut into pieces', () => {
  const stream = bytes(PART + PART);
  for (let size = 1; size <= stream.length; size++) {
    const reader = new MultipartReader();
    const parts = [];
    for (let start = 0; start < stream.length; start += size)
      parts.push(...reader.push(stream.subarray(start, start + size)));
    assert.deepEqual(parts.map(({ type, bytes: content }) => [type, Buffer.from(content).toString()]),
      [['image/png', 'ab\r\n'], ['image/png', 'ab\r\n']], `pieces of ${size}`);
  }
});

test('what is no stream of pictures is refused', () => {
  for (const text of ['--b\r\nContent-Type: image/png\r\n\r\n', '--b\r\nContent-Length: 99999999999\r\n\r\n', 'x'.repeat(9000)])
    assert.throws(() => new MultipartReader().push(bytes(text)), /stream of pictures/);
});
