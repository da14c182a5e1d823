// The public entry: shows a Webots simulation in any page. Touches the DOM.
//
//   <script type="module" src="https://HOST/view/webots_view.js"></script>
//   <webots-view data-server="https://github.com/owner/repository/blob/main/worlds/world.wbt"></webots-view>
//
// class View has the interface that Webots documents for its own class; the module also sets `webots.View`.
//   new View(element, mobile)
//   open(url[, mode])   ws://host:1999/project/worlds/world.wbt   a project of the page's own website
//                       ws://host:1999/session?url=world          a world of a repository (http: and .../session.php too)
//                       https://github.com/...wbt                 the same, at the server that this file comes from
//                       ws://host:2001                            a simulator that runs
//                       file.x3d                                  an exported scene
//                       mode: 'mjpeg' (a picture, unless said otherwise), 'w3d' or 'x3d' (the browser draws, if this build can)
//                       open(url, mode, {request, ticket}): `request` is asked for a machine instead of the url's session server
//                       (a class: https://host:1999/session?class=token); `ticket`, of onticket(), returns to a simulation
//   close()             ends what open() started
//   setTimeout(seconds) how much simulated time runs without the user; negative: any (60 unless said otherwise)
//   setWebotsDocUrl(url)
//   broadcast           true, set before open(): only watches
//   showRevert, showReload, showQuit, showRun, showPlay, showStep, showReset, showTerminal, showRobotWindow,
//   showWorldSelection, showIde, showProgram  whether the toolbar has them; set on the view, or on `webots`, before open()
//   play(), pause(), step(), fast(), reset(), reload(), loadWorld(name), send(text), sendRobotMessage(robot, message),
//   extend()            more time, as far as the operator allows it
//   state               'idle' | 'starting' | 'waiting' (in the line of the session server; it starts by itself) | 'paused' | 'running' | 'fast' | 'lost' (nothing arrives) | 'ended' | 'failed'
//   time                simulated milliseconds
//   project             of ws://host/project/worlds/world.wbt; otherwise ''
//   simulator           the address of the simulator, ws://host:2001, once it is known; otherwise ''
//   offersStart         false: no button of the view starts; otherwise there is one after close(), and where no machine was free, when one is
//   runOnLoad           true: plays as soon as it can
//   program()           resolves to the program in the editor, {file, text}, or to null; takeProgram(file, text) opens the editor with one
//   running             which program the simulation runs, {file, changed, line, goal}, as far as it is known, or null (program_panel.js)
//   snapshot(width, height)  resolves to an OffscreenCanvas with what is shown, at most so large; to null while nothing is; rejects
//                       where the simulator does not let scripts of this page read its picture
//
// Handlers, which pages set: onready(), onclose({text, failed, full, busy}) (as the event "ended" of Session; without an argument
// after close()), onticket(ticket) (the simulation, or the place in the line, outlives the page for a while, and open() can return to it;
// null: to nothing any more), onprogress({text, percent, ahead, least, most, why, wantsRoom, returning}) (as the event of Session), onerror(text),
// onstdout(text), onstderr(text), onquit(), onstate(state), onworldloaded(), onrobotmessage(robot, message),
// oncontroller({controller, file, content}), onprogram() (`running` has changed).
//
// For pages with an editor (Webots up to R2021b, and those that keep its messages):
//   getController(name)                         the simulator's files arrive at oncontroller, the main one first
//   setController(name, file, content)          gives the simulator a file, until the simulation ends
//   syncController(name, file)                  asks the simulator for one of its files
//   resetController(name, file)                 the file as the project has it, also in the simulator
//   saveController(name, file, content)         stores the file at the website if a user is logged in, then setController(); rejects
//                                               with an Error whose message can be shown
//   getControllers()                            the names that the scene's robots have; [] while it is a picture
//
// `webots.User1Id`, `User1Name`, `User1Authentication`, `User2Id`, `User2Name`, `CustomData`: what the website's page knows
// of its user; sent with a project of the website.
//
// <webots-view> has the attributes data-server (or src), data-mode, data-broadcast, data-timeout, data-thumbnail, data-autoplay,
// data-is-mobile-device, data-scene and data-animation, which are read once; and connect(server, mode, broadcast,
// isMobileDevice, timeout, thumbnail), close(), hasView(), loadScene(), loadAnimation(), sendMessage(), showToolbar(),
// hideToolbar(), resize(), setAmbientOcclusion(), setWebotsMessageCallback(), setWebotsErrorMessageCallback(), onready,
// ondisconnect, view.

