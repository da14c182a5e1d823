// Joins the page's controls to the session. The state is kept on <body>:
//   data-availability  available | full | unknown
//   data-site          in more words: free | busy | full | draining | down | none | unknown (availability.js)
//   data-room          there while one may wait when no machine is free
//   data-state         idle | starting | waiting (in line) | paused | running | fast | lost (nothing arrives) | ended (after it ran) | failed (never ran)
//   data-time          simulated time in milliseconds

import { folderIn, parseAddress, parseViewAddress, sessionServerOf, webToSocket } from './view/address.js';
import { Availability, lightText } from './view/availability.js';
import { Console } from './view/console.js';
import { fetchAgain } from './view/fetch_again.js';
import { forget, recall, remember } from './view/memory.js';
import { loadPageTexts, offerLanguages } from './view/page_texts.js';
import { Picture } from './view/picture.js';
import { ProgramPanel } from './view/program_panel.js';
import { showPoster, worldName } from './view/poster.js';
import { Scene } from './view/scene.js';
import { saveScreenshot } from './view/screenshot.js';
import { Session } from './view/session.js';
import { say } from './view/texts.js';
import { Toolbar } from './view/toolbar.js';
import { WakeLock } from './view/wake_lock.js';
import { placeText, returningText, SlowVoice, waitingTitle } from './view/waiting.js';
import { whenBack } from './view/watch.js';
import { titleOf } from './view/world_lists.js';
import { onFirstSign } from './first_sign.js';
import { Sharing } from './sharing.js';

const SETTLING_MS = 3000; // the server updates its availability once a second
const SOON_S = 1800; // in which a simulation ends, so that people are told all the time
const PICTURE_S = 10; // by then the first picture is there

await loadPageTexts();

const page = document.body;
const ownServer = sessionServerOf(new URL('..', location.href));
const GALLERY = new URL('worlds/', location.href);
const element = (id) => document.getElementById(id);

let session = null;
let ready = false;
let lastMode = 'paused';
let refused = false; // the last start found no free machine
let deadline = { ends: Infinity, extendable: 0 };
let pauseHidden = 0; // seconds
let withoutPicture = 0; // seconds
let resting = 0; // the timer that pauses the simulation of a hidden page
let interrupted = ''; // its mode before that
let place = null; // in the line: what the event "progress" tells of it
let ticket = null; // to return with, and to what
let hasRoom = false; // the session server of this page lets people wait
let listed = new Map(); // the worlds of the gallery, by their addresses
let unseen = ''; // what happened while the page was hidden: 'started' or 'free'
let programs = null; // of the simulation that was started here
let saidStatus = () => say('viewer.idle'); // said again when the language changes
const output = new Console(element('console'));
const wakeLock = new WakeLock();
const toolbar = new Toolbar(element('controls'));
const sharing = new Sharing(linkToShare);
const picture = new Picture(element('screen'), { resized: (size) => session?.resize(size) });
picture.element.id = 'picture';
const scene = new Scene(element('screen'), { told: setWarning });
scene.element.id = 'scene';
const voice = new SlowVoice((text) => setText('place-said', text));
const availability = new Availability((value, state) => {
  page.dataset.availability = value;
  page.dataset.site = state;
  setText('light-text', light());
  if (value === 'available')
    takeBackRefusal();
});

const light = () => lightText(page.dataset.site, page.dataset.room !== undefined);

// Writes only text that differs: a screen reader would read equal text out again.
function setText(id, text) {
  if (element(id).textContent !== text)
    element(id).textContent = text;
}

// `text` is a text, or a function that says it in the language of the page. `quiet`: people see it anyway, so that only screen readers are told.
function setStatus(text, { problem = false, quiet = false } = {}) {
  saidStatus = typeof text === 'function' ? text : () => text;
  setText('status', saidStatus());
  element('status').classList.toggle('problem', problem);
  element('report').classList.toggle('problem', problem);
  element('status').classList.toggle('unseen', quiet);
  element('report').classList.toggle('quiet', quiet && ready);
}

