// class View and <webots-view>, in Chromium on pages of other sites. The servers are played by Playwright: no port is opened.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { before, beforeEach, describe, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { accessibilityFindings, inFirefox, isOfBrowser, openBrowser, until } from './page.mjs';

const HERE = new URL('.', import.meta.url);
const HOST = 'https://cloud.test'; // the session server, whose /view/ has the modules
const SITE = 'https://www.website.test'; // the page of somebody else
const OWN = 'wss://cloud.test'; // its sockets
const MACHINE = 'wss://machine.test/2000';
const SIMULATOR = 'wss://machine.test/2001';
const PROJECT = 'wss://cloud.test/student/simple/worlds/simple.wbt';
const WORLD = 'https://github.com/owner/repository/blob/main/worlds/arena.wbt';
const LIBRARY = '/build/node/src/web/view/node_modules/x_ite/dist/'; // installed by ./test.sh
const PICTURE = Buffer.from('iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==', 'base64');
const DEADLINE_MS = 20000; // The machine may be busy with other tests.

const SCENE = `<?xml version="1.0" encoding="UTF-8"?><Scene><WorldInfo id="n1"/><Viewpoint id="n2" position="0 0 5"/>
<Transform id="n3" name="e-puck" controller="line" window="panel"><Shape><Appearance><Material diffuseColor="1 0 0"/></Appearance><Box size="1 1 1"/></Shape></Transform>
<Transform id="n4" name="other" controller="&lt;extern&gt;"/></Scene>`;

const TEN_LINES = (attributes) => `<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>My robot</title></head>
<body><main>
<h1>My robot</h1>
<script type="module" src="${HOST}/view/webots_view.js"></script>
<webots-view ${attributes}></webots-view>
</main></body>
</html>`;

const WITH_CLASS = (before = '') => `<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>My robot</title><script>${before}</script></head>
<body><main><h1>My robot</h1><div id="here"></div></main>
<script type="module">
import '${HOST}/view/webots_view.js';
const view = globalThis.view = new webots.View(document.getElementById('here'), false);
globalThis.told = [];
for (const name of ['onready', 'onclose', 'onerror', 'onstdout', 'onstderr', 'onrobotmessage', 'oncontroller', 'onquit', 'onstate'])
  view[name] = (...values) => told.push([name, ...values]);
</script></body></html>`;

// Of every answer of a simulation.
const SANDBOX = 'sandbox allow-scripts allow-forms allow-popups allow-downloads';

// What a test says of the servers, and what they have heard.
class Cloud {
  session = MACHINE; // the answer of /session
  leases = []; // messages on /client
  launch = ['shutdownTimeout: 7200', `webots:${SIMULATOR}`]; // the answer to the first of them
  controls = []; // messages to the simulator
  windows = []; // messages of robot windows
  requests = []; // addresses, but those of modules
  uploads = [];
  origins = new Set(); // hosts asked for anything
  refuse = false; // the WebSocket of the simulation server
  world = ['world:worlds/arena.wbt:worlds/arena.wbt;worlds/corridor.wbt'];
  upload = 'OK';
  available = '1'; // what the session server tells of its machines
  watchers = []; // sockets to which it tells that
  lease = null;
  simulator = null;
  pages = {};
  hasLibrary = false; // of 3D

  sendLease(text) { this.lease.send(text); }
  send(text) { this.simulator.send(text); }

  async serve(route) {
    const url = new URL(route.request().url());
    this.origins.add(url.origin);
    if (url.origin === HOST && url.pathname.startsWith('/view/'))
      return serveModule(route, this.hasLibrary ? url.pathname.replace('/view/x_ite/', LIBRARY) : url.pathname);
    this.requests.push(url.href);
    if (url.pathname === '/session')
      return route.fulfill({ contentType: 'text/html; charset=UTF-8', headers: { 'Access-Control-Allow-Origin': '*' }, body: this.session });
    if (url.pathname.endsWith('/mjpeg'))
      return route.fulfill({ contentType: 'image/png', body: PICTURE });
    if (url.pathname === '/ajax/upload-file.php') {
      this.uploads.push(route.request().postData());
      return route.fulfill({ contentType: 'text/html', body: this.upload });
    }
    const page = this.pages[url.origin + url.pathname];
    if (page === undefined)
      return route.fulfill({ status: 404, body: '' });
    return route.fulfill({ contentType: 'text/html; charset=utf-8', ...page });
  }

  connect(socket) {
    const url = new URL(socket.url());
    if (['/2000/client', '/client'].includes(url.pathname))
      return this.#takeLease(socket);
    if (url.href === `${OWN}/?state`) {
      this.watchers.push(socket);
      return socket.send(this.available);
    }
    this.#simulate(socket);
  }

  #takeLease(socket) {
    if (this.refuse)
      return socket.close({ code: 1011 });
    this.lease = socket;
    socket.onMessage((message) => {
      this.leases.push(message);
      if (this.leases.length === 1)
        this.launch.forEach((line) => socket.send(line));
    });
  }

  #simulate(socket) {
    socket.onMessage((message) => {
      if (message.startsWith('robot:') && message.endsWith(':init robot window')) {
        this.windows.push(message);
        return socket.send('robot: {"message":"hello","name":"e-puck"}');
      }
      this.controls.push(message);
      if (message.startsWith('mjpeg: ')) {
        this.simulator = socket;
        return ['multimedia: mjpeg pause ', 'pause: 0', ...this.world, 'scene load completed'].forEach((line) => socket.send(line));
      }
      if (/^[wx]3d/.test(message)) {
        this.simulator = socket;
        return [...this.world, `model:${SCENE}`, 'application/json:{"time":0}', 'scene load completed', 'pause: 0'].forEach((line) => socket.send(line));
      }
      const verb = message.split(':')[0];
      if (verb === 'real-time' || verb === 'fast')
        socket.send(verb);
      else if (verb === 'pause' || verb === 'step')
        socket.send('paused by client');
      else if (verb === 'reset')
        socket.send('reset finished');
    });
  }
}

