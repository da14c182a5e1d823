// The editor for programs beside the simulation, against fake servers.

import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { accessibilityFindings, inFirefox, until } from './page.mjs';
import { PHONE, cloud, openViewer, runSimulation, state } from './viewer_page.mjs';

const PROGRAM = 'from controller import Robot; name = "e-puck"\nrobot = Robot()\nwhile robot.step(32) != -1:\n    pass\n';
const PACKAGES = fileURLToPath(new URL('../../build/node/src/web/view/node_modules', import.meta.url)); // installed by ./test.sh
const saved = async (path) => (await cloud.get('saved'))[path];
const said = (page) => page.locator('#programs .said').textContent();

// The fake servers show scripts as they are, and so none with libraries: these are bundled here, as cmake/bundle.cmake does.
function bundle(script) {
  const { buildSync } = createRequire(`${PACKAGES}/`)('esbuild');
  const { outputFiles: [{ text }] } = buildSync({
    entryPoints: [fileURLToPath(new URL(`../../src/web/view/${script}`, import.meta.url))],
    bundle: true, format: 'esm', minify: true, write: false, nodePaths: [PACKAGES],
  });
  return text;
}

const EDITORS = [{
  name: 'text field',
  element: '#programs textarea',
  text: (page) => page.inputValue('#programs textarea'),
  wrong: '#programs .numbers .wrong',
  wrongText: '3',
  isPlain: true,
}];
if (existsSync(`${PACKAGES}/@codemirror`)) {
  const bundles = Object.fromEntries(['archive.js', 'code_mirror.js'].map((script) => [script, bundle(script)]));
  EDITORS.push({
    name: 'CodeMirror',
    element: '#programs .cm-content',
    text: async (page) => (await page.locator('#programs .cm-line').allTextContents()).join('\n'),
    wrong: '#programs .cm-wrong',
    wrongText: 'while robot.step(32) != -1:',
    prepare: (page) => page.route(/\/view\/(archive|code_mirror)\.js$/, (route) => {
      route.fulfill({ contentType: 'text/javascript', body: bundles[route.request().url().split('/').pop()] });
    }),
  });
} else {
  test('CodeMirror', { skip: 'npm has not installed it' }, () => {});
}

async function openEditor(t, editor, options, programs = { 'drive/drive.py': PROGRAM, 'drive/map.py': 'MAP = 1\n' }) {
  await cloud.set('programs', programs);
  const page = await runSimulation(t, options, editor.prepare);
  await page.click('#show-code');
  await has(page, editor, PROGRAM);
  return page;
}

async function has(page, editor, text) {
  await page.waitForSelector(editor.element);
  await until(async () => await editor.text(page) === text, 'the text');
}

test('nothing of the editor is loaded or shown where there is nothing to change', async (t) => {
  const page = await runSimulation(t);
  assert.equal(await page.locator('#show-code').isHidden(), true);
  assert.deepEqual((await cloud.get('requests')).filter((path) => path.includes('program_editor')), []);
  assert.equal(JSON.parse((await cloud.get('started'))[0]).start.edit, true);
});

// With each editor that there can be.
function each(name, body, options = {}) {
  for (const editor of EDITORS)
    test(`${editor.name}: ${name}`, options, (t) => body(t, editor));
}

each('a program is changed, saved with Ctrl+S, and run from the beginning', async (t, editor) => {
  const page = await openEditor(t, editor);
  assert.equal(await editor.text(page), PROGRAM);
  await page.fill(editor.element, 'print("mine")\n');
  await page.focus(editor.element);
  await page.keyboard.press('Control+s');
  await until(async () => await saved('drive/drive.py') === 'print("mine")\n', 'the program');
  const last = async () => (await cloud.get('controls')).filter((text) => !text.startsWith('resize')).slice(-2).map((text) => text.split(':')[0]).join();
  await until(async () => await last() === 'reset,real-time', 'a new beginning');
  assert.equal(await saved('drive/map.py'), undefined); // which was not changed
  assert.equal(await said(page), 'Your program runs.');
});

