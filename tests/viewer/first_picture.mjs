// Measures what a visitor waits for after the click on Start: until the first picture is drawn, and until one that moves. For
// tests/bench/speed/first_picture_bench.py, which starts the servers, and says when the next start may come:
//
//   node tests/viewer/first_picture.mjs URL [hover|moved]   URL of the page; `hover`: the mouse rests on the button for a moment before,
//                                                          `moved`: elsewhere on the page
//
// For each line that it reads it clicks once, and prints {first, moving, steps}: milliseconds, and what the page has done when.

import { createInterface } from 'node:readline';
import { openBrowser } from './page.mjs';

const [url, way] = process.argv.slice(2);
const HOVER_MS = 500; // longer than all that can be prepared takes

// Runs in the page before its scripts.
function watchPage() {
  const steps = [];
  const blobs = new WeakMap();
  const pictures = [];
  const note = (what) => steps.push([performance.now(), what]);
  window.measured = { steps, pictures };
  addEventListener('click', ({ target }) => target.id === 'start' && note('click'), true);
  const decode = window.createImageBitmap;
  window.createImageBitmap = async (blob, ...more) => {
    const bitmap = await decode(blob, ...more);
    blobs.set(bitmap, blob);
    return bitmap;
  };
  const { prototype } = ImageBitmapRenderingContext;
  const draw = prototype.transferFromImageBitmap;
  prototype.transferFromImageBitmap = function (bitmap) {
    const size = `${bitmap.width}x${bitmap.height}`;
    blobs.set(this, blobs.get(bitmap));
    draw.call(this, bitmap);
    pictures.push([performance.now(), blobs.get(this), size]);
    note(`picture ${size}`);
  };
  const ask = window.fetch;
  window.fetch = (...what) => {
    note(`fetch ${what[0]?.url ?? what[0]}`);
    return ask(...what);
  };
  window.WebSocket = class extends WebSocket {
    constructor(address, ...more) {
      super(address, ...more);
      const name = new URL(address).pathname.replace(/[a-z]{28}/, '...');
      note(`open ${name}`);
      this.addEventListener('open', () => note(`opened ${name}`));
      this.addEventListener('message', ({ data }) => typeof data === 'string' && note(`heard ${name} ${data.slice(0, 40)}`));
    }
    send(data) {
      note(`say ${new URL(this.url).pathname.replace(/[a-z]{28}/, '...')} ${String(data).slice(0, 40)}`);
      super.send(data);
    }
  };
}

// In the page: when the first picture was drawn after the click, and the first that moves: it differs from one of its size. Null until then.
async function look() {
  const { steps, pictures } = window.measured;
  const clicked = steps.find(([, what]) => what === 'click')?.[0];
  if (clicked === undefined || pictures.length < 2)
    return null;
  const text = async (blob) => new Uint8Array(await blob.arrayBuffer()).join();
  const still = new Map(); // by size
  for (const [at, blob, size] of pictures.slice(0, 200)) {
    const seen = await text(blob);
    if (still.has(size) && still.get(size) !== seen)
      return { first: pictures[0][0] - clicked, moving: at - clicked, steps: steps.map(([when, what]) => [Math.round((when - clicked) * 10) / 10, what]) };
    still.set(size, seen);
  }
  return null;
}

const browser = await openBrowser();
for await (const line of createInterface({ input: process.stdin })) {
  if (line === '')
    break;
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  const page = await context.newPage();
  await page.addInitScript(watchPage);
  await page.goto(url);
  await page.waitForSelector('body[data-availability="available"]');
  await page.waitForLoadState('networkidle');
  if (way === 'hover')
    await page.hover('#start');
  else if (way === 'moved')
    await page.mouse.move(1, 1);
  if (way !== undefined && way !== '')
    await new Promise((resolve) => setTimeout(resolve, HOVER_MS));
  await page.click('#start');
  let measured = null;
  for (let tries = 0; measured === null && tries < 300; ++tries) {
    await new Promise((resolve) => setTimeout(resolve, 50));
    measured = await page.evaluate(look);
  }
  console.log(JSON.stringify(measured));
  await page.click('#quit').catch(() => {});
  await context.close();
}
await browser.close();
process.exit(0);
