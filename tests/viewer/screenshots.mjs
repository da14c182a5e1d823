// Makes the picture of the viewer in README, with the demo simulator behind the fake servers:
//
//   tests/support/run_page_test.sh tests/viewer/screenshots.mjs
//
// With FOLDER=build/screenshots in the environment: pictures of the gallery, of every state of the viewer and the monitors, of a refusal and the website of the example,
// to be looked at: in several sizes, light and dark, in two languages. Needs the release build; the picture
// of README also the package pngquant. (Those of a class: class_screenshots.mjs. Those of the tutorial: tutorial_pictures.mjs.)

import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { freePort } from '../support/free_port.mjs';
import { startDemoSimulator } from './demo_simulator.mjs';
import { saveDocumentPicture } from './document_picture.mjs';
import { FakeCloud } from './fake_cloud.mjs';
import { startFakeMonitor } from './fake_monitor.mjs';
import { DECISIONS, SESSION, SIMULATION } from './monitor_states.mjs';
import { openBrowser, openPage, until } from './page.mjs';

const { FOLDER } = process.env;
const root = (path) => fileURLToPath(new URL(`../../${path}`, import.meta.url));
const WORLD = 'https://github.com/owner/repository/blob/main/worlds/arena.wbt';
const WIDE = { viewport: { width: 1280, height: 800 } };
const mobile = (width, height, deviceScaleFactor) => ({ viewport: { width, height }, deviceScaleFactor, hasTouch: true, isMobile: true });
const SIZES = { wide: { viewport: { width: 1280, height: 720 } }, large: { viewport: { width: 1440, height: 900 } }, tablet: mobile(768, 1024, 2), upright: mobile(390, 844, 3), 'on-its-side': mobile(844, 390, 3) };
const LOOKS = { light: { colorScheme: 'light', locale: 'en-US' }, dark: { colorScheme: 'dark', locale: 'de-DE' } };
const SHOWN_MS = 2000; // simulated time that passes before the picture is taken

