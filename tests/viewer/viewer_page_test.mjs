// The viewer page in its sizes and languages, against fake servers.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { inFirefox, openPage, until } from './page.mjs';
import { LANDSCAPE, PHONE, WORLD, browser, cloud, enterAddress, openViewer, runSimulation, state } from './viewer_page.mjs';

const sent = async (prefix) => (await cloud.get('controls')).filter((message) => message.startsWith(prefix));
const box = (page, selector) => page.locator(selector).evaluate((element) => element.getBoundingClientRect().toJSON());

test('the picture is asked for in device pixels, at most 1920x1200', async (t) => {
  for (const [deviceScaleFactor, viewport] of [[1, { width: 1280, height: 800 }], [2, { width: 768, height: 1024 }], [3, { width: 2560, height: 1440 }]]) {
    const page = await runSimulation(t, { deviceScaleFactor, viewport });
    const { width, height } = await page.evaluate(() => {
      const { clientWidth, clientHeight } = document.getElementById('screen');
      return { width: clientWidth, height: clientHeight };
    });
    const scale = Math.min(deviceScaleFactor, 1920 / width, 1200 / height);
    const [asked] = await sent('mjpeg: ');
    assert.equal(asked, `mjpeg: ${Math.round(width * scale)}x${Math.round(height * scale)}`);
    await cloud.renew();
  }
});

test('the mouse is where the simulator thinks it is', async (t) => {
  const page = await runSimulation(t, { deviceScaleFactor: 2, viewport: { width: 900, height: 600 } });
  const screen = await box(page, '#picture');
  await page.mouse.move(Math.round(screen.x) + 100, Math.round(screen.y) + 60);
  await page.mouse.wheel(0, 100);
  const [, , , , x, y, , wheel] = (await until(async () => (await sent('mouse 2 '))[0], 'the wheel')).split(' ').map(Number);
  assert.ok(Math.abs(x - 200) <= 2 && Math.abs(y - 120) <= 2, `${x} ${y}`);
  assert.equal(wheel, 1);
});

test('fingers turn the view as far on every screen', { skip: inFirefox('its Touch has whole coordinates') }, async (t) => {
  const page = await runSimulation(t, { ...PHONE, deviceScaleFactor: 2 });
  await page.locator('#picture').evaluate((picture) => {
    const { left, top } = picture.getBoundingClientRect();
    const touch = (type, x, y) => {
      const finger = new Touch({ identifier: 1, target: picture, clientX: left + x, clientY: top + y });
      picture.dispatchEvent(new TouchEvent(type, { targetTouches: [finger], touches: [finger], cancelable: true }));
    };
    touch('touchstart', 50, 40);
    touch('touchmove', 60, 45);
  });
  await until(async () => (await sent('touch 0 ')).length, 'the movement');
  assert.deepEqual(await sent('touch '), ['touch -1 1 100 80', 'touch 0 1 10 5']);
});

test('keys move the camera of a picture that has the focus, and nothing else', async (t) => {
  const page = await runSimulation(t);
  const [asked] = await sent('mjpeg: ');
  const [x, y] = asked.slice(7).split('x').map((size) => Math.round(size / 2));
  await page.keyboard.press('ArrowRight');
  await page.focus('#picture');
  for (const key of ['ArrowLeft', 'Shift+ArrowUp', '+', '-', 'Control+ArrowLeft'])
    await page.keyboard.press(key);
  await until(async () => (await sent('mouse 2 ')).length === 2, 'the last key');
  assert.deepEqual(await sent('mouse '), [
    `mouse -1 0 1 ${x} ${y} 0 0`, `mouse 0 0 1 ${x - 20} ${y} 0 0`, `mouse 1 0 1 ${x - 20} ${y} 0 0`,
    `mouse -1 2 2 ${x} ${y} 0 0`, `mouse 0 2 2 ${x} ${y - 20} 0 0`, `mouse 1 2 2 ${x} ${y - 20} 0 0`,
    `mouse 2 0 0 ${x} ${y} 0 -1`, `mouse 2 0 0 ${x} ${y} 0 1`]);
});

