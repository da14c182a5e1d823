// The page of a class as teachers have it, against fake servers.

import assert from 'node:assert/strict';
import { existsSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { accessibilityFindings, openPage, until } from './page.mjs';
import { CODE, PHONE, WORLD, address, browser, classOf, cloud, fillForm, jpeg, openClass, openForm, press, said, says, shown, student, tell, tile, waitForSaid } from './class_page.mjs';
import { Pixels } from './pixels.mjs';

const DECODER = new URL('../../build/node/src/web/class/node_modules/qr/decode.js', import.meta.url); // installed by ./test.sh
const clean = async (page, where) => assert.deepEqual(await accessibilityFindings(page), [], where);
const answer = (page, choice) => page.click(choice ? '#question-yes' : '#question [value=""]');
const names = (page) => page.locator('#wall .name').allTextContents();
const lastTold = async () => (await said('tell')).at(-1);

test('a class is opened with a password, a world and seats; what is wrong is said in words', async (t) => {
  await cloud.set('defaults', { url: WORLD });
  const page = await openForm(t);
  await page.waitForFunction((world) => document.getElementById('world').value === world, WORLD);
  await clean(page, 'form');
  await page.fill('#password', 'abcd-efgh-jkmn');
  for (const [error, words] of Object.entries({ off: 'Nobody can open a class', password: 'not the teacher', tries: 'Too many wrong attempts', limit: 'any more classes',
    seats: '1 to 100', world: 'not the address of a world', message: 'for programs' })) {
    await cloud.set('class_answers', { teach: [{ error, text: 'for programs' }] });
    await page.click('#open-class');
    await says(page, '#open-problem', words);
  }
  await page.fill('#world', 'nonsense');
  await page.click('#open-class');
  await says(page, '#open-problem', 'not a complete address');
  await clean(page, 'refused');
  await page.fill('#world', WORLD);
  await page.fill('#seats', '24');
  await cloud.set('class_answers', { teach: [{ class: await classOf([], { seats: 24, reserved: 24 }) }] });
  await page.click('#open-class');
  await shown(page, 'lesson');
  assert.deepEqual((await said('teach')).at(-1), { password: 'abcd-efgh-jkmn', world: WORLD, mode: 'mjpeg', seats: 24 });
  await says(page, '#reserved', 'All 24 seats');
  await says(page, '#fetch-status', '1 of 1 machines');
  const [start] = (await cloud.get('started')).map((text) => JSON.parse(text));
  assert.deepEqual(start, { start: { url: WORLD, mode: 'mjpeg', fetch_only: true, reasons: true } });
  assert.equal(await page.inputValue('#password'), '');
  const used = await page.evaluate(() => JSON.stringify([{ ...localStorage }, { ...sessionStorage }]));
  assert.ok(used.includes(WORLD) && !used.includes('abcd-efgh'), used);
});

test('students can come in by a link, a short code, and a QR code that has the link', async (t) => {
  const page = await openClass(t);
  const link = await address(CODE);
  assert.equal(await page.getAttribute('#link', 'href'), link);
  assert.equal(await page.textContent('#class-code'), CODE);
  await says(page, '#link-local:not([hidden])', 'this machine only'); // 127.0.0.1
  await clean(page, 'empty class');
  await page.click('#project');
  await page.waitForFunction(() => document.fullscreenElement?.id === 'invitation');
  await tell({ student: student(1, 'Ada <b>') });
  await tell({ student: student(2, 'Zoë') });
  await says(page, '#here-count', 'In the class: 2');
  assert.deepEqual(await page.locator('#here li').allTextContents(), ['Ada <b>', 'Zoë']);
  assert.ok(await page.isVisible('#here'));
  await says(page, '#project', 'Back to the lesson');
  await clean(page, 'projector');
  if (!existsSync(fileURLToPath(DECODER)))
    return t.diagnostic('the QR code was not tried: npm could not install its library');
  const { default: decode } = await import(DECODER);
  const picture = new Pixels(await page.locator('#qr svg').screenshot());
  const data = new Uint8Array(picture.width * picture.height * 3);
  for (let i = 0; i < picture.width * picture.height; ++i)
    data.set(picture.at(i % picture.width, Math.floor(i / picture.width)), 3 * i);
  assert.equal(decode({ width: picture.width, height: picture.height, data }), link);
});

test('on a page that is open as localhost, the link is one for the network, or it is said how the site gets one', async (t) => {
  const here = await address();
  const there = here.replace('127.0.0.1', '192.168.1.5');
  const network = { addresses: ['10.0.0.9', '192.168.1.5'], open: true };
  const page = await openClass(t, { more: { network } });
  assert.equal(await page.getAttribute('#link', 'href'), `${there}${CODE}`);
  assert.equal(await page.isVisible('#link-local'), false);
  const alone = await openClass(t, { ...PHONE, more: { network: { ...network, open: false } } });
  assert.equal(await alone.getAttribute('#link', 'href'), `${here}${CODE}`);
  await says(alone, '#link-local', `./server.sh restart --lan on it, then open ${there}`);
  await clean(alone, 'this machine only');
});

test('the link is copied where browsers have no clipboard for pages, as by http', async (t) => {
  const page = await openPage(t, browser);
  await page.addInitScript(() => {
    Object.defineProperty(navigator, 'clipboard', { value: undefined });
    document.addEventListener('copy', ({ target }) => { globalThis.copied = target.value; });
  });
  await cloud.set('class_answers', { teach: [{ class: await classOf() }] });
  await page.goto(await address('#teach'));
  await fillForm(page);
  await page.click('#open-class');
  await shown(page, 'lesson');
  await page.click('#copy');
  await says(page, '#copy', 'Copied');
  assert.equal(await page.evaluate(() => globalThis.copied), await address(CODE));
  await tell({ code: 'ABCDEF' });
  await says(page, '#copy', 'Copy the link'); // it is another one
});

test('when the lesson runs, how to come in is one line, until somebody wants more', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada', { state: 'starting' })] });
  assert.ok(await page.isVisible('#qr') || await page.isVisible('#class-code'));
  const before = await page.locator('#invitation').evaluate((part) => part.offsetHeight);
  await tell({ student: student(1, 'Ada', { state: 'running' }) });
  await page.waitForSelector('#class-code', { state: 'hidden' });
  await says(page, '#in-short', CODE);
  assert.ok(await page.locator('#invitation').evaluate((part) => part.offsetHeight) < before / 3);
  assert.equal(await page.isVisible('#preparation'), false);
  await clean(page, 'folded');
  await cloud.call('set_available', 'full');
  await tell({ student: student(2, 'Bob', { state: 'waiting' }) });
  await says(page, '#reserved', 'Students waiting: 1.');
  assert.ok(await page.isVisible('#preparation'), 'seats can be added');
  await page.click('#fold');
  assert.ok(await page.isVisible('#class-code'));
  assert.equal(await page.getAttribute('#fold', 'aria-expanded'), 'true');
  await tell({ student: student(3, 'Cyd', { state: 'running' }) });
  await tile(page, 3).waitFor();
  assert.ok(await page.isVisible('#class-code'), 'it stays as the teacher wants it');
});

