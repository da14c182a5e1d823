// The real servers for a class, with the demo simulator, and what teachers and students do in browsers.

import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdir, mkdtemp, readFile, readdir, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after } from 'node:test';
import { fileURLToPath } from 'node:url';

import { freePort } from '../support/free_port.mjs';
import { openPage, until } from '../viewer/page.mjs';

export const PASSWORD = 'abcd-efgh-jkmn';
const PROJECTS = fileURLToPath(new URL('../../examples', import.meta.url));
export const WORLD = 'local:/demo_projects/robots/blob/main/worlds/arena.wbt';

// --- servers

// A session server and a simulation server, which end with the tests of the file; `session` and `simulation` are functions of both ports
// that return what is special in their configurations.
export async function startClassSite({ session: sessionConfig, simulation: simulationConfig }) {
  const folder = await mkdtemp(join(tmpdir(), 'webots_cloud_class_'));
  const running = [];
  after(async () => {
    await Promise.all(running.map(({ stop }) => stop()));
    await rm(folder, { recursive: true, force: true });
  });
  const ports = { session: await freePort(), simulation: await freePort() };
  const session = await start('session', folder, running, { port: ports.session, loadRefresh: 0.5, loadThreshold: 1000, teacherPassword: PASSWORD, ...sessionConfig(ports) });
  const simulation = await start('simulation', folder, running, { port: ports.simulation, notify: [], maxConnections: 40, sandbox: 'none', simulationUser: 'none',
    forges: [{ url: 'local:', directory: PROJECTS }], allowedRepositories: ['local:/demo_projects'], ...simulationConfig(ports) });
  const server = `http://localhost:${ports.session}`;
  await until(async () => (await fetch(`${server}/readyz`)).ok, 'a machine');
  return { folder, session, simulation, server, instances: join(folder, 'simulation/state/webots_cloud', String(ports.simulation), 'instances') };
}

// The example of a website, whose page shows what the site is; its address.
export async function startWebsite({ folder, server }) {
  const home = join(folder, 'website');
  await mkdir(home);
  const port = await freePort();
  const config = { port, sessionServer: server.replace('http', 'ws'), keyFile: 'key/localhost', usersDir: 'user',
    pageDir: join(PROJECTS, 'website_host/page'), users: [], projects: [{ name: 'robots', world: 'arena.wbt', controller: 'avoid_walls' }] };
  const path = join(home, 'website.json');
  await writeFile(path, JSON.stringify(config));
  const child = spawn(join(process.env.WEBOTS_CLOUD_BIN, 'webots-website-host'), [path], { cwd: home, stdio: 'ignore' });
  const kill = () => child.kill('SIGKILL');
  after(kill);
  process.on('exit', kill);
  const address = `http://localhost:${port}`;
  await until(() => fetch(address).then(({ ok }) => ok, () => false), 'the website');
  return address;
}

// {log, pid, stop(), reread(changes), command(...options)}, which joins `others`. `changes`: of its configuration; `command`: the program once
// more, which talks with the running one.
async function start(kind, folder, others, config) {
  const home = join(folder, kind);
  await mkdir(join(home, 'tmp'), { recursive: true });
  const path = join(home, 'config.json');
  const configure = (changes) =>
    writeFile(path, JSON.stringify({ server: 'localhost', ssl: false, portRewrite: false, debug: true, ...config, ...changes }));
  await configure({});
  const environment = { ...process.env, HOME: home, TMPDIR: join(home, 'tmp'), XDG_CACHE_HOME: join(home, 'cache'), XDG_STATE_HOME: join(home, 'state'),
    XDG_RUNTIME_DIR: '', DISPLAY: ':0', WEBOTS_DEMO_ADDRESS: '127.0.0.1' };
  delete environment.STATE_DIRECTORY;
  const program = join(process.env.WEBOTS_CLOUD_BIN, `webots-${kind}-server`);
  const child = spawn(program, [path], { env: environment, cwd: home });
  const ended = once(child, 'exit');
  const server = {
    log: '',
    pid: child.pid,
    async reread(changes) {
      await configure(changes);
      child.kill('SIGHUP');
    },
    command: (...options) => execFileSync(program, [...options, path], { env: environment, cwd: home }),
    async stop() {
      child.kill();
      await ended;
    },
  };
  for (const stream of [child.stdout, child.stderr])
    stream.on('data', (text) => { server.log += text; });
  others.push(server);
  process.on('exit', () => child.kill('SIGKILL'));
  await until(() => fetch(`http://localhost:${config.port}/load`).then(({ ok }) => ok, () => {
    assert.equal(child.exitCode, null, server.log);
    return false;
  }), `the ${kind} server`);
  return server;
}

// None of these texts is in a server's log, or in a file of the session server.
export async function assertNothingIsKept({ folder, session }, secrets) {
  for (const text of [session.log, ...await filesBelow(join(folder, 'session'))])
    for (const secret of secrets)
      assert.ok(!text.includes(secret), `${secret}: ${text}`);
}

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

// --- people

export const shown = (page, part) => page.waitForSelector(`body[data-shown="${part}"]`);
export const state = (page, name) => page.waitForSelector(`body[data-state="${name}"]`);
export const says = (page, selector, text) =>
  page.waitForFunction(([where, wanted]) => document.querySelector(where)?.textContent.includes(wanted), [selector, text]);
export const tile = (page, name) => page.locator('.tile').filter({ has: page.getByText(name, { exact: true }) });
export const time = (page, name) => tile(page, name).locator('.time').textContent();

export async function fillForm(teacher) {
  await teacher.fill('#password', PASSWORD);
  await teacher.fill('#world', WORLD);
}

// Returns the code of the class, and its link.
export async function openClass(teacher) {
  await teacher.click('#open-class');
  await shown(teacher, 'lesson');
  await says(teacher, '#fetch-status', '1 of 1');
  return { code: await teacher.textContent('#class-code'), link: await teacher.getAttribute('#link', 'href') };
}

export async function attend(t, browser, link, name, options = {}) {
  const page = await openPage(t, browser, { viewport: { width: 640, height: 480 }, ...options });
  await page.goto(link);
  await page.fill('#name', name);
  await page.click('#join');
  await state(page, 'running');
  return page;
}

export async function press(teacher, name, action) {
  await tile(teacher, name).locator('summary').click();
  await tile(teacher, name).locator(`[data-do="${action}"]`).click();
}

export async function tellAll(teacher, text) {
  await teacher.click('#for-all [data-do="message"]');
  await write(teacher, text);
}

export async function write(teacher, text) {
  await teacher.keyboard.type(text);
  await teacher.keyboard.press('Enter');
}

// As the student's page shows it.
export const simulated = (page) => page.evaluate(() => document.querySelector('#simulation > div').shadowRoot.querySelector('time').textContent);
