// Pictures of the class page in its states, wide and on a telephone, light and dark, to be looked at:
//
//   FOLDER=<folder> tests/support/run_page_test.sh tests/viewer/class_screenshots.mjs

import { mkdir } from 'node:fs/promises';
import { test } from 'node:test';
import { openPage } from './page.mjs';
import { CODE, LANDSCAPE, PHONE, address, browser, cloud, fillForm, jpeg, openClass, openForm, runSimulation, join, says, shown, state, student, tell, tile } from './class_page.mjs';

const { FOLDER = '/tmp/class_screenshots' } = process.env;
const SIZES = { wide: { viewport: { width: 1280, height: 800 } }, phone: PHONE };
const STATES = ['running', 'paused', 'waiting', 'lost', 'away', 'hidden', 'starting', 'joined', 'ended'];
const NAMES = ['Ada', 'Alan', 'Barbara', 'Claude', 'Donald', 'Edsger', 'Frances Elizabeth Holberton-Snyder', 'Grace', 'Hedy', 'Ida', 'John', 'Katherine'];

await mkdir(FOLDER, { recursive: true });

async function pictures(page, count) {
  for (let id = 1; id <= count; ++id)
    await tell({ picture: { id, jpeg: await jpeg(page, `hsl(${id * 37} 60% 60%)`) } });
}

async function wallOfTwelve() {
  const simulator = await cloud.call('address', 'simulator');
  return NAMES.map((name, i) => student(i + 1, name, { state: STATES[i % STATES.length], time: i * 12345, simulator }));
}

for (const [size, viewport] of Object.entries(SIZES)) {
  for (const [colorScheme, locale] of [['light', 'en-US'], ['dark', 'de-DE']]) {
    const options = { ...viewport, colorScheme, locale };
    const shoot = (page, name, more = {}) => page.screenshot({ path: `${FOLDER}/${size}-${colorScheme}-${name}.png`, scale: 'css', ...more });

    test(`doors ${size} ${colorScheme}`, async (t) => {
      const page = await openPage(t, browser, options);
      await page.goto(await address());
      await shown(page, 'doors');
      await shoot(page, 'doors');
      await page.goto(await address(CODE));
      await shown(page, 'name');
      await cloud.set('class_answers', { join: [{ error: 'code', text: '' }] });
      await page.fill('#name', 'Ada');
      await page.click('#join');
      await page.waitForSelector('#name-problem:not(:empty)');
      await shoot(page, 'name');
    });

    test(`student ${size} ${colorScheme}`, async (t) => {
      const page = await runSimulation(t, options);
      await tell({ do: 'message', text: 'Please look at the screen in front: the next task is to follow the line.' });
      await page.waitForSelector('#told:not([hidden])');
      await shoot(page, 'student');
      if (size === 'phone') {
        await page.setViewportSize(LANDSCAPE.viewport);
        await shoot(page, 'student-on-its-side');
      }
      await tell({ closed: 'teacher' });
      await shown(page, 'over');
      await shoot(page, 'over');
    });

    test(`student waits ${size} ${colorScheme}`, async (t) => {
      await cloud.set('answer', 'Error: no simulation server available');
      const page = await join(t, options);
      await state(page, 'waiting');
      await shoot(page, 'student-waits');
    });

    test(`student in line ${size} ${colorScheme}`, async (t) => {
      await cloud.set('relays', true);
      await cloud.set('place', [3, 60, 240]);
      const page = await join(t, options);
      await state(page, 'waiting');
      await page.waitForSelector('#place:not([hidden])');
      await shoot(page, 'student-in-line');
    });

    test(`teacher ${size} ${colorScheme}`, async (t) => {
      const form = await openForm(t, options);
      await cloud.set('class_answers', { teach: [{ error: 'password', text: '' }] });
      await fillForm(form);
      await form.click('#open-class');
      await form.waitForSelector('#open-problem:not(:empty)');
      await shoot(form, 'open');
      await cloud.set('fetching', ['loading: Receiving objects: 40% (4/10)']);
      const page = await openClass(t, options);
      await shoot(page, 'lesson-empty', { fullPage: true });
    });

    test(`wall ${size} ${colorScheme}`, async (t) => {
      await cloud.set('fetching', ['reason: {"code":"no-repository","values":{"name":"owner/repository"}}', 'loading: Error: Repository owner/repository does not exist or is private.']);
      const page = await openClass(t, { ...options, students: await wallOfTwelve(), more: { seats: 12, reserved: 12 } });
      await pictures(page, 5);
      await says(page, '#fetch-faults', ':');
      await shoot(page, 'wall', { fullPage: true });
      await tile(page, 2).locator('summary').click();
      await tile(page, 2).scrollIntoViewIfNeeded();
      await shoot(page, 'wall-menu');
      await page.keyboard.press('Escape');
      await page.click('#for-all [data-do="end"]');
      await shoot(page, 'question');
      await page.keyboard.press('Escape');
      await page.click('#for-all [data-do="message"]');
      await shoot(page, 'message');
      await page.keyboard.press('Escape');
      await page.click('#project');
      await page.waitForFunction(() => document.fullscreenElement !== null);
      await shoot(page, 'projector');
      await page.click('#project');
      await page.waitForFunction(() => document.fullscreenElement === null);
      await tile(page, 1).locator('.look').click();
      await page.waitForSelector('#look-view [data-live]');
      await shoot(page, 'look');
    });
  }
}