test('a slow network is asked for smaller pictures, and old ones are not waited for', async (t) => {
  const page = await runSimulation(t);
  const { width } = await page.locator('#screen').evaluate(({ clientWidth, clientHeight }) => ({ width: clientWidth, height: clientHeight }));
  await cloud.set('slow', true);
  const smaller = (message) => Number(/(\d+)x/.exec(message)[1]) < width;
  await until(async () => (await sent('resize: ')).some(smaller), 'a smaller size');
  await until(async () => await cloud.get('opened_streams') >= 2, 'a new stream');
});

test('the pictures of simulators that do not let scripts read them are shown by the browser', async (t) => {
  await cloud.set('picture_headers', '');
  const page = await runSimulation(t, { deviceScaleFactor: 2 });
  assert.equal(await page.locator('#picture > img').count(), 1);
  const { width, height } = await box(page, '#screen');
  const wanted = `resize: ${Math.round(width)}x${Math.round(height)}`; // Nobody could notice that more is too much for the network.
  await until(async () => (await sent('resize: ')).at(-1) === wanted, wanted);
  await page.click('#quit');
  await state(page, 'idle');
  await until(async () => await cloud.get('streams') === 0, 'the end of the stream');
});

test('pictures that come late are read all the same', async (t) => {
  await cloud.set('refused_pictures', 2);
  const page = await runSimulation(t);
  await page.waitForSelector('#picture > canvas');
});

test("a spectator's picture takes no focus and sends nothing", async (t) => {
  await cloud.set('multimedia', 'multimedia: mjpeg pause 640 480');
  const page = await runSimulation(t);
  assert.equal(await page.getAttribute('#picture', 'role'), 'img');
  await page.evaluate(() => document.getElementById('picture').focus());
  await page.keyboard.press('ArrowLeft');
  await page.click('#pause');
  await state(page, 'paused');
  assert.deepEqual(await sent('mouse '), []);
});

test('the screen stays on while a simulation runs, and no longer', async (t) => {
  const page = await openViewer(t);
  await page.evaluate(() => {
    window.locks = 0;
    navigator.wakeLock.request = async (type) => {
      window.locks += type === 'screen' ? 1 : 0;
      return { released: false, release() { window.locks--; } };
    };
  });
  await page.click('#start');
  await page.waitForFunction(() => window.locks === 1);
  await page.click('#pause');
  await page.waitForFunction(() => window.locks === 0);
  await page.click('#fast');
  await page.waitForFunction(() => window.locks === 1);
  await page.click('#quit');
  await page.waitForFunction(() => window.locks === 0);
});

test('the last picture stays while the page returns to the simulator', async (t) => {
  await cloud.set('launch', [...await cloud.call('good_start'), 'reconnectToken: a1b2']);
  const page = await runSimulation(t);
  await page.locator('#picture').evaluate((picture) => {
    window.gone = 0;
    new MutationObserver(() => { window.gone += picture.hidden || !('live' in picture.dataset) ? 1 : 0; }).observe(picture, { attributes: true });
  });
  await cloud.call('drop', 'simulator');
  await until(async () => (await sent('mjpeg: ')).length === 2, 'the return');
  await until(async () => await cloud.get('opened_streams') >= 2, 'the new stream');
  assert.equal(await page.evaluate(() => window.gone), 0);
});

test('full screen shows the picture, its controls and what happens', async (t) => {
  const page = await runSimulation(t);
  await page.click('#fullscreen');
  await page.waitForFunction(() => document.fullscreenElement !== null);
  await page.waitForSelector('#fullscreen[aria-pressed="true"]');
  for (const id of ['pause', 'time', 'quit'])
    assert.ok(await inSight(page, id), `${id} is out of sight`);
  await page.waitForFunction(() => Math.abs(document.getElementById('controls').getBoundingClientRect().bottom - innerHeight) < 1);
  await cloud.set('mute', ['simulator']);
  await state(page, 'lost');
  assert.ok(await inSight(page, 'status'), 'what happens is out of sight');
  await page.click('#fullscreen');
  await page.waitForFunction(() => document.fullscreenElement === null);
});

