// The viewer page before fake servers, for the files of its tests.

import { after, beforeEach } from 'node:test';
import { FakeCloud } from './fake_cloud.mjs';
import { openBrowser, openPage } from './page.mjs';

export const WORLD = 'https://github.com/owner/repository/blob/main/worlds/arena.wbt';
export const PHONE = { viewport: { width: 360, height: 740 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true };
export const LANDSCAPE = { ...PHONE, viewport: { width: 740, height: 360 } };

export const browser = await openBrowser();
export const cloud = new FakeCloud();
after(() => cloud.close());
beforeEach(() => cloud.renew());

// `prepare(page)` is called before the page is loaded.
export async function openViewer(t, options, prepare = () => {}) {
  const page = await openPage(t, browser, options);
  await prepare(page);
  await page.goto(`${await cloud.get('page')}?url=${WORLD}`);
  await state(page, 'idle');
  await page.waitForSelector('body:not([data-availability="unknown"])');
  return page;
}

// Where another world is entered: folded, while the page has one.
export async function enterAddress(page, address) {
  await page.locator('#address').evaluate((details) => { details.open = true; });
  await page.fill('#connect-to', address);
}

export async function runSimulation(t, options, prepare) {
  const page = await openViewer(t, options, prepare);
  await page.click('#start');
  await state(page, 'running');
  await page.waitForSelector('#picture[data-live]');
  return page;
}

export const state = (page, name) => page.waitForSelector(`body[data-state="${name}"]`);
export const status = (page, text) => page.waitForFunction((wanted) => document.getElementById('status').textContent.includes(wanted), text);
