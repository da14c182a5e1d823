// The page of a class before fake servers, for the files of its tests.

import { after, beforeEach } from 'node:test';
import { FakeCloud } from './fake_cloud.mjs';
import { openBrowser, openPage, until } from './page.mjs';

export const WORLD = 'https://github.com/owner/repository/blob/main/worlds/arena.wbt';
export const CODE = 'K7M2QX';
export const PHONE = { viewport: { width: 360, height: 740 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true };
export const LANDSCAPE = { ...PHONE, viewport: { width: 740, height: 360 } };
export const JOINED = { id: 1, token: 'token-of-ada', seat: 'seat-of-ada', name: 'Ada', world: WORLD, mode: 'mjpeg' };

export const browser = await openBrowser();
export const cloud = new FakeCloud();
after(() => cloud.close());
beforeEach(() => cloud.renew());

export const address = async (path = '') => (await cloud.get('page')).replace('/viewer/', `/class/${path}`);
export const shown = (page, part) => page.waitForSelector(`body[data-shown="${part}"]`);
export const state = (page, name) => page.waitForSelector(`body[data-state="${name}"]`);
export const says = (page, selector, text) => page.waitForFunction(([where, wanted]) =>
  document.querySelector(where)?.textContent.includes(wanted), [selector, text]);

// What pages of the class have sent under this name, in order.
export const said = async (name) => (await cloud.get('class_said')).filter(([, message]) => name in message).map(([, message]) => message[name]);
export const waitForSaid = (name, matches = () => true) => until(async () => (await said(name)).find(matches), name);
export const tell = (message) => cloud.call('tell_class', message);

// --- a student

export async function join(t, { joined = JOINED, ...options } = {}) {
  await cloud.set('class_answers', { join: [{ joined }] });
  const page = await openPage(t, browser, options);
  await page.goto(await address(CODE));
  await page.fill('#name', joined.name);
  await page.click('#join');
  await shown(page, 'seat');
  return page;
}

export async function runSimulation(t, options) {
  const page = await join(t, options);
  await state(page, 'running');
  await page.waitForSelector('#simulation [data-live]');
  return page;
}

// --- the teacher

export const student = (id, name, more = {}) => ({ id, name, state: 'joined', time: 0, ...more });

export async function classOf(students = [], more = {}) {
  return { code: CODE, key: 'key-of-the-teacher', world: WORLD, mode: 'mjpeg', seats: 30, reserved: 18,
    machines: [await cloud.call('address', 'simulation')], students, ...more };
}

export async function openForm(t, options) {
  const page = await openPage(t, browser, options);
  await page.goto(await address('#teach'));
  await shown(page, 'open');
  return page;
}

export async function fillForm(page) {
  await page.fill('#password', 'abcd-efgh-jkmn');
  await page.fill('#world', WORLD);
}

export async function openClass(t, { students = [], more = {}, ...options } = {}) {
  await cloud.set('class_answers', { teach: [{ class: await classOf(students, more) }] });
  const page = await openForm(t, options);
  await fillForm(page);
  await page.click('#open-class');
  await shown(page, 'lesson');
  return page;
}

export const tile = (page, id) => page.locator(`#wall [data-student="${id}"]`);

export async function press(page, id, action) {
  await tile(page, id).locator('summary').click();
  await tile(page, id).locator(`[data-do="${action}"]`).click();
}

// A picture of one colour, as a JPEG in base64.
export const jpeg = (page, color) => page.evaluate(async (fill) => {
  const canvas = new OffscreenCanvas(160, 120);
  const pen = canvas.getContext('2d');
  pen.fillStyle = fill;
  pen.fillRect(0, 0, 160, 120);
  const blob = await canvas.convertToBlob({ type: 'image/jpeg' });
  return btoa(String.fromCharCode(...new Uint8Array(await blob.arrayBuffer())));
}, color);