test('another world is chosen for all, and the machines fetch it', async (t) => {
  const other = WORLD.replace('arena', 'maze');
  await cloud.set('worlds', [{ url: WORLD, title: 'The arena' }, { url: other, title: 'The maze' }]);
  const page = await openClass(t, { students: [student(1, 'Ada', { state: 'running' })] });
  await says(page, '#fetch-status', '1 of 1');
  await page.click('#for-all [data-do="world"]');
  await page.fill('#another-world', 'nonsense');
  await page.keyboard.press('Enter');
  await says(page, '#another-problem', 'not a complete address');
  await clean(page, 'another world');
  await page.locator('#another-pick button').nth(1).click();
  assert.equal(await page.inputValue('#another-world'), other);
  await cloud.set('class_answers', { world: [{ world: { world: other, mode: 'mjpeg' } }],
    teach: [{ class: { ...await classOf([student(1, 'Ada')]), world: other } }] });
  await page.click('#another .primary');
  assert.deepEqual(await waitForSaid('world'), { world: other, mode: 'mjpeg' });
  await until(async () => (await said('teach')).at(-1).key === 'key-of-the-teacher', 'new tickets for the machines');
  await until(async () => (await cloud.get('started')).some((text) => JSON.parse(text).start.url === other), 'the fetching');
  assert.equal(await page.textContent('#class-world'), other);
  await page.click('#for-all [data-do="world"]');
  await page.keyboard.press('Escape');
  assert.equal((await said('world')).length, 1);
});