// People look at other tabs meanwhile.
function sayTitle() {
  const title = say('viewer.title');
  switch (unseen) {
    case 'started': document.title = say('waiting.titleStarted', { title }); break;
    case 'free': document.title = say('waiting.titleFree', { title }); break;
    default: document.title = waitingTitle(title, place);
  }
}

function note(what) {
  unseen = document.hidden ? what : '';
  sayTitle();
}

// Hides the error message, which is no longer true.
function takeBackRefusal() {
  if (!refused)
    return;
  refused = false;
  setState('idle');
  note('free');
  setStatus(() => say('viewer.machineAgain'));
}

// A machine may be available again before the indicator has shown that none was: then there will be no change to react to.
function awaitMachine() {
  refused = true;
  setTimeout(() => page.dataset.availability === 'available' && takeBackRefusal(), SETTLING_MS);
}

function setProgress(percent) {
  const bar = element('progress');
  bar.hidden = percent === undefined;
  if (Number.isFinite(percent))
    bar.value = percent;
  else
    bar.removeAttribute('value');
}

function setWarning(text) {
  setText('warning-text', text);
  element('warning').hidden = text === '';
  element('warning').scrollIntoView({ block: 'nearest' });
}

function setTime(milliseconds) {
  page.dataset.time = milliseconds;
  toolbar.setTime(milliseconds);
}

// A simulation has the window from its start on, so that the simulator is asked once for a picture of that size.
function takeWindow() {
  page.classList.add('watching');
  window.scrollTo(0, 0);
  element('address').open = false;
}

function setState(state) {
  if (page.dataset.state !== state) // whoever watches it sees changes alone
    page.dataset.state = state;
  const active = session !== null;
  page.classList.toggle('watching', active && state !== 'waiting'); // a long wait has the page's other parts
  element('report').classList.toggle('card', !ready);
  element('report').classList.toggle('line', ready);
  setText('start', startText());
  element('start').classList.toggle('leave', active);
  element('connect-to').readOnly = active;
  element('show').disabled = active;
  toolbar.setState(state, ready);
  element('screenshot').disabled = !ready;
  element('quit').disabled = !active;
  element('extend').disabled = false;
  wakeLock.wanted = state === 'running' || state === 'fast';
}

function startText() {
  if (place !== null)
    return say('viewer.leaveLine');
  if (session !== null)
    return say('viewer.cancel');
  return page.dataset.state === 'idle' ? say('viewer.start') : say('viewer.startAgain');
}

function sayHint() {
  setText('no-picture', place === null ? '' : say('waiting.hint'));
}

const sayPlace = () => (place.ahead === undefined ? returningText(place.returning) : placeText(place));

// `told`: what the event "progress" says of the place in the line. It may change every second: a screen reader is told slowly.
function showPlace(told) {
  const isNew = place === null;
  place = told;
  element('status').setAttribute('aria-live', 'off');
  setStatus(sayPlace);
  if (isNew) {
    setProgress(undefined);
    setState('waiting');
    sayHint();
  }
  voice.tell(isNew ? `${sayPlace()} ${say('waiting.hint')}` : sayPlace());
  sayTitle();
}

function leaveLine() {
  if (place === null)
    return;
  place = null;
  voice.stop();
  element('status').setAttribute('aria-live', 'polite');
  setState('starting');
  sayHint();
  sayTitle();
}

function sayMode() {
  switch (lastMode) {
    case 'running': return say('viewer.running');
    case 'fast': return say('viewer.runningFast');
    default: return say('viewer.paused');
  }
}

// What scripts and styles say, in the language of the page.
function sayAll() {
  sayTitle();
  setText('light-text', light());
  setText('status', saidStatus());
  setText('start', startText());
  sayHint();
  toolbar.sayAll();
  sharing.sayAll();
  programs?.sayAll();
  sayWorld();
  picture.sayName();
  scene.sayName();
  offerScene();
  element('console').style.setProperty('--empty', JSON.stringify(say('viewer.nothingPrinted')));
  element('console').style.setProperty('--error', JSON.stringify(say('viewer.errorLine')));
}

