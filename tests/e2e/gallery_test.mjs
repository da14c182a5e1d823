// The gallery of a site of one machine, with real servers and without any word about worlds in their configurations: what people see who
// open its address, and that one press starts a world.

import assert from 'node:assert/strict';
import { readFile, readdir } from 'node:fs/promises';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { accessibilityFindings, openBrowser, openPage, until } from '../viewer/page.mjs';
import { WORLD, startClassSite, state } from './class_site.mjs';

const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true };
const ARENA = 'Robots in an arena';
const PATROL = 'A robot on patrol';
const PATROL_IN_C = 'Patrol in C';
const DUEL = 'Two robots';
const TITLES = await demoTitles();
const LANGUAGES = ['en', 'de', 'es', 'fr', 'it', 'ja', 'zh'];

const site = await startClassSite({
  session: (ports) => ({ simulationServers: [`localhost:${ports.simulation}`], relay: true, viewerUrl: WORLD }),
  simulation: () => ({ maxConnections: 1 }),
});
const { server } = site;
const browser = await openBrowser();

// What the demo worlds say of themselves.
async function demoTitles() {
  const folder = fileURLToPath(new URL('../../examples/demo_projects/', import.meta.url));
  const files = (await readdir(folder, { recursive: true })).filter((file) => file.endsWith('.wbt'));
  return Promise.all(files.map(async (file) => /WorldInfo \{\s*title "(.*)"/.exec(await readFile(join(folder, file), 'utf-8'))[1]));
}

async function openGallery(t, { worlds = TITLES.length, ...options } = {}) {
  const page = await openPage(t, browser, options);
  await page.goto(server);
  await page.waitForSelector(`body[data-worlds="${worlds}"]`);
  return page;
}

const titles = (page) => page.locator('.world .name').allTextContents();
const isRunning = async (page) => {
  await state(page, 'running');
  await page.waitForSelector('#picture[data-live]');
};
const quit = async (page) => {
  await page.click('#quit');
  await page.waitForSelector('body[data-state="ended"], body[data-state="idle"]');
};

// With this list in the configuration of the session server, until the test ends.
async function list(t, worlds, shown) {
  t.after(() => site.session.reread({}));
  await site.session.reread({ worlds });
  await until(async () => (await (await fetch(`${server}/viewer/worlds/list.json`)).json()).worlds.length === shown, 'the list');
}

test('the address of a site leads people to all demo worlds, and scripts to a number', async (t) => {
  const page = await openGallery(t);
  assert.equal(page.url(), `${server}/viewer/worlds/`);
  const found = await titles(page);
  assert.equal(found[0], ARENA); // the one of "viewerUrl"
  assert.deepEqual(found.toSorted(), TITLES.toSorted());
  assert.match(await page.locator('.world').first().textContent(), /see walls and each other/);
  assert.equal(await (await fetch(server)).text(), '1');
});

test('one press starts a world, and its page leads back', async (t) => {
  const page = await openGallery(t);
  await page.locator('.world').first().click();
  await isRunning(page);
  assert.equal(new URL(page.url()).search, `?url=${encodeURIComponent(WORLD)}`);
  await quit(page);
  await page.reload();
  await page.waitForSelector('body[data-availability="available"]');
  assert.equal(await page.getAttribute('body', 'data-state'), 'idle', 'loading the page again has started a simulation');
  await page.click('#worlds');
  await page.waitForSelector(`body[data-worlds="${TITLES.length}"]`);
});

test('a world that has run shows its own picture from then on', { timeout: 120000 }, async (t) => {
  const page = await openGallery(t);
  const visitor = await openGallery(t);
  await visitor.locator('.world', { hasText: PATROL }).click();
  await isRunning(visitor);
  const card = page.locator('.world', { hasText: PATROL });
  const picture = card.locator('.picture img');
  await picture.waitFor(); // the machine looks every two seconds, the session server asks every thirty, the page every ten
  await page.waitForFunction((image) => image.complete && image.naturalWidth > 100, await picture.elementHandle());
  await quit(visitor);
  const other = page.locator('.world', { has: page.getByText(DUEL, { exact: true }) }); // which has not run
  assert.equal(await other.locator('.picture svg.drawing').count(), 1);
});

test('the form that opens a class offers the same worlds', async (t) => {
  const page = await openPage(t, browser);
  await page.goto(`${server}/class/#teach`);
  await page.waitForSelector('#pick button');
  assert.deepEqual((await page.locator('#pick button').allTextContents()).toSorted(), TITLES.toSorted());
});

test('a keyboard is enough', async (t) => {
  const page = await openGallery(t);
  await page.focus('#language');
  await page.keyboard.press('Tab');
  await page.keyboard.press('Tab');
  assert.equal(await page.locator('.world').nth(1).evaluate((link) => link === document.activeElement), true);
  await page.keyboard.press('Enter');
  await isRunning(page);
  await quit(page);
});

test('the address of any world starts it, too', async (t) => {
  const page = await openGallery(t);
  await page.fill('#address', ` ${WORLD} `);
  await page.keyboard.press('Enter');
  await isRunning(page);
  await quit(page);
});

const FOLDER = 'local:/demo_projects/robots';
const IN_FOLDER = [ARENA, 'Corridor', DUEL];

test('the address of a folder shows its worlds, of which one press starts one, and can be shared', async (t) => {
  const page = await openGallery(t);
  await page.fill('#address', ` ${FOLDER}/ `);
  await page.keyboard.press('Enter');
  await page.waitForSelector(`body[data-worlds="${IN_FOLDER.length}"]`);
  assert.deepEqual((await titles(page)).toSorted(), IN_FOLDER.toSorted());
  assert.match(await page.textContent('#folder-text'), /^Worlds of local:/);
  const other = await openPage(t, browser);
  await other.goto(page.url());
  await other.locator('.world', { hasText: ARENA }).click();
  await isRunning(other);
  await quit(other);
  await page.click('#folder a');
  await page.waitForSelector(`body[data-worlds="${TITLES.length}"]`);
});

test('so does the field of the viewer, and an address without worlds is told', async (t) => {
  const page = await openPage(t, browser);
  await page.goto(`${server}/viewer/?url=${FOLDER}`);
  await page.waitForSelector('body[data-availability="available"]');
  await page.click('#start');
  await page.waitForSelector(`body[data-worlds="${IN_FOLDER.length}"]`);
  for (const [address, words] of [['local:/demo_projects/nothing', /no worlds in local:/], ['https://forge.example/o/r', /must start with/]]) {
    await page.fill('#address', address);
    await page.keyboard.press('Enter');
    await page.locator('#trouble', { hasText: words }).waitFor();
    assert.deepEqual(await titles(page), []);
  }
});

test('in the form of a class its worlds take the place of the others', async (t) => {
  const page = await openPage(t, browser);
  await page.goto(`${server}/class/#teach`);
  await page.waitForSelector('#pick button');
  await page.fill('#password', 'a password');
  await page.fill('#world', FOLDER);
  await page.click('#open-class');
  await page.waitForFunction((count) => document.querySelectorAll('#pick button').length === count, IN_FOLDER.length);
  assert.equal(await page.textContent('#open-problem'), 'Please choose one of these worlds.');
  await page.locator('#pick button', { hasText: DUEL }).click();
  assert.match(await page.inputValue('#world'), /^local:\/demo_projects\/robots\/.*\.wbt$/);
});

test('an operator lists worlds, folders and groups, in words of the own', async (t) => {
  await list(t, [
    'local:/demo_projects/patrol',
    { url: WORLD, title: '<b>Lesson 1</b>', group: 'Week 1' },
    { url: 'local:/demo_projects/robots', group: 'Week 2' },
    { url: 'https://github.com/o/r/blob/main/worlds/pick_and_place.wbt', text: 'From afar', group: 'Week 1' },
  ], 6);
  const page = await openGallery(t, { worlds: 6 });
  assert.deepEqual(await titles(page), [PATROL, PATROL_IN_C, '<b>Lesson 1</b>', 'Pick and place', 'Corridor', DUEL]);
  assert.deepEqual(await page.locator('.group h2:visible').allTextContents(), ['Week 1', 'Week 2']);
});

test('a page that is open shows what has changed, and the focus stays', async (t) => {
  const page = await openGallery(t);
  await page.locator('.world').first().focus();
  await list(t, [WORLD], 1);
  await page.waitForSelector('body[data-worlds="1"]');
  assert.equal(await page.locator('.world').evaluate((link) => link === document.activeElement), true);
});

test('without a gallery the address leads to the viewer', async (t) => {
  await list(t, [], 0);
  const page = await openPage(t, browser);
  await page.goto(server);
  assert.equal(page.url(), `${server}/viewer/`);
  await page.goto(`${server}/viewer/worlds/`);
  await page.locator('#nothing').waitFor();
});

test('it says what the site is, as the viewer does', async (t) => {
  const page = await openGallery(t);
  const says = (text) => page.waitForFunction((wanted) => document.getElementById('light-text').textContent === wanted, text);
  await says('A machine is free.');
  const other = await openGallery(t);
  await other.locator('.world').first().click();
  await isRunning(other);
  await says('Every seat is taken. You can wait in line.');
  await quit(other);
  await says('A machine is free.');
});

for (const colorScheme of ['light', 'dark']) {
  for (const [name, size] of Object.entries({ phone: PHONE, laptop: { viewport: { width: 1280, height: 720 } } })) {
    test(`axe-core finds nothing: ${name}, ${colorScheme}`, async (t) => {
      await list(t, ['local:/demo_projects/patrol', { url: 'local:/demo_projects/robots', group: 'Robots' }], 5);
      const page = await openGallery(t, { worlds: 5, ...size, colorScheme });
      assert.deepEqual(await accessibilityFindings(page), []);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true, 'it is too wide');
      await page.goto(`${server}/viewer/worlds/?of=${FOLDER}/${'a_folder_with_a_long_name'.repeat(5)}`);
      await page.locator('#trouble').waitFor();
      assert.deepEqual(await accessibilityFindings(page), []);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true, 'it is too wide with an address');
    });
  }
}

