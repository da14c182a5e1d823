// The page of a class as students have it, against fake servers.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { accessibilityFindings, leaveAndGoBack, openPage, until } from './page.mjs';
import { CODE, JOINED, LANDSCAPE, PHONE, WORLD, address, browser, cloud, join, runSimulation, said, says, shown, state, tell, waitForSaid } from './class_page.mjs';

const PICTURES = { interval: 100, width: 160, height: 120, bytes: 4000 };
const clean = async (page, where) => assert.deepEqual(await accessibilityFindings(page), [], where);
const hide = (page, hidden) => page.evaluate((value) => {
  Object.defineProperty(document, 'hidden', { value, configurable: true });
  document.dispatchEvent(new Event('visibilitychange'));
}, hidden);
const controls = async (text) => until(async () => (await cloud.get('controls')).some((control) => control.startsWith(text)), text);

// The page tells the time of a simulation that runs once a second.
async function secondsPass(count) {
  const told = (await said('state')).length;
  await until(async () => (await said('state')).length > told + count, 'the time of the simulation');
}

async function sizeOf(page, base64) {
  return page.evaluate(async (text) => {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const { width, height } = await createImageBitmap(new Blob([bytes], { type: 'image/jpeg' }));
    return { width, height, bytes: bytes.length };
  }, base64);
}

test('two doors; a code as people type it leads to the name', async (t) => {
  const page = await openPage(t, browser, { ...PHONE, colorScheme: 'dark' });
  await page.goto(await address());
  await shown(page, 'doors');
  await clean(page, 'doors');
  await page.fill('#code', ' k7m 2qx');
  await page.keyboard.press('Enter');
  await page.waitForURL(await address(CODE));
  await shown(page, 'name');
  await says(page, '#name-title', CODE);
  await clean(page, 'name');
});

test('a code is checked before a name is asked for', async (t) => {
  await cloud.set('class_answers', { check: [{ error: 'code', text: 'for programs' }] });
  const page = await openPage(t, browser, PHONE);
  await page.goto(await address('222222'));
  await shown(page, 'doors');
  await says(page, '#code-problem', 'no class with this code');
  assert.equal(await page.inputValue('#code'), '222222');
  await clean(page, 'wrong code');
  await cloud.set('class_answers', {});
  await page.fill('#code', CODE);
  await page.keyboard.press('Enter');
  await shown(page, 'name');
  assert.deepEqual(await said('check'), ['222222', CODE]);
  assert.deepEqual(await said('join'), []);
});

test('a server that checks no codes asks for the name at once, and refuses the code then', async (t) => {
  await cloud.set('class_answers', { check: [{ error: 'message', text: '' }], join: [{ error: 'code', text: '' }] });
  const page = await openPage(t, browser);
  await page.goto(await address(CODE));
  await shown(page, 'name');
  await page.fill('#name', 'Ada');
  await page.click('#join');
  await shown(page, 'doors');
  await says(page, '#code-problem', 'no class with this code');
});

test('what the class refuses is said in words, and can be tried again', async (t) => {
  const page = await openPage(t, browser);
  await page.goto(await address(CODE));
  await shown(page, 'name');
  for (const [error, words] of Object.entries({ full: 'full', name: 'another name', tries: 'Too many wrong attempts' })) {
    await cloud.set('class_answers', { join: [{ error, text: 'for programs' }] });
    await page.fill('#name', 'Ada');
    await page.click('#join');
    await says(page, '#name-problem', words);
  }
  await clean(page, 'refused');
  await cloud.set('class_answers', { join: [{ joined: JOINED }] });
  await page.click('#join');
  await state(page, 'running');
  assert.deepEqual((await said('join')).at(-1), { code: CODE, name: 'Ada' });
});

test('the simulation starts with the seat of the class, and the teacher is told what it does', async (t) => {
  const page = await runSimulation(t);
  assert.ok((await cloud.get('requests')).includes(`/session?class=${JOINED.seat}`));
  assert.deepEqual(JSON.parse((await cloud.get('started'))[0]).start.url, WORLD);
  await controls('real-time:');
  const simulator = await cloud.call('address', 'simulator');
  const told = await waitForSaid('state', (each) => each.state === 'running' && each.time > 0);
  assert.equal(told.simulator, simulator);
  await page.locator('#simulation').getByRole('button', { name: 'Pause' }).click();
  await waitForSaid('state', (each) => each.state === 'paused');
  await clean(page, 'paused');
});

