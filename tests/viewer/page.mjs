// Chromium or Firefox for tests of pages: one for each file of tests, and a new context, as fresh as a new profile, for each page.
//
//   const browser = await openBrowser();     // ends with the tests of the file
//   test('…', async (t) => { const page = await openPage(t, browser, { viewport: { width: 360, height: 740 } }); … });
//
// When a test ends, its page has asked no other host for anything, or the test fails.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';
import { after } from 'node:test';

// Installed by test.sh; not beside this file, which may be read-only.
const require = createRequire(new URL('../../build/node/tests/viewer/package.json', import.meta.url));

const PATIENCE_MS = 110000; // A world that has run waits up to 90 s where a machine has too little left: docs/visitors.md.
const ARGUMENTS = ['--disable-gpu', '--disable-dev-shm-usage', '--disable-quic', '--no-proxy-server', '--hide-scrollbars'];

// Firefox is the one of the system, which Playwright drives by WebDriver BiDi.
const FIREFOX = {
  channel: 'moz-firefox',
  executablePath: '/usr/bin/firefox-esr',
  firefoxUserPrefs: {
    'dom.w3c_touch_events.enabled': 1,
    'ui.useOverlayScrollbars': 1, // they take no room, as in Chromium
    'webgl.force-enabled': true // without a graphics card
  }
};

// Chromium without windows and services, if it is installed: the same pages for a third of the processor time.
const CHROMIUM = '/usr/bin/chromium';
const SHELL = `${CHROMIUM}-headless-shell`;

// Which browser these tests run in: `firefox` or, if nothing is said, `chromium`.
export const BROWSER = process.env.WEBOTS_CLOUD_BROWSER ?? 'chromium';

// For the option `skip` of a test: the reason, in Firefox alone.
export const inFirefox = (reason) => (BROWSER === 'firefox' ? reason : false);

// `args` are those of Chromium. `whole`: all of Chromium, also where its shell is installed.
export async function openBrowser({ args = [], whole = false } = {}) {
  const { chromium, firefox } = require('playwright-core');
  const browser = BROWSER === 'firefox' ? await firefox.launch(FIREFOX)
    : await chromium.launch({
      executablePath: !whole && existsSync(SHELL) ? SHELL : CHROMIUM,
      chromiumSandbox: false, // it refuses to start as root
      args: [...ARGUMENTS, ...args]
    });
  after(() => browser.close());
  return browser;
}

// Opens an empty page, which waits at most `patience` ms for anything. The other options are those of Playwright's newContext().
export async function openPage(t, browser, { patience = PATIENCE_MS, ...options } = {}) {
  const context = await browser.newContext({ locale: 'en-US', viewport: { width: 1280, height: 800 }, ...options });
  context.setDefaultTimeout(patience);
  const page = await context.newPage();
  loadWhole(page);
  const foreign = foreignRequests(page);
  const complaints = [];
  page.on('pageerror', (error) => isOfBrowser(`${error}`) || complaints.push(`${error}`));
  t.after(async () => {
    await context.close();
    assert.deepEqual(foreign, [], 'requests to other hosts');
    assert.deepEqual(complaints, [], 'errors in scripts');
  });
  return page;
}

// Firefox reports what it could not load, or was told not to, like an error in a script; Chromium writes it to the console.
export const isOfBrowser = (text) => BROWSER === 'firefox' &&
  /^(Firefox can’t establish a connection|The connection to \S+ was interrupted|Cross-Origin Request Blocked:|Loading module from|Content-Security-Policy:|XML Parsing Error:)/.test(text);

// Chromium drops what it is loading when a network interface of the machine comes or goes, as other tests make them do: then `goto` loads
// the page once more.
function loadWhole(page) {
  const dropped = 'net::ERR_NETWORK_CHANGED';
  const load = page.goto.bind(page);
  page.goto = async (...options) => {
    for (let attempts = 10; ; --attempts) {
      let isWhole = true;
      const look = (request) => { isWhole &&= request.failure()?.errorText !== dropped; };
      page.on('requestfailed', look);
      try {
        const answer = await load(...options);
        if (isWhole || attempts === 1)
          return answer;
      } catch (failure) {
        if (!`${failure}`.includes(dropped) || attempts === 1)
          throw failure;
      } finally {
        page.off('requestfailed', look);
      }
    }
  };
}

// What the page asks of other hosts than this machine, as a list that grows.
function foreignRequests(page) {
  const foreign = [];
  const look = (address) => {
    const { protocol, hostname } = new URL(address);
    if (!['data:', 'blob:', 'about:'].includes(protocol) && !['127.0.0.1', 'localhost'].includes(hostname))
      foreign.push(address);
  };
  page.on('request', (request) => look(request.url()));
  page.on('websocket', (socket) => look(socket.url()));
  return foreign;
}

// Waits until `condition` (which may be asynchronous) returns something true, and returns that.
export async function until(condition, what) {
  const deadline = Date.now() + PATIENCE_MS;
  for (;;) {
    const found = await condition();
    if (found)
      return found;
    assert.ok(Date.now() < deadline, `waited in vain for ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

// Another page, and Back: browsers show the page as it was, if they have kept it, or load it again.
export async function leaveAndGoBack(page) {
  await page.goto('about:blank');
  await page.goBack();
}

// What axe-core has to say against the page as it is now: a list of sentences.
export async function accessibilityFindings(page) {
  await page.evaluate(`${require('axe-core').source}; 0`);
  const { violations } = await page.evaluate('axe.run()');
  return violations.flatMap(({ id, help, nodes }) => nodes.map((node) => `${id}: ${help}: ${node.html.slice(0, 200)} ${node.failureSummary ?? ''}`));
}

