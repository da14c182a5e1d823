// What people see of a View: the picture, the toolbar, the panels. Knows nothing of servers. Touches the DOM.

import { Console } from './console.js';
import { showPoster } from './poster.js';
import { editorStyle, sharedStyle } from './shared_style.js';
import { say } from './texts.js';
import { icon, toolButton, Toolbar } from './toolbar.js';
import { adopt, STYLE } from './view_style.js';
import { SlowVoice } from './waiting.js';

// The options that show the commands of the toolbar.
const OPTIONS = { play: 'showPlay', pause: 'showPlay', step: 'showStep', fast: 'showRun', reset: 'showReset', reload: 'showReload' };
const ACTIVE = ['paused', 'running', 'fast'];
const SHOWING = [...ACTIVE, 'lost']; // there is something to see

export class ViewFrame extends EventTarget {
  #root;
  #host;
  #parts = {};
  #toolbar;
  #extend;
  #options;
  #output;
  #voice = new SlowVoice((text) => { this.#parts.unseen.textContent = text; });
  #close = { console: null, code: null };
  #editorStyle = null;

  // Events: command {name} (those of the toolbar, screenshot, quit and extend), world {name}, window {robot}.
  // `options`: showPlay and the others that View describes, `mobile` (larger buttons), `broadcast` (buttons have no effect).
  constructor(container, options) {
    super();
    this.#options = options;
    this.#host = document.createElement('div');
    this.#root = this.#host.attachShadow({ mode: 'open' });
    adopt(this.#root, sharedStyle() + STYLE);
    this.#build();
    container.append(this.#host);
    this.#host.toggleAttribute('data-free', growsWith(container, this.#host));
  }

  get display() { return this.#parts.display; }
  get labels() { return this.#parts.labels; }
  get host() { return this.#host; }

  remove() { this.#host.remove(); }

  print(stream, line) { this.#output.print(stream, line); }

  clearConsole() { this.#output.clear(); }

  // The name of what is shown, for its poster.
  setName(name) { this.#parts.name.textContent = name; }

  // One sentence over the poster or the picture; `percent` is a number, null (unknown) or undefined (no progress is shown). `slow`: it changes
  // often, so a screen reader is told slowly. `hint`: a second sentence, that stays. `button`: {label, pressed()}.
  setMessage(text, { problem = false, percent, slow = false, hint = '', button = null } = {}) {
    const { report, said, progress, hint: second, offer } = this.#parts;
    said.setAttribute('aria-live', slow ? 'off' : 'polite');
    if (slow)
      this.#voice.tell(text);
    else
      this.#voice.stop();
    second.hidden = hint === '';
    if (second.textContent !== hint)
      second.textContent = hint;
    offer.replaceChildren(...(button === null ? [] : [startButton(button)]));
    report.hidden = text === '';
    report.classList.toggle('problem', problem);
    if (said.textContent !== text)
      said.textContent = text;
    progress.hidden = percent === undefined;
    if (Number.isFinite(percent))
      progress.value = percent;
    else
      progress.removeAttribute('value');
  }

  // Something to know while the simulation goes on.
  setNotice(text) {
    const { notice, noticeText } = this.#parts;
    notice.hidden = text === '';
    noticeText.textContent = text;
  }

  // Whether the notice has a button for more time.
  setExtendable(extendable) { this.#extend.hidden = !extendable; }

  // For what has no commands.
  hideCommands() { this.#toolbar.hideCommands(); }

  // What the poster shows; '' is a drawn one.
  setThumbnail(url) { showPoster(this.#parts.poster, url); }

  setState(state) {
    const isActive = ACTIVE.includes(state);
    const isShowing = SHOWING.includes(state);
    this.#parts.view.dataset.state = state;
    this.#toolbar.setState(state, isActive && !this.#options.broadcast);
    this.#toolbar.button('screenshot').disabled = !isShowing;
    this.#toolbar.button('quit').disabled = ['idle', 'ended', 'failed'].includes(state);
    this.#parts.worlds.disabled = !isActive || this.#options.broadcast;
    this.#parts.poster.hidden = isShowing;
    this.#parts.report.classList.toggle('card', !isShowing);
    this.#parts.report.classList.toggle('line', isShowing);
  }

  setTime(milliseconds) { this.#toolbar.setTime(milliseconds); }

  setWorlds(current, worlds) {
    const { worlds: select } = this.#parts;
    select.replaceChildren(...worlds.map((world) => new Option(world.split('/').pop(), world, false, world === current)));
    select.hidden = worlds.length < 2 || !this.#options.showWorldSelection;
  }

  // [{robot, open}]
  setWindows(windows) {
    const { windows: group } = this.#parts;
    group.replaceChildren(...(this.#options.showRobotWindow ? windows : []).map(({ robot, open }) => {
      const button = toolButton('window', () => this.#tell('window', { robot }), say('view.robotWindow', { robot }));
      button.setAttribute('aria-pressed', String(open));
      return button;
    }));
  }

  setToolbar(shown) { this.#toolbar.element.hidden = !shown; }

  setHelp(url) { setLink(this.#parts.help, url); }

  setEditor(url) { setLink(this.#parts.editor, this.#options.showIde ? url : ''); }

  // Whether the toolbar has a button for programs, which the event "command" is told of.
  setPrograms(shown) { this.#toolbar.button('code').hidden = !shown || !this.#options.showProgram; }

  // Their editor, below the picture with the console; null: none.
  async showPrograms(element, closed) {
    this.#toolbar.button('code').setAttribute('aria-pressed', String(element !== null));
    this.#close.code?.();
    this.#close.code = null;
    if (element === null)
      return;
    adopt(this.#root, this.#editorStyle ??= await editorStyle());
    this.#close.code = this.showPanel(say('code.title'), element, closed);
    if (this.#close.console === null)
      this.#toggleConsole();
  }

  // Shows `content` below the picture; `closed` is called when its button is pressed. Returns what takes it away.
  showPanel(title, content, closed) {
    const panel = document.createElement('section');
    panel.setAttribute('aria-label', title);
    const name = document.createElement('p'); // no heading: its level would depend on the page
    name.textContent = title;
    const header = document.createElement('header');
    header.append(name, this.#button(say('view.close'), closed));
    panel.append(header, content);
    this.#parts.panels.append(panel);
    return () => panel.remove();
  }

  #build() {
    const make = (tag, name, parent, properties = {}) => {
      const element = Object.assign(document.createElement(tag), properties);
      element.className = name;
      this.#parts[name] = element;
      parent.append(element);
      return element;
    };
    const view = make('section', 'view', this.#root);
    view.setAttribute('aria-label', say('viewer.simulation'));
    view.classList.toggle('mobile', this.#options.mobile);
    const stage = make('div', 'stage', view);
    make('div', 'display', stage);
    make('div', 'labels', stage);
    make('div', 'poster', stage).setAttribute('aria-hidden', 'true');
    showPoster(this.#parts.poster);
    const report = make('div', 'report', stage, { hidden: true });
    report.classList.add('card');
    make('p', 'name', report);
    make('p', 'said', report).setAttribute('role', 'status');
    make('p', 'hint', report, { hidden: true }).setAttribute('role', 'status');
    make('p', 'unseen', report).setAttribute('aria-live', 'polite'); // what a screen reader is told slowly
    make('progress', 'progress', report, { max: 100, hidden: true }).setAttribute('aria-label', say('viewer.progress'));
    make('div', 'offer', report);
    const notice = make('div', 'notice', view, { hidden: true });
    make('p', 'noticeText', notice).setAttribute('role', 'alert');
    this.#extend = Object.assign(this.#button(say('lease.extend'), () => this.#tell('command', { name: 'extend' })), { hidden: true });
    notice.append(this.#extend);
    notice.append(this.#button(say('view.close'), () => this.setNotice('')));
    this.#buildToolbar(view);
    make('div', 'panels', view);
    const list = Object.assign(document.createElement('div'), { className: 'console', tabIndex: 0 });
    list.setAttribute('role', 'log');
    list.setAttribute('aria-live', 'off');
    list.setAttribute('aria-label', say('viewer.console'));
    this.#parts.console = list;
    this.#output = new Console(list);
  }

  #buildToolbar(view) {
    const toolbar = this.#toolbar = new Toolbar();
    const tell = (name) => this.#tell('command', { name });
    toolbar.addCommands(tell, (name) => ({ shown: this.#options[OPTIONS[name]] }));
    const worlds = this.#parts.worlds = Object.assign(document.createElement('select'), { hidden: true });
    worlds.setAttribute('aria-label', say('view.world'));
    worlds.addEventListener('change', () => this.#tell('world', { name: worlds.value }));
    toolbar.addTime(worlds);
    const windows = this.#parts.windows = Object.assign(document.createElement('span'), { className: 'windows' });
    toolbar.element.append(windows);
    toolbar.add('code', () => tell('code'), { shown: false }).setAttribute('aria-pressed', 'false');
    toolbar.add('console', () => this.#toggleConsole(), { shown: this.#options.showTerminal }).setAttribute('aria-pressed', 'false');
    toolbar.add('screenshot', () => tell('screenshot'));
    toolbar.add('fullscreen', () => this.#toggleFullscreen(), { shown: document.fullscreenEnabled });
    this.#parts.editor = this.#link('window', say('view.editor'));
    this.#parts.help = this.#link('help', say('view.help'));
    toolbar.add('quit', () => tell('quit'), { shown: this.#options.showQuit });
    view.append(toolbar.element);
    this.setState('idle');
  }

  #link(name, text) {
    const link = Object.assign(document.createElement('a'), { className: 'tool', target: '_blank', rel: 'noopener', hidden: true });
    link.append(icon(name), text);
    this.#toolbar.element.append(link);
    return link;
  }

  #button(text, pressed) {
    const button = Object.assign(document.createElement('button'), { type: 'button', textContent: text });
    button.addEventListener('click', pressed);
    return button;
  }

  #toggleConsole() {
    if (this.#close.console === null) {
      this.#close.console = this.showPanel(say('viewer.console'), this.#parts.console, () => this.#toggleConsole());
    } else {
      this.#close.console();
      this.#close.console = null;
    }
    this.#toolbar.button('console').setAttribute('aria-pressed', String(this.#close.console !== null));
  }

  #toggleFullscreen() {
    if (document.fullscreenElement === null)
      this.#host.requestFullscreen();
    else
      document.exitFullscreen();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}

function setLink(link, url) {
  link.hidden = url === '';
  if (url !== '')
    link.href = url;
}

// Whether `container` is as high as what is in it.
function growsWith(container, content) {
  const height = container.clientHeight;
  content.style.display = 'none';
  const isLower = container.clientHeight < height;
  content.style.display = '';
  return isLower;
}

function startButton({ label, pressed }) {
  const button = Object.assign(document.createElement('button'), { type: 'button', className: 'start', textContent: label });
  button.addEventListener('click', pressed);
  return button;
}