const TYPES = { js: 'text/javascript', mjs: 'text/javascript', json: 'application/json', css: 'text/css', wasm: 'application/wasm' };

async function serveModule(route, path) {
  const file = fileURLToPath(path.startsWith(LIBRARY) ? new URL(`../..${path}`, HERE) : new URL(`../../src/web${path}`, HERE));
  if (!existsSync(file))
    return route.fulfill({ status: 404, headers: { 'Access-Control-Allow-Origin': '*' }, body: '' });
  return route.fulfill({ contentType: TYPES[path.split('.').pop()], headers: { 'Access-Control-Allow-Origin': '*' }, body: await readFile(file) });
}

const browser = await openBrowser({ args: ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
let cloud;
let page;

async function openPage(options) {
  const context = await browser.newContext({ viewport: { width: 900, height: 700 }, ...options });
  await context.route('**/*', (route) => cloud.serve(route));
  await context.routeWebSocket(/.*/, (socket) => cloud.connect(socket));
  const opened = await context.newPage();
  opened.setDefaultTimeout(DEADLINE_MS);
  opened.on('pageerror', (error) => isOfBrowser(`${error}`) || assert.fail(`the page threw ${error.stack}`));
  return opened;
}

before(async () => { page = await openPage({ locale: 'en-US' }); });

beforeEach(async () => {
  cloud = new Cloud();
  await page.goto('about:blank');
});

async function show(html, path = '/lesson/page.html', headers = {}) {
  cloud.pages[SITE + path] = { body: html, headers };
  await page.goto(SITE + path);
}

const state = (name) => page.waitForFunction((wanted) => (globalThis.view?.state ?? document.querySelector('webots-view').dataset.state) === wanted, name);
const heard = (message) => until(() => cloud.controls.includes(message), `${message} among the messages to the simulator`);
const told = (name) => page.evaluate((wanted) => globalThis.told.filter(([called]) => called === wanted).map(([, ...values]) => values), name);
const button = (name) => page.getByRole('button', { name, exact: true });
const controlsAfterOpening = () => cloud.controls.filter((message) => !/^(mjpeg|resize):/.test(message));

async function open(url = PROJECT, before = '', mode = 'mjpeg') {
  await show(WITH_CLASS(before));
  await page.evaluate(([address, how]) => globalThis.view.open(address, how ?? undefined), [url, mode]);
}

describe('The three forms of open', () => {
  test('a project of the website is started with its nine strings, byte for byte', async () => {
    await open(PROJECT, `globalThis.webots = { User1Id: 12, User1Name: 'Ada', User1Authentication: '$2y$10$abc', User2Id: 7, User2Name: 'Zoë', CustomData: 'lap=2' };`);
    await state('paused');
    assert.deepEqual(cloud.leases, ['{ "init" : [ "https://website.test", "student/simple", "simple.wbt", "12", "Ada", "$2y$10$abc", "7", "Zoë", "lap=2" ], "mode" : "mjpeg", "reasons" : true }']);
    assert.ok(cloud.requests.includes(`${HOST}/session`), JSON.stringify(cloud.requests));
    assert.deepEqual(await told('onready'), [[]]);
    assert.deepEqual(controlsAfterOpening(), [], 'it waits for the user');
  });

  test('what is unset is empty, 0 is nobody, and quotes are escaped but never twice', async () => {
    await open(PROJECT, `globalThis.webots = { User1Id: 0, User1Name: 'a "quoted" name', CustomData: '{\\\\"lap\\\\":2}' };`);
    await state('paused');
    assert.equal(cloud.leases[0], '{ "init" : [ "https://website.test", "student/simple", "simple.wbt", "", "a \\"quoted\\" name", "", "", "", "{\\"lap\\":2}" ], "mode" : "mjpeg", "reasons" : true }');
  });

  test('a world of a repository is started with its address, in each way to say it', async () => {
    for (const url of [`wss://cloud.test/session?url=${WORLD}`, `${HOST}/session?url=${WORLD}`, WORLD]) {
      cloud.leases = [];
      cloud.requests = [];
      await open(url);
      await state('paused');
      assert.equal(JSON.parse(cloud.leases[0]).start.url, WORLD);
      assert.equal(JSON.parse(cloud.leases[0]).start.mode, 'mjpeg');
      assert.ok(cloud.requests.includes(`${HOST}/session?url=${WORLD}`), JSON.stringify(cloud.requests));
    }
  });

  test('a simulator is shown without a server of sessions', async () => {
    await open(SIMULATOR);
    await state('paused');
    assert.deepEqual(cloud.leases, []);
    assert.match(cloud.controls[0], /^mjpeg: \d+x\d+$/);
    assert.deepEqual(controlsAfterOpening(), []);
  });

  test('a wrong address is said in a sentence', async () => {
    for (const [url, sentence] of [['wss://cloud.test/simple.wbt', /does not name a project and a world/], ['nonsense', /is not a complete address/]]) {
      await open(url);
      await state('failed');
      assert.match((await told('onerror'))[0][0], sentence);
    }
  });
});

describe('What the user does', () => {
  test('the buttons say what to do, and the time limit follows a start', async () => {
    await open();
    await state('paused');
    await page.evaluate(() => globalThis.view.setTimeout(300));
    await button('Play').click();
    await state('running');
    await heard('timeout:300000');
    await button('Fast').click();
    await state('fast');
    await button('Pause').click();
    await state('paused');
    await button('Step').click();
    await button('Reset').click();
    await heard('reset');
    assert.deepEqual(controlsAfterOpening(), ['real-time:300000', 'timeout:300000', 'fast:300000', 'timeout:300000', 'pause', 'step', 'reset']);
  });

  test('one minute is the limit where the page sets none, and a negative one is none', async () => {
    await open();
    await state('paused');
    await page.evaluate(() => globalThis.view.play());
    await heard('timeout:60000');
    cloud.controls = [];
    await page.evaluate(() => {
      globalThis.view.setTimeout(-1);
      globalThis.view.fast();
    });
    await state('fast');
    await page.evaluate(() => globalThis.view.send('step'));
    await heard('step');
    assert.deepEqual(cloud.controls, ['fast:-1', 'step']);
  });

  test('who broadcasts only watches', async () => {
    await show(WITH_CLASS());
    await page.evaluate((url) => {
      globalThis.view.broadcast = true;
      globalThis.view.runOnLoad = true;
      globalThis.view.setTimeout(10);
      globalThis.view.open(url, 'mjpeg');
    }, SIMULATOR);
    await state('paused');
    cloud.send('real-time');
    await state('running');
    await page.evaluate(() => ['play', 'pause', 'reset'].forEach((name) => globalThis.view[name]()));
    assert.ok(await button('Play').isDisabled());
    await page.mouse.click(450, 300);
    await page.setViewportSize({ width: 700, height: 500 });
    await page.setViewportSize({ width: 900, height: 700 });
    cloud.send('pause: 5');
    await state('paused');
    assert.match(cloud.controls[0], /^mjpeg: /);
    assert.equal(cloud.controls.length, 1, JSON.stringify(cloud.controls));
  });

  test('the other worlds are offered, and the toolbar has what the page wants', async () => {
    await show(WITH_CLASS('globalThis.webots = { showQuit: false, showRevert: true, showRun: false };'));
    await page.evaluate((url) => globalThis.view.open(url, 'mjpeg'), PROJECT);
    await state('paused');
    assert.equal(await button('Quit').count(), 0);
    assert.equal(await button('Fast').count(), 0);
    await button('Reload').click();
    await heard('revert');
    await page.getByRole('combobox', { name: 'World' }).selectOption('corridor.wbt');
    await heard('load:worlds/corridor.wbt');
    assert.equal(await page.getByRole('link', { name: 'Help' }).count(), 0);
    await page.evaluate(() => globalThis.view.setWebotsDocUrl('https://www.website.test/help/'));
    assert.equal(await page.getByRole('link', { name: 'Help' }).getAttribute('href'), 'https://www.website.test/help/');
  });

  test('quit is what the page says it is', async () => {
    await open();
    await state('paused');
    await button('Quit').click();
    await until(async () => (await told('onquit')).length === 1, 'a call of onquit');
    await page.evaluate(() => globalThis.view.close());
    await state('idle');
    assert.deepEqual(await told('onclose'), [[]]);
  });
});

describe('What the simulation says', () => {
  test('lines arrive at the page and in the console', async () => {
    await open();
    await state('paused');
    cloud.send('stdout:first\nstderr:\u001b[31moops\u001b[0m\nrobot: {"message":"hi","name":"e-puck"}\nstdout:<b>last</b>');
    await until(async () => (await told('onstdout')).length === 2, 'two lines');
    assert.deepEqual(await told('onstdout'), [['first'], ['<b>last</b>']]);
    assert.deepEqual(await told('onstderr'), [['\u001b[31moops\u001b[0m']]);
    assert.deepEqual(await told('onrobotmessage'), [['e-puck', 'hi']]);
    await button('Console').click();
    const log = page.getByRole('log', { name: 'Console' });
    await log.getByText('<b>last</b>').waitFor();
    assert.match(await log.innerText(), /^first\noops\n<b>last<\/b>$/);
  });

  test('a coming end is announced, and an editor beside the simulation has a link', async () => {
    cloud.launch = ['ide: enable', 'type:demo\n', 'shutdownTimeout: 299', 'extendable: 600', `webots:${SIMULATOR}`];
    await open();
    await state('paused');
    const notice = page.getByRole('alert');
    await notice.waitFor();
    assert.ok((await notice.innerText()).length > 10);
    await button('More time').click();
    await until(() => cloud.leases.includes('{"extend":600}'), 'a request for more time');
    await button('Close').click();
    await notice.waitFor({ state: 'hidden' });
    assert.equal(await page.getByRole('link', { name: 'Editor' }).getAttribute('href'), 'https://machine.test/2501/#/home/project/webots-project/');
  });

  test('labels lie over the picture, in their place and colour', async () => {
    await open();
    await state('paused');
    cloud.send('label:1;Arial;1,0,0,1;0.1;0.25;0.5;Lap; 2');
    const first = page.getByText('Lap; 2');
    await first.waitFor();
    const [place, stage, colour] = await first.evaluate((element) => [element.getBoundingClientRect(), element.parentElement.getBoundingClientRect(), getComputedStyle(element).color]);
    assert.ok(Math.abs((place.x - stage.x) / stage.width - 0.25) < 0.01 && Math.abs((place.y - stage.y) / stage.height - 0.5) < 0.01);
    assert.equal(colour, 'rgb(255, 0, 0)');
    cloud.send('application/json:{"time":64,"labels":[{"id":1,"font":"Arial","rgba":"0,0,1,1","size":0.1,"x":0,"y":0,"text":"<img src=x>"},{"id":2,"font":"Lucida Console","rgba":"0,1,0,0.5","size":0.05,"x":0.5,"y":0.1,"text":"two"}]}');
    await page.getByText('<img src=x>').waitFor();
    cloud.send('application/json:{"time":96,"labels":[{"id":1,"font":"Arial","rgba":"0,0,1,1","size":0.1,"x":0,"y":0,"text":""}]}');
    await page.getByText('<img src=x>').waitFor({ state: 'detached' });
    assert.equal(await page.getByText('two').count(), 1);
  });

  test('a window of a robot opens in a frame, and its socket talks', async () => {
    cloud.pages['https://machine.test/2001/robot_windows/panel/panel.html'] = { body: `<!DOCTYPE html><html lang="en"><title>w</title><p id="p">-</p><script>
      const name = new URLSearchParams(location.search).get('name');
      const socket = new WebSocket(location.href.replace('http', 'ws').replace(/robot_windows.*/, ''));
      socket.onopen = () => socket.send('robot:' + name + ':init robot window');
      socket.onmessage = ({ data }) => { document.getElementById('p').textContent = data; };
    </script><p id="m">-</p><script type="module" src="more.js"></script>`, headers: { 'Content-Security-Policy': SANDBOX } };
    cloud.pages['https://machine.test/2001/robot_windows/panel/more.js'] = { contentType: 'text/javascript',
      headers: { 'Access-Control-Allow-Origin': '*', 'Content-Security-Policy': SANDBOX },
      body: "document.getElementById('m').textContent = `module of ${origin}`;" };
    await open();
    await state('paused');
    cloud.send('robot window: {"robot":"e-puck","window":"panel"}');
    cloud.send('robot window: {"robot":"e-puck","window":"panel"}');
    assert.equal(await page.locator('iframe').count(), 0);
    await button('Window of e-puck').click();
    await page.frameLocator('iframe[title="e-puck"]').getByText('"message":"hello"').waitFor();
    assert.deepEqual(cloud.windows, ['robot:e-puck:init robot window']);
    await page.frameLocator('iframe[title="e-puck"]').getByText('module of null').waitFor();
    await button('Window of e-puck').click();
    await page.locator('iframe').waitFor({ state: 'detached' });
    cloud.send('robot window: {"remove":true,"robot":"e-puck","window":"panel"}');
    await button('Window of e-puck').waitFor({ state: 'detached' });
  });

  test('a window from the origin of the page cannot reach the page', async () => {
    await show(WITH_CLASS());
    cloud.pages[`${SITE}/2001/robot_windows/evil/evil.html`] = { body: `<!DOCTYPE html><html lang="en"><title>w</title><p id="p">-</p><script>
      try { parent.document.title = 'stolen'; p.textContent = 'reached'; } catch (error) { p.textContent = error.name; }
    </script>` };
    await page.evaluate((url) => globalThis.view.open(url, 'mjpeg'), 'wss://www.website.test/2001');
    await state('paused');
    cloud.send('robot window: {"robot":"evil","visible":true,"window":"evil"}');
    await page.frameLocator('iframe[title="evil"]').getByText('SecurityError').waitFor();
    assert.equal(await page.title(), 'My robot');
  });

  test('a window that leads its frame to the origin of the page has an origin of its own there', async () => {
    await show(WITH_CLASS());
    cloud.pages['https://machine.test/2001/robot_windows/evil/evil.html'] = { headers: { 'Content-Security-Policy': SANDBOX },
      body: `<!DOCTYPE html><html lang="en"><title>w</title><script>location.href = '${SITE}/2001/robot_windows/evil/evil.html';</script>` };
    cloud.pages[`${SITE}/2001/robot_windows/evil/evil.html`] = { headers: { 'Content-Security-Policy': SANDBOX },
      body: `<!DOCTYPE html><html lang="en"><title>w</title><p id="p">-</p><script>
      const tries = [() => parent.document.title, () => sessionStorage.length, () => localStorage.length];
      p.textContent = tries.map((steal) => { try { return 'got ' + steal(); } catch (error) { return error.name; } }).join();
    </script>` };
    await page.evaluate((url) => globalThis.view.open(url, 'mjpeg'), 'wss://machine.test/2001');
    await state('paused');
    cloud.send('robot window: {"robot":"evil","visible":true,"window":"evil"}');
    await page.frameLocator('iframe[title="evil"]').getByText('SecurityError,SecurityError,SecurityError').waitFor();
  });

  test('who only watches sees windows that want to be open when they press the button', async () => {
    await show(WITH_CLASS());
    await page.evaluate((url) => { globalThis.view.broadcast = true; globalThis.view.open(url, 'mjpeg'); }, 'wss://machine.test/2001');
    await until(() => cloud.simulator !== null, 'a viewer');
    cloud.send('robot window: {"robot":"e-puck","visible":true,"window":"panel"}');
    await button('Window of e-puck').waitFor();
    assert.equal(await page.locator('iframe').count(), 0);
    await button('Window of e-puck').click();
    await page.locator('iframe').waitFor();
  });

  test('a window of an old simulation lies beside the page and gets its messages', async () => {
    cloud.pages[`${SITE}/lesson/window/info/info.html`] = { body: '<!DOCTYPE html><html lang="en"><title>w</title><p id="p">-</p>' };
    cloud.pages[`${SITE}/lesson/window/info/info.js`] = { contentType: 'text/javascript', body: `
      webots.window('info').receive = (message, robot) => {
        document.getElementById('p').textContent = robot + ' ' + message;
        webots.window('info').send('thanks', robot);
      };` };
    await open();
    await state('paused');
    cloud.send('world info: {"title":"Other","window":"<none>"}');
    cloud.send('world info: {"title":"Square","window":"info"}');
    await button('Window of Square').click();
    cloud.send('robot:Square:lap 3');
    await page.frameLocator('iframe[title="Square"]').getByText('Square lap 3').waitFor();
    await heard('robot:Square:thanks');
    assert.equal(await button('Window of Other').count(), 0);
  });
});

describe('The editor of a page', () => {
  const USER = `globalThis.webots = { User1Id: 12, User1Name: 'Ada', User1Authentication: 'x' };`;

  test('gets the files of a controller and gives them back', async () => {
    await open();
    await state('paused');
    await page.evaluate(() => globalThis.view.getController('line'));
    await heard('get controller:line');
    cloud.send('set controller:line/line.py:2\nimport robot\nrun()');
    await until(async () => (await told('oncontroller')).length === 1, 'a file');
    assert.deepEqual(await told('oncontroller'), [[{ controller: 'line', file: 'line.py', content: 'import robot\nrun()' }]]);
    await page.evaluate(() => globalThis.view.setController('line', 'line.py', 'a\nb\nc'));
    await heard('set controller:line/line.py:3\na\nb\nc');
    await page.evaluate(() => globalThis.view.resetController('line', 'line.py'));
    await until(() => cloud.leases.includes('{"reset controller":"line/line.py"}'), 'a message to the simulation server');
    cloud.sendLease('reset controller: line/line.py');
    await heard('sync controller:line/line.py');
  });

  test('saves at the website what a user has written, and only then in the simulator', { skip: inFirefox('WebDriver BiDi does not tell what is posted') }, async () => {
    await open(PROJECT, USER);
    await state('paused');
    await page.evaluate(() => globalThis.view.saveController('line', 'line.py', 'x = 1'));
    await heard('set controller:line/line.py:1\nx = 1');
    for (const part of ['name="dirname"\r\n\r\nstudent/simple/controllers/line\r\n', 'name="filename"\r\n\r\nline.py\r\n', 'name="content"\r\n\r\nx = 1\r\n'])
      assert.ok(cloud.uploads[0].includes(part), cloud.uploads[0]);
    cloud.controls = [];
    cloud.upload = 'Error: Disk quota exceeded:<br>10 MB';
    const problem = await page.evaluate(() => globalThis.view.saveController('line', 'line.py', 'x = 2').catch((error) => error.message));
    assert.equal(problem, 'Disk quota exceeded: 10 MB');
    assert.deepEqual(cloud.controls, []);
  });
});

describe('Programs of the simulation', () => {
  const PROGRAM = 'robot.step(32)\n';
  const text = () => page.getByRole('textbox', { name: 'Text of the program' });

  test('are changed in a panel of the view, and saved where the simulation is', async () => {
    await show(WITH_CLASS());
    await page.evaluate((world) => globalThis.view.open(world), WORLD);
    await state('paused');
    assert.equal(await button('Program').count(), 0, 'nothing to change yet');
    assert.equal(JSON.parse(cloud.leases[0]).start.edit, true);
    cloud.sendLease('files: [{"path":"drive/drive.py","changed":false}]');
    await button('Program').click();
    await until(() => cloud.leases.includes('{"original":"drive/drive.py"}'), 'a question for the program');
    cloud.sendLease(`file: ${JSON.stringify({ path: 'drive/drive.py', text: PROGRAM })}`);
    cloud.sendLease(`file: ${JSON.stringify({ path: 'drive/drive.py', original: PROGRAM })}`);
    await page.waitForFunction(() => globalThis.view !== undefined);
    await until(async () => await text().inputValue() === PROGRAM, 'the program');
    await text().fill('pass\n');
    await button('Run').click();
    await until(() => cloud.leases.includes('{"write":{"path":"drive/drive.py","text":"pass\\n"}}'), 'the new program');
    assert.equal(cloud.controls.includes('reset'), false, 'not before it is saved');
    cloud.sendLease('file: {"path":"drive/drive.py","saved":true}');
    await heard('reset');
    await heard('real-time:60000');
    cloud.send('stderr:  File "/i/controllers/drive/drive.py", line 1, in <module>');
    await page.getByText('There is a mistake in drive.py, line 1').waitFor();
    assert.deepEqual(await accessibilityFindings(page), []);
    await button('Program').click();
    assert.equal(await text().count(), 0);
  });

  test('are nobody\u2019s business where the page says so', async () => {
    await show(WITH_CLASS());
    await page.evaluate((world) => {
      globalThis.view.showProgram = false;
      globalThis.view.open(world);
    }, WORLD);
    await state('paused');
    assert.equal(JSON.parse(cloud.leases[0]).start.edit, undefined);
  });
});

describe('The line of the session server', () => {
  async function waitInLine() {
    cloud.session = OWN;
    cloud.launch = ['waitingTicket: ticket-1', 'waiting: 3 60 240'];
    await show(WITH_CLASS());
    await page.evaluate((url) => {
      view.onprogress = (progress) => told.push(['onprogress', progress]);
      view.onticket = (ticket) => told.push(['onticket', ticket]);
      view.open(url, 'mjpeg');
    }, WORLD);
    await state('waiting');
  }

  test('is shown and told, and the simulation starts by itself', async () => {
    await waitInLine();
    const place = { text: 'You are number 4 in line. Every seat is taken. About 1 to 4 minutes.', percent: null, ahead: 3, least: 60, most: 240, why: '', wantsRoom: false };
    assert.deepEqual((await told('onprogress')).at(-1), [place]);
    await page.locator('.report .said', { hasText: place.text }).waitFor();
    await page.locator('.report', { hasText: 'starts by itself' }).waitFor();
    assert.equal(await page.locator('.report .said').getAttribute('aria-live'), 'off');
    assert.equal(await page.locator('.report .unseen').textContent(), place.text);
    assert.deepEqual(await told('onticket'), [[{ machine: OWN, waiting: 'ticket-1' }]]);
    assert.deepEqual(await accessibilityFindings(page), []);
    cloud.sendLease('loading: A machine is free.');
    await state('starting');
    await page.locator('.report .said', { hasText: 'A machine is free' }).waitFor();
    assert.equal(await page.locator('.report .hint').isVisible(), false);
    cloud.sendLease(`webots:${SIMULATOR}`);
    await state('paused');
    assert.deepEqual((await told('onstate')).flat(), ['starting', 'waiting', 'starting', 'paused']);
    assert.deepEqual((await told('onticket')).at(-1), [null]);
    assert.deepEqual([await told('onerror'), await told('onclose')], [[], []]);
  });

  test('is taken again with the ticket, by a view that was opened anew as well', async () => {
    await waitInLine();
    await page.evaluate((url) => view.open(url, 'mjpeg', { ticket: { machine: 'wss://cloud.test', waiting: 'ticket-1' } }), WORLD);
    await until(() => cloud.leases.length === 2, 'the return');
    assert.equal(JSON.parse(cloud.leases[1]).start.waitingTicket, 'ticket-1');
    assert.equal(cloud.requests.filter((url) => url.includes('/session')).length, 1);
  });

  test('is not needed to hear that a machine is free: the view says so, with a button, unless the page does', async () => {
    cloud.session = 'Error: no simulation server available at the moment.';
    cloud.available = '0';
    await open(WORLD);
    await state('failed');
    await until(() => cloud.watchers.length === 1, 'who watches the machines');
    assert.equal(await button('Start simulation').count(), 0);
    const why = { busy: 'The machines are busy: a start may have to wait.', full: 'Every seat is taken.', draining: 'No machine takes new simulations at the moment.', down: 'No machine is running.' };
    for (const [site, text] of Object.entries(why)) {
      cloud.watchers[0].send(site);
      await page.locator('.report.problem .said', { hasText: `${text} This page will tell you when there is one.` }).waitFor();
    }
    cloud.session = MACHINE;
    cloud.watchers[0].send('1');
    await page.locator('.report:not(.problem) .said', { hasText: 'A machine is free now.' }).waitFor();
    assert.deepEqual(await accessibilityFindings(page), []);
    await button('Start simulation').click();
    await state('paused');
    assert.equal(await button('Start simulation').count(), 0);
    cloud.session = 'Error: no simulation server available at the moment.';
    await page.evaluate((url) => {
      view.offersStart = false;
      view.open(url, 'mjpeg');
    }, WORLD);
    await state('failed');
    await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
    assert.equal(cloud.watchers.length, 1);
  });
});

describe('What can go wrong', () => {
  test('a refusal of the server is shown and told', async () => {
    cloud.session = 'Error: no simulation server available at the moment.';
    await open();
    await state('failed');
    const [[text]] = await told('onerror');
    assert.ok(text.length > 20 && !text.includes('allowedOrigins'), text);
    assert.equal(await page.getByRole('status').innerText(), text);
  });

  test('a server of another site that lets nobody in is said to perhaps not know the page', async () => {
    cloud.refuse = true;
    await open();
    await state('failed');
    const [[text]] = await told('onerror');
    assert.match(text, /https:\/\/www\.website\.test.*"allowedOrigins"/);
  });

  test('what the page opened ends when it goes, and is opened again when the browser brings it back', async () => {
    await open();
    await state('paused');
    const closed = new Promise((resolve) => { cloud.lease.onClose(resolve); });
    await page.evaluate(() => dispatchEvent(new PageTransitionEvent('pagehide', { persisted: true })));
    await closed;
    cloud.leases = [];
    await page.evaluate(() => dispatchEvent(new PageTransitionEvent('pageshow', { persisted: true })));
    await until(() => cloud.leases.length === 1, 'another start');
    await state('paused');
  });

  test('a world that is loaded again is ready again', async () => {
    await open();
    await state('paused');
    cloud.send('robot window: {"robot":"e-puck","window":"panel"}');
    await button('Window of e-puck').waitFor();
    for (const message of ['delete world', 'loading:Creating nodes:65'])
      cloud.send(message);
    await button('Window of e-puck').waitFor({ state: 'detached' });
    await page.getByRole('progressbar').waitFor();
    cloud.send('scene load completed');
    await until(async () => (await told('onready')).length === 2, 'a second call of onready');
    cloud.send('scene load completed');
    cloud.send('stdout:done');
    await until(async () => (await told('onstdout')).length === 1, 'a line');
    assert.equal((await told('onready')).length, 2, 'once for each world');
  });

  test('the end of the simulation is said', async () => {
    await open();
    await state('paused');
    await cloud.lease.close();
    await state('ended');
    const [[{ text, failed, full }]] = await told('onclose');
    assert.deepEqual([text.length > 30, failed, full], [true, false, false]);
  });

  test('without 3D, simulations are shown as pictures, and what can only be drawn is explained', async () => {
    await open(PROJECT, '', null);
    await state('paused');
    assert.match(cloud.controls[0], /^mjpeg: /);
    for (const [url, mode] of [['robot.x3d', null], [SIMULATOR, 'w3d']]) {
      await open(url, '', mode);
      await state('failed');
      assert.ok((await told('onerror'))[0][0].length > 30, JSON.stringify(await told('onerror')));
    }
  });

  test('the browser draws the scene where the page asks for it', { skip: inFirefox('without a graphics card it has no WebGL') }, async (t) => {
    if (!existsSync(new URL(`../..${LIBRARY}x_ite.min.mjs`, HERE)))
      return t.skip('x_ite is not installed (./test.sh does it, with npm)');
    cloud.hasLibrary = true;
    await open(PROJECT, '', null);
    await state('paused');
    assert.match(cloud.controls[0], /^mjpeg: /, 'the default is a picture everywhere');
    Object.assign(cloud, { leases: [], controls: [] });
    await open(PROJECT, '', 'w3d');
    await state('paused');
    assert.match(cloud.leases[0], /"simple.wbt", "", "", "", "", "", "" \], "reasons" : true }$/, 'as websites have asked for scenes ever');
    assert.match(cloud.controls[0], /^w3d\b/);
    await page.locator('canvas').waitFor();
    assert.deepEqual(await page.evaluate(() => globalThis.view.getControllers()), ['line']);
    cloud.send('application/json:{"time":64,"updates":[{"id":3,"translation":"1 0 0"}],"labels":[{"id":1,"font":"Arial","rgba":"0,0,1,1","size":0.1,"x":0,"y":0,"text":"Lap"}]}');
    await page.getByText('Lap', { exact: true }).waitFor();
    await page.waitForFunction(() => globalThis.view.time === 64);
    await button('Window of e-puck').waitFor(); // of an old simulation: its scene names it
    cloud.controls = [];
    await page.evaluate((url) => {
      globalThis.view.broadcast = true;
      globalThis.view.open(url, 'w3d');
    }, SIMULATOR);
    await until(() => cloud.controls.length > 0, 'a watcher');
    assert.deepEqual(cloud.controls, ['w3d;broadcast']);

    cloud.pages[`${SITE}/lesson/robot.x3d`] = { contentType: 'model/x3d+xml', body: SCENE };
    cloud.controls = [];
    await page.evaluate(() => globalThis.view.open('robot.x3d'));
    await state('paused');
    await page.locator('canvas').waitFor();
    assert.equal(await button('Reset').count(), 0, 'there is no simulation');
    assert.deepEqual(cloud.controls, []);
  });

  test('nobody is sent pictures that nobody sees', async () => {
    await open(SIMULATOR);
    await state('paused');
    const picture = page.getByRole('application');
    await picture.waitFor();
    await page.evaluate(() => {
      Object.defineProperty(document, 'hidden', { configurable: true, get: () => globalThis.unseen });
      globalThis.unseen = true;
      document.dispatchEvent(new Event('visibilitychange'));
    });
    await picture.waitFor({ state: 'hidden' });
    await page.evaluate(() => {
      globalThis.unseen = false;
      document.dispatchEvent(new Event('visibilitychange'));
    });
    await picture.waitFor();
  });
});