// Of the graphics processors that test machines do not have.
const browser = await openBrowser({ args: ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'] });
const cloud = new FakeCloud();
after(() => cloud.close());
const monitors = { session: await startFakeMonitor('session'), simulation: await startFakeMonitor('simulation') };

const state = (page, name) => page.waitForSelector(`body[data-state="${name}"]`);
const simulate = (page, milliseconds = SHOWN_MS) => page.waitForFunction((time) => Number(document.body.dataset.time) > time, milliseconds);

async function openViewer(t, options) {
  await cloud.renew();
  await cloud.set('heartbeats', true);
  const port = await startDemoSimulator(); // a new one, whose first page this is
  await cloud.set('launch', ['heartbeat: 1', 'shutdownTimeout: 7200', `webots:ws://127.0.0.1:${port}`, 'reconnectToken: a1b2']);
  const page = await openPage(t, browser, options);
  // The fake servers lack it, real ones do not.
  await page.route('**/view/x_ite/*', (route) => route.fulfill({ path: root(`build/node/src/web/view/node_modules/x_ite/dist/${basename(route.request().url())}`) }));
  await page.goto(`${await cloud.get('page')}?url=${WORLD}`);
  await page.waitForSelector('body[data-availability="available"]');
  return page;
}

async function openLine() {
  await cloud.renew();
  await cloud.set('defaults', { waiting: true });
  await cloud.set('relays', true);
  await cloud.set('place', [3, '-', '-']);
  await cloud.call('set_available', '0');
}

async function run(page) {
  await page.click('#start');
  await page.waitForSelector('#picture[data-live]');
  await simulate(page);
}

// What brings the viewer into each of its states, from the state before.
const STATES = {
  idle: async () => {},
  help: async (page) => {
    await page.click('#address > summary');
    await page.click('#grammar summary');
  },
  'wrong-address': async (page) => {
    await page.fill('#connect-to', 'nonsense');
    await page.click('#start');
    await state(page, 'failed');
    await page.fill('#connect-to', WORLD);
    await page.evaluate(() => document.activeElement.blur());
  },
  full: async (page) => {
    await cloud.set('answer', 'Error: no simulation server available at the moment.');
    await cloud.call('set_available', '0');
    await page.waitForSelector('body[data-availability="full"]');
    await page.click('#start');
    await state(page, 'failed');
  },
  'free-again': async (page) => {
    await cloud.set('answer', null);
    await cloud.call('set_available', '1');
    await page.waitForSelector('body[data-availability="available"][data-state="idle"]');
  },
  refused: async (page) => {
    const launch = await cloud.get('launch');
    await cloud.set('launch', ['reason: {"code":"no-repository","values":{"name":"owner/repository"}}', 'loading: Error: Repository owner/repository does not exist or is private.']);
    await page.click('#start');
    await page.waitForSelector('#status.problem');
    await cloud.call('close', 'simulation');
    await state(page, 'failed');
    await cloud.set('launch', launch);
  },
  starting: async (page) => {
    const launch = await cloud.get('launch');
    await cloud.set('launch', ['heartbeat: 1', 'loading: Receiving objects: 42% (42/100)']);
    await page.click('#start');
    await page.waitForSelector('#progress[value="42"]');
    await cloud.set('launch', launch);
  },
  running: async (page) => {
    for (const line of await cloud.get('launch'))
      await cloud.call('send', 'simulation', line);
    await page.waitForSelector('#picture[data-live]');
    await simulate(page);
  },
  share: async (page) => {
    await page.click('#share');
    await page.waitForSelector('#qr svg');
  },
  camera: async (page) => {
    await page.keyboard.press('Escape');
    await page.click('#show-help');
  },
  console: async (page) => {
    await page.keyboard.press('Escape');
    await page.click('#show-console');
  },
  warning: async (page) => {
    await page.click('#show-console');
    await cloud.call('send', 'simulation', 'shutdownTimeout: 240');
    await cloud.call('send', 'simulation', 'extendable: 900');
    await page.waitForSelector('#warning:not([hidden])');
  },
  paused: async (page) => {
    await page.click('#dismiss');
    await page.click('#pause');
    await state(page, 'paused');
  },
  lost: async (page) => {
    await page.click('#play');
    await state(page, 'running');
    await cloud.set('mute', ['simulation']);
    await state(page, 'lost');
  },
  ended: async (page) => {
    await cloud.set('mute', []);
    await state(page, 'running');
    await cloud.call('send', 'simulation', 'reason: {"code":"crashed"}');
    await cloud.call('send', 'simulation', 'loading: Error: Webots has quit unexpectedly: it was ended by signal 11.');
    await cloud.call('close', 'simulation');
    await state(page, 'ended');
  },
};

// The line of a session server.
const LINE = {
  busy: async (page) => page.waitForSelector('body[data-room][data-availability="full"]'),
  'waiting-no-estimate': async (page) => {
    await page.click('#start');
    await state(page, 'waiting');
  },
  waiting: async (page) => {
    await cloud.call('move', 3, 60, 480);
    await page.waitForFunction(() => document.getElementById('status').textContent.includes('8'));
  },
  next: async (page) => {
    await cloud.call('move', 0);
    await page.waitForFunction(() => !document.getElementById('status').textContent.includes('4'));
  },
  returning: async (page) => {
    await cloud.call('close', 'line', 1012);
    await cloud.call('shut', 'session');
    await page.waitForFunction(() => /[56]\d/.test(document.getElementById('status').textContent));
    await cloud.call('open', 'session');
  },
};

// --- The real servers, with the example's website

const endings = []; // what is left to do after the tests, in this order
after(async () => {
  for (const end of endings)
    await end();
});

async function startSite() {
  const folder = await mkdtemp(join(tmpdir(), 'webots_cloud_screenshots_'));
  endings.push(() => rm(folder, { recursive: true }));
  const [session, simulation, website] = [await freePort(), await freePort(), await freePort()];
  const common = { server: 'localhost', ssl: false, portRewrite: false, listenAddress: '127.0.0.1', logDir: folder };
  const start = async (program, port, config) => {
    await writeFile(join(folder, `${program}.json`), JSON.stringify({ port, ...config }));
    const environment = { ...process.env, HOME: folder, WEBOTS_DEMO_ADDRESS: '127.0.0.1', XDG_RUNTIME_DIR: '', XDG_STATE_HOME: join(folder, 'state') };
    const child = spawn(root(`build/release/bin/${program}`), [join(folder, `${program}.json`)], { cwd: folder, stdio: 'ignore', env: environment });
    const ended = once(child, 'exit');
    endings.unshift(async () => {
      child.kill();
      await ended;
    });
  };
  const FORGES = { forges: [{ url: 'local:', directory: root('examples') }], allowedRepositories: ['local:/demo_projects'] };
  const projects = [{ name: 'robots', world: 'arena.wbt', controller: 'avoid_walls', title: 'Robots in an arena' }];
  const users = [{ id: 1, name: 'Demo', email: 'demo@localhost', password: 'demo' }];
  await start('webots-website-host', website, { sessionServer: `ws://localhost:${session}`, keyFile: join(folder, 'key/localhost'), usersDir: join(folder, 'user'),
    pageDir: root('examples/website_host/page'), users, projects,
    hint: 'Demonstration: demo@localhost, password demo' });
  await until(() => fetch(`http://localhost:${website}/site.json`).then(() => true, () => false), 'the website'); // It makes the key.
  await start('webots-simulation-server', simulation, { ...common, ...FORGES, notify: [], sandbox: 'none', simulationUser: 'none',
    projectsDir: root('examples/demo_projects'), keyDir: join(folder, 'key') });
  await start('webots-session-server', session, { ...common, simulationServers: [`localhost:${simulation}`, 'localhost:9'], loadRefresh: 0.5, loadThreshold: 1000 });
  await until(() => fetch(`http://localhost:${session}/`).then((answer) => answer.text()).then((text) => text === '1', () => false), 'the servers');
  return { session: `http://localhost:${session}`, simulation: `http://localhost:${simulation}`, website: `http://localhost:${website}` };
}

const shoot = (page, size, look, name, more = {}) => page.screenshot({ path: `${FOLDER}/${name}-${size}-${look}.png`, scale: 'css', ...more });

if (FOLDER === undefined) {
  test('viewer.png', async (t) => {
    const page = await openViewer(t, WIDE);
    await run(page);
    await saveDocumentPicture(page, 'viewer');
  });
} else {
  await mkdir(FOLDER, { recursive: true });
  for (const [size, options] of Object.entries(SIZES)) {
    for (const [look, language] of Object.entries(LOOKS)) {
      test(`viewer ${size} ${look}`, async (t) => {
        const page = await openViewer(t, { ...options, ...language });
        for (const [name, reach] of Object.entries(STATES)) {
          await reach(page);
          await shoot(page, size, look, `viewer-${name}`);
        }
      });
    }
    for (const [look, language] of Object.entries({ ...LOOKS, chinese: { colorScheme: 'light', locale: 'zh-CN' } })) {
      test(`line ${size} ${look}`, async (t) => {
        await openLine();
        const page = await openPage(t, browser, { ...options, ...language });
        await page.goto(`${await cloud.get('page')}?url=${WORLD}`);
        for (const [name, reach] of Object.entries(LINE)) {
          await reach(page);
          await shoot(page, size, look, `viewer-${name}`);
        }
      });
    }
  }
  for (const [kind, states] of Object.entries({ session: SESSION, simulation: SIMULATION })) {
    const monitor = monitors[kind];
    monitor.decisions = DECISIONS;
    for (const [size, options] of Object.entries(SIZES)) {
      for (const [look, language] of Object.entries(LOOKS)) {
        test(`monitor of a ${kind} server ${size} ${look}`, async (t) => {
          for (const [name, snapshot] of Object.entries(states)) {
            monitor.snapshot = { ...snapshot, now: Date.now() / 1000 };
            const page = await openPage(t, browser, { ...options, ...language });
            await page.goto(monitor.url);
            await page.waitForSelector('#connection:not([hidden])');
            await shoot(page, size, look, `monitor-${kind}-${name}`, { fullPage: true });
            if (['five', 'running'].includes(name)) {
              await page.click('[data-span="day"]');
              await page.click('#operator');
              await page.waitForSelector('td.action');
              await shoot(page, size, look, `monitor-${kind}-operator`, { fullPage: true });
              await page.click('td.action button');
              await shoot(page, size, look, `monitor-${kind}-question`);
            }
            await page.context().close();
          }
        });
      }
    }
  }
  let site = null;
  for (const size of ['wide', 'upright', 'on-its-side']) {
    for (const [look, language] of Object.entries(LOOKS)) {
      test(`site ${size} ${look}`, async (t) => {
        site ??= await startSite();
        const options = { ...SIZES[size], ...language };
        const gallery = await openPage(t, browser, options);
        await gallery.goto(site.session);
        await gallery.waitForSelector('body[data-availability="available"][data-worlds]:not([data-worlds="0"], [data-worlds="1"])');
        await shoot(gallery, size, look, 'gallery', { fullPage: true });
        await gallery.context().close();
        const viewer = await openPage(t, browser, options);
        await viewer.goto(`${site.session}/viewer/?mode=w3d&url=local:/demo_projects/robots/blob/main/worlds/arena.wbt`);
        await viewer.waitForSelector('body[data-availability="available"]');
        await viewer.click('#start');
        await viewer.waitForSelector('body[data-state="running"]', { timeout: 60000 }); // Scenes are slow without a graphics processor.
        await viewer.waitForSelector('#scene:not([hidden])');
        await simulate(viewer);
        await shoot(viewer, size, look, 'viewer-scene');
        await viewer.click('#pause'); // Or else drawing it leaves no time for the other pages' pictures.
        await state(viewer, 'paused');
        for (const name of ['session', 'simulation']) {
          const monitor = await openPage(t, browser, options);
          await monitor.goto(`${site[name]}/monitor`);
          await monitor.waitForSelector('#history .line');
          await shoot(monitor, size, look, `monitor-${name}`, { fullPage: true });
          await monitor.context().close();
        }
        const refusal = await openPage(t, browser, options);
        await refusal.goto(`${site.session}/nothing`);
        await shoot(refusal, size, look, 'refusal');
        await refusal.context().close();
        await viewer.context().close();
        const website = await openPage(t, browser, options);
        await website.goto(site.website);
        await website.waitForSelector('#start');
        await shoot(website, size, look, 'website-idle', { fullPage: true });
        await website.click('#start');
        await website.waitForFunction(() => globalThis.webots?.currentView?.state === 'running');
        await website.waitForSelector('#editor :text("robot")');
        await shoot(website, size, look, 'website-running', { fullPage: true });
      });
    }
  }
}