import { SHOWN, View, webots } from './view.js';
import { adopt, ELEMENT_STYLE } from './view_style.js';

export { View, webots };

const isTrue = (text) => text !== undefined && text !== 'false';

export class WebotsView extends HTMLElement {
  onready = null;
  ondisconnect = null;

  #view = null;
  #toolbar = true;
  #printed = null;
  #complained = null;
  #hasRead = false; // the attributes

  constructor() {
    super();
    const root = this.attachShadow({ mode: 'open' });
    adopt(root, ELEMENT_STYLE);
    root.append(document.createElement('slot'));
  }

  // The View, with all that it has; null before connect().
  get view() { return this.#view; }

  connectedCallback() {
    if (this.#hasRead)
      return;
    this.#hasRead = true;
    const { scene, animation, server, src, mode, timeout, thumbnail } = this.dataset;
    const mobile = this.dataset.isMobileDevice ?? this.dataset.ismobiledevice; // HTML lowers "data-isMobileDevice"
    const broadcast = this.dataset.broadcast ?? this.dataset.isBroadcast ?? this.dataset.isbroadcast;
    const address = server ?? src ?? this.getAttribute('src') ?? '';
    if (scene !== undefined && animation !== undefined)
      this.loadAnimation(scene, animation, this.dataset.autoplay !== 'false', isTrue(mobile), thumbnail);
    else if (scene !== undefined)
      this.loadScene(scene, isTrue(mobile), thumbnail);
    else if (address !== '')
      this.connect(address, mode, isTrue(broadcast), mobile === undefined ? undefined : isTrue(mobile), Number(timeout ?? -1), thumbnail);
  }

  // Unless it has only been moved to another place.
  disconnectedCallback() { queueMicrotask(() => this.isConnected || this.close()); }

  connect(server, mode, broadcast, isMobileDevice, timeout = -1, thumbnail = '') {
    const view = this.#renew(isMobileDevice, thumbnail);
    view.broadcast = broadcast === true || broadcast === 'true';
    view.setTimeout(Number.isFinite(Number(timeout)) ? Number(timeout) : -1);
    view.runOnLoad = isTrue(this.dataset.autoplay);
    view.open(server, mode || undefined);
  }

  loadScene(scene, isMobileDevice, thumbnail = '') { this.#renew(isMobileDevice, thumbnail).open(scene); }

  loadAnimation(scene, animation, play = true, isMobileDevice = undefined, thumbnail = '') {
    const view = this.#renew(isMobileDevice, thumbnail);
    view.setAnimation(animation, play ? 'play' : 'pause');
    view.open(scene);
  }

  close() {
    this.#view?.remove();
    this.#view = null;
  }

  hasView() { return this.#view !== null; }
  resize() { this.#view?.resize(); }
  setAmbientOcclusion() {} // a level of Webots' own drawing, which ours has not
  sendMessage(message) { this.#view?.send(message); }

  showToolbar() { this.#setToolbar(true); }
  hideToolbar() { this.#setToolbar(false); }

  // Lines that the simulation prints, and those that it prints as errors.
  setWebotsMessageCallback(callback) { this.#printed = callback; }
  setWebotsErrorMessageCallback(callback) { this.#complained = callback; }

  #setToolbar(shown) {
    this.#toolbar = shown;
    this.#view?.setToolbar(shown);
  }

  #renew(isMobileDevice, thumbnail) {
    this.close();
    const view = this.#view = new View(this, isMobileDevice);
    for (const name of ['showRevert', ...Object.keys(SHOWN)])
      view[name] = this[name] ?? readFlag(this.dataset[name]);
    view.thumbnail = thumbnail ?? '';
    view.setToolbar(this.#toolbar);
    view.onready = () => this.onready?.();
    view.onclose = () => this.ondisconnect?.();
    view.onquit = () => view.close(); // which leaves its poster, with a button that starts
    view.onstdout = (line) => this.#printed?.(line);
    view.onstderr = (line) => this.#complained?.(line);
    view.onstate = (state) => { this.dataset.state = state; };
    return view;
  }
}

const readFlag = (text) => (text === undefined ? undefined : text !== 'false');

webots.View ??= View;
if (customElements.get('webots-view') === undefined)
  customElements.define('webots-view', WebotsView);

export default WebotsView;
