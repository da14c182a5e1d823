// 3D scenes in Chromium: of the demo simulator, live, on the page that the real session server has embedded; and from files.
// Protocol sections 7.3, 7.4, 7.7 and 7.8.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { Animation } from '../../src/web/view/animation.js';
import { freePort } from '../support/free_port.mjs';
import { accessibilityFindings, inFirefox, openBrowser, openPage, until } from './page.mjs';
import { Pixels } from './pixels.mjs';

const WORLD = fileURLToPath(new URL('../../examples/demo_projects/robots/worlds/arena.wbt', import.meta.url));
const SKY = [0, 0, 1];

// A red box at the origin before a blue sky, seen from the south.
const BOX = `<X3D><head><meta name="version" content="R2025a"/></head><Scene>
<WorldInfo id="n1" title="A box" basicTimeStep="32"/><Viewpoint id="n2" position="-4 0 0" orientation="0 0 1 0"/>
<Background id="n3" skyColor="${SKY.join(' ')}"/>
<Solid id="n10" translation="0 0 0" name="box"><Shape id="n11"><PBRAppearance id="n12" baseColor="1 0 0" roughness="1" metalness="0"/>
<Box id="n13" size="0.6 0.6 0.6"/></Shape><Pose role="boundingObject" id="n14"><Shape id="n15"><Box id="n16" size="9 9 9"/></Shape></Pose></Solid>
</Scene></X3D>`;
const BALL = `<nodes><Solid id="n20" translation="0 -1 0"><Shape id="n21"><PBRAppearance id="n22" baseColor="0 1 0" roughness="1" metalness="0"/>
<Sphere id="n23" radius="0.3"/></Shape></Solid></nodes>`;

const GREEN = Buffer.from('iVBORw0KGgoAAAANSUhEUgAAAAgAAAAICAIAAABLbSncAAAAEElEQVR4nGNg+M+AHQ0tCQDpMD/B9YBzjgAAAABJRU5ErkJggg==', 'base64');
const TEXTURED = BOX.replace('baseColor="1 0 0" roughness="1" metalness="0"/>',
  'roughness="1" metalness="0"><ImageTexture id="n17" role="baseColorMap" url="&quot;textures/green.png&quot;"/></PBRAppearance>');

// --- servers

const folder = await mkdtemp(join(tmpdir(), 'webots_cloud_scene_'));
after(() => rm(folder, { recursive: true }));
const ports = [await freePort(), await freePort()];
await writeFile(join(folder, 'session.json'), JSON.stringify({ port: ports[0], server: 'localhost', ssl: false, portRewrite: false,
  simulationServers: ['localhost:9'], logDir: folder, listenAddress: '127.0.0.1' }));
start('webots-session-server', [join(folder, 'session.json')]);
start('webots-demo-simulator', [`--port=${ports[1]}`, '--stream=w3d', '--mode=pause', '--demo-address=127.0.0.1', WORLD]);
const server = process.env.SCENE_PAGE ?? `http://127.0.0.1:${ports[0]}`;
const simulator = `ws://127.0.0.1:${ports[1]}`;
await until(() => Promise.all([`${server}/viewer/`, `http://127.0.0.1:${ports[1]}/`].map((url) => fetch(url))).then(() => true, () => false), 'the servers');
if (!(await fetch(`${server}/view/x_ite/x_ite.min.mjs`, { method: 'HEAD' })).ok) {
  console.log('skipped: this build has no library for scenes: test.sh installs it with npm, before it builds');
  process.exit(77);
}
// Of the graphics processors that test machines do not have.
const browser = await openBrowser({ args: ['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'] });

function start(program, args) {
  const child = spawn(join(process.env.WEBOTS_CLOUD_BIN, program), args, { stdio: 'ignore' });
  const ended = once(child, 'exit');
  after(async () => {
    child.kill();
    await ended;
  });
  process.on('exit', () => child.kill('SIGKILL'));
}

// --- what is seen

async function shot(page) {
  return new Pixels(await page.locator('#scene').screenshot());
}

