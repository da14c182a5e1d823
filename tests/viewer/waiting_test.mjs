// The viewer page in the line of a session server, against fake servers.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFindings, leaveAndGoBack, until } from './page.mjs';
import { LANDSCAPE, PHONE, WORLD, cloud, enterAddress, openViewer, state, status } from './viewer_page.mjs';

const TITLE = 'Webots simulation viewer';
const clean = async (page, where) => assert.deepEqual(await accessibilityFindings(page), [], where);
const title = (page, text) => page.waitForFunction((wanted) => document.title === wanted, text);
const hide = (page, hidden) => page.evaluate((value) => {
  Object.defineProperty(document, 'hidden', { value, configurable: true });
  document.dispatchEvent(new Event('visibilitychange'));
}, hidden);
const lamp = (page, text) => page.waitForFunction((wanted) => document.getElementById('light-text').textContent === wanted, text);
const starts = async () => (await cloud.get('started')).map((text) => JSON.parse(text));

// A page whose machines are all busy, and where one may wait.
async function openBusy(t, options) {
  await cloud.set('defaults', { waiting: true });
  await cloud.set('relays', true);
  await cloud.set('place', [3, '-', '-']);
  await cloud.call('set_available', 'full');
  return openViewer(t, options);
}

async function waitInLine(t, options) {
  const page = await openBusy(t, options);
  await page.click('#start');
  await state(page, 'waiting');
  return page;
}

test('where one may wait, the lamp says so, and a start waits', async (t) => {
  const page = await openBusy(t);
  await lamp(page, 'Every seat is taken. You can wait in line.');
  assert.ok(await page.isEnabled('#start'));
  await page.click('#start');
  await status(page, 'You are number 4 in line. Every seat is taken. There is no estimate of the wait yet.');
  assert.equal((await starts())[0].start.waiting, true);
  assert.equal(await page.isVisible('#status.problem'), false);
});

test('the lamp of another session server, and of one without a line, says that no machine is free', async (t) => {
  const page = await openBusy(t);
  await page.waitForSelector('body[data-room]');
  await enterAddress(page, `${(await cloud.get('page')).replace('/viewer/', '')}/other/session?url=${WORLD}`);
  await page.locator('#connect-to').dispatchEvent('change');
  await page.waitForSelector('body:not([data-room])');
  await cloud.set('defaults', {});
  const plain = await openViewer(t);
  assert.equal(await plain.textContent('#light-text'), 'Every seat is taken.');
});

test('the connection for a start is there at the first sign of a person, and is the one that the start takes', async (t) => {
  await cloud.set('defaults', { waiting: true });
  await cloud.set('relays', true);
  const page = await openViewer(t, { viewport: { width: 1280, height: 720 } });
  await page.waitForSelector('body[data-room]');
  await hide(page, true);
  await page.mouse.move(3, 3);
  assert.equal(await cloud.get('line'), 0);
  await hide(page, false);
  await page.mouse.move(6, 6);
  await until(async () => await cloud.get('line') === 1, 'the connection');
  await page.mouse.move(9, 9);
  await page.keyboard.press('Tab');
  await page.click('#start');
  await state(page, 'running');
  assert.equal((await starts()).length, 1);
  assert.equal(await cloud.get('line'), 1);
});

// The table "What a site is" of docs/visitors.md, and what servers say that are not ours.
const SITES = {
  free: ['available', 'A machine is free.'],
  busy: ['full', 'The machines are busy: a start may have to wait. You can wait in line.'],
  full: ['full', 'Every seat is taken. You can wait in line.'],
  draining: ['full', 'No machine takes new simulations at the moment.'],
  down: ['full', 'No machine is running.'],
  unknown: ['unknown', 'It is not known whether a machine is free.'],
  1: ['available', 'A machine is free.'],
  0: ['full', 'No machine is free. You can wait in line.'],
};

test('the lamp says what the site is, and a place in the line says the same', async (t) => {
  const page = await openBusy(t);
  await page.waitForSelector('body[data-room]');
  for (const [site, [availability, text]] of Object.entries(SITES)) {
    await cloud.call('set_available', site);
    await lamp(page, text);
    assert.equal(await page.getAttribute('body', 'data-availability'), availability, site);
  }
  await page.click('#start');
  await state(page, 'waiting');
  const places = {
    room: 'You are number 3 in line. There are free seats, but the machines are too busy for this world.',
    busy: 'You are number 3 in line. The machines are busy: a start may have to wait.',
    suitable: 'You are number 3 in line. No machine that can run this world is free.',
    draining: 'You are number 3 in line. No machine takes new simulations at the moment.',
    down: 'You are number 3 in line. No machine is running. Please tell the operator of this site.',
  };
  for (const [why, text] of Object.entries(places)) {
    await cloud.call('move', 2, '-', `- ${why}`);
    await status(page, text);
    await cloud.call('set_available', why === 'room' || why === 'suitable' ? 'busy' : why);
    await page.waitForSelector('body:not([data-availability="available"])');
  }
});

test('place and estimate are told, and the simulation starts by itself', async (t) => {
  const page = await waitInLine(t);
  await title(page, `No. 4 in line – ${TITLE}`);
  assert.equal(await page.textContent('#start'), 'Leave the line');
  assert.equal(await page.textContent('#no-picture'), 'The simulation starts by itself when it is your turn. You can look at other tabs meanwhile.');
  await cloud.call('move', 1, 60, 240);
  await status(page, 'You are number 2 in line. Every seat is taken. About 1 to 4 minutes.');
  await cloud.call('move', 0);
  await status(page, 'You are next.');
  await title(page, `Next in line – ${TITLE}`);
  await cloud.call('take_turn');
  await state(page, 'running');
  await title(page, TITLE);
  assert.equal(await page.isVisible('#start'), false);
});