// The indicator shows the session server of the address, or else the one that serves this page.
function followAvailability() {
  let server = ownServer;
  try {
    server = parseAddress(element('connect-to').value, ownServer).server ?? ownServer;
  } catch { /* The address is not complete yet; Start tells what is wrong with it. */ }
  page.toggleAttribute('data-room', hasRoom && server === ownServer);
  setText('light-text', light());
  availability.follow(webToSocket(server));
}

function start() {
  refused = false;
  const field = element('connect-to');
  let target;
  try {
    target = /^https?:/i.test(field.value.trim()) ? parseViewAddress(field.value, ownServer, location) : parseAddress(field.value, ownServer);
    field.removeAttribute('aria-invalid');
  } catch (error) {
    const folder = folderIn(field.value);
    if (folder !== '')
      return location.assign(new URL(`?${new URLSearchParams({ of: folder })}`, GALLERY));
    field.setAttribute('aria-invalid', 'true');
    element('address').open = true;
    field.focus();
    setState('failed');
    return setStatus(error.message, { problem: true });
  }
  if (target.kind === 'scene')
    return openScene(target.url);
  target.mode = element('show').value;
  target.machine = ownMachine(target);
  begin(target);
}

// The session server of this page takes starts itself where one may wait in line; else it has to be asked where they are taken.
function ownMachine({ server }) {
  return hasRoom && server === ownServer ? webToSocket(server).replace(/\/+$/, '') : undefined;
}

// Somebody may press the button soon.
function prepare() {
  if (session !== null)
    return;
  try {
    Session.prepare({ machine: ownMachine(parseAddress(element('connect-to').value, ownServer)) });
  } catch { /* Start tells what is wrong with the address. */ }
}

// Whether the connection for a start, which is closed again where none follows, makes sense: the button is in view, and what it starts is known.
function prepareEarly() {
  const { top, bottom } = element('start').getBoundingClientRect();
  const isInView = session === null && bottom > 0 && top < innerHeight;
  if (isInView)
    prepare();
  return isInView;
}

// A file, not a simulation: nothing runs and nothing ends.
async function openScene(url) {
  setWarning('');
  setState('idle');
  try {
    await scene.open(url);
    element('poster').hidden = true;
    setStatus(() => say('viewer.sceneFile'));
  } catch (error) {
    setState('failed');
    setStatus(error.message, { problem: true });
  }
}

// `kept`: a ticket, to return to a simulation or to the place in the line.
function begin(target, kept = null) {
  followAvailability();
  note('');
  scene.hide();
  lastMode = 'paused';
  element('poster').hidden = false;
  takeWindow();
  session = new Session({ ...target, edit: true }, picture.size, kept);
  closeEditor();
  programs = new ProgramPanel(session, target.world ?? '', { offered: (some) => { element('show-code').hidden = !some; }, run: beginAnew });
  session.hidden = document.hidden;
  deadline = { ends: Infinity, extendable: 0 };
  interrupted = '';
  listen(session);
  output.clear();
  setTime(0);
  setText('world', '');
  setWarning('');
  sayHint();
  setState('starting');
  session.start();
}

// How much time is left, once that matters, and whether there can be more.
function showDeadline() {
  const left = Math.max(0, Math.round((deadline.ends - Date.now()) / 1000));
  element('deadline').hidden = session === null || left > SOON_S;
  element('extend').hidden = element('deadline').hidden || deadline.extendable === 0;
  const two = (number) => String(number % 60).padStart(2, '0');
  setText('left', `${Math.floor(left / 3600)}:${two(Math.floor(left / 60))}:${two(left)}`);
}

