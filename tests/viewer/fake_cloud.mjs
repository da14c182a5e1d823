// FakeCloud of fake_cloud.py, for tests in JavaScript. Each member is used by name:
//   await cloud.get('controls');  await cloud.set('launch', [...]);  await cloud.call('send', 'simulator', 'time: 32');

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { createInterface } from 'node:readline';
import { fileURLToPath } from 'node:url';

export class FakeCloud {
  #process;
  #lines;

  // Starts the servers. They end with close(), or with this process.
  constructor() {
    const script = fileURLToPath(new URL('fake_cloud.py', import.meta.url));
    this.#process = spawn('/usr/bin/python3', [script], { stdio: ['pipe', 'pipe', 'inherit'] });
    this.#lines = createInterface({ input: this.#process.stdout })[Symbol.asyncIterator]();
  }

  // Ends all connections and begins anew, with nothing set and nothing seen.
  renew() { return this.#ask({ new: true }); }

  get(name) { return this.#ask({ get: name }); }
  set(name, value) { return this.#ask({ set: name, to: value }); }
  call(name, ...values) { return this.#ask({ call: name, with: values }); }

  async close() {
    const ended = once(this.#process, 'exit');
    this.#process.stdin.end();
    await ended;
  }

  async #ask(question) {
    this.#process.stdin.write(`${JSON.stringify(question)}\n`);
    const { value: line, done } = await this.#lines.next();
    if (done)
      throw new Error('The fake servers have ended.');
    const { value, error } = JSON.parse(line);
    if (error !== undefined)
      throw new Error(`${JSON.stringify(question)}: ${error}`);
    return value;
  }
}
