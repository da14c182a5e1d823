// What people press until they have what they came for: five tasks with real servers on a site of one machine with one seat, from the address of
// the site on. docs/visitors.md has the table. Fields that are filled in are counted apart.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { openBrowser, openPage, until } from '../viewer/page.mjs';
import { PASSWORD, WORLD, shown, startClassSite, state } from './class_site.mjs';

const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true };

const { server } = await startClassSite({
  session: (ports) => ({ simulationServers: [`localhost:${ports.simulation}`], relay: true, viewerUrl: WORLD }),
  simulation: () => ({ maxConnections: 1 }),
});
const browser = await openBrowser();

// A person who presses and fills in, and both are counted.
async function person(t, options) {
  const page = await openPage(t, browser, options);
  let clicks = 0;
  let fields = 0;
  return {
    page,
    counts: () => ({ clicks, fields }),
    async press(selector) {
      await page.locator(selector).first().click();
      ++clicks;
    },
    async fill(selector, text) {
      await page.locator(selector).fill(text);
      ++fields;
    },
  };
}

const CARD = '.world[href*="arena.wbt"]';

async function start(one) {
  await one.page.goto(server);
  await one.page.waitForSelector(CARD);
  await one.press(CARD);
}

async function end({ page }) {
  await page.click('#quit');
  await page.waitForSelector('body[data-state="ended"], body[data-state="idle"]');
  await page.close();
}

test('a robot moves after one click', async (t) => {
  const visitor = await person(t);
  await start(visitor);
  await state(visitor.page, 'running');
  await visitor.page.waitForSelector('#picture[data-live]');
  assert.deepEqual(visitor.counts(), { clicks: 1, fields: 0 });
  await end(visitor);
});

test('a simulation is shared with two', async (t) => {
  const visitor = await person(t);
  await start(visitor);
  await state(visitor.page, 'running');
  const before = visitor.counts().clicks;
  await visitor.press('#share');
  await visitor.page.waitForSelector('#sharing[open] #qr svg, #sharing[open] #link');
  await visitor.press('#copy');
  assert.equal(visitor.counts().clicks - before, 2);
  await visitor.page.keyboard.press('Escape');
  await end(visitor);
});

test('who waits reads why, without a click', async (t) => {
  const first = await person(t);
  await start(first);
  await state(first.page, 'running');
  const second = await person(t);
  await start(second);
  await state(second.page, 'waiting');
  assert.match(await second.page.textContent('#status'), /^You are next\. Every seat is taken\./);
  assert.deepEqual(second.counts(), { clicks: 1, fields: 0 });
  await second.page.close();
  await end(first);
});

test('a class is opened with three, and joined by phone with one', async (t) => {
  const teacher = await person(t);
  await teacher.page.goto(server);
  await teacher.press('a[href="../../class/"]');
  await shown(teacher.page, 'doors');
  await teacher.press('#doors a[href="./#teach"]');
  await shown(teacher.page, 'open');
  await teacher.fill('#password', PASSWORD);
  await teacher.press('#open-class'); // for the world of the site
  await shown(teacher.page, 'lesson');
  assert.deepEqual(teacher.counts(), { clicks: 3, fields: 1 });

  const student = await person(t, PHONE);
  await student.page.goto(await teacher.page.getAttribute('#link', 'href')); // the picture of it, which the phone has seen
  await shown(student.page, 'name');
  await student.fill('#name', 'Ada');
  await student.press('#join');
  await state(student.page, 'running');
  assert.deepEqual(student.counts(), { clicks: 1, fields: 1 });
});
