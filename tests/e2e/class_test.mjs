// A lesson with the real servers and the demo simulator: a teacher and three students in browsers, and 27 more, who send pictures.
// (With 30 simulations, and measured: full_class.mjs.)

import assert from 'node:assert/strict';
import { readdir } from 'node:fs/promises';
import { test } from 'node:test';

import { openBrowser, openPage, until } from '../viewer/page.mjs';
import { WORLD, assertNothingIsKept, attend, fillForm, openClass, press, says, shown, simulated, startClassSite, state, tellAll, tile, time } from './class_site.mjs';

const OTHER_WORLD = WORLD.replace('arena', 'corridor');
const NAMES = ['Ada', 'Grace', 'Hedy'];
const MORE = 27;

const site = await startClassSite({
  session: (ports) => ({ simulationServers: [`localhost:${ports.simulation}`] }),
  simulation: () => ({ gateway: true }),
});
const { server } = site;

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
  await fillForm(teacher);
  await teacher.fill('#password', 'wrong');
  await teacher.click('#open-class');
  await teacher.waitForSelector('#open-problem:not(:empty)');
  await fillForm(teacher);
  const { code, link } = await openClass(teacher);
  assert.equal(link, `${server}/class/${code}`);

  // Everybody comes, and is on the wall with a picture.
  const pages = [];
  for (const name of NAMES)
    pages.push(await attend(t, browser, link, name));
  const more = await joinMore(t, browser, code);
  await teacher.waitForFunction((count) => document.querySelectorAll('.tile[data-state="running"][data-pictured]').length === count, NAMES.length + MORE);
  assert.deepEqual((await teacher.locator('.name').allTextContents()).slice(0, 4), [...NAMES, 'Student 1']);

  // What the teacher says and does reaches all.
  await tellAll(teacher, 'Good morning!');
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
  await press(teacher, 'Grace', 'reset');
  await until(async () => await time(teacher, 'Grace') === '0:00:00', 'a new beginning');

  // Looking at one does not disturb.
  await tile(teacher, 'Ada').locator('.look').click();
  await teacher.waitForSelector('#look-view [data-live]');
  const before = await simulated(pages[0]);
  await until(async () => await simulated(pages[0]) !== before, 'the simulation to go on');
  await teacher.click('#look-back');
  await shown(teacher, 'lesson');

  // Who reloads is back.
  await pages[1].reload();
  await state(pages[1], 'paused');
  await teacher.reload();
  await shown(teacher, 'lesson');
  await teacher.waitForFunction((count) => document.querySelectorAll('.tile[data-pictured]').length === count, NAMES.length + MORE);
  await says(teacher, '#fetch-status', '1 of 1');

  // One ends, and starts again; a hand is raised, and lowered.
  await press(teacher, 'Ada', 'end');
  await teacher.click('#question-yes');
  await state(pages[0], 'ended');
  await teacher.click('#for-all [data-do="start"]');
  await state(pages[0], 'running');
  await pages[1].click('[data-sign="hand"]');
  await until(async () => await teacher.locator('.name').first().textContent() === 'Grace', 'Grace to be the first');
  await press(teacher, 'Grace', 'lower');
  await pages[1].waitForSelector('[data-sign="hand"][aria-pressed="false"]');

  // Another world is started by all.
  await teacher.click('#for-all [data-do="world"]');
  await teacher.fill('#another-world', OTHER_WORLD);
  await teacher.click('#another .primary');
  await says(teacher, '#class-world', OTHER_WORLD);
  for (const page of pages)
    await until(async () => (await page.evaluate(() => document.querySelector('#simulation > div').shadowRoot.textContent)).includes('corridor'), 'the corridor');
  for (const page of pages)
    await state(page, 'running');

  // One leaves, one is removed.
  await pages[2].click('#leave');
  await until(async () => await tile(teacher, 'Hedy').count() === 0, 'Hedy to be gone');
  await press(teacher, 'Student 27', 'remove');
  await teacher.click('#question-yes');
  await more.waitForFunction(() => globalThis.students[26].told.some(({ closed }) => closed === 'removed'));

  await teacher.click('#close-class');
  await teacher.click('#question-yes');
  await shown(teacher, 'over');
  for (const page of pages.slice(0, 2))
    await shown(page, 'over');
  await more.waitForFunction(() => globalThis.students.every(({ socket }) => socket.readyState === WebSocket.CLOSED));
  await until(async () => (await readdir(site.instances)).length === 0, 'the end of all simulations');
  await assertNothingIsKept(site, [...NAMES, code, 'Good morning']);
});
