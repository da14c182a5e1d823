// The editor for programs beside the simulation, against fake servers.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { until } from './page.mjs';
import { PHONE, cloud, openViewer, runSimulation, state } from './viewer_page.mjs';

const PROGRAM = 'from controller import Robot\nrobot = Robot()\nwhile robot.step(32) != -1:\n    pass\n';
const TEXT = '#programs textarea';
const saved = async (path) => (await cloud.get('saved'))[path];
const said = (page) => page.locator('#programs .said').textContent();

async function openEditor(t, options) {
  await cloud.set('programs', { 'drive/drive.py': PROGRAM, 'drive/map.py': 'MAP = 1\n' });
  const page = await runSimulation(t, options);
  await page.click('#show-code');
  await page.waitForFunction(([selector, text]) => document.querySelector(selector)?.value === text, [TEXT, PROGRAM]);
  return page;
}

test('nothing of the editor is loaded or shown where there is nothing to change', async (t) => {
  const page = await runSimulation(t);
  assert.equal(await page.locator('#show-code').isHidden(), true);
  assert.deepEqual((await cloud.get('requests')).filter((path) => path.includes('program_editor')), []);
  assert.equal(JSON.parse((await cloud.get('started'))[0]).start.edit, true);
});

test('a program is changed, saved with Ctrl+S, and run from the beginning', async (t) => {
  const page = await openEditor(t);
  assert.equal(await page.inputValue(TEXT), PROGRAM);
  assert.equal(await page.locator('#programs .numbers span').count(), 5);
  await page.fill(TEXT, 'print("mine")\n');
  await page.focus(TEXT);
  await page.keyboard.press('Control+s');
  await until(async () => await saved('drive/drive.py') === 'print("mine")\n', 'the program');
  const last = async () => (await cloud.get('controls')).slice(-2).map((text) => text.split(':')[0]).join();
  await until(async () => await last() === 'reset,real-time', 'a new beginning');
  assert.equal(await saved('drive/map.py'), undefined); // which was not changed
  assert.equal(await said(page), 'Your program runs.');
});

test('what cannot be saved is said, and the simulation does not begin anew', async (t) => {
  await cloud.set('save_error', 'The disk is full.');
  const page = await openEditor(t);
  await page.fill(TEXT, 'x');
  await page.click('#programs .primary');
  await until(async () => await said(page) === 'The disk is full.', 'the sentence');
  assert.equal((await cloud.get('controls')).includes('reset'), false);
});

test('Python\u2019s complaint is marked at its line', async (t) => {
  const page = await openEditor(t);
  await cloud.call('send', 'simulator', 'stderr:  File "/tmp/instance/project/controllers/drive/drive.py", line 3, in <module>');
  await page.waitForSelector('#programs .numbers .wrong');
  assert.equal(await page.locator('#programs .numbers .wrong').textContent(), '3');
  assert.equal(await said(page), 'There is a mistake in drive.py, line 3: see the console.');
  await page.click('#programs .primary');
  await until(async () => await page.locator('#programs .numbers .wrong').count() === 0, 'a new try');
});

test('what was written is there at the next start, also of another page, and can be undone', async (t) => {
  const page = await openEditor(t);
  await page.fill(TEXT, 'print("kept")\n');
  await page.waitForFunction(() => (localStorage.getItem('webots-cloud.programs') ?? '').includes('kept'));
  await page.click('#quit');
  await state(page, 'idle');
  await page.reload();
  await state(page, 'idle');
  await page.click('#start');
  await state(page, 'running');
  await page.click('#show-code');
  await page.waitForFunction((selector) => document.querySelector(selector)?.value === 'print("kept")\n', TEXT);
  assert.match(await said(page), /^This is what you wrote last time, kept/);
  assert.equal(await saved('drive/drive.py'), undefined); // before Run the simulation has the project's
  page.on('dialog', (dialog) => dialog.accept());
  await page.click('#programs button:text("Undo everything")');
  await page.waitForFunction(([selector, text]) => document.querySelector(selector)?.value === text, [TEXT, PROGRAM]);
  assert.equal(await page.evaluate(() => localStorage.getItem('webots-cloud.programs')), '{}');
});

test('keys are those of an editor, and none of them traps people', async (t) => {
  const page = await openEditor(t);
  await page.fill(TEXT, 'if x:');
  await page.focus(TEXT);
  await page.keyboard.press('End');
  await page.keyboard.press('Enter');
  await page.keyboard.type('y');
  assert.equal(await page.inputValue(TEXT), 'if x:\n    y');
  await page.keyboard.press('Enter');
  await page.keyboard.press('Shift+Tab');
  await page.keyboard.press('Tab');
  assert.equal(await page.inputValue(TEXT), 'if x:\n    y\n    ');
  await page.keyboard.press('Escape');
  await page.keyboard.press('Tab');
  assert.equal(await page.evaluate((selector) => document.activeElement === document.querySelector(selector), TEXT), false);
});

test('the editor is beside the picture on a large screen, and below it on a telephone', async (t) => {
  const box = (page, selector) => page.locator(selector).evaluate((element) => element.getBoundingClientRect().toJSON());
  for (const [options, isBeside] of [[{ viewport: { width: 1280, height: 720 } }, true], [PHONE, false]]) {
    const page = await openEditor(t, options);
    const [picture, editor] = [await box(page, '#screen'), await box(page, '#programs')];
    assert.equal(editor.left >= picture.right - 1, isBeside);
    assert.equal(editor.top >= picture.bottom - 1, !isBeside);
    assert.ok(editor.width >= 320 && (await box(page, TEXT)).height >= 150, JSON.stringify(editor));
    await cloud.renew();
  }
});

test('a page that cannot be reached any more closes the editor, and keeps what was written', async (t) => {
  const page = await openEditor(t);
  await page.fill(TEXT, 'print("kept")\n');
  await page.waitForFunction(() => (localStorage.getItem('webots-cloud.programs') ?? '').includes('kept'));
  await page.click('#quit');
  await state(page, 'idle');
  assert.equal(await page.locator('#programs').isHidden(), true);
});
