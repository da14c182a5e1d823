// Pages of which something did not arrive, as when a phone changes its network while they load: they load again by themselves, or say
// that they are not complete.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CODE, WORLD, address, browser, cloud } from './class_page.mjs';
import { openPage, until } from './page.mjs';

const PAGES = {
  viewer: { open: async () => `${await cloud.get('page')}?url=${WORLD}`, whole: 'body[data-availability="available"]' },
  class: { open: () => address(CODE), whole: 'body[data-shown="name"]' },
};
const SAID = '#incomplete:not([hidden])';
const hasStyle = (page) => page.locator('header').evaluate((header) => getComputedStyle(header).display === 'flex');

// The next `times` requests for files of this name fail. Returns how often they were made.
async function lose(page, name, times = Infinity) {
  const asked = { count: 0 };
  await page.route(name, (route) => (++asked.count <= times ? route.abort('connectionaborted') : route.continue()));
  return asked;
}

// Hours pass on the page, until it says this.
async function untilSaid(page, pattern) {
  await until(async () => {
    await page.clock.runFor(1000).catch(() => {}); // It was being loaded.
    return await page.locator(SAID).count() === 1;
  }, 'what the page says');
  assert.match(await page.textContent(SAID), pattern);
}

for (const [kind, { open, whole }] of Object.entries(PAGES)) {
  for (const lost of ['view/texts.js', `${kind}.css`, 'en.json']) {
    test(`the ${kind} page is complete although ${lost} did not arrive at once`, async (t) => {
      const page = await openPage(t, browser);
      const asked = await lose(page, `**/${lost}`, 2);
      await page.goto(await open());
      await until(() => asked.count === 3, 'the third request');
      await page.waitForSelector(whole);
      await until(() => hasStyle(page), 'the style');
      assert.equal(await page.locator(SAID).count(), 0);
    });
  }

  test(`the ${kind} page says that it is not complete, and is when the network is back`, async (t) => {
    const page = await openPage(t, browser, { locale: 'de-AT' });
    await page.clock.install();
    const asked = await lose(page, '**/view/texts.js');
    await page.goto(await open());
    await untilSaid(page, /nicht vollständig/);
    const tries = asked.count;
    assert.ok(tries > 2, `${tries}`);
    await page.clock.runFor(60000);
    assert.equal(asked.count, tries); // It does not go on for ever.
    await page.unroute('**/view/texts.js');
    await page.clock.resume();
    await page.context().setOffline(true);
    await page.context().setOffline(false);
    await page.waitForSelector(whole);
    assert.equal(await page.locator(SAID).count(), 0);
  });

  test(`the ${kind} page says that it is not complete when its texts never arrive`, async (t) => {
    const page = await openPage(t, browser);
    await page.clock.install();
    await lose(page, '**/en.json');
    await page.goto(await open());
    await untilSaid(page, /not loaded completely/);
  });

  test(`the ${kind} page says so when it takes long, but not any more when it is complete`, async (t) => {
    const page = await openPage(t, browser);
    await page.clock.install();
    let arrive;
    await page.route('**/view/texts.js', async (route) => {
      await new Promise((resolve) => { arrive = resolve; });
      await route.continue();
    });
    await page.goto(await open(), { waitUntil: 'commit' });
    await until(() => arrive, 'the request');
    await untilSaid(page, /not loaded completely/);
    arrive();
    await page.clock.resume();
    await page.waitForSelector(whole);
    await page.waitForSelector('#incomplete', { state: 'hidden' });
  });

  test(`the ${kind} page does not become the browser's own page of errors while its server cannot be reached`, async (t) => {
    const page = await openPage(t, browser);
    await lose(page, '**/view/texts.js', 1);
    await page.goto(await open());
    const { pathname } = new URL(page.url());
    const asked = await lose(page, (url) => url.pathname === pathname, 2);
    await page.waitForSelector(whole);
    assert.ok(asked.count > 2, `${asked.count}`);
  });
}
