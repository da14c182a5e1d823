// The first lesson of the demo with real servers: from the wrong program to the goal, on a large screen and on a telephone, and in a class whose
// seats are staged.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

import { accessibilityFindings, openBrowser, openPage, until } from '../viewer/page.mjs';
import { PASSWORD, assertNothingIsKept, attend, openClass, says, shown, startClassSite, state, tile } from './class_site.mjs';

const PHONE = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 3, hasTouch: true, isMobile: true, locale: 'de-DE' };
const LESSON = 'local:/demo_projects/lessons/blob/main/worlds/lesson_1_move.wbt';
const GIVEN = await readFile(fileURLToPath(new URL('../../examples/demo_projects/lessons/controllers/move/move.py', import.meta.url)), 'utf-8');
const WRONG = GIVEN.replace('left.setVelocity(0)', 'left.setVelocity(\'fast\')');
const SOLVED = GIVEN.replaceAll('.setVelocity(0)', '.setVelocity(10)');
const EDITOR = ':is(.cm-content, .program-text textarea)'; // with and without npm
const WRONG_LINE = ':is(.cm-wrong, .numbers .wrong)';

const site = await startClassSite({
  session: (ports) => ({ simulationServers: [`localhost:${ports.simulation}`], relay: true }),
  simulation: () => ({ maxConnections: 4, allowEdit: true }),
});
const { server } = site;
const browser = await openBrowser();

const textOf = (page, place = '#programs') => page.locator(`${place} ${EDITOR}`).evaluate((editor) => (editor.tagName === 'TEXTAREA' ? editor.value
  : [...editor.querySelectorAll('.cm-line')].map(({ textContent }) => textContent).join('\n')));
const has = (page, part) => until(async () => (await textOf(page)).includes(part), part);

// Parts of a page cut off what is wider than they are, and nobody can scroll there: the width of the document says nothing of it.
async function assertEveryControlIsReached(page, place) {
  const screen = page.viewportSize();
  const around = await page.locator(place).boundingBox();
  const [left, right] = [Math.max(0, around.x), Math.min(screen.width, around.x + around.width)];
  const controls = await page.locator(`${place} :is(.program-editor .head, .panels header) :is(select, button):visible`).all();
  assert.ok(controls.length >= 5, `${controls.length} controls`);
  for (const control of controls) {
    const seen = async () => `${await control.evaluate(({ outerHTML }) => outerHTML)}: ${JSON.stringify(await control.boundingBox())} in ${JSON.stringify(screen)}`;
    const { x, width } = await control.boundingBox(); // before anything scrolls: scripts can, where people can't
    assert.ok(x >= left && x + width <= right, await seen());
    await control.scrollIntoViewIfNeeded();
    const { y, height } = await control.boundingBox();
    assert.ok(y >= 0 && y + height <= screen.height, await seen());
  }
}

async function write(page, program) {
  await page.fill(`#programs ${EDITOR}`, program);
  await page.click('#programs .primary');
}

for (const [name, options, words] of [
  ['a large screen', { viewport: { width: 1280, height: 720 } }, { title: 'Lesson 1: Move', step: 'Press Run.', goal: /^You did it: \d+\.\d s$/ }],
  ['a telephone, in German', PHONE, { title: 'Lektion 1: Fahren', step: 'Drücken Sie „Ausführen“.', goal: /^Geschafft: \d+,\d s$/ }],
]) {
  test(`from the wrong program to the goal, and back after a reload, on ${name}`, { timeout: 120000 }, async (t) => {
    const page = await openPage(t, browser, options);
    await page.goto(server);
    const card = page.locator('.world[href*="lesson_1"]');
    await card.waitFor();
    assert.equal(await card.locator('.name').textContent(), words.title);
    await card.click();
    await state(page, 'running');
    await page.waitForSelector('#programs .lesson li');
    assert.equal(await page.textContent('#programs .lesson summary'), words.title);
    assert.ok((await page.textContent('#programs .lesson li')).startsWith(words.step));
    await has(page, 'left.setVelocity(0)');
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), options.viewport.width);
    await assertEveryControlIsReached(page, '#programs');
    assert.deepEqual(await accessibilityFindings(page), []);

    await write(page, WRONG);
    await page.waitForSelector(`#programs ${WRONG_LINE}`);
    const line = WRONG.split('\n').findIndex((each) => each.includes('\'fast\'')) + 1;
    assert.match(await page.textContent('#programs .said'), new RegExp(`move\\.py.*\\b${line}\\b`));
    await write(page, SOLVED);
    await until(async () => words.goal.test(await page.textContent('#programs .reached')), 'the goal');
    assert.equal(await page.locator(`#programs ${WRONG_LINE}`).count(), 0);

    await page.reload();
    await state(page, 'running');
    await has(page, 'left.setVelocity(10)');
    await page.click('#quit');
    await state(page, 'idle');
    await page.click('#start');
    await state(page, 'running');
    await has(page, 'left.setVelocity(10)');
    await page.click('#quit');
    await state(page, 'idle');
  });
}