// Where `look` finds, in a screenshot of now, what it looks for: nothing is drawn in no time.
async function seen(page, look, what) {
  let last;
  await until(async () => {
    last = await look(await shot(page));
    return last === true || last.length === 0;
  }, what).catch((error) => assert.fail(`${error.message}: ${JSON.stringify(last)}`));
}

// 0 to 360, or null for what is nearly grey.
function hue([red, green, blue]) {
  const [most, least] = [Math.max(red, green, blue), Math.min(red, green, blue)];
  if (most - least < 0.15 * most || most === 0)
    return null;
  const sixth = most === red ? ((green - blue) / (most - least) + 6) % 6 : most === green ? (blue - red) / (most - least) + 2 : (red - green) / (most - least) + 4;
  return 60 * sixth;
}

const like = (pixel, colour) => hue(pixel) !== null && Math.abs(((hue(pixel) - hue(colour) + 540) % 360) - 180) < 25;

const numbers = (text) => text.split(' ').map(Number);

// A function that tells where a point of the world is in a picture: Webots' camera looks along its x, and has z above.
function camera(model) {
  const [, orientation, position, angle] = /<Viewpoint[^>]* orientation="([^"]*)" position="([^"]*)" fieldOfView="([^"]*)"/.exec(model);
  const [x, y, z, turn] = numbers(orientation);
  const back = rotation([x, y, z], -turn);
  return ({ width, height }, point) => {
    const [ahead, left, up] = back(point.map((value, i) => value - numbers(position)[i]));
    const focal = Math.max(width, height) / 2 / Math.tan(Number(angle) / 2);
    return [width / 2 - focal * left / ahead, height / 2 - focal * up / ahead];
  };
}

function rotation(axis, angle) {
  const length = Math.hypot(...axis);
  const [x, y, z] = axis.map((value) => value / length);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return ([a, b, d]) => {
    const along = (x * a + y * b + z * d) * (1 - c);
    return [a * c + (y * d - z * b) * s + x * along, b * c + (z * a - x * d) * s + y * along, d * c + (x * b - y * a) * s + z * along];
  };
}

// What the simulator has sent to the page: its scene, and the latest places of its robots.
function follow(page) {
  const state = { model: '', places: new Map(), models: 0 };
  let own = null; // the connection of the viewer, which comes first
  page.on('websocket', (socket) => socket.url().startsWith(simulator) && (own ??= socket) === socket && socket.on('framereceived', ({ payload }) => {
    if (payload.startsWith('model:')) {
      state.model = payload;
      ++state.models;
    }
    if (payload.startsWith('application/json:'))
      for (const { id, translation } of JSON.parse(payload.slice('application/json:'.length)).updates)
        if (translation !== undefined)
          state.places.set(id, numbers(translation));
  }));
  return state;
}

// What is wrong with a picture of the robots: a sentence for each that is not where it should be, or without its name above it.
function missing(picture, { model, places }) {
  const project = camera(model);
  return [...model.matchAll(ROBOTS)].flatMap(([, id, height, colour, name]) => {
    const [x, y] = places.get(Number(id));
    const spot = project(picture, [x, y - RIM, Number(height) + HALF]);
    const pixel = picture.at(...spot);
    const sign = project(picture, [x, y, Number(name)]);
    const letters = around(picture, sign).filter((each) => like(each, numbers(colour))).length;
    return [...like(pixel, numbers(colour)) ? [] : [`robot ${id} is not at ${spot}: ${pixel} instead of ${colour}`],
      ...letters >= 10 ? [] : [`the name of robot ${id} is not at ${sign}: ${letters} pixels of it`]];
  });
}

// The id of each, the height of its body, its colour, and the height of its name.
const ROBOTS = /<Robot id="n(\d+)".*?<Pose [^>]*translation="0 0 ([^"]*)".*?baseColor="([^"]*)".*?<Pose [^>]*translation="0 0 ([^"]*)"[^>]* billboard="true"/gs;
const RIM = 0.065; // metres from the middle of the body, where no arrow is
const HALF = 0.03; // of the body's height

// The pixels of a part of the picture as large as four letters.
function around(picture, [x, y]) {
  const [columns, rows] = [[...Array(21).keys()], [...Array(9).keys()]];
  return rows.flatMap((row) => columns.map((column) => picture.at(x - 10 + column, y - 4 + row)));
}

