// The pages at /monitor of sites that servers are seldom in together: machines in every state, people who wait, graphics, a day that has passed.
// (That servers tell what the pages show: tests/e2e/monitor_test.py.)

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { startFakeMonitor } from './fake_monitor.mjs';
import { DECISIONS, SESSION, SIMULATION } from './monitor_states.mjs';
import { accessibilityFindings, openBrowser, openPage } from './page.mjs';

const SIZES = [[390, 844], [844, 390], [1280, 720], [1440, 900]];
const browser = await openBrowser();
const session = await startFakeMonitor('session');
const simulation = await startFakeMonitor('simulation');

async function open(t, monitor, snapshot, options = {}) {
  monitor.snapshot = { ...snapshot, now: Date.now() / 1000 };
  const page = await openPage(t, browser, options);
  await page.goto(monitor.url);
  return page;
}

const text = (page, selector) => page.locator(selector).first().innerText();
const texts = (page, selector) => page.locator(selector).allInnerTexts();
const row = async (page, number) => (await texts(page, `#servers tbody tr:nth-child(${number}) td`)).map((cell) => cell.replace(/\s+/g, ' '));

for (const [monitor, states] of [[session, SESSION], [simulation, SIMULATION]]) {
  for (const [name, snapshot] of Object.entries(states)) {
    test(`${monitor.kind} ${name}: nothing is cut off or hard to use, at every size, light and dark`, async (t) => {
      const page = await open(t, monitor, snapshot);
      for (const [width, height] of SIZES) {
        await page.setViewportSize({ width, height });
        for (const span of name === 'none' ? [] : ['day', 'minutes']) {
          await page.click(`[data-span="${span}"]`);
          const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
          assert.ok(overflow <= 0, `${overflow} px too wide at ${width}`);
        }
        assert.deepEqual(await accessibilityFindings(page), [], `at ${width}`);
      }
      await page.emulateMedia({ colorScheme: 'dark' });
      assert.deepEqual(await accessibilityFindings(page), [], 'dark');
    });
  }
}

test('free seats come first, and those of machines that take nobody are not free', async (t) => {
  const page = await open(t, session, SESSION.five);
  assert.equal(await text(page, '#free'), '5 of 32 free');
  assert.equal(await text(page, '#site'), 'A machine is free.');
  assert.equal(await text(page, '#waiting'), 'Nobody waits.');
  assert.equal(await text(page, '#managing'), '5 machines');
  assert.deepEqual((await row(page, 1)).slice(0, 4), ['sim1.example.org:2000', '5 of 8', '32%', 'Free']);
});

test('each machine gives the reason of its state', async (t) => {
  const page = await open(t, session, SESSION.five);
  assert.equal((await row(page, 2))[3], 'Busy Its load is over 95%, where this site stops sending people.');
  assert.equal((await row(page, 3))[3], 'Full Every seat of this machine is taken.');
  assert.equal((await row(page, 4))[3], 'Drained Drained by the operator: it gets no new simulations.');
  assert.deepEqual((await row(page, 5)).slice(1, 4), ['–', '–', 'Does not answer Connection refused']);
});

test('who waits, how long and why are sentences', async (t) => {
  const page = await open(t, session, SESSION.waiting);
  assert.equal(await text(page, '#free'), '0 of 4 free');
  assert.equal(await text(page, '#waiting'), '3 people wait, the first for 95 seconds.\n2 of them: Every seat is taken.\n'
    + '1 of them: There are free seats, but the machines are too busy for this world.');
});

test('one reason that the page gives already is not given twice', async (t) => {
  const page = await open(t, session, { ...SESSION.waiting, waiting: 1, waitingFor: { seat: 1 } });
  assert.equal(await text(page, '#waiting'), 'One person waits, for 95 seconds.');
});

test('of one machine there is no average', async (t) => {
  assert.ok((await texts(await open(t, session, SESSION.five), '#facts dt')).includes('Average load'));
  const one = await open(t, session, SESSION.one);
  assert.ok(!(await texts(one, '#facts dt')).includes('Average load'));
  assert.equal(await text(one, '#managing'), 'One machine');
});

test('machines that know no seats are counted themselves', async (t) => {
  const page = await open(t, session, SESSION.plain);
  assert.equal(await text(page, '#free'), '1 of 1 machines free');
  assert.equal(await page.isVisible('#waiting'), false, 'it does not relay, so nobody can wait');
});

test('a site without machines says where they are written', async (t) => {
  const page = await open(t, session, SESSION.none);
  assert.match(await text(page, 'main'), /Add one to "simulationServers"/);
  assert.equal(await text(page, '#free'), '0 machines');
  assert.equal(await page.isVisible('#servers, #history'), false);
});

test('many machines are three lines of a chart, and a line each in the table', async (t) => {
  const page = await open(t, session, SESSION.many);
  assert.deepEqual((await texts(page, '.legend li')).map((each) => each.split(' ')[0]), ['Average', 'Highest', 'Lowest']);
  assert.equal(await page.locator('.spark path:not([d=""])').count(), 60);
});

test('a day is there at a press, with seats and who waited', async (t) => {
  const page = await open(t, session, SESSION.five);
  assert.deepEqual(await texts(page, '.chart h3'), ['Load']);
  await page.click('[data-span="day"]');
  assert.deepEqual(await texts(page, '.chart h3'), ['Seats', 'Load']);
  const last = (name) => SESSION.five.day.series.find((each) => each.name === name).history.at(-1);
  assert.deepEqual(await texts(page, '.chart:first-child .legend li'), [`Seats taken ${last('taken')}`, `Seats ${last('seats')}`, `Waiting ${last('waiting')}`]);
  await page.hover('.chart:first-child svg', { position: { x: 80, y: 60 } });
  assert.match(await text(page, '.chart:first-child figcaption .reading'), /^\d\d:\d\d$/);
});

