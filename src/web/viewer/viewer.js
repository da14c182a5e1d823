// Joins the page's controls to the session. The state is kept on <body>:
//   data-availability  available | full | unknown
//   data-site          in more words: free | busy | full | draining | down | none | unknown (availability.js)
//   data-room          there while one may wait when no machine is free
//   data-state         idle | starting | waiting (in line) | paused | running | fast | lost (nothing arrives) | ended (after it ran) | failed (never ran)
//   data-time          simulated time in milliseconds

import { parseAddress, parseViewAddress, sessionServerOf, webToSocket } from './view/address.js';
import { Availability, siteText } from './view/availability.js';
import { Console } from './view/console.js';
import { fetchAgain } from './view/fetch_again.js';
import { forget, recall, remember } from './view/memory.js';
import { loadPageTexts, offerLanguages } from './view/page_texts.js';
import { Picture } from './view/picture.js';
import { Scene } from './view/scene.js';
import { Session } from './view/session.js';
import { say } from './view/texts.js';
import { WakeLock } from './view/wake_lock.js';
import { placeText, returningText, SlowVoice, waitingTitle } from './view/waiting.js';
import { whenBack } from './view/watch.js';

const SETTLING_MS = 3000; // the server updates its availability once a second
const PICTURE_S = 10; // by then the first picture is there
const COMMANDS = ['play', 'pause', 'step', 'fast', 'reset', 'reload'];

await loadPageTexts();

const page = document.body;
const ownServer = sessionServerOf(new URL('..', location.href));
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
let unseen = ''; // what happened while the page was hidden: 'started' or 'free'
let saidStatus = () => say('viewer.idle'); // said again when the language changes
const output = new Console(element('console'));
const wakeLock = new WakeLock();
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

// Where there is a line and what it waits for is a seat or room, one may wait.
function light() {
  const { room, site } = page.dataset;
  const text = siteText(site);
  return room !== undefined && ['busy', 'full', 'none'].includes(site) ? `${text} ${say('site.mayWait')}` : text;
}

// Writes only text that differs: a screen reader would read equal text out again.
function setText(id, text) {
  if (element(id).textContent !== text)
    element(id).textContent = text;
}

// `text` is a text, or a function that says it in the language of the page.
function setStatus(text, problem = false) {
  saidStatus = typeof text === 'function' ? text : () => text;
  setText('status', saidStatus());
  element('status').classList.toggle('problem', problem);
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
  const total = Math.max(0, Math.round(milliseconds));
  const part = (unit, count, digits) => String(Math.floor(total / unit) % count).padStart(digits, '0');
  setText('time', `${Math.floor(total / 3600000)}:${part(60000, 60, 2)}:${part(1000, 60, 2)}.${part(1, 1000, 3)}`);
}

function setState(state) {
  page.dataset.state = state;
  if (ready && !page.classList.contains('watching'))
    window.scrollTo(0, 0); // Small screens show little else then, and begin with what happens.
  page.classList.toggle('watching', ready);
  const active = session !== null;
  setText('start', startText());
  element('start').classList.toggle('leave', active);
  element('connect-to').readOnly = active;
  element('show').disabled = active;
  for (const id of COMMANDS)
    element(id).disabled = !ready;
  for (const [id, pressed] of [['play', 'running'], ['pause', 'paused'], ['fast', 'fast']])
    element(id).setAttribute('aria-pressed', String(state === pressed));
  element('extend').disabled = false;
  wakeLock.wanted = state === 'running' || state === 'fast';
}

function startText() {
  if (place !== null)
    return say('viewer.leaveLine');
  if (session !== null)
    return ready ? say('viewer.disconnect') : say('viewer.cancel');
  return page.dataset.state === 'idle' ? say('viewer.start') : say('viewer.startAgain');
}