test('without the QR library the link and the code are there, and no error', async (t) => {
  const page = await openForm(t);
  let asked = 0;
  await page.route('**/qr.js*', (route) => route.fulfill({ status: 404 }).then(() => ++asked));
  await cloud.set('class_answers', { teach: [{ class: await classOf() }] });
  await fillForm(page);
  await page.click('#open-class');
  await says(page, '#class-code', CODE);
  await until(() => asked === 2, 'the library is asked for once more');
  assert.equal(await page.locator('#qr > *').count(), 0);
  assert.equal(await page.isVisible('#trouble'), false);
});

test('a world of the gallery is chosen with one press', async (t) => {
  const other = 'local:/school/week_1/blob/main/worlds/<b>.wbt';
  await cloud.set('worlds', [{ url: WORLD, title: 'The arena' }, { url: other, title: '<b>Bold</b>' }]);
  const page = await openForm(t, PHONE);
  const picks = page.locator('#pick button');
  await picks.nth(1).click();
  assert.equal(await page.inputValue('#world'), other);
  assert.deepEqual(await picks.allTextContents(), ['The arena', '<b>Bold</b>']);
  assert.deepEqual(await picks.evaluateAll((all) => all.map((each) => each.ariaPressed)), ['false', 'true']);
  await clean(page, 'with worlds');
  await page.fill('#world', WORLD);
  assert.deepEqual(await picks.evaluateAll((all) => all.map((each) => each.ariaPressed)), ['true', 'false']);
  await cloud.set('class_answers', { teach: [{ class: await classOf() }] });
  await page.fill('#password', 'abcd-efgh-jkmn');
  await page.click('#open-class');
  await shown(page, 'lesson');
});

test('machines that cannot fetch the project are named with the reason, and are asked again', async (t) => {
  await cloud.set('fetching', ['reason: {"code":"no-repository","values":{"name":"owner/repository"}}', 'loading: Error: Repository owner/repository does not exist or is private.']);
  const here = await cloud.call('address', 'simulation');
  const page = await openClass(t, { ...PHONE, more: { machines: [`${here}/ticket-of-mine`, 'ws://127.0.0.1:1'] } });
  await says(page, '#fetch-faults', 'does not exist, or is private');
  await says(page, '#fetch-faults', '127.0.0.1:1: The machine cannot be reached');
  await says(page, '#fetch-status', '0 of 2');
  assert.ok(!(await page.textContent('#preparation')).includes('ticket-of-mine'));
  await clean(page, 'faults');
  await cloud.set('fetching', ['loading: Receiving objects: 40% (4/10)', 'fetched:']);
  await page.click('#fetch-again');
  await says(page, '#fetch-status', '1 of 2');
  await page.waitForSelector('#fetch-again');
  assert.equal(await page.locator('#fetch-faults li').count(), 1);
});