test('a telephone on its side shows the picture on most of its screen, with the controls beside it', async (t) => {
  const page = await runSimulation(t, LANDSCAPE);
  const { width, height } = LANDSCAPE.viewport;
  const screen = await box(page, '#screen');
  assert.ok(screen.height >= 0.8 * height, `the picture is ${screen.height} high`);
  assert.ok(screen.width >= 0.75 * width, `the picture is ${screen.width} wide`);
  for (const id of ['play', 'pause', 'reload', 'fullscreen', 'time', 'quit'])
    assert.ok(await inSight(page, id), `${id} is out of sight`);
});

test('a telephone on which the page was scrolled shows what happens when the simulation is there, and when it will end', async (t) => {
  for (const options of [PHONE, LANDSCAPE]) {
    const page = await openViewer(t, options);
    await page.evaluate(() => {
      document.getElementById('start').click();
      window.scrollTo(0, document.body.scrollHeight);
    });
    await state(page, 'running');
    await page.waitForSelector('#picture[data-live]');
    for (const id of ['play', 'quit', 'time'])
      assert.ok(await inSight(page, id), `${id} is out of sight`);
    assert.equal(await page.isVisible('#no-scene'), false); // There is nothing to choose now.
    await page.evaluate(() => window.scrollTo(0, document.body.scrollHeight));
    await cloud.call('send', 'simulation', 'shutdownTimeout: 60');
    await page.waitForSelector('#warning:not([hidden])');
    assert.ok(await inSight(page, 'warning-text'), 'the warning is out of sight');
    await cloud.renew();
  }
});

test('an upright telephone shows picture and controls at once', async (t) => {
  const page = await runSimulation(t, PHONE);
  const screen = await box(page, '#screen');
  assert.ok(screen.height >= 0.7 * PHONE.viewport.height, `the picture is ${screen.height} high`);
  for (const id of ['play', 'reload', 'time', 'quit'])
    assert.ok(await inSight(page, id), `${id} is out of sight`);
});

test('a tablet has its buttons in one row, in languages of long words too', async (t) => {
  const page = await runSimulation(t, { viewport: { width: 768, height: 1024 }, locale: 'de-DE' });
  const tops = await page.locator('#controls .tool').evaluateAll((buttons) => buttons.filter((button) => button.checkVisibility()).map((button) => button.getBoundingClientRect().top));
  assert.ok(tops.length >= 12 && new Set(tops).size === 1, `${tops}`);
});

const SIZES = [{ width: 1280, height: 720 }, { width: 1440, height: 900 }];

test('before a start the page is a picture of the world, with its name and the button in it', async (t) => {
  for (const { viewport, ...options } of [...SIZES.map((viewport) => ({ viewport })), PHONE, LANDSCAPE]) {
    const page = await openViewer(t, { ...options, viewport });
    assert.equal(await page.textContent('#world-name'), 'arena');
    const poster = await box(page, '#poster > svg');
    const button = await box(page, '#start');
    assert.ok(poster.width * poster.height >= 0.6 * viewport.width * viewport.height, `the picture has ${poster.width}x${poster.height}`);
    assert.ok(button.left >= poster.left && button.right <= poster.right && button.top >= poster.top && button.bottom <= poster.bottom, 'the button is elsewhere');
    assert.ok(await inSight(page, 'start'), 'the button is out of sight');
    for (const id of ['connect-to', 'console', 'controls', 'status'])
      assert.ok(await isFolded(page, id), `${id} is there before anybody wants it`);
  }
});

