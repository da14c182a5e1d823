// Pictures of the class page in its states, on two laptops and a telephone, light and dark, to be looked at:
//
//   FOLDER=<folder> tests/support/run_page_test.sh tests/viewer/class_screenshots.mjs
//
// ONLY=<a part of a name, as "phone light">: those alone.

import { mkdir } from 'node:fs/promises';
import { test } from 'node:test';
import { openPage } from './page.mjs';
import { CODE, PHONE, address, browser, cloud, fillForm, jpeg, openClass, openForm, runSimulation, join, says, shown, state, student, tell, tile } from './class_page.mjs';

const { FOLDER = '/tmp/class_screenshots', ONLY = '' } = process.env;
const SIZES = { small: { viewport: { width: 1280, height: 720 } }, wide: { viewport: { width: 1440, height: 900 } },
  phone: { ...PHONE, viewport: { width: 390, height: 844 } }, side: { ...PHONE, viewport: { width: 844, height: 390 } } };
const STATES = ['running', 'paused', 'waiting', 'lost', 'away', 'hidden', 'starting', 'joined', 'ended'];
const NAMES = ['Ada', 'Alan', 'Barbara', 'Claude', 'Donald', 'Edsger', 'Frances Elizabeth Holberton-Snyder', 'Grace', 'Hedy', 'Ida', 'John', 'Katherine'];

await mkdir(FOLDER, { recursive: true });

async function pictures(page, count) {
  for (let id = 1; id <= count; ++id)
    await tell({ picture: { id, jpeg: await jpeg(page, `hsl(${id * 37} 60% 60%)`) } });
}

async function wallOfTwelve() {
  const simulator = await cloud.call('address', 'simulator');
  const more = { 1: { sign: 'hand' }, 2: { why: 'busy', ahead: 2 }, 6: { sign: 'done' }, 8: { why: 'The project has no file worlds/arena.wbt. Please check the name.' }, 9: { sign: 'done' } };
  return NAMES.map((name, i) => student(i + 1, name, { state: STATES[i % STATES.length], time: i * 12345, simulator, ...more[i] }));
}

const picturesOf = (name, run) => test(name, { skip: !name.includes(ONLY) }, run);

for (const [size, viewport] of Object.entries(SIZES)) {
  for (const [colorScheme, locale] of [['light', 'en-US'], ['dark', 'de-DE']]) {
    const options = { ...viewport, colorScheme, locale };
    const shoot = (page, name, more = {}) => page.screenshot({ path: `${FOLDER}/${size}-${colorScheme}-${name}.png`, scale: 'css', ...more });

    picturesOf(`doors ${size} ${colorScheme}`, async (t) => {
      const page = await openPage(t, browser, options);
      await page.goto(await address());
      await shown(page, 'doors');
      await shoot(page, 'doors');
      await page.goto(await address(CODE));
      await shown(page, 'name');
      await shoot(page, 'name');
      await cloud.set('class_answers', { check: [{ error: 'code', text: '' }] });
      await page.goto(await address('222222'));
      await page.waitForSelector('#code-problem:not(:empty)');
      await shoot(page, 'wrong-code');
    });

    picturesOf(`student ${size} ${colorScheme}`, async (t) => {
      const page = await runSimulation(t, options);
      await tell({ do: 'message', text: 'Please look at the screen in front: the next task is to follow the line.' });
      await page.waitForSelector('#told:not([hidden])');
      await shoot(page, 'student');
      await page.click('#told-close');
      await tell({ sign: 'hand' });
      await page.waitForSelector('[aria-pressed="true"][data-sign]');
      await shoot(page, 'student-hand');
      await tell({ do: 'end' });
      await state(page, 'ended');
      await shoot(page, 'student-ended');
      await tell({ closed: 'removed' });
      await shown(page, 'over');
      await shoot(page, 'removed');
    });

    picturesOf(`student waits ${size} ${colorScheme}`, async (t) => {
      await cloud.set('answer', 'Error: no simulation server available');
      const page = await join(t, options);
      await state(page, 'waiting');
      await shoot(page, 'student-waits');
    });

    picturesOf(`student in line ${size} ${colorScheme}`, async (t) => {
      await cloud.set('relays', true);
      await cloud.set('place', [3, 60, 240]);
      const page = await join(t, options);
      await state(page, 'waiting');
      await page.waitForSelector('#place:not([hidden])');
      await shoot(page, 'student-in-line');
    });

    picturesOf(`teacher ${size} ${colorScheme}`, async (t) => {
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

    picturesOf(`wall ${size} ${colorScheme}`, async (t) => {
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
      for (let id = 13; id <= 30; ++id)
        await tell({ student: student(id, `${NAMES[id % 12]} ${id}`) });
      await says(page, '#here-count', '30');
      await shoot(page, 'projector-full');
      await page.click('#project');
      await page.waitForFunction(() => document.fullscreenElement === null);
      await page.click('#for-all [data-do="world"]');
      await page.waitForSelector('#another[open]');
      await shoot(page, 'another-world');
      await page.keyboard.press('Escape');
      await page.click('#fold');
      await shoot(page, 'unfolded');
      await tile(page, 1).locator('.look').click();
      await page.waitForSelector('#look-view [data-live]');
      await shoot(page, 'look');
    });
  }
}
