// Makes the picture of the viewer in README, with the demo simulator behind the fake servers:
//
//   tests/support/run_page_test.sh tests/viewer/screenshots.mjs
//
// With FOLDER=<folder> in the environment: pictures of the page in many sizes, light and dark, in two languages, to be looked at.

import { mkdir } from 'node:fs/promises';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { startDemoSimulator } from './demo_simulator.mjs';
import { FakeCloud } from './fake_cloud.mjs';
import { openBrowser, openPage } from './page.mjs';

const { FOLDER } = process.env;
const WORLD = 'https://github.com/owner/repository/blob/main/worlds/arena.wbt';
const WIDE = { viewport: { width: 1280, height: 800 } };
const mobile = (width, height, deviceScaleFactor) => ({ viewport: { width, height }, deviceScaleFactor, hasTouch: true, isMobile: true });
const SIZES = { '1280x800': WIDE, '1920x1080': { viewport: { width: 1920, height: 1080 } }, '768x1024': mobile(768, 1024, 2),
  '360x740': mobile(360, 740, 3), '740x360': mobile(740, 360, 3) };
const SHOWN_MS = 2000; // simulated time that passes before the picture is taken

const browser = await openBrowser();
const cloud = new FakeCloud();
after(() => cloud.close());

async function openViewer(t, options) {
  const port = await startDemoSimulator(); // a new one, whose first page this is
  await cloud.set('launch', ['shutdownTimeout: 7200', `webots:ws://127.0.0.1:${port}`]);
  const page = await openPage(t, browser, options);
  await page.goto(`${await cloud.get('page')}?url=${WORLD}`);
  await page.waitForSelector('body[data-availability="available"]');
  return page;
}

async function run(page) {
  await page.click('#start');
  await page.waitForSelector('#picture[data-live]');
  await page.waitForFunction((time) => Number(document.body.dataset.time) > time, SHOWN_MS);
}

if (FOLDER === undefined) {
  test('viewer.png', async (t) => {
    const page = await openViewer(t, WIDE);
    await run(page);
    await page.screenshot({ path: fileURLToPath(new URL('../../docs/images/viewer.png', import.meta.url)) });
  });
} else {
  await mkdir(FOLDER, { recursive: true });
  for (const [name, size] of Object.entries(SIZES)) {
    for (const [colorScheme, locale] of [['light', 'en-US'], ['dark', 'de-DE']]) {
      test(`${name} ${colorScheme}`, async (t) => {
        const page = await openViewer(t, { ...size, colorScheme, locale });
        await page.screenshot({ path: `${FOLDER}/${name}-${colorScheme}-idle.png`, scale: 'css' });
        await run(page);
        await page.screenshot({ path: `${FOLDER}/${name}-${colorScheme}-running.png`, scale: 'css' });
      });
    }
  }
}
