// class View: one simulation in an element of a page, from its address to its end. Carries commands of the toolbar and of the page to the
// session (session.js), and what the session tells to what shows it: the frame with its toolbar, the picture or scene, windows, programs.
// Its interface is described in webots_view.js. Touches the DOM.

import { parseViewAddress, sessionServerOf, socketToWeb, webToSocket } from './address.js';
import { Availability, siteText } from './availability.js';
import { Labels } from './labels.js';
import { Picture } from './picture.js';
import { worldName } from './poster.js';
import { ProgramPanel } from './program_panel.js';
import { RobotWindows } from './robot_windows.js';
import { saveScreenshot } from './screenshot.js';
import { Session } from './session.js';
import { loadSharedStyle } from './shared_style.js';
import { loadTexts, say } from './texts.js';
import { ViewFrame } from './view_frame.js';
import { fileMessage, initMessage, parseFileMessage, upload } from './website.js';

const DEFAULT_TIMEOUT_S = 60;
const SETTLING_MS = 3000; // a machine that was free a moment ago may have been taken
const ACTIVE = ['paused', 'running', 'fast'];
const DRAWN = ['w3d', 'x3d'];
const ROOM_FOR_LESSON = 360; // pixels of height: the picture keeps a third
const NOT_WANTED = { Scene: null, missing: '' };
const OLD_MODES = { x3dom: 'x3d', video: 'mjpeg' }; // of 2018 and 2019
// What the toolbar has unless the page says otherwise.
export const SHOWN = { showPlay: true, showStep: true, showRun: true, showReset: true, showReload: false, showQuit: true, showRobotWindow: true,
  showTerminal: true, showWorldSelection: true, showIde: true, showProgram: true };

const ownServer = sessionServerOf(new URL('..', import.meta.url));

// Pages set members of `webots` before or after this module is loaded.
export const webots = globalThis.webots ??= {};

let essentials = null; // texts and style, while they are fetched and afterwards

export class View {
  broadcast = false;
  runOnLoad = false;
  offersStart = true;
  thumbnail = '';
  onready = null;
  onclose = null;
  onticket = null;
  onprogress = null;
  onerror = (text) => console.warn(text);
  onstdout = null;
  onstderr = null;
  onstate = null;
  onworldloaded = null;
  onrobotmessage = null;
  oncontroller = null;
  onprogram = null;
  // As Webots' own class does: https://host/folder/page.html leads to https://host/folder/.
  onquit = () => location.assign(location.href.slice(0, location.href.lastIndexOf('/', location.href.length - 2) + 1));

  #container;
  #mobile;
  #frame = null;
  #labels = null;
  #windows = null;
  #display = null;
  #drawn = false; // the browser draws the scene
  #session = null;
  #target = null;
  #attempt = 0; // of open() and close(): what was awaited for an earlier one is out of date
  #timeout = DEFAULT_TIMEOUT_S * 1000;
  #docUrl = '';
  #toolbar = true;
  #state = 'idle';
  #mode = 'paused'; // of the simulator, also while it is not ready
  #time = 0;
  #base = ''; // of the simulator, http:
  #heard = false; // whether anything came from the server or the simulator
  #hasEditor = false; // the simulation has one, in a container beside it
  #model = '';
  #animation = null;
  #loaded = false; // the world; pages have been told
  #ticket = null;
  #openAgain = null; // what was opened, without a ticket
  #availability = null; // of machines, after a start for which there was none
  #settling = 0;
  #returns = false; // to a simulation that runs, or was paused by somebody
  #programs = null; // of a simulation that was started here
  #showsPrograms = false;
  #page = null; // an AbortController: while something is open, the view follows the page's going and coming

  constructor(view3D, mobile = matchMedia('(pointer: coarse)').matches) {
    this.#container = view3D;
    this.#mobile = mobile === true;
    webots.currentView = this;
  }