test('while it runs the simulation has the window, but for one row of controls below it', async (t) => {
  for (const viewport of SIZES) {
    const page = await runSimulation(t, { viewport });
    const screen = await box(page, '#screen');
    const controls = await box(page, '#controls');
    assert.deepEqual([screen.left, screen.top, screen.width], [0, 0, viewport.width]);
    assert.ok(screen.height >= viewport.height - 64, `the picture is ${screen.height} high`);
    assert.deepEqual([controls.top, controls.bottom], [screen.bottom, viewport.height]);
    for (const id of ['status', 'connect-to', 'console'])
      assert.ok(await isFolded(page, id), `${id} is there before anybody wants it`);
    const times = await page.locator('time').evaluateAll((elements) => elements.filter((element) => element.checkVisibility()).map(({ id }) => id));
    assert.deepEqual(times, ['time']);
    await page.click('#show-console');
    assert.ok(await inSight(page, 'console'), 'the console is out of sight');
    assert.ok(await inSight(page, 'play'), 'the controls are out of sight');
  }
});

test('what there is to say while it runs is one line over the picture', async (t) => {
  const page = await runSimulation(t);
  await cloud.set('mute', ['simulator']);
  await state(page, 'lost');
  assert.ok(await inSight(page, 'status'), 'nobody is told');
  const [screen, report] = [await box(page, '#screen'), await box(page, '#report')];
  assert.deepEqual([report.left, report.top, report.width], [screen.left, screen.top, screen.width]);
  await cloud.set('mute', []);
  await state(page, 'running');
  await page.waitForSelector('#report.quiet');
});

test('a wrong address is answered in one line, and how they are written is told to who asks', async (t) => {
  const page = await openViewer(t);
  await enterAddress(page, 'nonsense');
  await page.click('#start');
  await state(page, 'failed');
  assert.equal(await page.textContent('#status'), '"nonsense" is not a complete address: please copy the whole link to the world.');
  const { height } = await box(page, '#status');
  const lineHeight = await page.locator('#status').evaluate((element) => parseFloat(getComputedStyle(element).lineHeight));
  assert.ok(height < 2.5 * lineHeight, `the sentence is ${height} high`);
  assert.equal(await page.isVisible('#grammar li'), false);
  await page.getByText('How do I write an address?').click();
  await page.getByText('A simulator that is running already:').waitFor();
  assert.equal(await page.getAttribute('#connect-to', 'aria-invalid'), 'true');
  await page.fill('#connect-to', WORLD);
  assert.equal(await page.getAttribute('#connect-to', 'aria-invalid'), null, 'another address is not wrong yet');
});

test('the link to share, and its QR code, start the same world in the same way', async (t) => {
  const page = await runSimulation(t);
  await page.click('#share');
  await page.waitForSelector('#qr svg path');
  const link = new URL(await page.inputValue('#link'));
  assert.deepEqual([link.pathname, link.searchParams.get('url'), link.searchParams.get('mode')], ['/viewer/', WORLD, null]);
  assert.ok(await page.isVisible('#link-local'), 'nobody says that the link is of this machine alone');
  await page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined })); // as on pages without TLS
  await page.click('#copy');
  await page.waitForFunction(() => document.getElementById('copy').textContent === 'Copied');
  await page.keyboard.press('Escape');
  assert.equal(await page.isVisible('#sharing'), false);
  assert.equal(await page.getAttribute('body', 'data-state'), 'running');
});

test('on a telephone on its side the link, its code and the buttons are there at once', async (t) => {
  const page = await runSimulation(t, LANDSCAPE);
  await page.click('#share');
  await page.waitForSelector('#qr svg path');
  for (const id of ['qr', 'link', 'copy'])
    assert.ok(await inSight(page, id), `${id} is out of sight`);
  assert.equal(await page.locator('#link').evaluate((field) => field.scrollLeft), 0, 'the link is shown from its beginning');
});

test('a screenshot is a file of the picture, as large as the simulator has drawn it', { skip: inFirefox('its driver tells nothing of downloads') }, async (t) => {
  const page = await runSimulation(t);
  const downloads = page.waitForEvent('download');
  await page.click('#screenshot');
  const download = await downloads;
  assert.equal(download.suggestedFilename(), 'arena.png');
  const file = await readFile(await download.path());
  const size = await page.locator('#picture > canvas').evaluate(({ width, height }) => [width, height]);
  assert.deepEqual([file.readUInt32BE(16), file.readUInt32BE(20)], size);
});