test('the teacher pauses, runs, resets, says something and ends it', async (t) => {
  const page = await runSimulation(t, { ...PHONE, colorScheme: 'dark' });
  await tell({ do: 'pause' });
  await state(page, 'paused');
  await tell({ do: 'run' });
  await state(page, 'running');
  await tell({ do: 'reset' });
  await controls('reset');
  await tell({ do: 'message', text: '<b>Look</b> up, please.' });
  await says(page, '#told-text', '<b>Look</b> up, please.');
  await clean(page, 'message');
  await page.click('#told-close');
  await page.waitForSelector('#told', { state: 'hidden' });
  await tell({ do: 'end' });
  await state(page, 'ended');
  await waitForSaid('state', (each) => each.state === 'ended');
  await until(async () => await cloud.get('leases') === 0, 'the end of the lease');
  await clean(page, 'ended');
  await page.click('#again');
  await state(page, 'running');
});

test('whose simulation is over starts again for the teacher, who disturbs nobody else', async (t) => {
  const page = await runSimulation(t);
  const started = async () => (await cloud.get('started')).length;
  await tell({ do: 'start' });
  await tell({ do: 'end' });
  await state(page, 'ended');
  assert.equal(await started(), 1, 'what ran went on');
  await tell({ do: 'start' });
  await state(page, 'running');
  assert.equal(await started(), 2);
  assert.equal(await page.isVisible('#again'), false);
});

test('another world takes the place of the first one, also after a loss of the connection and after a reload', async (t) => {
  const other = WORLD.replace('arena', 'maze');
  const third = WORLD.replace('arena', 'third');
  await cloud.set('keeps', true);
  await cloud.set('launch', ['reconnectToken: abc', `webots:${await cloud.call('address', 'simulator')}`]);
  const page = await runSimulation(t);
  const urls = async () => (await cloud.get('started')).map((text) => JSON.parse(text).start?.url ?? 'returns');
  await tell({ world: { world: other, mode: 'mjpeg' } });
  await until(async () => (await urls()).length === 2, 'the second world');
  await state(page, 'running');
  await until(async () => await cloud.get('leases') === 1, 'the end of the first one');
  await cloud.set('class_answers', { join: [{ joined: { ...JOINED, world: third } }] });
  await cloud.call('drop', 'class');
  await until(async () => (await urls()).length === 3, 'the third world');
  await state(page, 'running');
  await page.reload();
  await until(async () => (await urls()).length === 4, 'the same simulation');
  await cloud.set('class_answers', { join: [{ joined: { ...JOINED, world: WORLD } }] });
  await state(page, 'running');
  await page.reload();
  await until(async () => (await urls()).length === 5, 'the first world again');
  assert.deepEqual(await urls(), [WORLD, other, third, 'returns', WORLD]);
});

test('a student raises a hand, or is done, and sees what the teacher sees', async (t) => {
  const page = await runSimulation(t, PHONE);
  const pressed = () => page.locator('#signs button').evaluateAll((all) => all.map((each) => each.getAttribute('aria-pressed')));
  await page.click('[data-sign="hand"]');
  assert.equal(await waitForSaid('sign'), 'hand');
  assert.deepEqual(await pressed(), ['false', 'false'], 'not before the class has it');
  await tell({ sign: 'hand' });
  await page.waitForSelector('[data-sign="hand"][aria-pressed="true"]');
  await clean(page, 'hand');
  await page.click('[data-sign="done"]');
  await waitForSaid('sign', (sign) => sign === 'done');
  await tell({ sign: 'done' });
  await page.waitForSelector('[data-sign="hand"][aria-pressed="false"]');
  await page.click('[data-sign="done"]');
  await waitForSaid('sign', (sign) => sign === 'none');
  await tell({ sign: 'none' });
  await page.waitForSelector('[data-sign="done"][aria-pressed="false"]');
  await cloud.set('class_answers', { join: [{ joined: { ...JOINED, sign: 'hand' } }] });
  await page.reload();
  await page.waitForSelector('[data-sign="hand"][aria-pressed="true"]');
});

test('how far a start is, is told to the teacher in the words of the page', async (t) => {
  await cloud.set('launch', ['loading: Receiving objects: 40% (4/10)']);
  const page = await join(t);
  await waitForSaid('state', (each) => each.state === 'starting' && each.why === 'Receiving the project: 40% (4/10)');
  await cloud.call('send', 'simulation', `webots:${await cloud.call('address', 'simulator')}`);
  await state(page, 'running');
  assert.equal((await waitForSaid('state', (each) => each.state === 'running')).why, undefined);
});