each('what cannot be saved is said, and the simulation does not begin anew', async (t, editor) => {
  await cloud.set('save_error', 'The disk is full.');
  const page = await openEditor(t, editor);
  await page.fill(editor.element, 'x');
  await page.click('#programs .primary');
  await until(async () => await said(page) === 'The program is not saved: The disk is full.', 'the sentence');
  assert.equal((await cloud.get('controls')).includes('reset'), false);
});

each('Python\u2019s complaint is marked at its line', async (t, editor) => {
  const page = await openEditor(t, editor);
  await cloud.call('send', 'simulator', 'stderr:  File "/tmp/instance/project/controllers/drive/drive.py", line 3, in <module>');
  await page.waitForSelector(editor.wrong);
  assert.equal(await page.locator(editor.wrong).textContent(), editor.wrongText);
  assert.equal(await said(page), 'There is a mistake in drive.py, line 3: see the console.');
  await page.click('#programs .primary');
  await until(async () => await page.locator(editor.wrong).count() === 0, 'a new try');
});

each('what was written is there at the next start, also of another page, and can be undone', async (t, editor) => {
  const page = await openEditor(t, editor);
  await page.fill(editor.element, 'print("kept")\n');
  await page.waitForFunction(() => (localStorage.getItem('webots-cloud.programs') ?? '').includes('kept'));
  await page.click('#quit');
  await state(page, 'idle');
  await page.reload();
  await state(page, 'idle');
  await page.click('#start');
  await state(page, 'running');
  await page.click('#show-code');
  await has(page, editor, 'print("kept")\n');
  assert.match(await said(page), /^This is what you wrote last time, kept/);
  assert.equal(await saved('drive/drive.py'), undefined); // before Run the simulation has the project's
  page.on('dialog', (dialog) => dialog.accept());
  await page.click('#programs button:text("Undo everything")');
  await has(page, editor, PROGRAM);
  assert.equal(await page.evaluate(() => localStorage.getItem('webots-cloud.programs')), '{}');
});

each('keys are those of an editor, and none of them traps people', async (t, editor) => {
  const page = await openEditor(t, editor);
  await page.fill(editor.element, 'if x:');
  await page.focus(editor.element);
  await page.keyboard.press('End');
  await page.keyboard.press('Enter');
  await page.keyboard.type('y');
  assert.equal(await editor.text(page), 'if x:\n    y');
  await page.keyboard.press('Enter');
  await page.keyboard.press('Shift+Tab');
  await page.keyboard.press('Tab');
  assert.equal(await editor.text(page), 'if x:\n    y\n    ');
  await page.keyboard.press('Escape');
  await page.keyboard.press('Tab');
  assert.equal(await page.locator(editor.element).evaluate((element) => element.getRootNode().activeElement === element), false);
});

each('the editor is beside the picture on a large screen, and below it on a telephone', async (t, editor) => {
  const box = (page, selector) => page.locator(selector).evaluate((element) => element.getBoundingClientRect().toJSON());
  for (const [options, isBeside] of [[{ viewport: { width: 1280, height: 720 } }, true], [PHONE, false]]) {
    const page = await openEditor(t, editor, options);
    const [picture, panel] = [await box(page, '#screen'), await box(page, '#programs')];
    assert.equal(panel.left >= picture.right - 1, isBeside);
    assert.equal(panel.top >= picture.bottom - 1, !isBeside);
    assert.ok(panel.width >= 320 && (await box(page, editor.element)).height >= 150, JSON.stringify(panel));
    assert.deepEqual(await accessibilityFindings(page), []);
    await cloud.renew();
  }
});

each('a page that cannot be reached any more closes the editor, and keeps what was written', async (t, editor) => {
  const page = await openEditor(t, editor);
  await page.fill(editor.element, 'print("kept")\n');
  await page.waitForFunction(() => (localStorage.getItem('webots-cloud.programs') ?? '').includes('kept'));
  await page.click('#quit');
  await state(page, 'idle');
  assert.equal(await page.locator('#programs').isHidden(), true);
});