describe('Ten lines of another site', () => {
  test('show a simulation, without a finding of axe-core and without a request to anybody else', async () => {
    await page.addInitScript(() => {
      globalThis.forbidden = [];
      document.addEventListener('securitypolicyviolation', (event) => globalThis.forbidden.push(event.blockedURI));
    });
    const machine = 'https://machine.test'; // its pictures, and wss:, as docs/embedding.md says
    await show(TEN_LINES(`data-server="${WORLD}" data-mode="mjpeg" data-autoplay data-timeout="120"`), '/', { 'Content-Security-Policy':
      `default-src 'none'; script-src ${HOST}; style-src 'none'; img-src ${machine}; connect-src ${HOST} wss://machine.test ${machine}` });
    await state('running');
    await heard('timeout:120000');
    await button('Console').click();
    const size = await page.locator('webots-view').boundingBox();
    assert.ok(size.width > 800 && size.height > 400, JSON.stringify(size));
    const inside = await page.locator('webots-view .view').boundingBox();
    assert.ok(Math.abs(inside.height - size.height) < 2 && Math.abs(inside.width - size.width) < 2, JSON.stringify([size, inside]));
    assert.deepEqual([...cloud.origins].sort(), [HOST, machine, SITE].sort());
    assert.deepEqual(await page.evaluate(() => globalThis.forbidden.filter((each) => !each.endsWith('/favicon.ico'))), []);
    if (process.env.SCREENSHOTS)
      await page.screenshot({ path: `${process.env.SCREENSHOTS}/ten-lines.png` });
    assert.deepEqual(await accessibilityFindings(page), []);
  });

  // The sizes in which people look, and the least part of the window's height that the picture has.
  const SIZES = [[1440, 900, 0.7], [1280, 720, 0.65], [390, 844, 0.35], [844, 390, 0.55]];

  test('have picture and toolbar in view on every screen', async () => {
    for (const [width, height, part] of SIZES) {
      await page.setViewportSize({ width, height });
      cloud = new Cloud();
      await show(TEN_LINES(`data-server="${WORLD}" data-mode="mjpeg"`));
      await state('paused');
      await seesAllOf(height, part);
    }
    await page.setViewportSize({ width: 900, height: 700 });
  });

  test('a class View in an element without a height does so, too, and has the height of one that has one', async () => {
    for (const [width, height, part] of SIZES) {
      await page.setViewportSize({ width, height });
      cloud = new Cloud();
      await open(WORLD);
      await state('paused');
      await seesAllOf(height, part);
    }
    await page.setViewportSize({ width: 900, height: 700 });
    cloud = new Cloud();
    await show(WITH_CLASS().replace('id="here"', 'id="here" class="high"').replace('</head>', '<style>.high { height: 333px; }</style></head>'));
    await page.evaluate((url) => globalThis.view.open(url), WORLD);
    await state('paused');
    assert.equal((await page.locator('.view').boundingBox()).height, 333);
  });

  // On the smallest ones the page may have to be scrolled, by its heading.
  async function seesAllOf(height, part) {
    const [view, stage, toolbar] = await Promise.all(['.view', '.stage', '.toolbar'].map((name) => page.locator(name).boundingBox()));
    assert.ok(view.y + view.height <= height + (height < 480 ? view.y : 0), `the view ends at ${view.y + view.height} of ${height}`);
    assert.ok(Math.abs(toolbar.y + toolbar.height - view.y - view.height) < 2, 'the toolbar is cut off');
    assert.ok(stage.height >= part * height, `the picture is ${stage.height} high of ${height}`);
    assert.ok(stage.height > toolbar.height, 'the buttons are larger than the picture');
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), await page.evaluate(() => innerWidth));
  }

  test('leave a poster with a button that starts, when they are quit', async () => {
    await show(TEN_LINES(`data-server="${WORLD}" data-mode="mjpeg"`));
    await state('paused');
    assert.equal(await page.locator('.poster > svg').isVisible(), false);
    const before = await page.locator('webots-view').boundingBox();
    await button('Quit').click();
    await state('idle');
    assert.ok(await page.locator('.poster > svg').isVisible(), 'there is no poster');
    assert.deepEqual(await page.locator('webots-view').boundingBox(), before);
    assert.deepEqual(await accessibilityFindings(page), []);
    cloud.leases = [];
    await button('Start simulation').click();
    await state('paused');
    assert.equal(cloud.leases.length, 1);
    assert.equal(await page.locator('.poster').isVisible(), false);
  });

  test('have a button that starts again when the simulation has ended', async () => {
    await show(TEN_LINES(`data-server="${WORLD}" data-mode="mjpeg"`));
    await state('paused');
    await cloud.lease.close();
    await state('ended');
    cloud.leases = [];
    await button('Start again').click();
    await state('paused');
  });

  test('have the attributes and methods that pages of today use', async () => {
    await show(TEN_LINES(`data-server="${SIMULATOR}" data-mode="mjpeg" data-isBroadcast="true" data-thumbnail="${SITE}/t.png" data-show-step="false"`));
    await state('paused');
    assert.equal(await button('Step').count(), 0);
    assert.ok(await button('Play').isDisabled());
    const element = page.locator('webots-view');
    assert.ok(await element.evaluate((view) => view.hasView()));
    await element.evaluate((view) => view.hideToolbar());
    assert.equal(await page.getByRole('toolbar').count(), 0);
    await element.evaluate((view, url) => {
      globalThis.calls = [];
      view.onready = () => globalThis.calls.push('ready');
      view.ondisconnect = () => globalThis.calls.push('disconnect');
      view.showToolbar();
      view.setWebotsMessageCallback((text) => globalThis.calls.push(text));
      view.connect(url, 'mjpeg', false, false, -1);
    }, SIMULATOR);
    await page.waitForFunction(() => globalThis.calls.includes('ready'));
    await element.evaluate((view) => view.sendMessage('robot:{"name":"supervisor","message":"reset"}'));
    await heard('robot:{"name":"supervisor","message":"reset"}');
    cloud.send('stdout:hello');
    await page.waitForFunction(() => globalThis.calls.includes('hello'));
    await element.evaluate((view) => view.remove());
    await page.waitForFunction(() => globalThis.calls.at(-1) === 'disconnect');
    assert.deepEqual(await page.evaluate(() => globalThis.calls), ['disconnect', 'ready', 'hello', 'disconnect'], 'connect() leaves what was there');
  });

  test('say it in the language of the browser', async () => {
    const english = page;
    page = await openPage({ locale: 'de-CH' });
    await show(TEN_LINES(`src="${SIMULATOR}" data-mode="mjpeg"`));
    await state('paused');
    await button('Konsole').waitFor();
    await page.context().close();
    page = english;
  });
});