test('why a simulation does not start is told to the teacher in the words of the page', async (t) => {
  await cloud.set('launch', ['loading: Error: the world is too large.']);
  const page = await join(t);
  await page.getByText('The world is too large.').first().waitFor();
  await cloud.call('close', 'simulation', 1000);
  await state(page, 'ended');
  await waitForSaid('state', (each) => each.state === 'ended' && each.why === 'The world is too large.');
  await cloud.set('launch', null);
  await page.click('#again');
  await state(page, 'running');
  assert.equal((await waitForSaid('state', (each) => each.state === 'running')).why, undefined);
});

test('the teacher reads the program, and gives another one, which is in the editor then', async (t) => {
  await cloud.set('programs', { 'drive/drive.py': 'print(1)\n' });
  const page = await runSimulation(t);
  await tell({ do: 'program' });
  assert.deepEqual(await waitForSaid('program', ({ file }) => file === 'drive/drive.py'), { file: 'drive/drive.py', text: 'print(1)\n' });
  await tell({ do: 'take', file: 'drive/drive.py', text: 'print("start here")\n' });
  const text = page.getByRole('textbox', { name: 'Text of the program' });
  await text.waitFor();
  await until(async () => await text.inputValue() === 'print("start here")\n', 'the program');
  await clean(page, 'program');
  await text.fill('print(2)\n');
  await page.getByRole('button', { name: 'Run' }).click();
  await until(async () => (await cloud.get('saved'))['drive/drive.py'] === 'print(2)\n', 'the program of the student');
  await tell({ do: 'program' });
  await waitForSaid('program', (each) => each.text === 'print(2)\n');
});

test('the teacher is told which program runs, whether it was changed, where it fails, and that it has reached the goal', async (t) => {
  const file = 'drive/drive.py';
  await cloud.set('programs', { [file]: 'print(1)\n' });
  const page = await runSimulation(t);
  const told = (wanted) => waitForSaid('state', ({ program }) => JSON.stringify(program) === JSON.stringify(wanted));
  await told({ file, changed: false });
  await page.getByRole('button', { name: 'Program' }).click();
  const text = page.getByRole('textbox', { name: 'Text of the program' });
  await text.waitFor();
  await until(async () => await text.inputValue() === 'print(1)\n', 'the program');
  await text.fill('print(2)\n');
  await page.getByRole('button', { name: 'Run' }).click();
  await told({ file, changed: true });
  await cloud.call('send', 'simulator', 'stderr:  File "drive.py", line 12, in <module>');
  await told({ file, changed: true, line: 12 });
  await text.fill('print(3)\n');
  await page.getByRole('button', { name: 'Run' }).click();
  await until(async () => JSON.stringify((await said('state')).at(-1).program) === JSON.stringify({ file, changed: true }), 'no mistake');
  await cloud.call('send', 'simulator', 'stdout:You did it: 23.4 s');
  await told({ file, changed: true, goal: 23400 });
  // What the teacher hands out takes the place of the project's.
  await tell({ do: 'take', file, text: 'print("start here")\n' });
  await until(async () => await text.inputValue() === 'print("start here")\n', 'the program');
  await page.getByRole('button', { name: 'Run' }).click();
  await until(async () => (await said('state')).at(-1).program.changed === false, 'as handed out');
});

test('the teacher is told where a program does not compile, which runs only once it does', async (t) => {
  const file = 'drive/drive.c';
  await cloud.set('programs', { [file]: 'int main;\n' });
  await cloud.set('compiles', ['drive']);
  await cloud.set('compiled', { drive: { output: 'drive.c:1:5: error: no\n', error: 'No.', code: 'not-compiled', values: { controller: 'drive' } } });
  const page = await runSimulation(t);
  const isTold = (wanted) => until(async () => JSON.stringify((await said('state')).at(-1).program) === JSON.stringify(wanted), JSON.stringify(wanted));
  await page.getByRole('button', { name: 'Program' }).click();
  const text = page.getByRole('textbox', { name: 'Text of the program' });
  await text.waitFor();
  await until(async () => await text.inputValue() === 'int main;\n', 'the program');
  await text.fill('int mine\n');
  await page.getByRole('button', { name: 'Run' }).click();
  await isTold({ file, changed: true, line: 1 });
  await clean(page, 'compiler');
  await cloud.set('compiled', { drive: { output: '' } });
  await page.getByRole('button', { name: 'Run' }).click();
  await isTold({ file, changed: true });
});