test('the wall has a tile for each student, with state and time in words; who needs somebody comes first', async (t) => {
  const simulator = await cloud.call('address', 'simulator');
  const page = await openClass(t, { students: [student(1, 'Grace', { state: 'running', time: 61000, simulator }), student(2, 'Ada', { state: 'waiting' })] });
  assert.deepEqual(await names(page), ['Ada', 'Grace']);
  await tell({ student: student(3, 'Bob <i>10</i>') });
  await tell({ student: student(4, 'Bob 9', { state: 'lost' }) });
  await tell({ student: student(5, 'Zoë', { state: 'away' }) });
  await until(async () => (await names(page)).length === 5, 'five tiles');
  assert.deepEqual(await names(page), ['Bob 9', 'Zoë', 'Ada', 'Bob <i>10</i>', 'Grace']);
  assert.equal(await tile(page, 1).locator('.time').textContent(), '0:01:01');
  for (const [id, words] of Object.entries({ 1: 'Running', 2: 'Waiting for a seat', 3: 'Joined', 4: 'Simulation not responding', 5: 'No connection' }))
    assert.equal(await tile(page, id).locator('.words').textContent(), words);
  // Those who need somebody stand out by more than a colour.
  const border = (id) => tile(page, id).evaluate((item) => getComputedStyle(item).borderTopStyle);
  assert.deepEqual(await Promise.all([1, 2, 3, 4, 5].map(border)), ['solid', 'dashed', 'solid', 'dashed', 'dashed']);
  await says(page, '#summary', '5 students: 1 running, 1 waiting for a seat, 1 not responding, 1 without a connection, and 1 about to start');
  await tell({ picture: { id: 1, jpeg: await jpeg(page, 'rgb(200 30 30)') } });
  await tell({ picture: { id: 2, jpeg: 'bm9uc2Vuc2U=' } });
  await page.waitForSelector('#wall [data-student="1"][data-pictured]');
  const pixels = new Pixels(await tile(page, 1).locator('canvas').screenshot());
  const [red, green] = pixels.at(pixels.width / 2, pixels.height / 2);
  assert.ok(red > 180 && green < 60, `${red} ${green}`);
  await clean(page, 'wall');
  await tell({ student: student(1, 'Grace', { state: 'paused', time: 62000, simulator }) });
  await says(page, '[data-student="1"] .words', 'Paused');
  await tell({ gone: 2 });
  await until(async () => (await names(page)).length === 4, 'one less');
  await page.selectOption('#language', 'fr');
  await says(page, '[data-student="1"] .words', 'En pause');
});

test('hands come first, who is done last; nothing moves under a pointer', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada', { state: 'running' }), student(2, 'Bob', { state: 'running' }), student(3, 'Cyd', { state: 'lost' })] });
  assert.deepEqual(await names(page), ['Cyd', 'Ada', 'Bob']);
  await tell({ student: student(2, 'Bob', { state: 'running', sign: 'hand' }) });
  await tell({ student: student(1, 'Ada', { state: 'running', sign: 'done' }) });
  await says(page, '[data-student="1"] .sign', 'Done');
  await says(page, '[data-student="2"] .sign', 'Hand raised');
  assert.deepEqual(await names(page), ['Bob', 'Cyd', 'Ada']);
  await says(page, '#summary', '3 students: 2 running and 1 not responding · 1 with a raised hand and 1 done');
  await clean(page, 'signs');
  await press(page, 2, 'lower');
  await waitForSaid('tell', (each) => each.do === 'lower' && each.students[0] === 2);
  await tell({ student: student(2, 'Bob', { state: 'running' }) });
  await page.waitForSelector('[data-student="2"] .sign', { state: 'hidden' });
  assert.deepEqual(await names(page), ['Bob', 'Cyd', 'Ada'], 'the pointer is there');
  assert.equal(await page.evaluate(() => document.activeElement.closest('.tile')?.dataset.student), '2');
  await until(async () => (await names(page)).join() === 'Cyd,Bob,Ada', 'the order, when it has rested');
});

