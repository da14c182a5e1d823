// What a newcomer does after README's first command: opens the address that it printed, chooses a world, and sees robots move. Run by
// tests/first_contact.sh, against the site that ./server.sh start has started with the configurations that ship.
//
//   SITE=http://localhost:1999/ WEBSITE=http://localhost:1998/ tests/support/run_page_test.sh tests/viewer/first_contact.mjs

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { openBrowser, openPage } from './page.mjs';

const { SITE, WEBSITE } = process.env;
const PATIENCE_MS = 120000; // A machine that has just built all this is busy for a moment: the page waits in line until it is not.
const SHOWN_MS = 500; // simulated time between two looks

const browser = await openBrowser({ whole: true });

test('one press starts a simulation whose picture moves, and stopping ends it', async (t) => {
  const page = await openPage(t, browser, { patience: PATIENCE_MS });
  await page.goto(SITE);
  await page.waitForFunction(() => Number(document.body.dataset.worlds) >= 4); // the demo worlds, of which no configuration says anything
  await page.click('.world');
  await page.waitForSelector('body[data-state="running"]').catch(async (late) => {
    throw new Error(`No simulation runs. The page says: ${await page.innerText('main')}`, { cause: late });
  });
  await page.waitForSelector('#picture[data-live]');
  const picture = page.locator('#picture');
  const before = { time: await simulated(page), pixels: await picture.screenshot() };
  await page.waitForFunction((time) => Number(document.body.dataset.time) > time, before.time + SHOWN_MS);
  assert.notDeepEqual(await picture.screenshot(), before.pixels, 'the picture stands still');

  await page.click('#quit');
  await page.waitForSelector('body[data-state="ended"], body[data-state="idle"]');
});

test('the website that starts simulations shows its page', async (t) => {
  const page = await openPage(t, browser, { patience: PATIENCE_MS });
  const answer = await page.goto(WEBSITE);
  assert.equal(answer.status(), 200);
  assert.ok(await page.locator('form').count() > 0, 'nothing to sign in with');
});

function simulated(page) {
  return page.evaluate(() => Number(document.body.dataset.time));
}