// Called every second. Proxies that keep whole answers keep pictures, whose stream has no end.
function lookForPicture() {
  const isMissing = ready && !session.lost && !document.hidden && session.target.mode === 'mjpeg' && picture.element.dataset.live === undefined;
  withoutPicture = isMissing ? withoutPicture + 1 : 0;
  if (withoutPicture === PICTURE_S)
    offerScene();
  element('no-picture-comes').hidden = withoutPicture < PICTURE_S;
  element('start-in-3d').hidden = session?.owned !== true || element('show').querySelector('[value="w3d"]').disabled;
}

// Simulators draw either pictures or scenes: another one is started.
function startInScene() {
  disconnect();
  element('show').value = 'w3d';
  start();
}

// With `pauseHidden` in the server's configuration, a simulation of this page does not run for long while nobody sees it.
function setHidden() {
  if (!document.hidden)
    note('');
  clearTimeout(resting);
  const mode = page.dataset.state;
  if (session !== null)
    session.hidden = document.hidden;
  if (document.hidden && pauseHidden > 0 && session?.owned && ['running', 'fast'].includes(mode)) {
    resting = setTimeout(() => {
      interrupted = mode;
      session?.simulator?.pause();
    }, pauseHidden * 1000);
  }
  if (document.hidden || interrupted === '')
    return;
  session?.simulator?.[interrupted === 'fast' ? 'fast' : 'play']();
  interrupted = '';
}

function leave(state, text) {
  leaveLine();
  forget();
  ticket = null;
  session = null;
  programs = null;
  ready = false;
  closeEditor();
  picture.hide();
  scene.hide();
  setWarning('');
  showDeadline();
  setProgress(undefined);
  sayHint();
  setState(state);
  setStatus(text, { problem: state !== 'idle' });
}

function disconnect() {
  const said = whatWasLeft();
  session.stop();
  leave('idle', said);
}

function whatWasLeft() {
  if (place !== null)
    return () => say('viewer.gaveUp');
  return session.owned ? () => say('viewer.stopped') : () => say('viewer.left');
}

function listen(to) {
  const on = (type, handler) => to.addEventListener(type, ({ detail }) => handler(detail));
  on('progress', ({ text, percent, ...told }) => {
    if (told.ahead !== undefined || told.returning !== undefined)
      return showPlace(told);
    leaveLine();
    setStatus(percent === null || text.includes('%') ? text : `${text} (${Math.round(percent)} %)`);
    setProgress(percent);
  });
  on('problem', ({ text }) => {
    leaveLine();
    setStatus(text, { problem: true });
  });
  on('ticket', (given) => {
    ticket = given === null ? null : { target: to.target, address: element('connect-to').value, ticket: given };
    if (ticket === null)
      forget();
    else
      remember(ticket);
  });
  on('lost', ({ text, connected }) => {
    if (!ready)
      return;
    setState('lost');
    toolbar.setState('lost', connected); // nobody would hear it
    element('extend').disabled = !connected;
    availability.recheck();
    setStatus(text, { problem: true });
  });
  on('notice', ({ text }) => setWarning(text));
  on('deadline', (told) => {
    deadline = told;
    showDeadline();
  });
  on('rest', () => picture.hide());
  on('output', ({ stream, line }) => output.print(stream, line));
  on('time', (milliseconds) => {
    setTime(milliseconds);
    picture.receive('time');
  });
  on('world', (name) => setText('world', name.split('/').pop()));
  on('picture', (source) => picture.show(source, (message) => to.simulator.send(message)));
  on('scene', (source) => scene.show(source));
  for (const type of ['model', 'update', 'label', 'node', 'delete'])
    on(type, (detail) => scene.receive(type, detail));
  on('mode', (mode) => {
    lastMode = mode;
    showMode();
  });
  on('ready', () => {
    if (!ready) {
      note('started');
      window.scrollTo(0, 0);
      if (programs?.hasLesson && element('programs').hidden)
        toggleEditor({ focus: false });
    }
    ready = true;
    setProgress(undefined);
    showMode();
  });
  on('ended', ({ text, failed, full }) => {
    const awaited = full && page.dataset.availability !== 'unknown';
    leave(failed ? 'failed' : 'ended', awaited ? () => `${text} ${say('viewer.willTell')}` : text);
    if (full)
      awaitMachine();
  });
}