test('a tile says why its student waits, and why a simulation has ended', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada', { state: 'waiting', why: 'busy', ahead: 2 })] });
  const why = (id, text) => page.waitForFunction(([number, wanted]) => document.querySelector(`[data-student="${number}"] .why`)?.textContent === wanted, [id, text]);
  await why(1, 'No. 3 in line. The machines are busy: a start may have to wait.');
  await tell({ student: student(1, 'Ada', { state: 'waiting', why: 'suitable' }) });
  await why(1, 'No machine that can run this world is free.');
  await tell({ student: student(1, 'Ada', { state: 'waiting', why: 'later-page' }) });
  await why(1, '');
  await tell({ student: student(1, 'Ada', { state: 'waiting', why: 'Too <b>many</b> were asked for.' }) });
  await why(1, 'Too <b>many</b> were asked for.');
  await tell({ student: student(1, 'Ada', { state: 'starting', why: 'Receiving the project: 40%' }) });
  await why(1, 'Receiving the project: 40%');
  await tell({ student: student(1, 'Ada', { state: 'ended', why: 'The <b>world</b> is too large.' }) });
  await why(1, 'The <b>world</b> is too large.');
  await clean(page, 'why');
});

test('a tile says which program its student runs, and how that goes', async (t) => {
  const file = 'drive/drive.py';
  const runs = (id, name, program) => student(id, name, { state: 'running', program });
  const page = await openClass(t, { students: [runs(1, 'Ada', { file, changed: false }), student(2, 'Bob', { state: 'running' })] });
  const program = (id, text) => page.waitForFunction(([number, wanted]) => document.querySelector(`[data-student="${number}"] .program`)?.textContent === wanted, [id, text]);
  await program(1, 'drive.py, as handed out');
  await program(2, '');
  await tell({ student: runs(1, 'Ada', { file, changed: true, line: 12 }) });
  await tell({ student: runs(2, 'Bob', { file: 'drive/<b>.py', changed: true }) });
  await program(1, 'drive.py, changed · error in line 12');
  await program(2, '<b>.py, changed');
  await clean(page, 'programs');
  await tell({ student: runs(1, 'Ada', { file, changed: true, line: 12, goal: 23400 }) });
  await program(1, 'drive.py, changed · goal reached in 23.4 s');
  await clean(page, 'goal');
  const words = {
    de: 'drive.py, geändert · Ziel erreicht in 23,4 s', es: 'drive.py, modificado · meta alcanzada en 23,4 s', fr: 'drive.py, modifié · but atteint en 23,4 s',
    it: 'drive.py, modificato · traguardo raggiunto in 23,4 s', ja: 'drive.py（変更あり） · 23.4 秒でゴール', zh: 'drive.py，已更改 · 用 23.4 秒到达目标',
  };
  for (const [language, text] of Object.entries(words)) {
    await page.selectOption('#language', language);
    await program(1, text);
  }
});

test('those whose simulation has ended are started again, one or all', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada', { state: 'running' }), student(2, 'Bob', { state: 'running' })] });
  const all = page.locator('#for-all [data-do="start"]');
  assert.ok(await all.isDisabled());
  await tell({ student: student(2, 'Bob', { state: 'ended' }) });
  await says(page, '[data-student="2"] .toggle', 'Start again');
  await tile(page, 2).locator('.toggle').click();
  await all.click();
  await until(async () => (await said('tell')).length === 2, 'two messages');
  assert.deepEqual(await said('tell'), [{ students: [2], do: 'start' }, { students: null, do: 'start' }]);
});

test('in every language the form and the lesson fit on a telephone, without scrolling sideways', async (t) => {
  const fits = async (page) => {
    for (const language of await page.locator('#language option').evaluateAll((options) => options.map(({ value }) => value))) {
      await page.selectOption('#language', language);
      await page.waitForSelector(`html[lang="${language}"]`);
      assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), PHONE.viewport.width, language);
    }
  };
  await fits(await openForm(t, PHONE));
  await fits(await openClass(t, { ...PHONE, students: [student(1, 'Frances Elizabeth Holberton-Snyder', { state: 'lost' }), student(2, 'Ada')] }));
});

