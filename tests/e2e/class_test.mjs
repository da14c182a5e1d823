// A lesson with the real servers and the demo simulator: a teacher and three students in browsers, and 27 more, who send pictures.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdir, mkdtemp, readFile, readdir, rm, writeFile } from 'node:fs/promises';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { openBrowser, openPage, until } from '../viewer/page.mjs';

const PASSWORD = 'abcd-efgh-jkmn';
const PROJECTS = fileURLToPath(new URL('../../examples', import.meta.url));
const WORLD = 'local:/demo_projects/robots/blob/main/worlds/arena.wbt';
const NAMES = ['Ada', 'Grace', 'Hedy'];
const MORE = 27;

// --- servers

const folder = await mkdtemp(join(tmpdir(), 'webots_cloud_class_'));
after(() => rm(folder, { recursive: true, force: true }));
const [sessionPort, simulationPort] = [await freePort(), await freePort()];
const session = await start('session', { port: sessionPort, simulationServers: [`localhost:${simulationPort}`], loadRefresh: 0.5, loadThreshold: 1000,
  teacherPassword: PASSWORD });
const simulation = await start('simulation', { port: simulationPort, notify: [], maxConnections: 40, sandbox: 'none', simulationUser: 'none', gateway: true,
  forges: [{ url: 'local:', directory: PROJECTS }], allowedRepositories: ['local:/demo_projects'] });
const server = `http://localhost:${sessionPort}`;
await until(async () => (await fetch(`${server}/readyz`)).ok, 'a machine');

async function start(kind, config) {
  const home = join(folder, kind);
  await mkdir(join(home, 'tmp'), { recursive: true });
  const path = join(home, 'config.json');
  await writeFile(path, JSON.stringify({ server: 'localhost', ssl: false, portRewrite: false, debug: true, ...config }));
  const environment = { ...process.env, HOME: home, TMPDIR: join(home, 'tmp'), XDG_CACHE_HOME: join(home, 'cache'), XDG_STATE_HOME: join(home, 'state'),
    XDG_RUNTIME_DIR: '', DISPLAY: ':0', WEBOTS_DEMO_ADDRESS: '127.0.0.1' };
  delete environment.STATE_DIRECTORY;
  const child = spawn(join(process.env.WEBOTS_CLOUD_BIN, `webots-${kind}-server`), [path], { env: environment, cwd: home });
  const running = { log: '' };
  for (const stream of [child.stdout, child.stderr])
    stream.on('data', (text) => { running.log += text; });
  const ended = once(child, 'exit');
  after(async () => {
    child.kill();
    await ended;
  });
  process.on('exit', () => child.kill('SIGKILL'));
  await until(() => fetch(`http://localhost:${config.port}/load`).then(({ ok }) => ok, () => {
    assert.equal(child.exitCode, null, running.log);
    return false;
  }), `the ${kind} server`);
  return running;
}

async function freePort() {
  const socket = createServer().listen(0, '127.0.0.1');
  await once(socket, 'listening');
  const { port } = socket.address();
  socket.close();
  await once(socket, 'close');
  return port;
}

// --- people

const shown = (page, part) => page.waitForSelector(`body[data-shown="${part}"]`);
const state = (page, name) => page.waitForSelector(`body[data-state="${name}"]`);
const says = (page, selector, text) => page.waitForFunction(([where, wanted]) => document.querySelector(where)?.textContent.includes(wanted), [selector, text]);
const tile = (page, name) => page.locator('.tile').filter({ has: page.getByText(name, { exact: true }) });
const time = (page, name) => tile(page, name).locator('.time').textContent();

async function attend(t, browser, link, name) {
  const page = await openPage(t, browser, { viewport: { width: 640, height: 480 } });
  await page.goto(link);
  await page.fill('#name', name);
  await page.click('#join');
  await state(page, 'running');
  return page;
}

// Students of whom there is only a socket: globalThis.students, {name, id, token, wanted, told}.
async function joinMore(t, browser, code) {
  const page = await openPage(t, browser);
  await page.goto(`${server}/class/`);
  await page.evaluate(async ([count, classCode]) => {
    const canvas = new OffscreenCanvas(160, 120);
    canvas.getContext('2d').fillRect(20, 20, 90, 70);
    const blob = await canvas.convertToBlob({ type: 'image/jpeg', quality: 0.5 });
    const picture = btoa(String.fromCharCode(...new Uint8Array(await blob.arrayBuffer())));
    globalThis.students = Array.from({ length: count }, (_, i) => {
      const student = { name: `Student ${i + 1}`, told: [] };
      const socket = student.socket = new WebSocket(`${location.origin.replace('http', 'ws')}/class`);
      const send = (message) => socket.send(JSON.stringify(message));
      let sending = 0;
      socket.onopen = () => send({ join: { code: classCode, name: student.name } });
      socket.onmessage = ({ data }) => {
        const message = JSON.parse(data);
        student.told.push(message);
        if (message.joined)
          send({ state: { state: 'running', time: 1000 * i } });
        if (message.pictures !== undefined)
          clearInterval(sending);
        if (message.pictures)
          sending = setInterval(() => socket.readyState === WebSocket.OPEN && send({ picture }), message.pictures.interval);
      };
      socket.onclose = () => clearInterval(sending);
      return student;
    });
  }, [MORE, code]);
  return page;
}