each('a program of this computer is taken, by its name, and none that is too large', async (t, editor) => {
  const page = await openEditor(t, editor);
  const choose = (name, text) => page.setInputFiles('#programs input[type=file]', { name, mimeType: 'text/x-python', buffer: Buffer.from(text) });
  await choose('map.py', 'MAP = 2\n');
  await has(page, editor, 'MAP = 2\n');
  assert.equal(await page.inputValue('#programs select'), 'drive/map.py');
  assert.equal(await said(page), 'drive/map.py is what you have uploaded. Press Run to try it.');
  await choose('other.py', 'OTHER = 1\n');
  await has(page, editor, 'OTHER = 1\n');
  await choose('other.py', 'x'.repeat(2 << 20));
  await until(async () => await said(page) === 'This file is too large for a program.', 'the sentence');
  assert.equal(await editor.text(page), 'OTHER = 1\n');
  await page.click('#programs .primary');
  await until(async () => await saved('drive/map.py') === 'OTHER = 1\n', 'the program');
});

each('programs are downloaded, several as an archive', async (t, editor) => {
  const page = await openEditor(t, editor);
  await page.fill(editor.element, 'print("mine")\n');
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#programs button:text("Download")')]);
  const bytes = readFileSync(await download.path());
  if (editor.prepare === undefined) { // without the library
    assert.deepEqual([download.suggestedFilename(), bytes.toString()], ['drive.py', 'print("mine")\n']);
    return;
  }
  assert.equal(download.suggestedFilename(), 'controllers.zip');
  const { strFromU8, unzipSync } = createRequire(`${PACKAGES}/`)('fflate');
  const files = Object.entries(unzipSync(bytes)).map(([path, content]) => [path, strFromU8(content)]);
  assert.deepEqual(files, [['drive/drive.py', 'print("mine")\n'], ['drive/map.py', 'MAP = 1\n']]);
}, { skip: inFirefox('its driver tells nothing of downloads') });

each('when the project has changed meanwhile, what is different is shown, and the project\u2019s is taken with one press', async (t, editor) => {
  const page = await openEditor(t, editor);
  const mine = PROGRAM.replace(/while[^]*/, 'print("mine")\n'); // nothing indented: Firefox's driver types, and the editor indents then
  await page.fill(editor.element, mine);
  await page.waitForFunction(() => (localStorage.getItem('webots-cloud.programs') ?? '').includes('mine'));
  await page.click('#quit');
  await state(page, 'idle');
  await cloud.set('programs', { 'drive/drive.py': `# New.\n${PROGRAM}`, 'drive/map.py': 'MAP = 1\n' });
  await page.click('#start');
  await state(page, 'running');
  await page.click('#show-code');
  await has(page, editor, mine);
  assert.match(await said(page), /^This is what you wrote last time. The project\u2019s own program has changed since/);
  assert.equal(await page.locator('#programs .changes pre').textContent(),
    '- # New.\n  from controller import Robot; name = "e-puck"\n  robot = Robot()\n- while robot.step(32) != -1:\n-     pass\n+ print("mine")\n  \n');
  assert.deepEqual(await accessibilityFindings(page), []);
  page.on('dialog', (dialog) => dialog.accept());
  await page.click('#programs button:text("Undo everything")');
  await has(page, editor, `# New.\n${PROGRAM}`);
  assert.equal(await page.locator('#programs .changes').isHidden(), true);
});

each('of a program that has to be compiled, where nobody does that, it is said', async (t, editor) => {
  const page = await openEditor(t, editor, {}, { 'drive/drive.py': PROGRAM, 'drive/fast.cpp': 'int fast;\n' });
  assert.equal(await said(page), '');
  await page.selectOption('#programs select', 'drive/fast.cpp');
  await has(page, editor, 'int fast;\n');
  assert.match(await said(page), /^This server does not compile fast.cpp: what you change in it has no effect here/);
  await page.fill(editor.element, 'int slow;\n');
  await page.click('#programs .primary');
  await until(async () => await saved('drive/fast.cpp') === 'int slow;\n', 'the program');
  assert.match(await said(page), /^This server does not compile/);
  assert.deepEqual(await cloud.get('compiling'), []);
  await page.selectOption('#programs select', 'drive/drive.py');
  await has(page, editor, PROGRAM);
  assert.equal(await said(page), '');
});