  get state() { return this.#state; }
  get time() { return this.#time; }
  get simulator() { return this.#session === null ? '' : webToSocket(this.#base); }
  get project() { return this.#target?.project ?? ''; }

  // Never rejects: what goes wrong is shown, and told to onerror.
  async open(url, mode, { request, ticket = null } = {}) {
    this.#leave();
    this.#ticket = ticket;
    this.#openAgain = () => this.open(url, mode, { request });
    const attempt = ++this.#attempt;
    await (essentials ??= Promise.all([loadTexts(), loadSharedStyle()]));
    if (attempt !== this.#attempt)
      return;
    this.#build();
    try {
      const target = parseViewAddress(url, ownServer, document.baseURI);
      if (request !== undefined)
        Object.assign(target, { request, server: sessionServerOf(request) });
      const wanted = OLD_MODES[mode] ?? mode ?? 'mjpeg';
      const drawing = target.kind !== 'scene' && wanted === 'mjpeg' ? NOT_WANTED : await findDrawing();
      if (attempt === this.#attempt) {
        this.#start(target, wanted, drawing);
        this.#followPage(() => this.open(url, mode, { request, ticket: this.#ticket }));
      }
    } catch (error) {
      if (attempt === this.#attempt)
        this.#fail(error.message);
    }
  }

  close() {
    this.#attempt++;
    if (this.#state === 'idle')
      return;
    this.#leave();
    this.#frame?.setMessage(say('view.closed'), { button: this.offersStart ? this.#startAgain(say('viewer.start')) : null });
    this.onclose?.();
  }

  // Takes everything out of the page again.
  remove() {
    this.close();
    this.#frame?.remove();
    this.#frame = null;
  }

  setTimeout(seconds) { this.#timeout = seconds < 0 ? -1 : seconds * 1000; }

  setWebotsDocUrl(url) {
    this.#docUrl = url ?? '';
    this.#frame?.setHelp(this.#docUrl);
  }

  setToolbar(shown) {
    this.#toolbar = shown;
    this.#frame?.setToolbar(shown);
  }

  // Of the scene that is opened next: the file with its movements. `gui`: 'play' or 'pause'.
  setAnimation(url, gui = 'play', loop = true) { this.#animation = { url, play: gui === 'play', loop }; }

  play() { this.send(`real-time:${this.#timeLimit}`); }
  fast() { this.send(`fast:${this.#timeLimit}`); }
  pause() { this.send('pause'); }
  step() { this.send('step'); }
  reset() { this.send('reset'); }
  // Simulators up to R2021b know only the old name.
  reload() { this.send(this.#target?.project === undefined ? 'reload' : 'revert'); }
  extend() { this.#session?.extend(); }
  loadWorld(name) { this.send(`load:${name}`); }

  async snapshot(width, height) { return (await this.#display?.snapshot?.({ width, height })) ?? null; }

  send(text) { this.#session?.simulator?.send(text); }

  sendRobotMessage(robot, message) { this.send(`robot:${robot}:${message}`); }

  // The picture follows the size of its element by itself.
  resize() {}

  getController(name) { this.send(`get controller:${name}`); }
  syncController(name, file) { this.send(`sync controller:${name}/${file}`); }
  setController(controller, file, content) { this.send(fileMessage({ controller, file, content })); }
  resetController(name, file) { this.#session?.sendToServer(JSON.stringify({ 'reset controller': `${name}/${file}` })); }

  async saveController(name, file, content) {
    if (this.project !== '' && webots.User1Id && webots.User1Authentication)
      await upload(`${this.project}/controllers/${name}`, file, content);
    this.setController(name, file, content);
  }

  getControllers() {
    const names = elementsWith(this.#model, 'controller').map((element) => element.getAttribute('controller'));
    return [...new Set(names)].filter((name) => name !== '' && !name.startsWith('<')); // <none>, <generic>, <extern>
  }

  openRobotWindow(robot) { this.#windows?.open(robot); }

  get #timeLimit() { return this.broadcast ? -1 : this.#timeout; }

  #shown(name) { return this[name] ?? webots[name] ?? SHOWN[name]; }

  #build() {
    this.#frame?.remove();
    const options = { broadcast: this.broadcast, mobile: this.#mobile };
    for (const name of Object.keys(SHOWN))
      options[name] = this.#shown(name);
    options.showReload = this.showRevert ?? webots.showRevert ?? options.showReload; // the old name
    this.#frame = new ViewFrame(this.#container, options);
    this.#frame.addEventListener('command', ({ detail }) => this.#obey(detail.name));
    this.#frame.addEventListener('world', ({ detail }) => this.loadWorld(detail.name));
    this.#frame.addEventListener('window', ({ detail }) => this.#toggleWindow(detail.robot));
    this.#frame.setToolbar(this.#toolbar);
    this.#frame.setHelp(this.#docUrl);
    this.#frame.setThumbnail(this.thumbnail);
    this.#labels = new Labels(this.#frame.labels);
    this.#windows = new RobotWindows((...panel) => this.#frame.showPanel(...panel), () => this.#frame.setWindows(this.#windows?.list ?? []));
    this.#setTime(0);
  }

  // A simulation that is started here can be shown in either way; a simulator that runs, and a scene, in one alone.
  #start(target, mode, { Scene, missing }) {
    if (Scene === null && (target.kind === 'scene' || (DRAWN.includes(mode) && target.kind === 'simulator')))
      return this.#fail(missing);
    const drawn = target.kind === 'scene' || (Scene !== null && mode !== 'mjpeg');
    this.#drawn = drawn;
    this.#target = target;
    this.#frame.setName(worldName(target.world ?? target.url));
    this.#setState('starting');
    if (drawn)
      this.#display = new Scene(this.#frame.display, { told: (text) => this.#tellProblem(text) });
    else
      this.#display = new Picture(this.#frame.display, { resized: (size) => this.#session?.resize(size) });
    if (target.kind === 'scene') {
      this.#frame.hideCommands();
      return this.#openScene(target.url);
    }
    const wanted = drawn ? mode : 'mjpeg';
    this.#base = target.kind === 'simulator' ? socketToWeb(target.url) : '';
    this.#listen(this.#session = new Session({ ...target, opening: this.#opening(target, wanted), mode: wanted, paused: true,
      broadcast: this.broadcast === true, edit: this.#shown('showProgram') }, this.#display.size, this.#ticket));
    this.#programs = new ProgramPanel(this.#session, target.world ?? '',
      { offered: (some) => this.#frame.setPrograms(some), run: () => this.#beginAnew(), changed: () => this.onprogram?.() });
    this.#returns = this.#ticket?.token !== undefined;
    this.#session.hidden = document.hidden;
    this.#session.start();
  }

  // What was opened ends with the page, unless the page can return to it. Browsers may keep the page for the button Back: then it is opened again.
  #followPage(openAgain) {
    this.#page = new AbortController();
    const { signal } = this.#page;
    addEventListener('pagehide', () => (this.onticket === null ? this.#session?.stop() : this.#session?.leave()), { signal });
    document.addEventListener('visibilitychange', () => this.#session !== null && (this.#session.hidden = document.hidden), { signal });
    addEventListener('pageshow', ({ persisted }) => persisted && openAgain(), { signal });
  }

  get running() { return this.#programs?.running ?? null; }

  // {file, text} of the editor or the simulation; null: there is nothing to change.
  async program() { return (await this.#programs?.current().catch(() => null)) ?? null; }

  // Opens the editor with a program that comes from elsewhere.
  async takeProgram(file, text) {
    await this.#programs?.take(file, text);
    if (this.#programs !== null && !this.#showsPrograms)
      await this.#togglePrograms();
  }

  async #togglePrograms({ focus = true } = {}) {
    this.#showsPrograms = !this.#showsPrograms;
    if (!this.#showsPrograms)
      return this.#frame.showPrograms(null);
    try {
      await this.#frame.showPrograms(await this.#programs.open(), () => this.#togglePrograms());
      if (focus)
        this.#programs.focus();
    } catch {
      this.#showsPrograms = false;
      this.#frame.setNotice(say('code.notLoaded'));
    }
  }

  // Simulators start the controllers of a world again with it.
  #beginAnew() {
    this.#frame.clearConsole();
    this.reset();
    this.play();
  }

  #opening(target, mode) {
    return target.project === undefined ? undefined : initMessage(target, location.origin, webots, mode);
  }

  async #openScene(url) {
    const attempt = this.#attempt;
    try {
      await this.#display.open(url, this.#animation);
      if (attempt === this.#attempt)
        this.#becomeReady();
    } catch (error) {
      if (attempt === this.#attempt)
        this.#fail(error.message);
    }
  }

  #listen(session) {
    const on = (type, handler) => session.addEventListener(type, ({ detail }) => session === this.#session && handler(detail));
    on('progress', (told) => this.#takeProgress(told));
    on('lost', ({ text }) => this.#lose(text));
    on('problem', ({ text }) => this.#tellProblem(text));
    on('notice', ({ text }) => this.#frame.setNotice(text));
    on('deadline', ({ extendable }) => this.#frame.setExtendable(extendable > 0));
    on('ticket', (given) => {
      this.#ticket = given;
      this.onticket?.(given);
    });
    on('output', ({ stream, line }) => this.#print(stream, line));
    on('time', (time) => {
      this.#setTime(time);
      this.#display.receive?.('time'); // pictures are announced by it
    });
    on('picture', (source) => this.#display.show({ ...source, viewOnly: source.viewOnly || this.broadcast },
      (message) => this.send(message)));
    on('rest', () => this.#drawn || this.#display.hide());
    on('scene', (source) => this.#display.show(source, (message) => this.send(message)));
    for (const type of ['model', 'update', 'label', 'node', 'delete'])
      on(type, (detail) => this.#display.receive?.(type, detail));
    on('message', ({ from, text }) => (from === 'server' ? this.#hearServer(text) : this.#hearSimulator(text)));
    on('mode', (mode) => this.#takeMode(mode));
    on('ready', () => this.#becomeReady());
    on('ended', (detail) => this.#end(detail));
  }

  #takeProgress(told) {
    const { text, percent, ahead, returning } = told;
    const waits = ahead !== undefined || returning !== undefined;
    if (waits)
      this.#setState('waiting');
    else if (this.#state === 'waiting')
      this.#setState('starting');
    this.#frame.setMessage(text, waits ? { slow: true, hint: say('waiting.hint') } : { percent });
    this.onprogress?.(told);
  }

  #hearServer(text) {
    this.#heard = true;
    const [, prefix, rest] = /^(webots|reset controller):\s?(.*)$/s.exec(text) ?? [];
    if (text.trim() === 'ide: enable')
      this.#hasEditor = true;
    else if (prefix === 'webots')
      this.#takeAddress(socketToWeb(rest.trim().replace(/\/+$/, '')));
    else if (prefix === 'reset controller')
      this.send(`sync controller:${rest.trim()}`);
  }

  #takeAddress(base) {
    this.#base = base;
    if (this.#hasEditor)
      this.#frame.setEditor(editorAddress(base));
  }

  #hearSimulator(text) {
    this.#heard = true;
    if (!this.#drawn) // scenes have their own
      this.#labels.receive(text);
    if (text.startsWith('world:'))
      this.#takeWorlds(text.slice('world:'.length));
    else if (text.startsWith('robot window:'))
      this.#announceWindow(parseObject(text.slice('robot window:'.length)));
    else if (text.startsWith('world info:'))
      this.#takeWorldInfo(parseObject(text.slice('world info:'.length)));
    else if (text.startsWith('set controller:'))
      this.#takeFile(parseFileMessage(text));
    else if (text.startsWith('model:'))
      this.#takeModel(text.slice('model:'.length));
    else if (text.startsWith('delete world'))
      this.#deleteWorld();
    else if (/^(robot|stdout|stderr):/.test(text))
      text.split('\n').filter((line) => line.startsWith('robot:')).forEach((line) => this.#takeRobotMessage(line.slice('robot:'.length)));
  }

  // A window that the toolbar does not have does not open by itself either.
  // A person who only watches somebody else's simulation opens its windows, if at all, by pressing a button.
  #announceWindow(window) {
    const mayOpen = !this.broadcast && this.#shown('showRobotWindow');
    this.#windows.announce({ ...window, visible: window.visible && mayOpen }, this.#base);
  }

  #deleteWorld() {
    this.#windows.clear();
    this.#loaded = false;
  }

  // "<current>:<world>;<world>"
  #takeWorlds(rest) {
    const [current, list = ''] = rest.split(/:(.*)/s);
    this.#frame.setWorlds(current.trim(), list.split(';').filter((world) => world !== ''));
  }

  #takeWorldInfo({ title, window }) {
    if (typeof window === 'string')
      this.#windows.announceOld(String(title || window), window, (message, robot) => this.sendRobotMessage(robot, message));
  }

  #takeFile(file) {
    if (file !== null)
      this.oncontroller?.(file);
  }

  #takeModel(model) {
    this.#model = model;
    if (!/\bwindow=/.test(model))
      return;
    for (const element of elementsWith(model, 'window'))
      if (element.hasAttribute('name'))
        this.#windows.announceOld(element.getAttribute('name'), element.getAttribute('window'),
          (message, robot) => this.sendRobotMessage(robot, message));
  }

  // {"message":"...","name":"..."}, or of old simulators "<robot>:<text>"
  #takeRobotMessage(rest) {
    const { name, message } = parseObject(rest);
    const [robot, text] = name === undefined ? rest.split(/:(.*)/s) : [name, message];
    this.#windows.receive(robot, text ?? '');
    this.onrobotmessage?.(robot, text ?? '');
  }

  #print(stream, line) {
    this.#frame.print(stream, line);
    (stream === 'stderr' ? this.onstderr : this.onstdout)?.(line);
  }

  #takeMode(mode) {
    if (ACTIVE.includes(this.#state))
      this.#setState(mode);
    this.#mode = mode;
    if (mode !== 'paused' && this.#timeLimit >= 0)
      this.send(`timeout:${this.#timeLimit}`);
  }

  #becomeReady() {
    this.#frame.setMessage('');
    this.#setState(this.#mode);
    if (this.#loaded)
      return; // a connection was restored
    this.#loaded = true;
    if (this.#programs?.hasLesson && !this.#showsPrograms && this.#container.clientHeight >= ROOM_FOR_LESSON)
      this.#togglePrograms({ focus: false });
    this.onready?.();
    this.onworldloaded?.();
    if (this.runOnLoad && !this.broadcast && !this.#returns)
      this.play();
  }

  // Until "ready" or "ended" what is shown is old.
  #lose(text) {
    if (ACTIVE.includes(this.#state))
      this.#setState('lost');
    this.#frame.setMessage(text, { problem: true });
  }

  #setTime(milliseconds) {
    this.#time = milliseconds;
    this.#frame.setTime(milliseconds);
  }

  #setState(state) {
    if (state === this.#state)
      return;
    this.#state = state;
    this.#frame?.setState(state);
    this.onstate?.(state);
  }

  #obey(command) {
    if (command === 'quit')
      this.onquit?.();
    else if (command === 'screenshot')
      this.#screenshot();
    else if (command === 'code')
      this.#togglePrograms();
    else
      this[command]();
  }

  #toggleWindow(robot) {
    if (this.#windows.list.find((window) => window.robot === robot)?.open)
      this.#windows.close(robot);
    else
      this.#windows.open(robot);
  }

  #tellProblem(text, button = null) {
    this.#frame.setMessage(text, { problem: true, button });
    this.onerror?.(text);
  }

  #fail(text) {
    this.#leave('failed');
    this.#tellProblem(text);
  }

  #end({ text, failed, full, busy }) {
    const { server } = this.#target;
    const hint = failed && this.#mayBeRefused ? ` ${say('view.origin', { origin: location.origin })}` : '';
    this.#leave(failed ? 'failed' : 'ended');
    this.#tellProblem(text + hint, this.offersStart && !full ? this.#startAgain(say('viewer.startAgain')) : null);
    if (full && this.offersStart)
      this.#followMachines(server);
    this.onclose?.({ text, failed, full, busy });
  }

  // Says when a machine is free. Until then there is the sentence that says that none is, and why.
  #followMachines(server) {
    this.#availability ??= new Availability((value, state) => {
      clearTimeout(this.#settling);
      if (value === 'available')
        this.#settling = setTimeout(() => this.#offerStart(), SETTLING_MS);
      else if (!['unknown', 'none'].includes(state))
        this.#frame.setMessage(`${siteText(state)} ${say('viewer.willTell')}`, { problem: true });
    });
    this.#availability.follow(webToSocket(server));
  }

  #offerStart() {
    this.#availability.follow(null);
    this.#frame.setMessage(say('view.machineAgain'), { button: this.#startAgain(say('viewer.start')) });
  }

  #startAgain(label) { return { label, pressed: () => this.#openAgain() }; }

  async #screenshot() {
    const problem = await saveScreenshot(this.#display, worldName(this.#target.world ?? this.#target.url));
    if (problem !== '')
      this.#frame.setNotice(problem);
  }

  // Scripts are not told why a WebSocket was refused. A server of another site may not know the page's.
  get #mayBeRefused() {
    const hasSocket = this.#session.owned || this.#target.kind === 'simulator';
    return hasSocket && !this.#heard && new URL(this.#target.request ?? socketToWeb(this.#target.url)).origin !== location.origin;
  }

  #leave(state = 'idle') {
    const session = this.#session;
    this.#session = null;
    session?.stop();
    this.#availability?.follow(null);
    clearTimeout(this.#settling);
    this.#display?.hide();
    this.#display = null;
    this.#windows?.clear();
    this.#labels?.clear();
    this.#programs = null;
    this.#showsPrograms = false;
    this.#frame?.showPrograms(null);
    this.#frame?.setPrograms(false);
    this.#mode = 'paused';
    this.#heard = false;
    this.#hasEditor = false;
    this.#loaded = false;
    this.#model = '';
    this.#page?.abort();
    this.#setState(state);
  }
}

// {Scene, missing}: the class that draws, or null, and the sentence that says why there is none.
async function findDrawing() {
  try {
    const { Scene } = await import('./scene.js');
    const missing = await Scene.missing();
    return { Scene: missing === '' ? Scene : null, missing };
  } catch {
    return { Scene: null, missing: say('scene.notLoaded') };
  }
}

// The editor's port is the simulator's plus 500. The number that stands last may stand in the address more than once: as in the
// pages of today, where it first stands it is replaced.
function editorAddress(base) {
  const number = /\d+(?=\D*$)/.exec(base)?.[0];
  return number === undefined ? '' : `${base.replace(number, String(Number(number) + 500))}/#/home/project/webots-project/`;
}

// Simulators are not ours: whatever is no object counts as one without members.
function parseObject(json) {
  try {
    const value = JSON.parse(json);
    return typeof value === 'object' && value !== null ? value : {};
  } catch {
    return {};
  }
}

function elementsWith(model, attribute) {
  if (model === '')
    return [];
  return [...new DOMParser().parseFromString(model, 'text/xml').querySelectorAll(`[${attribute}]`)];
}