test('a tile says why it has no picture', async (t) => {
  const page = await openForm(t);
  await page.clock.install();
  await cloud.set('class_answers', { teach: [{ class: await classOf([student(1, 'Ada', { state: 'running' }), student(2, 'Bob', { state: 'hidden' })]) }] });
  await fillForm(page);
  await page.click('#open-class');
  await says(page, '[data-student="1"] .no-picture', 'Waiting for the picture');
  await says(page, '[data-student="2"] .no-picture', 'page is hidden');
  await page.clock.runFor(14000);
  await says(page, '[data-student="1"] .no-picture', 'can’t read it');
  await tell({ picture: { id: 1, jpeg: await jpeg(page, 'rgb(200 30 30)') } });
  await page.waitForSelector('[data-student="1"] .no-picture', { state: 'hidden' });
});

test('one student or all are paused, run, reset, written to, ended and removed', async (t) => {
  const page = await openClass(t, { ...PHONE, colorScheme: 'dark', students: [student(1, 'Ada', { state: 'running' }), student(2, 'Bob', { state: 'paused' })] });
  await tile(page, 1).locator('.toggle').click();
  await tile(page, 2).locator('.toggle').click();
  await press(page, 1, 'reset');
  await until(async () => (await said('tell')).length === 3, 'three messages');
  assert.deepEqual(await said('tell'), [{ students: [1], do: 'pause' }, { students: [2], do: 'run' }, { students: [1], do: 'reset' }]);
  await press(page, 2, 'message');
  await clean(page, 'writing');
  await page.keyboard.type('Well done!');
  await page.keyboard.press('Enter');
  await waitForSaid('tell', (each) => each.text === 'Well done!');
  assert.deepEqual(await lastTold(), { students: [2], do: 'message', text: 'Well done!' });
  for (const action of ['end', 'remove']) {
    await press(page, 1, action);
    await says(page, '#question-text', 'Ada');
    await clean(page, action);
    await answer(page, true);
    await waitForSaid('tell', (each) => each.do === action);
    assert.deepEqual(await lastTold(), { students: [1], do: action });
  }
  const all = (action) => page.click(`#for-all [data-do="${action}"]`);
  for (const action of ['pause', 'run', 'reset']) {
    await all(action);
    await waitForSaid('tell', (each) => each.students === null && each.do === action);
  }
  const before = (await said('tell')).length;
  await all('end');
  await answer(page, false);
  await all('end');
  await answer(page, true);
  await all('remove');
  await answer(page, true);
  await all('message');
  await page.fill('#writing-text', 'Five minutes left');
  await page.click('#writing-send');
  await until(async () => (await said('tell')).length === before + 3, 'three messages: one was cancelled');
  assert.deepEqual((await said('tell')).slice(before), [{ students: null, do: 'end' }, { students: null, do: 'remove' },
    { students: null, do: 'message', text: 'Five minutes left' }]);
});

test('a new code takes the place of the old one', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada')] });
  await page.click('#new-code');
  assert.equal(await waitForSaid('code'), 'new');
  await tell({ code: 'ABCDEF' });
  await says(page, '#class-code', 'ABCDEF');
  assert.equal(await page.getAttribute('#link', 'href'), await address('ABCDEF'));
  assert.deepEqual(await names(page), ['Ada']);
});

test('a student who runs and says nothing more does not break the connection of the class', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada', { state: 'running', time: 7 })] });
  await page.clock.install();
  await tell({ student: student(1, 'Ada', { state: 'running', time: 7 }) });
  await tell({ student: student(2, 'Bob') });
  await tile(page, 2).waitFor();
  await page.clock.runFor(30_000);
  await tell({ student: student(3, 'Cyd') });
  await tile(page, 3).waitFor();
  assert.equal((await said('teach')).length, 1, 'it was not given up');
});