// What stands where the picture will be.
function sayWithoutPicture() {
  if (place !== null)
    return setText('no-picture', say('waiting.hint'));
  setText('no-picture', session === null ? say('viewer.noSimulation') : say('viewer.pictureComes'));
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
    sayWithoutPicture();
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
  sayWithoutPicture();
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
  sayWithoutPicture();
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
    field.setAttribute('aria-invalid', 'true');
    field.focus();
    setState('failed');
    return setStatus(error.message, true);
  }
  if (target.kind === 'scene')
    return openScene(target.url);
  target.mode = element('show').value;
  begin(target);
}

// A file, not a simulation: nothing runs and nothing ends.
async function openScene(url) {
  setWarning('');
  setText('no-picture', '');
  setState('idle');
  try {
    await scene.open(url);
    setStatus(() => say('viewer.sceneFile'));
  } catch (error) {
    setState('failed');
    setStatus(error.message, true);
  }
}

// `kept`: a ticket, to return to a simulation or to the place in the line.
function begin(target, kept = null) {
  followAvailability();
  note('');
  scene.hide();
  lastMode = 'paused';
  session = new Session(target, picture.size, kept);
  session.hidden = document.hidden;
  deadline = { ends: Infinity, extendable: 0 };
  interrupted = '';
  listen(session);
  output.clear();
  setTime(0);
  setText('world', '');
  setWarning('');
  sayWithoutPicture();
  setState('starting');
  session.start();
}

// How much time is left, and whether there can be more.
function showDeadline() {
  const left = Math.max(0, Math.round((deadline.ends - Date.now()) / 1000));
  element('deadline').hidden = session === null || !Number.isFinite(left);
  element('extend').hidden = element('deadline').hidden || deadline.extendable === 0;
  const two = (number) => String(number % 60).padStart(2, '0');
  setText('left', `${Math.floor(left / 3600)}:${two(Math.floor(left / 60))}:${two(left)}`);
}

// Called every second. Proxies that keep whole answers keep pictures, whose stream has no end.
function lookForPicture() {
  const isMissing = ready && !session.lost && !document.hidden && session.target.mode === 'mjpeg' && picture.element.dataset.live === undefined;
  withoutPicture = isMissing ? withoutPicture + 1 : 0;
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
  ready = false;
  picture.hide();
  scene.hide();
  setWarning('');
  showDeadline();
  setProgress(undefined);
  sayWithoutPicture();
  setState(state);
  setStatus(text, state !== 'idle');
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
    setStatus(text, true);
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
    for (const id of [...COMMANDS, 'extend'])
      element(id).disabled = !connected; // nobody would hear it
    availability.recheck();
    setStatus(text, true);
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
    if (!ready)
      note('started');
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
  setStatus(sayMode);
}

// Offers the scene, or says why there is none; again when the network is back, which may have been the reason.
async function offerScene() {
  const missing = await Scene.missing();
  setText('no-scene', missing);
  element('no-scene').hidden = missing === '';
  element('show').querySelector('[value="w3d"]').disabled = missing !== '';
  if (missing !== '')
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

// What the server suggests to a visitor: an address to start with, and a notice about itself.
async function loadDefaults() {
  const field = element('connect-to');
  field.value = new URLSearchParams(location.search).get('url') ?? '';
  followAvailability();
  const defaults = await fetchAgain('defaults.json', { cache: 'no-store' })
    .then((response) => (response.ok ? response.json() : {}))
    .catch(() => ({}));
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
element('connect-to').addEventListener('change', followAvailability);
element('clear').addEventListener('click', () => output.clear());
element('dismiss').addEventListener('click', () => setWarning(''));
for (const id of COMMANDS)
  element(id).addEventListener('click', () => session?.simulator?.[id]());
offerLanguages(element('language'), sayAll);
offerFullscreen(element('fullscreen'));
// Links may ask for the scene.
element('show').value = new URLSearchParams(location.search).get('mode') === 'w3d' ? 'w3d' : 'mjpeg';
sayAll();
whenBack(offerScene);
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
const kept = await recall();
await loadDefaults();
if (kept !== null && session === null) {
  element('connect-to').value = kept.address;
  element('show').value = kept.target.mode ?? 'mjpeg';
  begin(kept.target, kept.ticket);
}
