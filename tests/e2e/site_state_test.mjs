// The table "What a site is" of docs/visitors.md on a site of one machine, with real servers: in each state the lamp of the viewer, the
// line, the pages of a class, an embedded view, a website, the monitor and /metrics say the same. (Which facts make which state: site_state_test.cpp.)

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { createServer } from 'node:http';
import { test } from 'node:test';

import { openBrowser, openPage } from '../viewer/page.mjs';
import { WORLD, attend, fillForm, openClass, says, shown, startClassSite, startWebsite, state } from './class_site.mjs';

const SENTENCES = {
  free: 'A machine is free.',
  busy: 'The machines are busy: a start may have to wait.',
  full: 'Every seat is taken.',
  draining: 'No machine takes new simulations at the moment.',
  down: 'No machine is running.',
};
const CAN_WAIT = ' You can wait in line.';
const BURN_S = 60; // at most

const site = await startClassSite({
  session: (ports) => ({ simulationServers: [`localhost:${ports.simulation}`], relay: true }),
  simulation: () => ({ maxConnections: 1 }),
});
const { server } = site;
const website = await startWebsite(site);
const browser = await openBrowser();

// The pages that only look: viewer, website and monitor.
async function openWatchers(t) {
  const lamp = await openPage(t, browser);
  await lamp.goto(`${server}/viewer/`);
  const ofWebsite = await openPage(t, browser);
  await ofWebsite.goto(website);
  const monitor = await openPage(t, browser);
  await monitor.goto(`${server}/monitor`);
  return { lamp, ofWebsite, monitor };
}

async function assertSite({ lamp, ofWebsite, monitor }, wanted) {
  const sentence = SENTENCES[wanted];
  const mayWait = ['busy', 'full'].includes(wanted);
  await lamp.waitForFunction((text) => document.getElementById('light-text').textContent === text, mayWait ? sentence + CAN_WAIT : sentence);
  await ofWebsite.waitForFunction((text) => document.getElementById('availability').textContent === text, sentence);
  await monitor.waitForFunction((text) => document.getElementById('site').textContent === text, sentence);
  const metrics = await (await fetch(`${server}/metrics`)).text();
  assert.deepEqual(metrics.match(/^webots_site_state\{state="\w+"\} 1$/gm), [`webots_site_state{state="${wanted}"} 1`]);
}

async function visit(t) {
  const page = await openPage(t, browser);
  await page.goto(`${server}/viewer/?url=${WORLD}`);
  await page.click('#start');
  return page;
}

// A page of another site with a view, which starts at once.
async function embed(t) {
  const host = createServer((_, answer) => answer.writeHead(200, { 'Content-Type': 'text/html' }).end(`<!DOCTYPE html><title>A robot</title>
    <script type="module" src="${server}/view/webots_view.js"></script><webots-view data-server="${WORLD}" data-mode="mjpeg"></webots-view>`));
  host.listen(0, 'localhost');
  await once(host, 'listening');
  t.after(() => host.close());
  const page = await openPage(t, browser);
  await page.goto(`http://localhost:${host.address().port}`);
  return page;
}

const reads = (page, text) => page.getByText(text).first().waitFor();

const quit = async (page) => {
  await page.click('#quit');
  await page.waitForSelector('body[data-state="ended"], body[data-state="idle"]');
};

// Keeps a core busy until the test ends, or for BURN_S.
function burn(t) {
  const loop = spawn('timeout', [String(BURN_S), 'sh', '-c', 'while :; do :; done'], { stdio: 'ignore' });
  t.after(() => loop.kill());
  return loop;
}

test('free, and full of visitors: the lamp, the line and the monitor agree', { timeout: 120000 }, async (t) => {
  const watchers = await openWatchers(t);
  await assertSite(watchers, 'free');
  const first = await visit(t);
  await state(first, 'running');
  await assertSite(watchers, 'full');
  const second = await visit(t);
  await state(second, 'waiting');
  await says(second, '#status', 'You are next.');
  const embedded = await embed(t);
  await reads(embedded, 'You are number 2 in line.');
  await embedded.close();
  await quit(first);
  await state(second, 'running');
  await quit(second);
  await assertSite(watchers, 'free');
});

test('a class: full while its seat is reserved, and its own pages give the true reason for a wait', { timeout: 180000 }, async (t) => {
  const watchers = await openWatchers(t);
  const teacher = await openPage(t, browser);
  await teacher.goto(`${server}/class/#teach`);
  await shown(teacher, 'open');
  await fillForm(teacher);
  await teacher.fill('#seats', '1');
  const { link } = await openClass(teacher);
  await assertSite(watchers, 'full');
  const ada = await attend(t, browser, link, 'Ada');
  await assertSite(watchers, 'full');

  const grace = await come(t, link, 'Grace');
  await says(grace, '#place', SENTENCES.full);
  await says(teacher, '#reserved', SENTENCES.full);
  await ada.click('#leave');
  await state(grace, 'running');
  await grace.click('#leave');

  // Seats are free, and the processor is not.
  const loop = burn(t);
  await site.session.reread({ loadThreshold: 1 });
  await assertSite(watchers, 'busy');
  const hedy = await come(t, link, 'Hedy');
  await says(hedy, '#seat', 'The machines are busy');
  await says(teacher, '#reserved', SENTENCES.busy);
  assert.ok(!(await hedy.textContent('#seat')).includes(SENTENCES.full));
  loop.kill();
  await site.session.reread({});
  await state(hedy, 'running');
  await hedy.click('#leave');
  await teacher.click('#close-class');
  await teacher.click('#question [value="yes"], #question button:last-of-type');
  await assertSite(watchers, 'free');
});

test('drained, and down: nobody is told to wait for a seat', { timeout: 120000 }, async (t) => {
  const watchers = await openWatchers(t);
  site.simulation.command('--drain');
  await assertSite(watchers, 'draining');
  const waits = await visit(t);
  await state(waits, 'waiting');
  await says(waits, '#status', 'No machine takes new simulations');
  const embedded = await embed(t);
  await reads(embedded, SENTENCES.draining);
  await embedded.close();
  site.simulation.command('--resume');
  await state(waits, 'running');
  await site.simulation.stop();
  await assertSite(watchers, 'down');
  const late = await visit(t);
  await says(late, '#status', 'No machine is running');
  await reads(await embed(t), SENTENCES.down);
});

async function come(t, link, name) {
  const page = await openPage(t, browser);
  await page.goto(link);
  await page.fill('#name', name);
  await page.click('#join');
  await page.waitForFunction(() => !document.getElementById('waiting').hidden);
  return page;
}
