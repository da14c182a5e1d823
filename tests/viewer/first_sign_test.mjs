// When the viewer takes somebody for present (src/web/viewer/first_sign.js). No browser is needed: view_test.sh runs it.

import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';
import { onFirstSign } from '../../src/web/viewer/first_sign.js';

let seen = 0;
let page = null;

beforeEach(() => {
  seen = 0;
  page = new EventTarget();
  globalThis.addEventListener = (...what) => page.addEventListener(...what);
  globalThis.document = Object.assign(new EventTarget(), { hidden: false });
});

const sign = (...types) => types.forEach((type) => page.dispatchEvent(new Event(type)));
const note = () => ++seen > 0;

function show(shown) {
  document.hidden = !shown;
  document.dispatchEvent(new Event('visibilitychange'));
}

test('whatever a person does first is a sign, and nothing after it', () => {
  for (const type of ['pointermove', 'pointerdown', 'keydown', 'wheel', 'scroll', 'focus']) {
    onFirstSign(note);
    sign(type, type, 'pointermove', 'keydown');
    assert.equal(seen, 1, type);
    seen = 0;
  }
});

test('what was too early does not count', () => {
  let isReady = false;
  onFirstSign(() => note() && isReady);
  sign('pointermove', 'pointermove');
  isReady = true;
  sign('pointermove', 'pointermove', 'pointermove');
  assert.equal(seen, 3);
});

test('nobody is at a page that is hidden, and somebody else may be when it is shown again', () => {
  document.hidden = true;
  onFirstSign(note);
  sign('pointermove');
  assert.equal(seen, 0);
  show(true);
  sign('pointermove', 'pointermove');
  assert.equal(seen, 1);
  show(false);
  sign('pointermove');
  show(true);
  sign('keydown', 'keydown');
  assert.equal(seen, 2);
});
