// A lesson as it is: a teacher and 30 students, each in a page of a real browser, each with a simulation of the demo simulator, and all of
// it on this machine. It says what the teacher's wall costs.
//
//   WEBOTS_CLOUD_BIN=build/release/bin [STUDENTS=30] [SECONDS_MEASURED=20] tests/support/run_page_test.sh tests/e2e/full_class.mjs
//
// Not in the suite: it takes some minutes, and both cores.

import assert from 'node:assert/strict';
import { readFile, readdir } from 'node:fs/promises';
import { test } from 'node:test';
import { setTimeout as pass } from 'node:timers/promises';

import { openBrowser, openPage } from '../viewer/page.mjs';
import { assertNothingIsKept, attend, fillForm, openClass, press, says, shown, simulated, startClassSite, state, tellAll, tile, time, write } from './class_site.mjs';

const STUDENTS = Number(process.env.STUDENTS ?? 30);
const MEASURED_MS = 1000 * Number(process.env.SECONDS_MEASURED ?? 20);
const SETTLING_MS = 3000;
const PATIENCE_MS = 120000;
const AT_ONCE = 5; // who come in at the same time
const PHONE = { viewport: { width: 360, height: 640 }, patience: PATIENCE_MS };
const CLOCK_TICKS = 100; // a second, in /proc
const FIRST_NAMES = ['Ada', 'Alan', 'Barbara', 'Charles', 'Donald', 'Edsger', 'Frances', 'Grace', 'Hedy', 'Ida'];

// As config/*/lan.json: one address for all.
const site = await startClassSite({
  session: ({ simulation }) => ({ server: '*', portRewrite: true, relay: true, simulationServers: [{ address: `*/${simulation}`, internal: `127.0.0.1:${simulation}` }] }),
  simulation: () => ({ server: '*', portRewrite: true, listenAddress: '127.0.0.1' }),
});

async function until(condition, what) {
  const deadline = Date.now() + PATIENCE_MS;
  while (!await condition()) {
    assert.ok(Date.now() < deadline, `waited in vain for ${what}`);
    await pass(100);
  }
}

// The command lines of all processes that the servers have started, and their own.
async function processes() {
  const numbers = (await readdir('/proc')).filter((name) => /^\d+$/.test(name));
  const lines = await Promise.all(numbers.map(async (number) => {
    const environment = await readFile(`/proc/${number}/environ`, 'latin1').catch(() => '');
    return environment.includes(site.folder) ? readFile(`/proc/${number}/cmdline`, 'latin1').catch(() => '') : '';
  }));
  return lines.filter((line) => line !== '');
}

// Those that guard or contain a simulator name it as well, but not first.
const simulators = async () => (await processes()).filter((line) => line.split('\0')[0].endsWith('/webots-demo-simulator')).length;

async function processorSeconds(pid) {
  const fields = (await readFile(`/proc/${pid}/stat`, 'latin1')).split(') ').pop().split(' ');
  return (Number(fields[11]) + Number(fields[12])) / CLOCK_TICKS;
}

// Counts what arrives on a page's socket of the class: {bytes, pictures}. Bytes are those of the frames, without TCP and IP.
function countArrivals(page) {
  const arrived = { bytes: 0, pictures: 0 };
  page.on('websocket', (socket) => new URL(socket.url()).pathname === '/class' && socket.on('framereceived', ({ payload }) => {
    const size = Buffer.byteLength(payload);
    arrived.bytes += size + (size < 126 ? 2 : size < 65536 ? 4 : 10);
    arrived.pictures += payload.startsWith('{"picture"') ? 1 : 0;
  }));
  return arrived;
}

async function measure(arrived) {
  await pass(SETTLING_MS);
  const figures = async () => ({ ...arrived, session: await processorSeconds(site.session.pid), simulation: await processorSeconds(site.simulation.pid), at: performance.now() });
  const before = await figures();
  await pass(MEASURED_MS);
  const later = await figures();
  const rate = (name) => 1000 * (later[name] - before[name]) / (later.at - before.at);
  return { megabits: 8e-6 * rate('bytes'), pictures: rate('pictures'), session: 100 * rate('session'), simulation: 100 * rate('simulation') };
}

const sayFigures = (t, what, { megabits, pictures, session, simulation }) => t.diagnostic(`${what}: ${megabits.toFixed(2)} Mbit/s and ${pictures.toFixed(1)} pictures a second `
  + `to the teacher; session server ${session.toFixed(1)} % of a core, simulation server ${simulation.toFixed(1)} %`);

// As when the teacher looks at another tab.
const setHidden = (page, hidden) => page.evaluate((value) => {
  Object.defineProperty(document, 'hidden', { configurable: true, get: () => value });
  document.dispatchEvent(new Event('visibilitychange'));
}, hidden);

const thumbnails = (teacher) => teacher.evaluate(() => [...document.querySelectorAll('.tile canvas')].map((canvas) => canvas.toDataURL()));

const count = (teacher, selector) => teacher.locator(selector).count();

async function thumbnailsChange(teacher, count) {
  const before = await thumbnails(teacher);
  assert.equal(before.length, STUDENTS);
  const changed = new Set();
  await until(async () => {
    (await thumbnails(teacher)).forEach((picture, i) => picture !== before[i] && changed.add(i));
    return changed.size === count;
  }, `new pictures of ${count}`);
}

