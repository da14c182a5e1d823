// The site in Chromium, opened from disk and without a network: it is searched, read on a telephone and in the dark. Run by site_test.py,
// with the folder of the site in SITE.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { test } from 'node:test';
import { openBrowser } from '../viewer/page.mjs';

const site = (path) => `${pathToFileURL(process.env.SITE)}/${path}`;
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
const browser = await openBrowser();

// Opens a page of the site, which may load files of the site only, and whose scripts may not fail.
async function open(t, path, options = {}) {
  const context = await browser.newContext({ locale: 'en-US', viewport: { width: 1280, height: 800 }, offline: true, ...options });
  const page = await context.newPage();
  const complaints = [];
  page.on('pageerror', (error) => complaints.push(`${error}`));
  page.on('request', (request) => /^(data:|file:)/.test(request.url()) || complaints.push(request.url()));
  t.after(async () => {
    await context.close();
    assert.deepEqual(complaints, []);
  });
  await page.goto(site(path));
  return page;
}

const background = (page) => page.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number)[0]);

test('the search finds a section', async (t) => {
  const page = await open(t, 'index.html');
  await page.waitForURL(/docs\/index\.html/);
  await page.fill('.sidebar-search', 'waiting room');
  await page.press('.sidebar-search', 'Enter');
  await page.getByRole('link', { name: 'The waiting room' }).click();
  await page.waitForURL(/scheduling\.html.*#the-waiting-room$/);
});

test('the search shows the sentence around the word', async (t) => {
  const page = await open(t, 'search.html?q=certificate');
  await page.getByText('Search finished').waitFor();
  const results = page.locator('ul.search > li');
  await results.first().locator('.context').waitFor();
  const pages = await results.count();
  await page.waitForFunction((count) => document.querySelectorAll('ul.search > li .context').length === count, pages);
  assert.match((await results.locator('.context').allInnerTexts()).join(' '), /certificate/i);
});

test('what to do is found before why', async (t) => {
  const page = await open(t, 'search.html?q=certificate');
  await page.getByText('Search finished').waitFor();
  const found = await page.locator('ul.search > li > a').evaluateAll((links) => links.map((link) => link.getAttribute('href')));
  assert.ok(found.some((path) => path.includes('docs/gateway')) && found.some((path) => path.includes('docs/decisions/')), `${found}`);
  assert.ok(found.findLastIndex((path) => path.includes('docs/gateway')) < found.findIndex((path) => path.includes('docs/decisions/')), `${found}`);
});

test('the API reference is found from the start page, and searched', async (t) => {
  const page = await open(t, 'docs/index.html');
  await page.getByRole('link', { name: 'API reference' }).click();
  await page.waitForURL(/api\/index\.html/);
  await page.locator('#MSearchField').pressSequentially('LoadMonitor');
  const results = await page.locator('iframe#MSearchResults').count() ? page.frameLocator('#MSearchResults') : page; // of Doxygen before 1.9.8
  await results.locator('.SRResult:visible', { hasText: 'LoadMonitor' }).first().waitFor();
});

test('pages follow the colours of the system, and a button changes them', async (t) => {
  const light = await open(t, 'README.html');
  assert.ok(await background(light) > 200);
  const dark = await open(t, 'README.html', { colorScheme: 'dark' });
  assert.ok(await background(dark) < 60);
  await dark.click('.theme-toggle-content button.theme-toggle');
  assert.ok(await background(dark) > 200);
});

const undrawn = existsSync(`${process.env.SITE}/_static/mermaid.tiny.js`) ? false : 'npm could not install what draws them';
test('diagrams are drawn', { skip: undrawn }, async (t) => {
  const page = await open(t, 'docs/inside.html');
  const diagrams = page.locator('pre.mermaid');
  await diagrams.last().locator('svg').waitFor();
  assert.equal(await diagrams.locator('svg').count(), await diagrams.count());
  assert.match(await diagrams.first().locator('svg').textContent(), /GET \/session/);
});

test('no page is wider than a telephone', async (t) => {
  for (const path of ['docs/index.html', 'README.html', 'ARCHITECTURE.html', 'docs/protocol.html', 'docs/performance.html']) {
    const page = await open(t, path, PHONE);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), path);
  }
});

test("the teacher's page fits on one screen", async (t) => {
  const page = await open(t, 'docs/class.html', { viewport: { width: 1920, height: 940 } }); // 1080 without what a browser has around a page
  const { bottom, height } = await page.evaluate(() => ({ bottom: document.querySelector('article').getBoundingClientRect().bottom, height: innerHeight }));
  assert.ok(bottom <= height, `${bottom} of ${height}`);
});

test('the API reference has the colours of the other pages, light and dark', async (t) => {
  for (const colorScheme of ['light', 'dark']) {
    const colours = [];
    for (const path of ['README.html', 'api/index.html']) {
      const page = await open(t, path, { colorScheme });
      colours.push(await page.evaluate(() => {
        const style = (selector) => getComputedStyle(document.querySelector(selector));
        return [style('body').backgroundColor, style('article p a, .contents p a').color, style('article p, .contents p').fontFamily];
      }));
    }
    assert.deepEqual(colours[1], colours[0], colorScheme);
  }
});

test('the API reference leaves the page its room on a telephone', async (t) => {
  const page = await open(t, 'api/index.html', PHONE);
  assert.ok((await page.locator('#doc-content').boundingBox()).width > PHONE.viewport.width * 0.9);
});

test('what a metric means is seen without scrolling', async (t) => {
  const page = await open(t, 'docs/metrics.html');
  const wide = await page.locator('.table-wrapper').evaluateAll((tables) => tables.filter((table) => table.scrollWidth > table.clientWidth).length);
  assert.equal(wide, 0);
});

test('options keep both of their dashes in sentences', async (t) => {
  const page = await open(t, 'docs/git.html');
  await page.getByRole('cell', { name: 'git clone --depth=1, sparse checkout' }).waitFor();
});
