// The demo simulator with its arena, for measurements and pictures: built by cmake --build --preset release.

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { after } from 'node:test';
import { fileURLToPath } from 'node:url';

import { freePort } from '../support/free_port.mjs';

const path = (name) => fileURLToPath(new URL(`../../${name}`, import.meta.url));

// Starts it with pictures, paused, and returns its port. It ends with the tests of the file.
export async function startDemoSimulator() {
  const port = await freePort();
  const options = [`--port=${port}`, '--stream=mjpeg', '--heartbeat=5000', '--batch', '--mode=pause'];
  const simulator = spawn(path('build/release/bin/webots-demo-simulator'), [...options, path('examples/demo_projects/robots/worlds/arena.wbt')],
    { stdio: ['ignore', 'pipe', 'inherit'] });
  after(() => simulator.kill());
  await once(simulator.stdout, 'data'); // It is ready.
  simulator.stdout.resume();
  return port;
}