async function openLive(t) {
  const page = await openPage(t, browser, { viewport: { width: 600, height: 900 } });
  const state = follow(page);
  await page.goto(`${server}/viewer/?mode=w3d&url=${simulator}`);
  await page.waitForFunction(() => document.querySelector('#show [value="w3d"]').textContent !== '');
  await page.click('#start');
  await page.waitForSelector('body[data-state="paused"]');
  return { page, state };
}

// An empty page of the session server with a scene, as `scene` in its scripts.
async function openScene(t, prepare = () => {}, options = {}) {
  const page = await openPage(t, browser, { viewport: { width: 400, height: 400 }, ...options });
  await prepare(page);
  await page.route('**/empty', (route) => route.fulfill({ contentType: 'text/html',
    body: '<!DOCTYPE html><html lang="en"><title>Scene</title><body style="margin:0"><div id="box" style="width:400px;height:400px"></div>' }));
  await page.goto(`${server}/empty`);
  await page.evaluate(async () => {
    const { loadTexts } = await import('/view/texts.js');
    const { Scene } = await import('/view/scene.js');
    await loadTexts(['en']);
    globalThis.told = [];
    globalThis.scene = new Scene(document.getElementById('box'), { told: (text) => told.push(text) });
    scene.element.id = 'scene';
  });
  return page;
}

async function show(page, model) {
  await page.evaluate((text) => {
    scene.show({ url: location.href });
    scene.receive('model', { text });
  }, model);
}

// --- tests

test('robots are where the state says, move with it, and are back after a reload of the world',
  { skip: inFirefox('its driver shows no WebSockets') }, async (t) => {
  const { page, state } = await openLive(t);
  await seen(page, (picture) => missing(picture, state), 'the robots at the beginning');
  const before = new Map(state.places);

  await page.evaluate((url) => { // two seconds, exactly
    const socket = new WebSocket(url);
    socket.onopen = () => ['w3d;broadcast', 'real-time:2000'].forEach((message) => socket.send(message));
  }, simulator);
  await page.waitForSelector('body[data-time="2016"][data-state="paused"]');
  for (const [id, place] of before)
    assert.notDeepEqual(state.places.get(id), place);
  await seen(page, (picture) => missing(picture, state), 'the robots after two seconds');
  if (process.env.SCREENSHOTS)
    await page.screenshot({ path: join(process.env.SCREENSHOTS, 'scene.png') });
  assert.deepEqual(await accessibilityFindings(page), []);

  await page.click('#reload');
  await page.waitForSelector('body[data-time="0"][data-state="paused"]');
  assert.equal(state.models, 2);
  assert.deepEqual(state.places, before);
  await seen(page, (picture) => missing(picture, state), 'the robots after the reload');
});

test('the library is sent compressed, once to each browser', async () => {
  const url = `${server}/viewer/view/x_ite/x_ite.min.mjs`;
  const { headers } = await fetch(url, { headers: { 'Accept-Encoding': 'gzip' } });
  assert.equal(headers.get('Content-Encoding'), 'gzip');
  assert.ok(Number(headers.get('Content-Length')) < 400000, headers.get('Content-Length'));
  const again = await fetch(url, { headers: { 'If-None-Match': headers.get('ETag') } });
  assert.equal(again.status, 304);
});

