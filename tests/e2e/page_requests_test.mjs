// What the viewer's page costs a browser that comes first, from a real server: requests and bytes until Start can be pressed.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { openBrowser, openPage } from '../viewer/page.mjs';
import { WORLD, startClassSite, state } from './class_site.mjs';

const MOST_REQUESTS = 6; // page, script, style, texts, the list of worlds, icon
const MOST_BYTES = 79_000;

const { server } = await startClassSite({
  session: (ports) => ({ simulationServers: [`localhost:${ports.simulation}`], relay: true }),
  simulation: () => ({ maxConnections: 1 }),
});
const browser = await openBrowser();

test('the viewer is a handful of requests, and asks for a simulation', async (t) => {
  const script = await (await fetch(`${server}/viewer/viewer.js`)).text();
  if (/^import .* from '\.\//m.test(script))
    return t.skip('this build has no esbuild, so pages load file by file');
  const page = await openPage(t, browser);
  const missing = [];
  page.on('response', (response) => response.status() >= 400 && missing.push(response.url()));
  await page.goto(`${server}/viewer/?url=${WORLD}`);
  await state(page, 'idle');
  await page.waitForSelector('body:not([data-availability="unknown"])');
  await page.waitForLoadState('networkidle');
  const loaded = await page.evaluate(() => [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]
    .filter(({ transferSize }) => transferSize > 0) // Firefox takes the icon from its cache a second time
    .map(({ name, encodedBodySize }) => ({ name, encodedBodySize })));
  assert.deepEqual(missing, []);
  assert.ok(loaded.length <= MOST_REQUESTS, JSON.stringify(loaded, null, 1));
  const bytes = loaded.reduce((sum, { encodedBodySize }) => sum + encodedBodySize, 0);
  assert.ok(bytes <= MOST_BYTES, JSON.stringify(loaded, null, 1));
  t.diagnostic(`${loaded.length} requests, ${bytes} bytes`);
  const again = await page.context().newPage();
  await again.goto(`${server}/viewer/?url=${WORLD}`);
  await state(again, 'idle');
  const fetched = await again.evaluate(() => performance.getEntriesByType('resource')
    .filter(({ name, transferSize }) => /viewer\.(css|js)/.test(name) && transferSize > 0).map(({ name }) => name));
  assert.deepEqual(fetched, [], 'what has not changed is not asked for again');
  await again.close();
  await page.click('#start');
  await page.waitForSelector('body:is([data-state="running"], [data-state="waiting"])'); // in line, where the machine is busy with other tests
});