const IN_C = await readFile(fileURLToPath(new URL('../../examples/demo_projects/patrol/controllers/patrol_in_c/patrol_in_c.c', import.meta.url)), 'utf-8');
const isInstalled = (program) => process.env.PATH.split(':').some((folder) => existsSync(`${folder}/${program}`));
const missing = ['make', 'cc'].filter((program) => !isInstalled(program));

test('Run compiles a program in C: what is wrong is marked and nothing runs, and then the robot drives', {
  timeout: 120000, skip: missing.length > 0 && `${missing.join(' and ')} not installed`,
}, async (t) => {
  const page = await openPage(t, browser);
  await page.goto(server);
  await page.click('.world[href*="patrol_in_c"]');
  await state(page, 'running');
  await page.waitForSelector('#programs .lesson li');
  await has(page, 'Drives a robot'); // lines that can't be seen are not in the page
  await write(page, IN_C.replace('wb_robot_step(step)', 'wb_robot_step(stride)'));
  await page.waitForSelector(`#programs ${WRONG_LINE}`);
  const line = IN_C.split('\n').findIndex((each) => each.includes('wb_robot_step(step)')) + 1;
  assert.match(await page.textContent('#programs .said'), new RegExp(`patrol_in_c\\.c.*\\b${line}\\b`));
  assert.match(await page.textContent('#programs .messages'), /'stride' undeclared/);
  await write(page, IN_C.replace('on patrol', 'in C on patrol'));
  await says(page, '#console', 'in C on patrol');
  assert.equal(await page.locator(`#programs ${WRONG_LINE}`).count(), 0);
  await page.click('#quit');
  await state(page, 'idle');
});

// The view of a student has a shadow tree of its own, which selectors of Playwright see through.
const ofView = '#simulation';

async function programOf(student, program) {
  await student.bringToFront(); // in Firefox the other pages are hidden
  await student.fill(`${ofView} ${EDITOR}`, program);
  await student.click(`${ofView} .program-editor .primary`);
}

test('in a class the teacher sees who runs what, reads it, gives a starting file to all, and shows one on the projector', { timeout: 300000 }, async (t) => {
  const teacher = await openPage(t, browser);
  await teacher.goto(`${server}/class/#teach`);
  await teacher.fill('#password', PASSWORD);
  await teacher.fill('#world', LESSON);
  await teacher.fill('#seats', '2');
  const { link } = await openClass(teacher);
  await until(async () => /^[12] of 2 are ready/.test(await teacher.textContent('#staged')), 'staged seats');
  const students = { Ada: await attend(t, browser, link, 'Ada', PHONE), Grace: await attend(t, browser, link, 'Grace') };
  const runs = (name, words) => until(async () => words.test(await tile(teacher, name).locator('.program').textContent()), `${name}: ${words}`);
  for (const [name, student] of Object.entries(students)) {
    await student.waitForSelector(`${ofView} .lesson li`);
    await runs(name, /^move\.py, as handed out$/);
  }

  // On a telephone and a tablet, upright and on its side. Where the editor is below the picture, the view scrolls, and not the editor once more.
  for (const [width, height] of [[768, 1024], [1024, 768], [844, 390], [390, 844]]) {
    await students.Ada.setViewportSize({ width, height });
    await assertEveryControlIsReached(students.Ada, ofView);
  }
  assert.equal(await students.Ada.locator(`${ofView} .program-editor`).evaluate((editor) => editor.scrollHeight - editor.clientHeight), 0);

  await programOf(students.Ada, WRONG);
  await runs('Ada', /^move\.py, changed · error in line 1\d$/);
  await programOf(students.Grace, SOLVED);
  await runs('Grace', /^move\.py, changed · goal reached in \d+\.\d s$/);

  // Read beside its picture, and on the projector: that page shows one simulation, and can have the whole screen.
  await teacher.bringToFront();
  await tile(teacher, 'Grace').locator('.look').click();
  await shown(teacher, 'look');
  await teacher.waitForSelector('#look-view [data-live]');
  await teacher.click('#look .toolbar [data-do="program"]');
  await says(teacher, '#look-text', 'left.setVelocity(10)');
  assert.equal(await teacher.locator('#look-text').evaluate((text) => text.isContentEditable), false);
  await teacher.click('#look-full');
  await teacher.waitForFunction(() => document.fullscreenElement?.id === 'look');
  assert.equal(await teacher.locator('#look-text').isVisible(), true, 'the program is beside the picture');
  await teacher.click('#look-full');
  await teacher.waitForFunction(() => document.fullscreenElement === null);

  // Handed out to all: whoever runs it has it as handed out.
  await teacher.click('#look-program [data-do="give"]');
  await teacher.click('#question-yes');
  await until(async () => (await textOf(students.Ada, ofView)).includes('left.setVelocity(10)'), 'the starting file');
  await students.Ada.click(`${ofView} .program-editor .primary`);
  await runs('Ada', /^move\.py, as handed out · goal reached/);

  await teacher.click('#look-back');
  await teacher.click('#close-class');
  await teacher.click('#question-yes');
  await shown(students.Ada, 'over');
  await assertNothingIsKept(site, ['setVelocity(10)']);
});