test('nodes change, come and go, and so do labels', async (t) => {
  const page = await openScene(t);
  await show(page, BOX);
  const centre = [200, 200];
  const is = (spot, colour) => (picture) => like(picture.at(...spot), colour) || picture.at(...spot);
  await seen(page, is(centre, [1, 0, 0]), 'the box'); // and not its bounding object
  await seen(page, is([10, 10], SKY), 'the sky');

  const receive = (type, detail) => page.evaluate(([name, value]) => scene.receive(name, value), [type, detail]);
  await receive('update', { time: 32, updates: [{ id: 10, translation: '0 2 0' }], labels: [] });
  await seen(page, is(centre, SKY), 'the place that the box has left');
  await receive('update', { time: 64, updates: [{ id: 10, translation: '0 0 0' }, { id: 12, baseColor: '1 1 0' }, { id: 999, translation: '1 1 1' }], labels: [] });
  await seen(page, is(centre, [1, 1, 0]), 'the box in yellow');

  const small = await page.evaluate(async () => {
    const canvas = await scene.snapshot({ width: 80, height: 40 });
    const colour = (x, y) => [...canvas.getContext('2d').getImageData(x, y, 1, 1).data].slice(0, 3);
    return { size: [canvas.width, canvas.height], centre: colour(20, 20), corner: colour(1, 1) };
  });
  assert.deepEqual(small.size, [40, 40]);
  assert.ok(like(small.centre, [1, 1, 0]) && like(small.corner, SKY), JSON.stringify(small));

  await receive('node', { parent: 0, text: BALL });
  const ball = [200 + 200 * (1 / 4) / Math.tan(Math.PI / 8), 200];
  await seen(page, is(ball, [0, 1, 0]), 'the ball');
  await receive('update', { time: 96, updates: [{ id: 20, translation: '0 0 1' }], labels: [] });
  await seen(page, is(ball, SKY), 'the place that the ball has left');
  await receive('delete', { id: 10 });
  await seen(page, is(centre, SKY), 'the place of the box that was deleted');

  const label = { id: 1, font: 'Arial', rgba: '1,0,0,1', size: 0.1, x: 0.25, y: 0.5, text: 'Goal!' };
  await receive('update', { time: 128, updates: [], labels: [label] });
  const text = page.getByText('Goal!');
  const { x, y } = await text.boundingBox();
  assert.deepEqual([Math.round(x), Math.round(y)], [100, 200]);
  assert.match(await text.evaluate((element) => getComputedStyle(element).color), /^rgb\(255, 0, 0\)$/);
  await receive('label', { ...label, text: '' });
  assert.equal(await text.count(), 0);

  await receive('model', { text: '' });
  await receive('model', { text: BOX });
  await seen(page, is(centre, [1, 0, 0]), 'the box of the next world');
  assert.deepEqual(await page.evaluate('told'), []);
});

test('what has to face the camera does, and stays where it is', async (t) => {
  const page = await openScene(t);
  // A plate that is seen from its edge: a pixel wide.
  const plate = (billboard) => `<Pose id="n40" translation="0 0 0" rotation="1 0 0 0"${billboard}><Shape id="n41"><PBRAppearance id="n42" baseColor="1 1 0" roughness="1" metalness="0"/>
    <Box id="n43" size="1 1 0.01"/></Shape></Pose>`;
  const scene = (billboard) => BOX.replace(/<Solid id="n10"[^]*<\/Solid>/, plate(billboard));
  const corner = [200 + 30, 200 - 30];
  await show(page, scene(' billboard="true"'));
  await seen(page, (picture) => like(picture.at(...corner), [1, 1, 0]) || picture.at(...corner), 'the plate');
  await show(page, scene(''));
  await seen(page, (picture) => like(picture.at(...corner), SKY) || picture.at(...corner), 'its edge');
});

test("what is in Webots' Billboard stays before the camera", async (t) => {
  const page = await openScene(t);
  const held = '<Billboard id="n50"><Pose id="n51" translation="2 0.4 0.4"><Shape id="n52"><PBRAppearance id="n53" baseColor="1 1 0" roughness="1" metalness="0"/><Sphere id="n54" radius="0.2"/></Shape></Pose></Billboard>';
  await show(page, BOX.replace('</Scene>', `${held}</Scene>`));
  const away = 483 * 0.4 / 2; // pixels: to the left, and up
  const isThere = (picture) => like(picture.at(200 - away, 200 - away), [1, 1, 0]) || picture.at(200 - away, 200 - away);
  await seen(page, isThere, 'the ball');
  await page.evaluate(() => scene.receive('update', { time: 32, updates: [{ id: 2, position: '0 5 3', orientation: '0 0 1 2' }], labels: [] }));
  await seen(page, (picture) => like(picture.at(200, 200), SKY) || picture.at(200, 200), 'another view');
  await seen(page, isThere, 'the ball, in the same place');
});

