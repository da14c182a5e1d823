// The programs of a simulation (src/web/view/programs.js): what is asked of the server, what is compiled, and what compilers complain of.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { Programs, complaint } from '../../src/web/view/programs.js';
import { loadTexts } from '../../src/web/view/texts.js';

globalThis.fetch = async (url) => new Response(readFileSync(new URL(url)));
await loadTexts(['en']);

const FILES = ['drive/Makefile', 'drive/drive.c', 'drive/drive.h', 'walk/drive.c', 'walk/walk.cpp', 'look/look.py'];
const GCC = `make: Entering directory '/x/controllers/walk'
In file included from walk.cpp:1:
\x1b[01m\x1b[Kdrive.c:12:5:\x1b[m\x1b[K \x1b[01;31m\x1b[Kerror: \x1b[m\x1b[K'x' undeclared
walk.cpp:20:1: error: expected '}'
make: *** [Makefile:3: walk] Error 1
`;

// `said` are its messages to the server. What `saves` names is answered at once.
function openPrograms({ compiles = ['drive', 'walk'], changed = [] } = {}) {
  const said = [];
  const programs = new Programs((text) => said.push(JSON.parse(text)));
  const tell = (kind, message) => programs.receive(`${kind}: ${JSON.stringify(message)}`);
  const list = () => {
    tell('files', FILES.map((path) => ({ path, changed: changed.includes(path) })));
    if (compiles !== null)
      tell('compiles', compiles);
  };
  const save = async (path) => {
    const saved = programs.save(path, 'text');
    tell('file', { path, saved: true });
    await saved;
  };
  const compile = async (folder, answer) => {
    const compiled = programs.compile(folder);
    tell('compiled', { controller: folder, ...answer });
    return compiled;
  };
  list();
  return { programs, said, tell, list, save, compile };
}

test('a controller is compiled before its first run, and after each change of a source', async () => {
  const { programs, said, save, compile } = openPrograms();
  assert.deepEqual(programs.toCompile('look/look.py'), []);
  assert.deepEqual(programs.toCompile('drive/drive.h'), ['drive']);
  assert.equal(await compile('drive', { output: 'cc drive.c\n' }), 'cc drive.c\n');
  assert.deepEqual(said, [{ compile: 'drive' }]);
  assert.deepEqual(programs.toCompile('drive/drive.c'), []);
  for (const path of ['drive/drive.c', 'drive/drive.h', 'walk/walk.cpp'])
    await save(path);
  assert.deepEqual(programs.toCompile('look/look.py'), ['drive', 'walk']);
  await save('look/look.py');
  assert.deepEqual(programs.toCompile('look/look.py'), ['drive', 'walk']);
});

test('what was changed before the page was loaded again is compiled, and what was put back', async () => {
  const { programs, tell, compile } = openPrograms({ changed: ['drive/drive.c', 'look/look.py'] });
  assert.deepEqual(programs.toCompile('look/look.py'), ['drive']);
  await compile('drive', { output: '' });
  const reset = programs.reset('drive/drive.c');
  programs.receive('reset controller: drive/drive.c');
  tell('file', { path: 'drive/drive.c', original: 'int main;' });
  await new Promise((resolve) => setImmediate(resolve));
  tell('file', { path: 'drive/drive.c', original: 'int main;' });
  await reset;
  assert.deepEqual(programs.toCompile('look/look.py'), ['drive']);
});

test('what does not compile is to be compiled again, and is told with its first complaint, of a file of its own', async () => {
  const { programs, compile } = openPrograms();
  let changes = 0;
  programs.addEventListener('change', () => ++changes);
  const failed = compile('walk', { output: GCC, error: 'Look at the messages!', code: 'not-compiled', values: { controller: 'walk' } });
  await assert.rejects(failed, ({ message, output, wrong }) => {
    assert.equal(message, 'walk does not compile: look at the messages.');
    assert.match(output, /\ndrive\.c:12:5: error: 'x' undeclared\n/);
    assert.deepEqual(wrong, { path: 'walk/drive.c', line: 12 });
    return true;
  });
  assert.deepEqual(programs.wrong, { path: 'walk/drive.c', line: 12 });
  assert.equal(changes, 1);
  assert.deepEqual(programs.toCompile('look/look.py'), ['walk']);
  await compile('walk', { output: '' });
  assert.equal(programs.wrong, null);
});

test('a code that the page does not know is its sentence', async () => {
  const { compile } = openPrograms();
  await assert.rejects(compile('drive', { error: 'the moon is full', code: 'full-moon' }), { message: 'The moon is full', output: '', wrong: null });
});

test('where nothing compiles, nothing is to be compiled', async () => {
  const { programs, save, tell } = openPrograms({ compiles: null });
  await save('drive/drive.c');
  assert.deepEqual(programs.toCompile('drive/drive.c'), []);
  assert.equal(programs.canCompile('drive/drive.c'), false);
  tell('compiles', ['drive']);
  assert.equal(programs.canCompile('drive/drive.c'), true);
  assert.equal(programs.canCompile('walk/walk.cpp'), false);
});

test('answers that nobody waits for change nothing', async () => {
  const { programs, tell, compile } = openPrograms();
  tell('compiled', { controller: 'drive', output: '' });
  tell('compiled', { controller: 'drive', output: GCC, error: 'No.' });
  programs.receive('compiled: {');
  assert.deepEqual(programs.toCompile('drive/drive.c'), ['drive']);
  assert.equal(programs.wrong, null);
  await compile('drive', { output: '' });
  tell('compiled', { controller: 'drive', output: GCC, error: 'No.' });
  assert.deepEqual(programs.toCompile('drive/drive.c'), []);
});

test('after a return the page asks again for what it was not answered', async () => {
  const { programs, said, list, tell } = openPrograms();
  const compiled = programs.compile('drive');
  list();
  assert.deepEqual(said, [{ compile: 'drive' }, { compile: 'drive' }]);
  tell('compiled', { controller: 'drive', output: 'cc' });
  assert.equal(await compiled, 'cc');
  list();
  assert.equal(said.length, 2);
});

test('complaints of compilers, of make and of Python are found', () => {
  const at = (line) => complaint(line, FILES);
  assert.deepEqual(at("drive.h:3:10: fatal error: x.h: No such file or directory"), { path: 'drive/drive.h', line: 3 });
  assert.deepEqual(at("./walk.cpp:7: error: expected ';'"), { path: 'walk/walk.cpp', line: 7 });
  assert.deepEqual(at('/tmp/x/controllers/walk/drive.c:12:5: error: no'), { path: 'walk/drive.c', line: 12 });
  assert.deepEqual(at('Makefile:4: *** missing separator.  Stop.'), { path: 'drive/Makefile', line: 4 });
  assert.deepEqual(at('  File "/tmp/x/controllers/look/look.py", line 3, in <module>'), { path: 'look/look.py', line: 3 });
  for (const line of ["drive.c:12:5: warning: unused variable 'x'", '/usr/include/stdio.h:3:1: error: no', 'make: *** [Makefile:3: walk] Error 1', 'drive.c: In function main:'])
    assert.equal(at(line), null, line);
});