function showMode() {
  if (!ready || session.lost)
    return;
  setState(lastMode);
  setStatus(sayMode, { quiet: true });
}

// The world of the address, by its name and picture.
function sayWorld() {
  const address = element('connect-to').value.trim();
  const { picture, ...world } = listed.get(address) ?? {};
  setText('world-name', titleOf(world) ?? worldName(address));
  const url = picture === undefined ? '' : new URL(picture, GALLERY).href;
  const shown = `${address} ${url}`;
  if (element('poster').dataset.shown === shown)
    return;
  element('poster').dataset.shown = shown;
  showPoster(element('poster'), url);
}

// What others open to start the same world.
function linkToShare() {
  const link = new URL('./', location.href);
  link.search = `?${element('show').value === 'w3d' ? 'mode=w3d&' : ''}url=${encodeURIComponent(element('connect-to').value.trim())}`;
  return link.href;
}

async function screenshot() {
  const problem = await saveScreenshot(session?.target.mode === 'w3d' ? scene : picture, element('world-name').textContent);
  if (problem !== '')
    setWarning(problem);
}

function toggleConsole() {
  const { hidden } = element('output');
  element('output').hidden = !hidden;
  element('show-console').setAttribute('aria-pressed', String(hidden));
  if (hidden)
    element('output').scrollIntoView({ block: 'nearest' });
}

async function toggleEditor({ focus = true } = {}) {
  const place = element('programs');
  place.hidden = !place.hidden;
  element('show-code').setAttribute('aria-pressed', String(!place.hidden));
  if (place.hidden)
    return;
  try {
    place.replaceChildren(await programs.open());
  } catch {
    return setWarning(say('code.notLoaded'));
  }
  if (element('output').hidden)
    toggleConsole();
  if (focus)
    programs.focus();
  else
    window.scrollTo(0, 0); // on a telephone the console is below: first one sees the robot
}

// Simulators start the controllers of a world again with it.
function beginAnew() {
  output.clear();
  session?.simulator?.reset();
  session?.simulator?.play();
}

function closeEditor() {
  element('programs').replaceChildren();
  element('programs').hidden = true;
  element('show-code').hidden = true;
  element('show-code').setAttribute('aria-pressed', 'false');
}

function buildToolbar() {
  toolbar.addCommands((name) => session?.simulator?.[name](), (name) => ({ id: name }));
  const world = Object.assign(document.createElement('span'), { id: 'world' });
  toolbar.addTime(world, element('deadline')).id = 'time';
  toolbar.add('code', () => toggleEditor(), { id: 'show-code', shown: false }).setAttribute('aria-pressed', 'false');
  toolbar.add('console', toggleConsole, { id: 'show-console' }).setAttribute('aria-pressed', 'false');
  toolbar.add('share', () => sharing.open(), { id: 'share' });
  toolbar.add('screenshot', screenshot, { id: 'screenshot' });
  offerFullscreen(toolbar.add('fullscreen', () => {}, { id: 'fullscreen' }));
  toolbar.add('help', () => element('camera').showModal(), { id: 'show-help' });
  toolbar.add('quit', ({ detail: clicks }) => session !== null && clicks <= 1 && disconnect(), { id: 'quit' });
}

// Offers the scene, or says why there is none; again when the network is back, which may have been the reason. The server is asked for
// its library only once somebody can choose.
async function offerScene() {
  if (!element('address').open && element('show').value !== 'w3d' && withoutPicture < PICTURE_S)
    return;
  const missing = await Scene.missing();
  setText('no-scene', missing);
  element('no-scene').hidden = missing === '';
  element('show').querySelector('[value="w3d"]').disabled = missing !== '';
  if (missing === '')
    return;
  element('address').open ||= element('show').value === 'w3d'; // where it says why
  element('show').value = 'mjpeg';
}