test('a high and narrow screen shows as much from side to side as a tablet', async (t) => {
  const page = await openScene(t);
  await show(page, BOX);
  await seen(page, (picture) => like(picture.at(200 + 33, 200), [1, 0, 0]) || picture.at(200 + 33, 200), 'the box');
  await page.evaluate(() => { document.getElementById('box').style.width = '200px'; });
  await seen(page, (picture) => (picture.width === 200 && like(picture.at(100, 200), [1, 0, 0]) && like(picture.at(100 + 33, 200), SKY)) || picture.at(100 + 33, 200), 'a smaller box');
});

test('on a screen of small pixels the library finds what it draws lines with', async (t) => {
  const page = await openScene(t, () => {}, { deviceScaleFactor: 2 });
  const [texture] = await Promise.all([page.waitForResponse(/linetype/), show(page, BOX)]);
  assert.equal(texture.status(), 200, texture.url());
});

test('what cannot be drawn is told in a sentence', async (t) => {
  const page = await openScene(t);
  await show(page, BOX.replace('</Scene>', '<Solid id="n30"><CadShape id="n31" url="&quot;chair.obj&quot;"/></Solid></Scene>'));
  await until(() => page.evaluate('told.length'), 'a sentence');
  assert.match((await page.evaluate('told'))[0], /CadShape/);
  await show(page, TEXTURED.replace('textures/green.png', 'https://tracker.example/pixel.png'));
  await until(() => page.evaluate('told.length > 1'), 'another sentence'); // and no request, which openPage() would find
  assert.match((await page.evaluate('told'))[1], /ImageTexture/);
  await show(page, '<Scene><Solid></Scene>');
  await page.getByText('The scene could not be shown.').waitFor();
});

test('textures come from the simulator', async (t) => {
  const page = await openScene(t, (it) => it.route('**/2001/textures/green.png', (route) => route.fulfill({ contentType: 'image/png', body: GREEN })));
  await page.evaluate((text) => {
    scene.show({ url: `${location.origin}/2001` });
    scene.receive('model', { text });
  }, TEXTURED);
  await seen(page, (picture) => like(picture.at(200, 200), [0, 1, 0]) || picture.at(200, 200), 'the box in green');
  assert.deepEqual(await page.evaluate('told'), []);
});

test('a scene from a file plays the animation beside it, and can be wound', async (t) => {
  const moves = { basicTimeStep: 32, ids: '10', frames: [
    { time: 0, updates: [{ id: 10, rotation: '0 0 1 0' }] },
    { time: 500, updates: [{ id: 10, translation: '0 2 0' }], labels: [{ id: 1, font: 'Arial', rgba: '0,0,0,1', size: 0.1, x: 0, y: 0, text: 'away' }] },
    { time: 4000, updates: [{ id: 12, baseColor: '1 1 0' }] }] };
  const page = await openScene(t, async (it) => {
    await it.route('**/box.x3d', (route) => route.fulfill({ contentType: 'model/x3d+xml', body: BOX }));
    await it.route('**/box.json', (route) => route.fulfill({ json: moves }));
  });
  await page.evaluate(() => scene.open('box.x3d', { play: false }));
  const is = (spot, colour) => (picture) => like(picture.at(...spot), colour) || picture.at(...spot);
  await seen(page, is([200, 200], [1, 0, 0]), 'the box');
  assert.equal(await page.evaluate('scene.player.playing'), false);

  await page.getByRole('button', { name: 'Play the animation' }).click();
  await page.getByText('away').waitFor();
  await page.getByRole('button', { name: 'Pause the animation' }).click();
  await seen(page, is([200, 200], SKY), 'the place that the box has left');

  const slider = page.getByRole('slider', { name: 'Position in the animation' });
  await slider.focus();
  await page.keyboard.press('Home');
  await seen(page, is([200, 200], [1, 0, 0]), 'the box at the beginning again');
  assert.equal(await page.getByText('away').count(), 0);
  await page.keyboard.press('End');
  await seen(page, is([200, 200], SKY), 'the end');
  assert.equal(await page.evaluate('scene.player.time'), 4000);
  assert.deepEqual(await accessibilityFindings(page), []);
});