// --- programs in C

const C_PROGRAM = '#include "walls.h"\n\nint main() {\n  return walls()\n}\n';
const GCC = `cc -Wall -c drive.c -o drive.o
drive.c: In function 'main':
drive.c:4:17: error: expected ';' before '}' token
    4 |   return walls()
      |                 ^
      |                 ;
    5 | }
      | ~
make: *** [Makefile:7: drive.o] Error 1
`;
const DOES_NOT_COMPILE = { output: GCC, error: 'drive does not compile: look at the messages.', code: 'not-compiled', values: { controller: 'drive' } };
const controls = async (verb) => (await cloud.get('controls')).filter((text) => text.startsWith(verb)).length;
const messages = (page) => page.locator('#programs .messages');

async function openCEditor(t, editor, compiled, options) {
  await cloud.set('compiles', ['drive']);
  await cloud.set('compiled', compiled);
  await cloud.set('programs', { 'drive/drive.c': C_PROGRAM, 'drive/walls.h': 'int walls();\n', 'look/look.c': '', 'move/move.py': PROGRAM });
  const page = await runSimulation(t, options, editor.prepare);
  await page.click('#show-code');
  await has(page, editor, C_PROGRAM);
  assert.equal(await said(page), '');
  return page;
}

each('Run compiles a program in C, also one that nobody has changed, and runs it', async (t, editor) => {
  const page = await openCEditor(t, editor, {});
  await page.click('#programs .primary');
  await until(async () => await said(page) === 'Compiling drive \u2026', 'what goes on');
  assert.equal(await page.locator('#programs .primary').isDisabled(), true);
  await page.focus(editor.element);
  await page.keyboard.press('Control+s');
  const finish = () => cloud.call('send', 'simulation', `compiled: ${JSON.stringify({ controller: 'drive', output: 'cc -o drive drive.c\n' })}`);
  await cloud.call('send', 'simulation', 'compiled: {"controller":"look","output":""}');
  assert.equal(await controls('reset'), 0);
  await finish();
  await until(async () => await said(page) === 'Your program runs.', 'the run');
  await finish(); // of which nobody knows anything any more
  await page.click('#programs .primary');
  await until(async () => await controls('reset') === 2, 'a second run');
  assert.deepEqual(await cloud.get('compiling'), [['drive', {}]]);
  assert.equal(await messages(page).isHidden(), true);
});

each('what does not compile is not run: its line is marked, and the compiler\u2019s messages are there', async (t, editor) => {
  const page = await openCEditor(t, editor, { drive: DOES_NOT_COMPILE });
  await page.fill(editor.element, C_PROGRAM.replace('#', '// Mine.\n#'));
  await page.focus('#programs .primary');
  await page.keyboard.press('Enter');
  await until(async () => await said(page) === 'drive.c does not compile: see line 4, and the messages of the compiler.', 'the sentence');
  assert.equal(await page.locator(editor.wrong).textContent(), editor.isPlain ? '4' : 'int main() {');
  assert.equal(await controls('reset'), 0);
  assert.equal(await messages(page).locator('pre').innerText(), GCC);
  assert.equal(await messages(page).locator('.wrong').textContent(), `${GCC.split('\n')[2]}\n`);
  assert.equal(await page.evaluate(() => document.activeElement.className), 'primary', 'the keyboard is where it was');
  assert.deepEqual(await accessibilityFindings(page), []);
  await cloud.set('compiled', { drive: { output: '' } });
  await page.click('#programs .primary'); // Nothing was changed, but nothing is compiled either.
  await until(async () => await controls('reset') === 1, 'the run');
  assert.equal(await page.locator(editor.wrong).count(), 0);
  assert.equal(await messages(page).isHidden(), true);
  assert.equal((await cloud.get('compiling')).length, 2);
});

