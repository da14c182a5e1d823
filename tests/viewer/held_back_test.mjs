// The viewer page where something in between, or the simulator, keeps quiet, against fake servers.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFindings, until } from './page.mjs';
import { cloud, openViewer, state, status } from './viewer_page.mjs';

test('where no picture arrives, the page says so and offers 3D', async (t) => {
  await cloud.set('held_back', true);
  const page = await openViewer(t);
  await page.route('**/x_ite.min.mjs*', (route) => route.fulfill({ contentType: 'text/javascript', body: '' })); // the fake site has no library
  await page.click('#start');
  await state(page, 'running');
  assert.equal(await page.isVisible('#no-picture-comes'), false);
  await page.waitForSelector('#no-picture-comes:not([hidden])');
  assert.match(await page.textContent('#no-picture-comes'), /no picture arrives/);
  assert.deepEqual(await accessibilityFindings(page), []);
  await page.click('#start-in-3d');
  const modes = async () => (await cloud.get('started')).map((text) => JSON.parse(text).start.mode);
  await until(async () => (await modes()).join() === 'mjpeg,w3d', 'a start in 3D');
  await page.waitForSelector('#no-picture-comes', { state: 'hidden' });
});

test('the sentence goes when a picture arrives', async (t) => {
  await cloud.set('held_back', true);
  const page = await openViewer(t);
  await page.click('#start');
  await page.waitForSelector('#no-picture-comes:not([hidden])');
  await cloud.set('held_back', false);
  await page.waitForSelector('#no-picture-comes', { state: 'hidden' });
  await page.waitForSelector('#picture[data-live]');
});

test('a simulator that accepts and says nothing is named, and may still begin to speak', async (t) => {
  await cloud.set('mute', ['simulator']);
  const page = await openViewer(t);
  await page.click('#start');
  await status(page, 'Connecting to the simulator');
  await status(page, 'says nothing. If it is a Webots that you have started, start it with --stream');
  assert.ok(await page.isVisible('#status.problem'));
  await state(page, 'starting');
  await cloud.set('mute', []);
  await cloud.call('send', 'simulator', 'scene load completed');
  await state(page, 'running');
});

test('a proxy that passes no WebSockets on is told from a server that is not there', async (t) => {
  await cloud.set('strips_upgrade', true);
  const page = await openViewer(t);
  await page.click('#start');
  await status(page, 'lets no WebSocket through. Most likely a proxy in front of it');
  await state(page, 'failed');
  await cloud.call('shut', 'simulation');
  await page.click('#start');
  await status(page, 'cannot be reached. Please check your network');
  await cloud.set('strips_upgrade', false);
  await cloud.call('open', 'simulation');
});