test('pictures are sent while they are wanted, as small as they are wanted', async (t) => {
  const page = await runSimulation(t);
  assert.deepEqual(await said('picture'), []);
  await tell({ pictures: PICTURES });
  await until(async () => (await said('picture')).length > 2, 'pictures');
  const [first] = await said('picture');
  const { width, height, bytes } = await sizeOf(page, first);
  assert.ok(width <= 160 && height <= 120 && (width === 160 || height === 120) && bytes <= 4000, `${width}x${height}, ${bytes} bytes`);
  await tell({ pictures: { ...PICTURES, width: 80, height: 60, bytes: 900 } });
  await until(async () => (await sizeOf(page, (await said('picture')).at(-1))).width <= 80, 'smaller ones');
  assert.ok((await sizeOf(page, (await said('picture')).at(-1))).bytes <= 900);
  await tell({ pictures: null });
  await tell({ do: 'pause' });
  await state(page, 'paused'); // after this the page has been told that none are wanted
  const before = (await said('picture')).length;
  await tell({ do: 'run' });
  await secondsPass(1);
  assert.ok((await said('picture')).length <= before + 1, 'at most one was under way');
});

test('a page that is hidden says so, and sends no pictures', async (t) => {
  const page = await runSimulation(t);
  await tell({ pictures: PICTURES });
  await until(async () => (await said('picture')).length > 0, 'pictures');
  await hide(page, true);
  await waitForSaid('state', (each) => each.state === 'hidden');
  const before = (await said('picture')).length;
  await cloud.call('send', 'simulator', 'time: 70000');
  await waitForSaid('state', (each) => each.time === 70000);
  await cloud.call('send', 'simulator', 'time: 80000');
  await waitForSaid('state', (each) => each.time === 80000); // states come half a second after each other, or later
  assert.ok((await said('picture')).length <= before + 1, 'at most one was under way');
  await hide(page, false);
  await until(async () => (await said('picture')).length > before + 1, 'pictures again');
});

test('where the operator wants that, a simulation rests while its page is hidden, unless the teacher runs it', async (t) => {
  await cloud.set('defaults', { pauseHidden: 0.2 });
  const page = await runSimulation(t);
  const count = async (beginning) => (await cloud.get('controls')).filter((control) => control.startsWith(beginning)).length;
  await hide(page, true);
  await until(async () => await count('pause') === 1, 'its rest');
  await hide(page, false);
  await state(page, 'running');
  await hide(page, true);
  await until(async () => await count('pause') === 2, 'its rest');
  await tell({ do: 'pause' });
  await until(async () => await count('pause') === 3, 'the pause of the teacher');
  const runs = await count('real-time');
  await hide(page, false);
  await state(page, 'paused');
  await tell({ do: 'run' });
  await state(page, 'running');
  assert.equal(await count('real-time'), runs + 1, 'it runs by the teacher alone');
});

test('pictures that no script may read are not sent, and nothing else breaks', async (t) => {
  await cloud.set('picture_headers', '');
  const page = await runSimulation(t);
  await tell({ pictures: PICTURES });
  await secondsPass(2);
  assert.deepEqual(await said('picture'), []);
  await tell({ do: 'pause' });
  await state(page, 'paused');
});

test('when every seat is taken it waits, and starts by itself when one is free', async (t) => {
  await cloud.set('answer', 'Error: no simulation server available');
  await cloud.call('set_available', '0');
  const page = await join(t, PHONE);
  await state(page, 'waiting');
  await says(page, '#waiting', 'starts by itself');
  for (const [site, text] of [['full', 'Every seat is taken.'], ['busy', 'The machines are busy'], ['down', 'No machine is running.']]) {
    await cloud.call('set_available', site);
    await says(page, '#waiting-why', text);
    await waitForSaid('state', (each) => each.state === 'waiting' && each.why === site);
  }
  await cloud.call('set_available', '1'); // for others, perhaps
  await says(page, '#waiting-why', 'No machine is free.');
  await clean(page, 'waiting');
  assert.equal(await page.isVisible('#simulation'), false);
  await cloud.set('reason', 'too-fast');
  await cloud.set('answer', 'Error: too many sessions are asked for from your network.');
  const asked = async () => (await cloud.get('requests')).filter((path) => path.startsWith('/session?')).length;
  const before = await asked();
  await cloud.call('set_available', '1');
  await until(async () => await asked() > before, 'another attempt');
  await cloud.set('reason', null);
  await cloud.set('answer', null);
  await cloud.call('set_available', '1');
  await state(page, 'running');
  assert.equal(await page.isVisible('#waiting'), false);
});