each('the line that does not compile is scrolled to', async (t, editor) => {
  const page = await openCEditor(t, editor, { drive: { ...DOES_NOT_COMPILE, output: 'drive.c:150:1: error: no\n' } });
  await page.fill(editor.element, 'int drive;\n'.repeat(200));
  await page.locator(editor.element).press('Control+Home');
  await page.click('#programs .primary');
  const wrong = page.locator(editor.wrong);
  await wrong.waitFor();
  await until(() => wrong.evaluate((line) => {
    const [{ top, bottom }, text] = [line.getBoundingClientRect(), document.querySelector('#programs .program-text').getBoundingClientRect()];
    return top >= text.top && bottom <= text.bottom;
  }), 'the line');
});

each('several sources of a controller are saved, and then compiled once; warnings are folded', async (t, editor) => {
  const output = "drive.c:4:7: warning: unused variable 'x'\n";
  const page = await openCEditor(t, editor, { drive: { output } });
  await page.fill(editor.element, 'int drive;\n');
  await page.selectOption('#programs select', 'drive/walls.h');
  await has(page, editor, 'int walls();\n');
  await page.fill(editor.element, 'int none;\n');
  await page.selectOption('#programs select', 'move/move.py');
  await has(page, editor, PROGRAM);
  await page.click('#programs .primary');
  await until(async () => await controls('reset') === 1, 'the run');
  assert.deepEqual(await cloud.get('compiling'), [['drive', { 'drive/drive.c': 'int drive;\n', 'drive/walls.h': 'int none;\n' }]]);
  assert.equal(await said(page), 'Your program runs.');
  assert.equal(await messages(page).locator('pre').isHidden(), true);
  await messages(page).locator('summary').click();
  assert.equal(await messages(page).locator('pre').innerText(), output);
  await page.click('#programs .primary');
  await until(async () => await controls('reset') === 2, 'a second run');
  assert.equal(await messages(page).isHidden(), true);
});

each('Undo everything compiles what it has put back', async (t, editor) => {
  const page = await openCEditor(t, editor, { drive: { output: '' } });
  await page.fill(editor.element, 'int drive;\n');
  await page.click('#programs .primary');
  await until(async () => await controls('reset') === 1, 'the run');
  page.on('dialog', (dialog) => dialog.accept());
  await page.click('#programs button:text("Undo everything")');
  await until(async () => await controls('reset') === 2, 'the run');
  assert.deepEqual(await cloud.get('compiling'), [['drive', { 'drive/drive.c': 'int drive;\n' }], ['drive', {}]]);
});

each('why a controller is not compiled is said in the language of the page, and which ones never are', async (t, editor) => {
  const page = await openCEditor(t, editor, { drive: { error: 'Too long.', code: 'compiled-too-long', values: { seconds: 30 } } }, { locale: 'de-DE' });
  await page.click('#programs .primary');
  await until(async () => (await said(page)).startsWith('Das Kompilieren hat l\u00e4nger als 30 Sekunden gedauert'), 'the sentence');
  assert.equal(await messages(page).isHidden(), true);
  await page.selectOption('#programs select', 'look/look.c');
  await until(async () => (await said(page)).startsWith('Dieser Server kompiliert look.c nicht'), 'the sentence');
});

each('long names of programs do not make a telephone scroll sideways', async (t, editor) => {
  const long = `drive/${'a_program_with_a_very_long_name_'.repeat(4)}.py`;
  const page = await openEditor(t, editor, PHONE, { 'drive/drive.py': PROGRAM, [long]: '' });
  await page.selectOption('#programs select', long);
  const { right, scrolls, overflow } = await page.locator('#programs select').evaluate((select) => ({ right: select.getBoundingClientRect().right,
    scrolls: document.documentElement.scrollWidth, overflow: getComputedStyle(select).textOverflow }));
  assert.ok(right <= PHONE.viewport.width, String(right));
  assert.equal(scrolls, PHONE.viewport.width);
  assert.equal(overflow, 'ellipsis');
  assert.deepEqual(await page.locator('#programs option').allTextContents(), ['drive.py', long]);
});