test('the load from which nobody is sent is a line with its meaning, and does not stretch the scale', async (t) => {
  const page = await open(t, session, SESSION.one);
  assert.equal(await text(page, '.limit-note'), 'Nobody is sent to a machine above 95%');
  const far = await open(t, session, { ...SESSION.one, threshold: 1000 });
  assert.equal(await far.isVisible('.limit-note'), false);
  assert.equal((await far.$$eval('#history svg text', (all) => all.map((each) => each.textContent))).includes('100%'), true);
});

test('links lead to the worlds, the class and the page of each machine', async (t) => {
  const { about } = SESSION.five;
  const hrefs = (page) => page.$$eval('#servers a', (links) => links.map((link) => link.getAttribute('href')));
  const page = await open(t, session, SESSION.five);
  assert.deepEqual(await page.$$eval('header a', (links) => links.map((link) => link.getAttribute('href'))), ['viewer/worlds/', 'class/']);
  assert.equal((await hrefs(page))[0], 'http://sim1.example.org:2000/monitor');
  const servers = SESSION.five.servers.slice(0, 2);
  const gateway = await open(t, session, { ...SESSION.five, about: { ...about, gateway: true, tls: true },
    servers: [{ ...servers[0], address: '*/2000' }, { ...servers[1], address: '10.0.0.2:2000', path: '/machine/abc' }] });
  assert.deepEqual(await hrefs(gateway), ['2000/monitor', 'machine/abc/monitor']);
});

test('texts of machines are text', async (t) => {
  const hostile = '<img src=x onerror="window.hacked = 1">';
  const page = await open(t, session, { ...SESSION.five, servers: SESSION.five.servers.map((server) => ({ ...server, problem: hostile, refusal: hostile, foundBy: hostile })) });
  const machine = await open(t, simulation, { ...SIMULATION.running, about: { ...SIMULATION.running.about, notices: [hostile], description: hostile, sandbox: hostile },
    simulations: [{ ...SIMULATION.running.simulations[0], world: hostile, log: hostile, state: hostile }] });
  for (const each of [page, machine]) {
    assert.equal(await each.locator('main img').count(), 0);
    assert.equal(await each.evaluate(() => window.hacked), undefined);
    assert.ok((await text(each, 'main')).includes(hostile));
  }
});

test('a machine shows free seats, its simulations by the names of their worlds, and figures with units', async (t) => {
  const page = await open(t, simulation, SIMULATION.running);
  assert.equal(await text(page, '#free'), '1 of 4 free');
  assert.equal(await text(page, '#count'), '3 simulations');
  const cells = (await texts(page, '#simulations tbody tr:first-child td')).map((cell) => cell.replace(/\s+/g, ' '));
  assert.deepEqual(cells.slice(2), ['Runs', '62 min', '113%', '1.3 GB', '24 Process ID 8063']);
  assert.match(cells[1], /^nao_demo\.wbt https:\/\/github\.com\/cyberbotics\/.*\/worlds\/ Log: log\/simulation\/simulations\/7\.log$/);
  assert.match((await texts(page, '#simulations tbody tr:nth-child(2) td'))[5], /^more than 210 MB/);
});

test('without a graphics processor nothing is drawn of one', async (t) => {
  const names = async (page) => [...await texts(page, '.legend li'), ...await texts(page, '#measures dt')].join(' ');
  assert.doesNotMatch(await names(await open(t, simulation, SIMULATION.running)), /Graphics|Swap/);
  assert.match(await names(await open(t, simulation, SIMULATION.graphics)), /Graphics.*Swap/);
});

test('a machine that drains has no free seats, and says why', async (t) => {
  const page = await open(t, simulation, SIMULATION.draining);
  assert.equal(await text(page, '#free'), '0 of 4 free');
  assert.equal(await text(page, '#draining'), 'This machine drains: it takes no new simulations.');
});

test('decisions are sentences, and those that are alike are one', async (t) => {
  session.decisions = DECISIONS;
  const page = await open(t, session, { ...SESSION.five, about: { ...SESSION.five.about, decisions: true } });
  await page.waitForSelector('#decisions li');
  assert.deepEqual(await texts(page, '#decisions li'), [
    '12 sec ago Sent to sim1.example.org:2000, which had a load of 32% and 5 simulations. Not offered: 1 too busy, 1 full, 1 drained, 1 silent.',
    '80 sec ago 2 times nobody could be placed. Not offered: 4 full, 1 silent.']);
});

test('who may not read decisions does not ask for them', async (t) => {
  session.asked = [];
  const page = await open(t, session, SESSION.five);
  assert.equal(await page.isVisible('#decisions'), false);
  assert.deepEqual(session.asked.filter((each) => each.includes('decisions')), []);
});

test('the page speaks the language of its reader, who may choose another', async (t) => {
  const page = await open(t, session, SESSION.waiting, { locale: 'de-DE' });
  assert.equal(await text(page, '#free'), '0 von 4 frei');
  assert.match(await text(page, '#waiting'), /^3 Personen warten, die erste seit 95 Sekunden\.\n2 davon: /);
  assert.equal(await page.getAttribute('html', 'lang'), 'de');
  assert.deepEqual(await texts(page, '#language option'), ['English', 'Deutsch', 'Español', 'Français', 'Italiano', '日本語', '中文']);
  await page.selectOption('#language', 'fr');
  await page.waitForSelector('html[lang="fr"]');
  assert.equal(await text(page, '#free'), '0 sur 4 libres');
  await page.goto(session.url);
  assert.equal(await text(page, '#free'), '0 sur 4 libres', 'the choice is remembered');
});