// Telephones by Apple show nothing but films in full screen: then there is no button.
function offerFullscreen(button) {
  button.hidden = !document.fullscreenEnabled;
  button.addEventListener('click', () => {
    if (document.fullscreenElement === null)
      document.documentElement.requestFullscreen().catch(() => {}); // The browser asked, and people said no.
    else
      document.exitFullscreen();
  });
  document.addEventListener('fullscreenchange', () =>
    button.setAttribute('aria-pressed', String(document.fullscreenElement !== null)));
}

// What the server suggests to a visitor: an address to start with, a notice about itself, and the titles and pictures of its worlds.
async function loadSite() {
  const field = element('connect-to');
  field.value = new URLSearchParams(location.search).get('url') ?? '';
  followAvailability();
  const { worlds = [], site: defaults = {} } = await fetchAgain(new URL('list.json', GALLERY), { cache: 'no-cache' })
    .then((response) => (response.ok ? response.json() : {}))
    .catch(() => ({}));
  listed = new Map(worlds.map((world) => [world.url, world]));
  if (field.value === '' && typeof defaults.url === 'string')
    field.value = defaults.url;
  hasRoom = defaults.waiting === true;
  if (Number.isFinite(defaults.pauseHidden))
    pauseHidden = defaults.pauseHidden;
  if (typeof defaults.notice === 'string' && defaults.notice !== '') {
    setText('notice', defaults.notice);
    element('notice').hidden = false;
  }
  followAvailability();
  element('address').open = field.value === '' && session === null;
  sayWorld();
}

// A link of the gallery starts its world at once; loading the page again then does not.
function takeStart() {
  const here = new URL(location);
  const isAsked = here.searchParams.has('start');
  here.searchParams.delete('start');
  if (isAsked)
    history.replaceState(history.state, '', here);
  return isAsked;
}

// Enter in the address field. The button is not of type "submit", which Enter would press, so that only a click ends a simulation.
element('connection').addEventListener('submit', (event) => {
  event.preventDefault();
  if (session === null)
    start();
});
element('start').addEventListener('click', ({ detail: clicks }) => {
  if (clicks > 1)
    return; // a second click, which would undo the first
  if (session === null)
    start();
  else
    disconnect();
});
for (const type of ['pointerenter', 'pointerdown', 'focus'])
  element('start').addEventListener(type, prepare);
element('connect-to').addEventListener('change', followAvailability);
element('connect-to').addEventListener('input', ({ target: field }) => {
  field.removeAttribute('aria-invalid');
  sayWorld();
});
element('clear').addEventListener('click', () => output.clear());
element('dismiss').addEventListener('click', () => setWarning(''));
offerLanguages(element('language'), sayAll);
buildToolbar();
// Links may ask for the scene.
element('show').value = new URLSearchParams(location.search).get('mode') === 'w3d' ? 'w3d' : 'mjpeg';
sayAll();
whenBack(offerScene);
element('address').addEventListener('toggle', offerScene);
element('extend').addEventListener('click', () => session?.extend());
document.addEventListener('visibilitychange', setHidden);
element('start-in-3d').addEventListener('click', startInScene);
setInterval(() => {
  lookForPicture();
  if (session !== null)
    showDeadline();
}, 1000);
// Somebody who comes back, by a reload or with the button Back, finds the simulation again.
window.addEventListener('pagehide', () => {
  if (ticket !== null)
    remember(ticket); // a place is kept for so long from now on
  session?.leave();
});
window.addEventListener('pageshow', ({ persisted }) => persisted && session !== null && location.reload());
const startsAtOnce = takeStart();
const kept = await recall();
await loadSite();
if (kept !== null && session === null) {
  element('connect-to').value = kept.address;
  element('show').value = kept.target.mode ?? 'mjpeg';
  begin(kept.target, kept.ticket);
} else if (startsAtOnce && session === null) {
  start();
}
onFirstSign(prepareEarly);
