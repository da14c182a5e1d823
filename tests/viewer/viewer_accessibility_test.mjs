// axe-core finds nothing against any state of the viewer page.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFindings } from './page.mjs';
import { LANDSCAPE, PHONE, WORLD, cloud, enterAddress, openViewer, state, status } from './viewer_page.mjs';

// What brings the page into each of its states, from the state before.
const STATES = {
  idle: async () => {},
  'notice and help': async (page) => {
    await page.evaluate(() => {
      document.getElementById('notice').textContent = 'A demo simulator';
      document.getElementById('notice').hidden = false;
    });
    await page.click('#address > summary');
    await page.click('#grammar summary');
  },
  'senseless address': async (page) => {
    await enterAddress(page, 'nonsense');
    await page.click('#start');
    await state(page, 'failed');
    await page.fill('#connect-to', WORLD);
  },
  refused: async (page) => {
    await cloud.set('reason', 'too-fast');
    await cloud.set('answer', 'Error: too many sessions are asked for from your network.');
    await page.click('#start');
    await status(page, 'oo many simulations');
    await cloud.set('reason', null);
    await cloud.set('answer', null);
  },
  starting: async (page) => {
    await cloud.set('launch', ['loading: Receiving objects: 42% (42/100)']);
    await page.click('#start');
    await status(page, '42%');
  },
  running: async (page) => {
    await cloud.call('send', 'simulation', `webots:${await cloud.call('address', 'simulator')}`);
    await state(page, 'running');
    await page.waitForSelector('#picture[data-live]');
  },
  editor: async (page) => {
    await cloud.set('programs', { 'drive/drive.py': 'print(1)\n', 'drive/map.py': '' });
    await cloud.call('send', 'simulation', 'files: [{"path":"drive/drive.py","changed":false},{"path":"drive/map.py","changed":false}]');
    await page.click('#show-code');
    await page.waitForFunction(() => document.querySelector('#programs textarea')?.value === 'print(1)\n');
    await cloud.call('send', 'simulator', 'stderr:  File "/x/controllers/drive/drive.py", line 1');
    await page.waitForSelector('#programs .wrong');
  },
  'editor closed': async (page) => {
    await page.click('#show-code');
    await page.click('#show-console');
  },
  'full screen': async (page) => {
    await page.click('#fullscreen');
    await page.waitForFunction(() => document.fullscreenElement !== null);
  },
  'console and warning': async (page) => {
    await cloud.call('send', 'simulation', 'shutdownTimeout: 60');
    await page.waitForSelector('#warning:not([hidden])');
    await cloud.call('send', 'simulator', 'stdout:hello\nstderr:bad\n');
    await page.click('#show-console');
    await page.waitForSelector('#console .stderr');
  },
  'no longer full screen': async (page) => {
    await page.click('#fullscreen');
    await page.waitForFunction(() => document.fullscreenElement === null);
  },
  help: async (page) => {
    await page.click('#show-help');
    await page.waitForSelector('#camera[open]');
  },
  'a link to share': async (page) => {
    await page.keyboard.press('Escape');
    await page.click('#share');
    await page.waitForSelector('#qr svg');
  },
  fast: async (page) => {
    await page.keyboard.press('Escape');
    await page.click('#fast');
    await state(page, 'fast');
  },
  paused: async (page) => {
    await page.click('#pause');
    await state(page, 'paused');
  },
  ended: async (page) => {
    await cloud.call('close', 'simulation');
    await state(page, 'ended');
  },
};

for (const [name, options] of Object.entries({ 'wide and light': {}, 'upright and dark': { ...PHONE, colorScheme: 'dark' }, 'on its side': LANDSCAPE })) {
  test(`no findings ${name}`, async (t) => {
    const page = await openViewer(t, options);
    for (const [reached, reach] of Object.entries(STATES)) {
      await reach(page);
      assert.deepEqual(await accessibilityFindings(page), [], reached);
    }
  });
}