test('where the session server keeps a line, it waits there as a student of the class, and starts by itself', async (t) => {
  await cloud.set('relays', true);
  await cloud.set('place', [3, 60, 240]);
  const page = await join(t, PHONE);
  await state(page, 'waiting');
  await says(page, '#place', 'You are number 4 in line. Every seat is taken. About 1 to 4 minutes.');
  await says(page, '#place-said', 'You are number 4 in line.');
  await waitForSaid('state', (each) => each.state === 'waiting');
  const { start } = JSON.parse((await cloud.get('started'))[0]);
  assert.deepEqual([start.class, start.waiting, start.url], [JOINED.seat, true, WORLD]);
  assert.match(await page.title(), /^No\. 4 in line – /);
  assert.equal(await page.isVisible('#simulation'), false);
  await clean(page, 'in line');
  await waitForSaid('state', (each) => each.why === 'full' && each.ahead === 3);
  await cloud.call('move', 2, '-', '- busy'); // then that would not be true
  await says(page, '#place', 'You are number 3 in line. The machines are busy: a start may have to wait.');
  assert.equal(await page.textContent('#waiting-why'), '');
  await waitForSaid('state', (each) => each.why === 'busy' && each.ahead === 2);
  await cloud.set('place', [3, 60, 240]);
  await page.reload();
  await says(page, '#place', 'You are number 4 in line.');
  assert.equal(JSON.parse((await cloud.get('started'))[1]).start.waitingTicket, 'ticket-1');
  await cloud.call('close', 'line', 1012);
  await says(page, '#place', 'Returning to the line');
  await says(page, '#place', 'You are number 4 in line.');
  assert.equal(await page.getAttribute('body', 'data-state'), 'waiting');
  await hide(page, true);
  await cloud.call('take_turn');
  await waitForSaid('state', (each) => each.state === 'hidden');
  assert.match(await page.title(), /^Started – /);
  await hide(page, false);
  await state(page, 'running');
  assert.equal(await page.isVisible('#waiting'), false);
  assert.equal(await page.title(), 'Webots class');
  const asked = (await cloud.get('requests')).filter((path) => path.startsWith('/session?'));
  assert.deepEqual(asked, [`/session?class=${JOINED.seat}`]);
});

test('after a reload, and after Back, it is the same place and the same simulation, as it was left', async (t) => {
  await cloud.set('keeps', true);
  await cloud.set('launch', ['reconnectToken: abc', `webots:${await cloud.call('address', 'simulator')}`]);
  const page = await runSimulation(t);
  await tell({ do: 'pause' });
  await state(page, 'paused');
  const runs = async () => (await cloud.get('controls')).filter((control) => control.startsWith('real-time')).length;
  assert.equal(await runs(), 1);
  for (const again of [() => page.reload(), () => leaveAndGoBack(page)]) {
    const count = (await cloud.get('started')).length;
    await again();
    await until(async () => (await cloud.get('started')).length > count, 'the simulation');
    await state(page, 'paused');
    assert.deepEqual((await said('join')).at(-1), { token: JOINED.token });
    assert.deepEqual(JSON.parse((await cloud.get('started')).at(-1)), { reconnect: 'abc' });
    assert.equal(await runs(), 1, 'it stays paused');
  }
});

test('when the connection breaks it comes back to its place, and the simulation goes on', async (t) => {
  const page = await runSimulation(t);
  await cloud.call('drop', 'class');
  await waitForSaid('join', (each) => each.token === JOINED.token);
  assert.equal(await page.getAttribute('body', 'data-state'), 'running');
  await page.waitForSelector('#trouble', { state: 'hidden' });
  await cloud.call('shut', 'session');
  await says(page, '#trouble', 'connection to the class is lost');
  await cloud.call('open', 'session');
  await page.waitForSelector('#trouble', { state: 'hidden' });
});

test('the end of the class ends the simulation; the end of the server does not', async (t) => {
  const page = await runSimulation(t, LANDSCAPE);
  await tell({ closed: 'removed' });
  await shown(page, 'over');
  await says(page, '#over-title', 'You are no longer in the class');
  await says(page, '#over-text', 'removed you');
  await clean(page, 'over');
  await until(async () => await cloud.get('leases') === 0, 'the end of the lease');
  await page.click('#over-next');
  await shown(page, 'doors');
  const other = await runSimulation(t);
  await tell({ closed: 'server' });
  await says(other, '#trouble', 'Your simulation goes on');
  assert.equal(await other.getAttribute('body', 'data-state'), 'running');
});

test('who leaves is forgotten', async (t) => {
  const page = await runSimulation(t);
  await page.click('#leave');
  await waitForSaid('leave');
  await shown(page, 'doors');
  await until(async () => await cloud.get('leases') === 0, 'the end of the lease');
  await page.goto(await address(CODE));
  await shown(page, 'name');
});