test('a file that cannot be read is told in a sentence', async (t) => {
  const page = await openScene(t);
  const said = await page.evaluate(() => scene.open('nothing.x3d').catch(({ message }) => message));
  assert.match(said, /nothing\.x3d cannot be read\./);
});

test('the viewer opens files, too', async (t) => {
  const page = await openPage(t, browser, { viewport: { width: 600, height: 900 } });
  await page.route((url) => url.pathname === '/box.x3d', (route) => route.fulfill({ contentType: 'model/x3d+xml', body: BOX }));
  await page.goto(`${server}/viewer/?url=${server}/box.x3d`);
  await page.click('#start');
  await page.waitForFunction(() => document.getElementById('status').textContent === 'An exported scene. It is not a running simulation.');
  await seen(page, (picture) => like(picture.at(picture.width / 2, picture.height / 2), [1, 0, 0]), 'the box');
});

test('a build without the library says so, and shows pictures', async (t) => {
  const page = await openPage(t, browser);
  await page.route('**/x_ite.min.mjs', (route) => route.fulfill({ status: 404 }));
  await page.goto(`${server}/viewer/?mode=w3d`);
  await page.getByText("3D is not part of this server's build: choose the picture.").waitFor();
  assert.equal(await page.inputValue('#show'), 'mjpeg');
  assert.ok(await page.locator('#show option[value="w3d"]').isDisabled());
  await page.selectOption('#language', 'de');
  await page.getByText('3D gehört nicht zum Umfang dieses Servers').waitFor();
});

for (const [trouble, meet] of [['the network fails', (route) => route.abort()], ['a proxy has lost the server', (route) => route.fulfill({ status: 502 })]]) {
  test(`the viewer does not blame the build when ${trouble}, and offers the scene as soon as it can`, async (t) => {
    const page = await openPage(t, browser);
    await page.route('**/x_ite.min.mjs', meet);
    await page.goto(`${server}/viewer/?mode=w3d`);
    await page.getByText('3D could not be loaded: check your network').waitFor();
    assert.ok(await page.locator('#show option[value="w3d"]').isDisabled());
    await page.unroute('**/x_ite.min.mjs');
    await page.evaluate(() => dispatchEvent(new Event('online')));
    await page.waitForSelector('#no-scene', { state: 'hidden' });
    assert.ok(await page.locator('#show option[value="w3d"]').isEnabled());
  });
}

test('a library that is there, and does not arrive, is not loaded rather than missing', async (t) => {
  const page = await openScene(t);
  await page.route('**/x_ite.min.mjs', (route) => (route.request().method() === 'HEAD' ? route.continue() : route.abort()));
  await page.route('**/box.x3d', (route) => route.fulfill({ contentType: 'model/x3d+xml', body: BOX }));
  assert.match(await page.evaluate(() => scene.open('box.x3d').catch(({ message }) => message)), /^3D could not be loaded/);
});

test('an animation leads from each frame to each other one', () => {
  const initial = { 'translation 1': '9 9 9' };
  const animation = new Animation({ basicTimeStep: 10, ids: '1;2;', frames: [
    { time: 0, poses: [{ id: 2, rotation: 'a' }] }, { time: 10, poses: [{ id: 1, translation: 'b' }, { id: 2, rotation: 'c' }] },
    { time: 20 }, { time: 30, poses: [{ id: 1, translation: 'd' }], labels: [{ id: 7, text: 'hello' }] }] }, (id, name) => initial[`${name} ${id}`]);
  assert.equal(animation.duration, 30);
  assert.deepEqual(animation.at(0), { time: 0, updates: [{ id: 2, rotation: 'a' }], labels: [] });
  assert.equal(animation.at(9), null);
  assert.deepEqual(animation.at(35), { time: 30, updates: [{ id: 1, translation: 'd' }, { id: 2, rotation: 'c' }], labels: [{ id: 7, text: 'hello' }] });
  const back = animation.at(0);
  assert.deepEqual(back.updates.sort((a, b) => a.id - b.id), [{ id: 1, translation: '9 9 9' }, { id: 2, rotation: 'a' }]);
  assert.deepEqual(back.labels, [{ id: 7, text: '' }]);
  assert.throws(() => new Animation({ frames: [] }));
  assert.throws(() => new Animation(null));
});
