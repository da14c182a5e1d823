// What the parts of the class page share. Touches the DOM.

import { sessionServerOf, webToSocket } from './view/address.js';
import { fetchAgain } from './view/fetch_again.js';
import { say } from './view/texts.js';

export const element = (id) => document.getElementById(id);

// The page is /class/ or /class/<code>.
export const ownServer = sessionServerOf(new URL('..', location.href));
export const classSocket = `${webToSocket(ownServer)}class`;

// What the server suggests to pages: `url`, a world; `pauseHidden`, in seconds.
export const defaults = () => fetchAgain('defaults.json', { cache: 'no-store' })
  .then((response) => (response.ok ? response.json() : {}))
  .catch(() => ({}));

// As people type it, with blanks or in small letters.
export const codeOf = (text) => decode(text).replace(/[\s-]+/g, '').toUpperCase();

// Writes only text that differs: a screen reader would read equal text out again.
export function setText(target, text) {
  const place = typeof target === 'string' ? element(target) : target;
  if (place.textContent !== text)
    place.textContent = text;
}

// Shows one part of the page.
export function show(name) {
  const part = { name: 'name-part' }[name] ?? name;
  for (const each of document.querySelectorAll('.part'))
    each.hidden = each.id !== part;
  document.body.dataset.shown = name;
}

// Something that is wrong meanwhile; '' when it is over.
export function setTrouble(text) {
  setText('trouble', text);
  element('trouble').hidden = text === '';
}

export function duration(milliseconds) {
  const total = Math.max(0, Math.floor(milliseconds / 1000));
  const two = (number) => String(number % 60).padStart(2, '0');
  return `${Math.floor(total / 3600)}:${two(Math.floor(total / 60))}:${two(total)}`;
}

// What the server refuses, in the words of people; what it says itself where there are none.
export function explainCode(code, text) {
  switch (code) {
    case 'off': return say('class.errorOff');
    case 'password': return say('class.errorPassword');
    case 'tries': return say('class.errorTries');
    case 'code': return say('class.errorCode');
    case 'full': return say('class.errorFull');
    case 'name': return say('class.errorName');
    case 'limit': return say('class.errorLimit');
    case 'seats': return say('class.errorSeats');
    case 'world': return say('class.errorWorld');
    default: return text || say('class.errorOther');
  }
}

const titleOfEnd = (why) => (why === 'removed' ? say('class.overRemovedTitle') : say('class.over'));

function explainEnd(why) {
  switch (why) {
    case 'teacher': return say('class.overTeacher');
    case 'idle': return say('class.overIdle');
    case 'removed': return say('class.overRemoved');
    default: return say('class.overServer');
  }
}

// A button for what fills the screen. Telephones by Apple show nothing but films there: then there is no button.
export function offerFullscreen(button, target) {
  button.hidden = !document.fullscreenEnabled;
  button.addEventListener('click', () => {
    if (document.fullscreenElement === null)
      target.requestFullscreen().catch(() => {}); // The browser asked, and people said no.
    else
      document.exitFullscreen();
  });
  if (button.hasAttribute('aria-pressed'))
    document.addEventListener('fullscreenchange', () => button.setAttribute('aria-pressed', String(document.fullscreenElement === target)));
}

// Shows what has ended, and why.
export function showEnd(why) {
  setText('over-title', titleOfEnd(why));
  setText('over-text', explainEnd(why));
  show('over');
}

// Asks whether to do something that cannot be taken back. Resolves to true or false.
export async function confirmed(text, yes) {
  element('question-text').textContent = text;
  element('question-yes').textContent = yes;
  return await answerOf(element('question')) === 'yes';
}

// Resolves to what was written, or to ''.
export async function written(title) {
  element('writing-title').textContent = title;
  const field = element('writing-text');
  field.value = '';
  return await answerOf(element('writing')) === 'send' ? field.value.trim() : '';
}

export function answerOf(dialog) {
  dialog.returnValue = '';
  dialog.showModal();
  return new Promise((resolve) => dialog.addEventListener('close', () => resolve(dialog.returnValue), { once: true }));
}

function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