test('an address that leads nowhere says so in the language of the reader, and leads back', async (t) => {
  const told = new Set();
  for (const locale of LANGUAGES) {
    const page = await openPage(t, browser, { locale, ...PHONE });
    const answer = await page.goto(`${server}/viewer/worlds/nowhere`);
    assert.equal(answer.status(), 404);
    assert.equal(await page.locator('html').getAttribute('lang'), locale);
    told.add(await page.locator('h1').textContent());
    assert.deepEqual(await accessibilityFindings(page), []);
    assert.ok(await page.evaluate('document.documentElement.scrollWidth <= innerWidth'), 'nothing is beside the screen');
    await page.click('main a');
    await page.waitForURL(`${server}/viewer/worlds/`);
    await page.context().close();
  }
  assert.equal(told.size, LANGUAGES.length);
});

test('it speaks seven languages', async (t) => {
  const page = await openGallery(t);
  const leads = new Set();
  for (const language of LANGUAGES) {
    await page.selectOption('#language', language);
    await page.waitForSelector(`html[lang="${language}"]`);
    assert.doesNotMatch(await page.locator('body').innerText(), /\b(gallery|viewer|site)\.[a-z]/);
    leads.add(await page.textContent('.lead'));
  }
  assert.equal(leads.size, LANGUAGES.length);
});