test('who cannot have a screenshot is told what to do', async (t) => {
  await cloud.set('picture_headers', '');
  const page = await runSimulation(t);
  await page.click('#screenshot');
  await page.waitForSelector('#warning:not([hidden])');
  assert.match(await page.textContent('#warning-text'), /please take the screenshot with your system/);
});

test('a world of the gallery has its title and picture there', async (t) => {
  await cloud.set('worlds', [{ url: WORLD, title: 'The arena', picture: 'picture/0123456789abcdef' }]);
  const page = await openPage(t, browser);
  await page.route('**/viewer/worlds/picture/0123456789abcdef', async (route) =>
    route.fulfill({ contentType: 'image/svg+xml', body: await readFile(new URL('../../src/web/viewer/favicon.svg', import.meta.url)) }));
  await page.goto(`${await cloud.get('page')}?url=${WORLD}`);
  await page.waitForFunction(() => document.getElementById('world-name').textContent === 'The arena');
  await page.waitForFunction(() => document.querySelector('#poster > img')?.naturalWidth > 0 && document.querySelector('#poster > svg') === null);
  await enterAddress(page, WORLD.replace('arena', 'other'));
  await page.locator('#connect-to').blur();
  await page.waitForFunction(() => document.getElementById('world-name').textContent === 'other');
  assert.equal(await page.locator('#poster > img').count(), 0);
});

test('after its end there is the poster again, with a button that starts', async (t) => {
  const page = await runSimulation(t);
  await page.click('#quit');
  await state(page, 'idle');
  assert.ok(await page.isVisible('#poster > svg'), 'there is no picture');
  await page.click('#start');
  await state(page, 'running');
});

// Not there for who sees, or behind an element that opens.
const isFolded = (page, id) => page.locator(`#${id}`).evaluate((element) => {
  const { width, height } = element.getBoundingClientRect();
  return !element.checkVisibility() || width * height <= 1;
});

const inSight = (page, id) => page.locator(`#${id}`).evaluate((element) => {
  const { left, top, right, bottom } = element.getBoundingClientRect();
  const found = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
  return left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight && found !== null && element.contains(found);
});

test('the language is that of the browser, or the one that was chosen, which is remembered', async (t) => {
  const page = await openViewer(t, { locale: 'de-CH' });
  assert.equal(await page.textContent('#start'), 'Simulation starten');
  assert.equal(await page.getAttribute('html', 'lang'), 'de');
  await page.selectOption('#language', 'fr');
  await page.waitForFunction(() => document.getElementById('start').textContent === 'Lancer la simulation');
  assert.equal(await page.textContent('#light-text'), 'Une machine est libre.');
  assert.equal(await page.textContent('#connection label'), 'Adresse du monde');
  await page.reload();
  await page.waitForSelector('html[lang="fr"]');
  assert.equal(await page.textContent('#start'), 'Lancer la simulation');
});

test('a language that there is none of is English', async (t) => {
  const page = await openViewer(t, { locale: 'fi-FI' });
  assert.equal(await page.textContent('#start'), 'Start simulation');
});

test('in every language nothing is left unsaid, and a telephone needs no scrolling sideways', async (t) => {
  const page = await runSimulation(t, PHONE);
  const languages = await page.locator('#language option').evaluateAll((options) => options.map(({ value }) => value));
  assert.equal(languages.length, 7);
  for (const language of languages) {
    await page.locator('#language').evaluate((select, value) => { // It is out of the way while there is a simulation.
      select.value = value;
      select.dispatchEvent(new Event('change'));
    }, language);
    await page.waitForSelector(`html[lang="${language}"]`);
    const { silent, width } = await page.evaluate(() => ({
      silent: [...document.querySelectorAll('[data-say], .tool > span')].filter(({ textContent, dataset }) => textContent === '' || /^\w+\.\w+$/.test(textContent) || textContent === dataset.say).length,
      width: document.documentElement.scrollWidth,
    }));
    assert.deepEqual([language, silent, width], [language, 0, PHONE.viewport.width]);
  }
});