test('a screen reader hears the place at once, and what follows ten seconds later', async (t) => {
  const page = await waitInLine(t);
  assert.equal(await page.getAttribute('#status', 'aria-live'), 'off');
  assert.match(await page.textContent('#place-said'), /^You are number 4 in line\. .* starts by itself/);
  const begin = Date.now();
  for (const ahead of [2, 1, 0])
    await cloud.call('move', ahead);
  await status(page, 'You are next.');
  const said = await page.waitForFunction(() => {
    const { textContent } = document.getElementById('place-said');
    return textContent.startsWith('You are number 4') ? false : textContent;
  });
  assert.equal(await said.jsonValue(), 'You are next. Every seat is taken.');
  assert.ok(Date.now() - begin > 8000, `${Date.now() - begin} ms`);
  await cloud.call('take_turn');
  await state(page, 'running');
  assert.equal(await page.getAttribute('#status', 'aria-live'), 'polite');
  assert.equal(await page.textContent('#place-said'), '');
});

test('a page that is hidden tells its place in the title, and then that it has started', async (t) => {
  const page = await waitInLine(t);
  await hide(page, true);
  await cloud.call('move', 1);
  await title(page, `No. 2 in line – ${TITLE}`);
  await cloud.call('take_turn');
  await title(page, `Started – ${TITLE}`);
  await hide(page, false);
  await title(page, TITLE);
});

test('a connection that breaks in the line is restored by itself, and the place is kept', async (t) => {
  const page = await waitInLine(t);
  await cloud.call('close', 'line', 1012); // the server is restarted
  await cloud.call('shut', 'session');
  await status(page, 'Returning to the line: your place is kept for');
  assert.equal(await page.isVisible('#status.problem'), false);
  assert.equal(await page.getAttribute('body', 'data-state'), 'waiting');
  await title(page, `Waiting – ${TITLE}`);
  await clean(page, 'returning');
  await cloud.call('open', 'session');
  await status(page, 'You are number 4 in line.');
  assert.equal((await starts()).at(-1).start.waitingTicket, 'ticket-1');
});

test('a reloaded page, and one to which Back leads, is in its place again; one that gave its place up is not', async (t) => {
  const page = await waitInLine(t);
  for (const [times, again] of [[1, () => page.reload()], [2, () => leaveAndGoBack(page)]]) {
    await again();
    await until(async () => (await starts()).length === 1 + times, 'the line');
    await state(page, 'waiting');
    await status(page, 'You are number 4 in line.');
    assert.equal((await starts())[times].start.waitingTicket, `ticket-${times}`);
  }
  assert.ok((await cloud.get('requests')).filter((path) => path.startsWith('/session?')).length === 0, 'the server that keeps the line takes starts');
  await page.click('#start');
  await state(page, 'idle');
  await status(page, 'You have left the line.');
  await title(page, TITLE);
  await until(async () => await cloud.get('line') === 0, 'the end of the connection');
  assert.equal((await cloud.get('farewells')).at(-1), 1000);
  await page.reload();
  await page.waitForSelector('body[data-room]');
  await state(page, 'idle');
  assert.equal((await starts()).length, 3);
});

test('a refusal on /client is taken back when a machine is free, also on a hidden page', async (t) => {
  await cloud.set('relays', true);
  await cloud.call('set_available', '0');
  await cloud.set('launch', ['loading: Error: No simulation server available at the moment.']);
  const page = await openViewer(t);
  await page.click('#start');
  await status(page, 'No machine is free at the moment.');
  await cloud.call('close', 'line');
  await state(page, 'failed');
  await status(page, 'This page will tell you when there is one.');
  await hide(page, true);
  await cloud.call('set_available', '1');
  await status(page, 'A machine is available now');
  assert.equal(await page.isVisible('#status.problem'), false);
  await title(page, `A machine is free – ${TITLE}`);
  await cloud.set('launch', null);
  await hide(page, false);
  await page.click('#start');
  await state(page, 'running');
});

test('a refusal is taken back also where it was not known whether a machine is free', async (t) => {
  const page = await openViewer(t);
  await cloud.set('answer', 'Error: no simulation server available at the moment.');
  await page.evaluate(() => { document.body.dataset.availability = 'unknown'; }); // its socket is broken
  await page.click('#start');
  await state(page, 'failed');
  assert.equal(await page.textContent('#status'), 'No machine is free at the moment. Please try again in a few minutes.');
  await cloud.call('set_available', '1');
  await status(page, 'A machine is available now');
});

test('the line is said in every language, and again when another one is chosen', async (t) => {
  const page = await waitInLine(t, { ...PHONE, locale: 'de-DE' });
  await status(page, 'Sie sind Nummer 4 in der Warteschlange.');
  await page.selectOption('#language', 'zh');
  await status(page, '您排在第4位。');
  assert.match(await page.title(), /^第4位 – /);
  for (const language of ['en', 'de', 'es', 'fr', 'it', 'ja', 'zh']) {
    await page.selectOption('#language', language);
    await page.waitForSelector(`html[lang="${language}"]`);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), PHONE.viewport.width, language);
  }
});

for (const [name, options] of Object.entries({ 'wide and light': {}, 'upright and dark': { ...PHONE, colorScheme: 'dark' }, 'on its side': LANDSCAPE })) {
  test(`axe-core finds nothing against the line ${name}`, async (t) => {
    const page = await openBusy(t, options);
    await page.waitForSelector('body[data-room]');
    await clean(page, 'busy');
    await page.click('#start');
    await state(page, 'waiting');
    await clean(page, 'waiting');
    await cloud.call('move', 0, 60, 240);
    await status(page, 'You are next.');
    await clean(page, 'next');
  });
}