// --- lessons

const LESSON = { title: { en: 'Lesson 1: Move', de: 'Lektion 1: Fahren' }, about: {}, steps: [{ en: 'Press <b>Run</b>.', de: 'Los.' }, { '': 'MOVE' }] };
const steps = (page) => page.locator('#programs .lesson li').allTextContents();

test('a lesson opens the editor, and says in the language of the page what to do, and that the goal is reached', async (t) => {
  await cloud.set('lesson', LESSON);
  await cloud.set('programs', { 'drive/drive.py': PROGRAM });
  const page = await runSimulation(t);
  await page.waitForSelector('#programs .lesson summary');
  assert.equal(await page.locator('#programs .lesson summary').textContent(), 'Lesson 1: Move');
  assert.deepEqual(await steps(page), ['Press <b>Run</b>.', 'MOVE']);
  assert.equal(await page.evaluate(() => document.activeElement.closest('#programs')), null, 'no keyboard of a telephone opens by itself');
  assert.deepEqual(await accessibilityFindings(page), []);
  await cloud.call('send', 'simulator', 'stdout:You did it: 23.4 s');
  const reached = page.locator('#programs .reached');
  await until(async () => await reached.textContent() === 'You did it: 23.4 s', 'the goal');
  assert.deepEqual(await accessibilityFindings(page), []);
  await cloud.call('send', 'simulator', 'application/json:{"time":3000}');
  await cloud.call('send', 'simulator', 'application/json:{"time":0}');
  await until(async () => await reached.textContent() === '', 'a new beginning');
});

test('so it does on a telephone, in German', async (t) => {
  await cloud.set('lesson', LESSON);
  await cloud.set('programs', { 'drive/drive.py': PROGRAM });
  const page = await runSimulation(t, { ...PHONE, locale: 'de-DE' });
  await page.waitForSelector('#programs .lesson summary');
  assert.equal(await page.locator('#programs .lesson summary').textContent(), 'Lektion 1: Fahren');
  assert.deepEqual(await steps(page), ['Los.', 'MOVE']);
  await cloud.call('send', 'simulator', 'stdout:You did it: 23.4 s');
  await until(async () => await page.locator('#programs .reached').textContent() === 'Geschafft: 23,4 s', 'the goal');
  assert.deepEqual(await accessibilityFindings(page), []);
});

test('what a project calls a lesson is text, whatever it holds, and in another language than the page\u2019s where there is none', async (t) => {
  await cloud.set('lesson', { title: 7, steps: [{ sv: '<img src=x onerror=alert(1)>' }, null, 'x', { en: 1, de: 'Los.' }] });
  await cloud.set('programs', { 'drive/drive.py': PROGRAM });
  const page = await runSimulation(t, { locale: 'ja-JP' });
  await page.waitForSelector('#programs .lesson summary');
  assert.equal(await page.locator('#programs .lesson summary').textContent(), 'レッスン');
  assert.deepEqual(await steps(page), ['<img src=x onerror=alert(1)>', '', '', 'Los.']);
});

test('a lesson whose programs nobody may change opens nothing', async (t) => {
  await cloud.set('lesson', LESSON);
  const page = await runSimulation(t);
  assert.equal(await page.locator('#programs').isHidden(), true);
});

test('CodeMirror searches in the language of the page', { skip: EDITORS.length < 2 }, async (t) => {
  const page = await openEditor(t, EDITORS[1], { locale: 'de-DE' });
  await page.focus('#programs .cm-content');
  await page.keyboard.press('Control+f');
  await page.waitForSelector('#programs .cm-search');
  assert.equal(await page.locator('#programs .cm-search input[name=search]').getAttribute('placeholder'), 'Suchen');
  await page.keyboard.type('robot.step');
  await page.keyboard.press('Enter');
  await page.waitForSelector('#programs .cm-searchMatch');
  assert.deepEqual(await accessibilityFindings(page), []);
});