test('pictures are wanted while the wall is seen', async (t) => {
  const page = await openClass(t);
  await waitForSaid('watch');
  const hide = (hidden) => page.evaluate((value) => {
    Object.defineProperty(document, 'hidden', { value, configurable: true });
    document.dispatchEvent(new Event('visibilitychange'));
  }, hidden);
  await hide(true);
  await hide(false);
  await until(async () => (await said('watch')).length === 3, 'three of them');
  assert.deepEqual(await said('watch'), [true, false, true]);
});

test('one simulation is looked at, large and without disturbing, and then there is the wall again', async (t) => {
  const simulator = await cloud.call('address', 'simulator');
  const ada = student(1, 'Ada', { state: 'running', simulator });
  const page = await openClass(t, { students: [ada, student(2, 'Bob')] });
  assert.equal(await tile(page, 2).locator('.look').isDisabled(), true);
  await tile(page, 1).locator('.look').focus();
  await page.keyboard.press('Enter');
  await shown(page, 'look');
  await page.waitForSelector('#look-view [data-live]');
  await says(page, '#look-name', 'Ada');
  await cloud.call('send', 'simulator', 'robot window: {"robot":"e-puck","window":"e-puck","visible":true}');
  await cloud.call('send', 'simulator', 'time: 99000');
  await page.waitForFunction(() => document.querySelector('#look-view > div').shadowRoot.querySelector('time').textContent >= '0:01:39');
  assert.equal(await page.locator('#look iframe').count(), 0, 'no page of the student in the page of the teacher');
  await clean(page, 'look');
  assert.deepEqual((await said('watch')).at(-1), false);
  await page.click('#look [data-do="pause"]');
  await waitForSaid('tell', (each) => each.do === 'pause');
  await page.click('#look-full');
  await page.waitForFunction(() => document.fullscreenElement?.id === 'look');
  await clean(page, 'look in full screen');
  await page.click('#look-full');
  await page.waitForFunction(() => document.fullscreenElement === null);
  await tell({ student: { ...ada, state: 'ended', simulator: undefined } });
  await says(page, '#look-state', 'Ended');
  await tell({ student: ada });
  await page.waitForSelector('#look-view [data-live]');
  await page.keyboard.press('Escape');
  await shown(page, 'lesson');
  assert.equal((await said('watch')).at(-1), true);
  assert.equal(await page.evaluate(() => document.activeElement.closest('.tile')?.dataset.student), '1');
  const controls = await cloud.get('controls');
  assert.ok(controls.every((control) => control.startsWith('mjpeg: ')), `only the first line was sent: ${controls}`);
  await until(async () => await cloud.get('streams') === 0, 'the end of the picture');
});

test('a program is read beside its simulation, and given to all', async (t) => {
  const ada = student(1, 'Ada', { state: 'running', simulator: await cloud.call('address', 'simulator') });
  const page = await openClass(t, { students: [ada, student(2, 'Bob')] });
  await tile(page, 1).locator('.look').click();
  await shown(page, 'look');
  await page.click('#look .toolbar [data-do="program"]');
  await waitForSaid('tell', (each) => each.do === 'program' && each.students[0] === 1);
  await tell({ program: { id: 2, file: 'b/b.py', text: 'of somebody else' } });
  await tell({ program: { id: 1, file: 'a/a.py', text: '<b>print(1)</b>\n' } });
  await says(page, '#look-text', '<b>print(1)</b>');
  await tell({ student: { ...ada, program: { file: 'a/a.py', changed: true, line: 3 } } });
  await says(page, '#look-state', 'a.py, changed · error in line 3');
  await says(page, '#look-file', 'a/a.py');
  await clean(page, 'program');
  await page.click('#look-program [data-do="give"]');
  await answer(page, false);
  await page.click('#look-program [data-do="give"]');
  await answer(page, true);
  await waitForSaid('tell', (each) => each.do === 'take');
  assert.deepEqual((await said('tell')).filter((each) => each.do === 'take'), [{ students: null, do: 'take', file: 'a/a.py', text: '<b>print(1)</b>\n' }]);
  await page.click('#look-back');
  await tile(page, 1).locator('.look').click();
  assert.equal(await page.locator('#look-program').isHidden(), true, 'it may be another one by now');
});