test(`a lesson of ${STUDENTS} students, each with a simulation`, { timeout: 1800000 }, async (t) => {
  const browser = await openBrowser();
  const teacher = await openPage(t, browser, { patience: PATIENCE_MS });
  const arrived = countArrivals(teacher);
  await teacher.goto(`${site.server}/class/#teach`);
  await shown(teacher, 'open');
  await fillForm(teacher);
  await teacher.fill('#seats', String(STUDENTS));
  const { code, link } = await openClass(teacher);

  const names = Array.from({ length: STUDENTS }, (_, i) => `${FIRST_NAMES[i % FIRST_NAMES.length]} ${1 + Math.floor(i / FIRST_NAMES.length)}`).sort();
  const began = performance.now();
  const pages = [];
  const come = async (name) => {
    const page = await attend(t, browser, link, name, PHONE);
    await page.locator('#simulation').getByRole('button', { name: 'Pause', exact: true }).click(); // else the pages of those who are there leave no time for those who come
    await state(page, 'paused');
    return page;
  };
  while (pages.length < STUDENTS)
    pages.push(...await Promise.all(names.slice(pages.length, pages.length + AT_ONCE).map(come)));
  const all = (action) => Promise.all(pages.map(action));
  t.diagnostic(`${STUDENTS} simulations have started after ${((performance.now() - began) / 1000).toFixed(0)} s`);
  assert.equal(await simulators(), STUDENTS);

  // All are on the wall, live.
  await teacher.click('#for-all [data-do="run"]');
  await until(async () => await count(teacher, '.tile[data-state="running"][data-pictured]') === STUDENTS, 'a picture of everybody');
  assert.deepEqual(await teacher.locator('.tile .name').allTextContents(), names);
  await thumbnailsChange(teacher, STUDENTS);

  sayFigures(t, 'the wall is open', await measure(arrived));
  await setHidden(teacher, true);
  sayFigures(t, 'the wall is closed', await measure(arrived));
  await setHidden(teacher, false);
  sayFigures(t, 'the wall is open again', await measure(arrived));
  await thumbnailsChange(teacher, STUDENTS);
  assert.equal(await count(teacher, '.tile[data-state="running"]'), STUDENTS);

  // For all.
  const [first, second, third] = names;
  await tellAll(teacher, 'Good morning, everybody');
  await all((page) => says(page, '#told-text', 'Good morning, everybody'));
  await teacher.click('#for-all [data-do="pause"]');
  await all((page) => state(page, 'paused'));
  await until(async () => await count(teacher, '.tile[data-state="paused"]') === STUDENTS, 'a wall of paused simulations');
  const stopped = await all(simulated);
  await pass(SETTLING_MS);
  assert.deepEqual(await all(simulated), stopped, 'no time passes');
  await teacher.click('#for-all [data-do="reset"]');
  await until(async () => (await teacher.locator('.tile .time').allTextContents()).every((text) => text === '0:00:00'), 'a new beginning for all');

  // For one.
  await tile(teacher, first).locator('.toggle').click();
  await state(pages[0], 'running');
  await until(async () => await time(teacher, first) !== '0:00:00', 'the time of one');
  assert.equal(await count(teacher, '.tile[data-state="running"]'), 1);
  await tile(teacher, first).locator('.toggle').click();
  await state(pages[0], 'paused');
  await press(teacher, first, 'reset');
  await until(async () => await time(teacher, first) === '0:00:00', 'a new beginning for one');
  await press(teacher, second, 'message');
  await write(teacher, 'Only you');
  await says(pages[1], '#told-text', 'Only you');
  assert.deepEqual(new Set(await Promise.all([...pages.slice(0, 1), ...pages.slice(2)].map((page) => page.textContent('#told-text')))), new Set(['Good morning, everybody']));

  // One is shown to everybody, and is not disturbed.
  await tile(teacher, second).locator('.toggle').click();
  await state(pages[1], 'running');
  await tile(teacher, second).locator('.look').click();
  await teacher.waitForSelector('#look-view [data-live]');
  assert.equal(await teacher.textContent('#look-name'), second);
  const moment = await simulated(pages[1]);
  await until(async () => await simulated(pages[1]) !== moment, 'the simulation to go on');
  assert.equal(await pages[1].getAttribute('body', 'data-state'), 'running');
  await teacher.click('#look-back');
  await shown(teacher, 'lesson');
  await thumbnailsChange(teacher, 1);

  // One ends, then all.
  await press(teacher, third, 'end');
  await teacher.click('#question-yes');
  await state(pages[2], 'ended');
  await until(async () => await simulators() === STUDENTS - 1, 'the end of one');
  assert.equal(await count(teacher, '.tile[data-state="running"]'), 1);
  assert.equal(await count(teacher, '.tile[data-state="paused"]'), STUDENTS - 2);
  await teacher.click('#for-all [data-do="end"]');
  await teacher.click('#question-yes');
  await all((page) => state(page, 'ended'));
  await until(async () => await simulators() === 0, 'the end of all simulators');
  await until(async () => (await readdir(site.instances)).length === 0, 'nothing to be left of the simulations');

  await teacher.click('#close-class');
  await teacher.click('#question-yes');
  await shown(teacher, 'over');
  await all((page) => shown(page, 'over'));
  const secrets = [...names, code, 'Good morning', 'Only you'];
  for (const page of [teacher, ...pages]) {
    const kept = await page.evaluate(() => JSON.stringify([{ ...sessionStorage }, { ...localStorage }, document.cookie]));
    assert.deepEqual(secrets.filter((secret) => kept.includes(secret)), []);
  }
  await site.session.stop();
  await site.simulation.stop();
  assert.deepEqual(await processes(), []);
  await assertNothingIsKept(site, secrets);
});