test('a lesson from the first student to the last', { timeout: 200000 }, async (t) => {
  const browser = await openBrowser();
  const teacher = await openPage(t, browser);
  await teacher.goto(`${server}/class/#teach`);
  await shown(teacher, 'open');
  await teacher.fill('#password', 'wrong');
  await teacher.fill('#world', WORLD);
  await teacher.click('#open-class');
  await teacher.waitForSelector('#open-problem:not(:empty)');
  await teacher.fill('#password', PASSWORD);
  await teacher.click('#open-class');
  await shown(teacher, 'lesson');
  await says(teacher, '#fetch-status', '1 of 1');
  const code = await teacher.textContent('#class-code');
  const link = await teacher.getAttribute('#link', 'href');
  assert.equal(link, `${server}/class/${code}`);

  // Everybody comes, and is on the wall with a picture.
  const pages = [];
  for (const name of NAMES)
    pages.push(await attend(t, browser, link, name));
  const more = await joinMore(t, browser, code);
  await teacher.waitForFunction((count) => document.querySelectorAll('.tile[data-state="running"][data-pictured]').length === count, NAMES.length + MORE);
  assert.deepEqual((await teacher.locator('.name').allTextContents()).slice(0, 4), [...NAMES, 'Student 1']);

  // What the teacher says and does reaches all.
  await teacher.click('#for-all [data-do="message"]');
  await teacher.keyboard.type('Good morning!');
  await teacher.keyboard.press('Enter');
  for (const page of pages)
    await says(page, '#told-text', 'Good morning!');
  await more.waitForFunction(() => globalThis.students.every(({ told }) => told.some((message) => message.text === 'Good morning!')));
  await teacher.click('#for-all [data-do="pause"]');
  for (const page of pages)
    await state(page, 'paused');
  await tile(teacher, 'Ada').getByRole('button', { name: 'Run' }).click(); // its button says so as soon as her page has said that it is paused
  await state(pages[0], 'running');
  assert.equal(await pages[1].getAttribute('body', 'data-state'), 'paused');
  await until(async () => await time(teacher, 'Grace') !== '0:00:00', 'the time of Grace');
  await tile(teacher, 'Grace').locator('summary').click();
  await tile(teacher, 'Grace').locator('[data-do="reset"]').click();
  await until(async () => await time(teacher, 'Grace') === '0:00:00', 'a new beginning');

  // Looking at one does not disturb.
  await tile(teacher, 'Ada').locator('.look').click();
  await teacher.waitForSelector('#look-view [data-live]');
  const before = await pages[0].evaluate(() => document.querySelector('#simulation > div').shadowRoot.querySelector('time').textContent);
  await pages[0].waitForFunction((old) => document.querySelector('#simulation > div').shadowRoot.querySelector('time').textContent !== old, before);
  await teacher.click('#look-back');
  await shown(teacher, 'lesson');

  // Who reloads is back.
  await pages[1].reload();
  await state(pages[1], 'paused');
  await teacher.reload();
  await shown(teacher, 'lesson');
  await teacher.waitForFunction((count) => document.querySelectorAll('.tile[data-pictured]').length === count, NAMES.length + MORE);
  await says(teacher, '#fetch-status', '1 of 1');

  // One ends, one leaves, one is removed.
  await tile(teacher, 'Ada').locator('summary').click();
  await tile(teacher, 'Ada').locator('[data-do="end"]').click();
  await teacher.click('#question-yes');
  await state(pages[0], 'ended');
  await pages[2].click('#leave');
  await until(async () => await tile(teacher, 'Hedy').count() === 0, 'Hedy to be gone');
  await tile(teacher, 'Student 27').locator('summary').click();
  await tile(teacher, 'Student 27').locator('[data-do="remove"]').click();
  await teacher.click('#question-yes');
  await more.waitForFunction(() => globalThis.students[26].told.some(({ closed }) => closed === 'removed'));

  await teacher.click('#close-class');
  await teacher.click('#question-yes');
  await shown(teacher, 'over');
  for (const page of pages.slice(0, 2))
    await shown(page, 'over');
  await more.waitForFunction(() => globalThis.students.every(({ socket }) => socket.readyState === WebSocket.CLOSED));
  const instances = join(folder, 'simulation/state/webots_cloud', String(simulationPort), 'instances');
  await until(async () => (await readdir(instances)).length === 0, 'the end of all simulations');

  // Nothing is kept.
  for (const text of [session.log, ...await filesBelow(join(folder, 'session'))])
    for (const secret of [...NAMES, code, 'Good morning'])
      assert.ok(!text.includes(secret), `${secret}: ${text}`);
});

async function filesBelow(place) {
  const entries = await readdir(place, { withFileTypes: true });
  const texts = await Promise.all(entries.map(async (entry) => {
    const path = join(place, entry.name);
    if (entry.isDirectory())
      return filesBelow(path);
    return entry.isFile() ? [await readFile(path, 'latin1')] : [];
  }));
  return texts.flat();
}