test('what a student names as his simulation starts nothing on the teacher\'s page', async (t) => {
  const session = (await cloud.call('address', 'session')).replace(/\/*$/, '');
  const simulator = await cloud.call('address', 'simulator');
  const eve = (address) => student(1, 'Eve', { state: 'running', simulator: address });
  const page = await openClass(t, { students: [eve(`${session}/session?url=${WORLD}`)] });
  await says(page, '#fetch-status', '1 of 1');
  const started = (await cloud.get('started')).length;
  await tile(page, 1).locator('.look').click();
  await shown(page, 'look');
  await tell({ student: eve(`${session}/project/worlds/arena.wbt`) });
  await tell({ student: { ...eve(simulator), name: 'Eve, at last' } });
  await page.waitForSelector('#look-view [data-live]');
  assert.ok(!(await cloud.get('requests')).some((path) => path.startsWith('/session')), 'no seat was asked for');
  assert.equal((await cloud.get('started')).length, started);
});

test('seats are changed; a class is closed, and nothing is kept', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada')] });
  await page.fill('#class-seats', '20');
  await page.keyboard.press('Enter');
  assert.equal(await waitForSaid('seats'), 20);
  await tell({ reserved: 20 });
  await says(page, '#reserved', 'All 20 seats');
  assert.equal(await page.textContent('#staged'), '');
  await tell({ staged: { ready: 12, seats: 20 } });
  await says(page, '#staged', '12 of 20 are ready');
  await tell({ staged: { ready: 20, seats: 20 } });
  await says(page, '#staged', '20 of 20 are ready');
  await tell({ staged: null });
  await page.waitForFunction(() => document.getElementById('staged').textContent === '');
  await cloud.call('set_available', 'busy');
  for (const id of [11, 12, 13])
    await tell({ student: student(id, `Student ${id}`, { state: 'waiting' }) });
  await says(page, '#reserved', 'Students waiting: 3. The machines are busy: a start may have to wait.');
  assert.doesNotMatch(await page.textContent('#reserved'), /All 20 seats/); // true, but not why they wait
  await cloud.call('set_available', 'full');
  await says(page, '#reserved', 'Students waiting: 3. Every seat is taken.');
  for (const id of [11, 12, 13])
    await tell({ student: student(id, `Student ${id}`, { state: 'running' }) });
  await says(page, '#reserved', 'All 20 seats');
  await says(page, '.foot', 'Nothing about students is stored');
  await page.click('#close-class');
  await answer(page, false);
  await page.click('#close-class');
  await answer(page, true);
  await waitForSaid('close');
  assert.equal((await said('close')).length, 1);
  await tell({ closed: 'teacher' });
  await shown(page, 'over');
  await says(page, '#over', 'Nothing about the students was kept');
  await clean(page, 'over');
  assert.deepEqual(await page.evaluate(() => ({ ...sessionStorage })), {});
  assert.equal(await page.locator('.tile').count(), 0);
});

test('a reload returns to the class; a class that is gone is said to be', async (t) => {
  const page = await openClass(t, { students: [student(1, 'Ada')] });
  await says(page, '#fetch-status', '1 of 1');
  await page.reload();
  await shown(page, 'lesson');
  assert.deepEqual((await said('teach')).at(-1), { key: 'key-of-the-teacher' });
  assert.deepEqual(await names(page), ['Ada']);
  assert.equal((await cloud.get('started')).length, 1, 'the project was not fetched again');
  await cloud.call('drop', 'class');
  await until(async () => (await said('teach')).length === 3, 'its return');
  await page.waitForSelector('#trouble', { state: 'hidden' });
  await cloud.set('class_answers', { teach: [{ error: 'code', text: '' }] });
  await cloud.call('shut', 'session');
  await says(page, '#trouble', 'what you see is out of date');
  await cloud.call('open', 'session');
  await shown(page, 'over');
  await says(page, '#over-text', 'restarted');
});
