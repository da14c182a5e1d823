// How students join: a link, a short code, and a QR code of the link. Touches the DOM.

import { copyField, drawQrCode, isOfThisMachine } from './view/qr_code.js';
import { say } from './view/texts.js';
import { element, offerFullscreen, ownServer, setText } from './page.js';

const COMMAND = './server.sh restart --lan';
const CROWD = 20; // names that fit below a QR code in large letters

let drawn = '';
let copied = ''; // the link that was
let here = ''; // the names that are shown
let isFolded = false;
let wasFolded = false; // by itself: that happens once

export function prepareInvitation() {
  offerFullscreen(element('project'), element('invitation'));
  document.addEventListener('fullscreenchange', sayButtons);
  element('fold').addEventListener('click', () => fold(!isFolded));
  element('copy').addEventListener('click', async () => {
    const link = element('link').href;
    if (await copy(link))
      copied = link;
    sayButtons();
  });
}

// The lesson runs: the wall is what counts from now on. Whoever unfolds the invitation keeps it so.
export function foldOnce() {
  if (wasFolded)
    return;
  wasFolded = true;
  fold(true);
}

// Whoever has joined reads so on the projector.
export function showLobby(students) {
  element('invitation').classList.toggle('attended', students.length > 0);
  element('invitation').classList.toggle('crowded', students.length > CROWD);
  setText('here-count', say('class.here', { count: students.length }));
  const names = students.map(({ name }) => name);
  if (names.join('\n') === here)
    return;
  here = names.join('\n');
  element('here').replaceChildren(...names.map((name) => Object.assign(document.createElement('li'), { textContent: name })));
}

function fold(folded) {
  isFolded = folded;
  element('lesson').classList.toggle('folded', folded);
  element('fold').setAttribute('aria-expanded', String(!folded));
  sayButtons();
}

function sayButtons() {
  const isProjected = document.fullscreenElement === element('invitation');
  setText('project', isProjected ? say('class.backToLesson') : say('class.project'));
  element('project').classList.toggle('primary', isProjected);
  setText('fold', isFolded ? say('class.showInvitation') : say('class.foldInvitation'));
  setText('copy', copied !== '' && copied === element('link').href ? say('class.copied') : say('class.copy'));
}

// In a field that nobody sees, since a link can't be selected.
async function copy(text) {
  const field = Object.assign(document.createElement('input'), { value: text, className: 'unseen', readOnly: true });
  element('invitation').append(field);
  const isCopied = await copyField(field);
  field.remove();
  element('copy').focus();
  return isCopied;
}

// Shows how to come into the class with this code, in the language of the page. `network` is what the class has told of this machine's
// addresses, where the page is open under a name that leads nowhere else.
export function invite(code, network) {
  const folder = folderFor(network);
  const link = new URL(encodeURIComponent(code), folder).href;
  element('link').href = link;
  setText('link', link.replace(/^https?:\/\//, ''));
  setText('class-code', code);
  setText('short-link', folder.replace(/^https?:\/\//, ''));
  setText('short-code', code);
  element('link-local').hidden = !isOfThisMachine(new URL(link).hostname);
  const address = network === undefined ? '' : at(lastOf(network));
  sayCommand(element('link-local'), address === '' ? say('class.linkLocal', { command: COMMAND }) : say('class.linkLocalAt', { command: COMMAND, address }));
  setText('code-is', say('class.codeIs', { address: folder.replace(/^https?:\/\//, '') }));
  sayButtons();
  if (drawn !== link)
    showQrCode(drawn = link);
}

// The command is not broken into lines, and copied as it is.
function sayCommand(place, text) {
  const [before, after = ''] = text.split(COMMAND);
  place.replaceChildren(before, Object.assign(document.createElement('code'), { textContent: COMMAND }), after);
}

// Where students find the page: here, unless this is open as localhost on a site that answers in its network, too.
function folderFor(network) {
  return network?.open === true && isOfThisMachine(location.hostname) ? at(lastOf(network)) : new URL('./', location.href).href;
}

// The one that ./server.sh names.
const lastOf = ({ addresses }) => addresses[addresses.length - 1];

function at(address) {
  const folder = new URL('./', location.href);
  folder.hostname = address;
  return folder.href;
}

async function showQrCode(link) {
  const picture = await drawQrCode(link, new URL('class/qr.js', ownServer).href);
  if (picture !== null && link === drawn)
    element('qr').replaceChildren(picture);
}
