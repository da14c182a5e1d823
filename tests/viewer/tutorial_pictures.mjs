// Makes the pictures of docs/tutorial.md, of the site that runs on this machine, as the tutorial starts it:
//
//   ./server.sh start && tests/support/run_page_test.sh tests/viewer/tutorial_pictures.mjs
//
// Needs the package pngquant. Without Webots on the machine the pictures show the demo simulator, as they are meant to.

import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { saveDocumentPicture } from './document_picture.mjs';
import { openBrowser, openPage as openTestPage } from './page.mjs';

const SITE = 'http://localhost:1999';
const VIEW = { viewport: { width: 1200, height: 740 } };
const NAMES = ['Ada', 'Alan', 'Grace', 'Hedy'];
const SHOWN_MS = 2000; // simulated time that passes before a picture is taken
const PATIENCE_MS = 120000; // A machine that is busy is offered to nobody.

const browser = await openBrowser();

async function openPage(t, options) {
  const page = await openTestPage(t, browser, options);
  page.setDefaultTimeout(PATIENCE_MS);
  return page;
}

const simulated = (page) => page.waitForFunction((time) => Number(document.body.dataset.time) > time, SHOWN_MS);

test('a simulation, and the monitor while it runs', async (t) => {
  const page = await openPage(t, VIEW);
  await page.goto(SITE);
  await page.waitForSelector('body[data-availability="available"][data-worlds]:not([data-worlds="0"], [data-worlds="1"])');
  await saveDocumentPicture(page, 'tutorial-start');
  await page.locator('.world').first().click();
  await page.waitForSelector('#picture[data-live]');
  await simulated(page);
  await saveDocumentPicture(page, 'tutorial-run');

  const monitor = await openPage(t, VIEW);
  await monitor.goto(`${SITE}/monitor`);
  await monitor.waitForFunction(() => document.body.textContent.includes('localhost:2000'));
  await saveDocumentPicture(monitor, 'tutorial-monitor');
});

test('a class', async (t) => {
  const teacher = await openPage(t, { viewport: { width: 1024, height: 900 } });
  await teacher.goto(`${SITE}/class/#teach`);
  const password = await readFile(new URL('../../log/.teacher-password', import.meta.url), 'utf-8');
  await teacher.fill('#password', password.trim());
  await teacher.fill('#world', 'local:/demo_projects/robots/blob/main/worlds/arena.wbt');
  await teacher.fill('#seats', `${NAMES.length}`);
  await teacher.click('#open-class');
  await teacher.waitForSelector('body[data-shown="lesson"]');
  const code = await teacher.textContent('#class-code');
  for (const name of NAMES) {
    const student = await openPage(t, VIEW);
    await student.goto(`${SITE}/class/${code.trim()}`);
    await student.fill('#name', name);
    await student.click('#join');
    await student.waitForSelector('#simulation [data-live]');
  }
  await teacher.waitForFunction((count) => document.querySelectorAll('#wall [data-pictured]').length === count, NAMES.length);
  await teacher.waitForFunction((running) => document.getElementById('summary').textContent.includes(running), `${NAMES.length} running`);
  await saveDocumentPicture(teacher.locator('#wall-part'), 'tutorial-class');
  await teacher.click('#close-class');
});

test('a program that does what its lesson asks for', async (t) => {
  const page = await openPage(t, { viewport: { width: 1280, height: 720 } });
  await page.goto(SITE);
  await page.locator('.world[href*="lesson_1"]').click();
  await page.waitForSelector('#picture[data-live]');
  await page.waitForSelector('#programs .cm-line');
  for (const wheel of ['left', 'right']) {
    await page.locator('#programs .cm-line', { hasText: `${wheel}.setVelocity(0)` }).click();
    await page.keyboard.press('End');
    await page.keyboard.press('Backspace');
    await page.keyboard.press('Backspace');
    await page.keyboard.type('10)');
    await page.keyboard.press('Home');
  }
  await page.keyboard.press('Control+s');
  await page.waitForFunction(() => document.getElementById('console').textContent.includes('You did it'));
  await page.click('#show-console'); // the picture is larger without it
  if (await page.isVisible('#output'))
    await page.click('#show-console');
  await saveDocumentPicture(page, 'program');
});
