// What people see of a View: the picture, the toolbar, the panels. Knows nothing of servers. Touches the DOM.

import { Console } from './console.js';
import { sharedStyle } from './shared_style.js';
import { say } from './texts.js';
import { adopt, STYLE } from './view_style.js';
import { SlowVoice } from './waiting.js';

// The toolbar's buttons: name, the option that shows it, whether it says which state it is.
const COMMANDS = [
  ['play', 'showPlay', 'running'], ['pause', 'showPlay', 'paused'], ['step', 'showStep', null], ['fast', 'showRun', 'fast'],
  ['reset', 'showReset', null], ['reload', 'showReload', null],
];
const ACTIVE = ['paused', 'running', 'fast'];

export class ViewFrame extends EventTarget {
  #root;
  #host;
  #parts = {};
  #buttons = new Map();
  #options;
  #output;
  #voice = new SlowVoice((text) => { this.#parts.unseen.textContent = text; });
  #close = { console: null };

  // Events: command {name} (the buttons of COMMANDS, quit, and extend), world {name}, window {robot}.
  // `options`: showPlay and the others that View describes, `mobile` (larger buttons), `broadcast` (buttons have no effect).
  constructor(container, options) {
    super();
    this.#options = options;
    this.#host = document.createElement('div');
    this.#root = this.#host.attachShadow({ mode: 'open' });
    adopt(this.#root, sharedStyle() + STYLE);
    this.#build();
    container.append(this.#host);
  }

  get display() { return this.#parts.display; }
  get labels() { return this.#parts.labels; }
  get host() { return this.#host; }

  remove() { this.#host.remove(); }

  print(stream, line) { this.#output.print(stream, line); }

  clearConsole() { this.#output.clear(); }

  // One sentence over the picture; `percent` is a number, null (unknown) or undefined (no progress is shown). `slow`: it changes
  // often, so a screen reader is told slowly. `hint`: a second sentence, that stays. `button`: {label, pressed()}.
  setMessage(text, { problem = false, percent, slow = false, hint = '', button = null } = {}) {
    const { message, text: paragraph, bar, hint: second, offer } = this.#parts;
    paragraph.setAttribute('aria-live', slow ? 'off' : 'polite');
    if (slow)
      this.#voice.tell(text);
    else
      this.#voice.stop();
    second.hidden = hint === '';
    if (second.textContent !== hint)
      second.textContent = hint;
    offer.replaceChildren(...(button === null ? [] : [this.#button(button.label, button.pressed)]));
    message.hidden = text === '';
    message.classList.toggle('problem', problem);
    if (paragraph.textContent !== text)
      paragraph.textContent = text;
    bar.hidden = percent === undefined;
    if (Number.isFinite(percent))
      bar.value = percent;
    else
      bar.removeAttribute('value');
  }

  // Something to know while the simulation goes on.
  setNotice(text) {
    const { notice, noticeText } = this.#parts;
    notice.hidden = text === '';
    noticeText.textContent = text;
  }

  // Whether the notice has a button for more time.
  setExtendable(extendable) { this.#buttons.get('extend').hidden = !extendable; }

  // For what has no commands.
  hideCommands() { COMMANDS.forEach(([name]) => { this.#buttons.get(name).hidden = true; }); }

  setThumbnail(url) {
    const { thumbnail } = this.#parts;
    thumbnail.hidden = url === '';
    if (url === '')
      thumbnail.removeAttribute('src');
    else
      thumbnail.src = url;
  }

  setState(state) {
    const active = ACTIVE.includes(state) && !this.#options.broadcast;
    for (const [name, , pressed] of COMMANDS) {
      const button = this.#buttons.get(name);
      button.disabled = !active;
      if (pressed !== null)
        button.setAttribute('aria-pressed', String(state === pressed));
    }
    this.#buttons.get('quit').disabled = state === 'idle';
    this.#parts.worlds.disabled = !active;
    if (ACTIVE.includes(state))
      this.setThumbnail('');
  }

  setTime(milliseconds) {
    const total = Math.max(0, Math.round(milliseconds));
    const part = (unit, count, digits) => String(Math.floor(total / unit) % count).padStart(digits, '0');
    this.#parts.time.textContent = `${Math.floor(total / 3600000)}:${part(60000, 60, 2)}:${part(1000, 60, 2)}.${part(1, 1000, 3)}`;
  }

  setWorlds(current, worlds) {
    const { worlds: select } = this.#parts;
    select.replaceChildren(...worlds.map((world) => new Option(world.split('/').pop(), world, false, world === current)));
    select.hidden = worlds.length < 2 || !this.#options.showWorldSelection;
  }

  // [{robot, open}]
  setWindows(windows) {
    const { windows: group } = this.#parts;
    group.replaceChildren(...(this.#options.showRobotWindow ? windows : []).map(({ robot, open }) => {
      const button = this.#button(say('view.robotWindow', { robot }), () => this.#tell('window', { robot }));
      button.setAttribute('aria-pressed', String(open));
      return button;
    }));
  }

  setToolbar(shown) { this.#parts.toolbar.hidden = !shown; }

  setHelp(url) { setLink(this.#parts.help, url); }

  setEditor(url) { setLink(this.#parts.editor, this.#options.showIde ? url : ''); }

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
    make('img', 'thumbnail', stage, { alt: '', hidden: true });
    make('div', 'display', stage);
    make('div', 'labels', stage);
    const message = make('div', 'message', stage, { hidden: true });
    make('p', 'text', message).setAttribute('role', 'status');
    make('p', 'hint', message, { hidden: true }).setAttribute('role', 'status');
    make('p', 'unseen', message).setAttribute('aria-live', 'polite'); // what a screen reader is told slowly
    make('div', 'offer', message);
    make('progress', 'bar', message, { max: 100, hidden: true }).setAttribute('aria-label', say('viewer.progress'));
    const notice = make('div', 'notice', view, { hidden: true });
    make('p', 'noticeText', notice).setAttribute('role', 'alert');
    this.#addCommand(notice, 'extend', false);
    notice.append(this.#button(say('view.close'), () => this.setNotice('')));
    this.#buildToolbar(make, view);
    make('div', 'panels', view);
    const list = Object.assign(document.createElement('div'), { className: 'console', tabIndex: 0 });
    list.setAttribute('role', 'log');
    list.setAttribute('aria-live', 'off');
    list.setAttribute('aria-label', say('viewer.console'));
    this.#parts.console = list;
    this.#output = new Console(list);
  }

  #buildToolbar(make, view) {
    const toolbar = make('div', 'toolbar', view);
    toolbar.setAttribute('role', 'toolbar');
    toolbar.setAttribute('aria-label', say('viewer.controls'));
    for (const [name, option] of COMMANDS)
      this.#addCommand(toolbar, name, this.#options[option]);
    make('select', 'worlds', toolbar, { hidden: true }).setAttribute('aria-label', say('view.world'));
    this.#parts.worlds.addEventListener('change', () => this.#tell('world', { name: this.#parts.worlds.value }));
    make('span', 'windows', toolbar);
    const terminal = this.#button(say('viewer.console'), () => this.#toggleConsole(terminal));
    terminal.hidden = !this.#options.showTerminal;
    terminal.setAttribute('aria-pressed', 'false');
    toolbar.append(terminal);
    const full = this.#button(say('viewer.fullscreen'), () => this.#toggleFullscreen());
    full.hidden = !document.fullscreenEnabled;
    toolbar.append(full);
    make('a', 'editor', toolbar, { target: '_blank', rel: 'noopener', hidden: true, textContent: say('view.editor') });
    make('a', 'help', toolbar, { target: '_blank', rel: 'noopener', hidden: true, textContent: say('view.help') });
    make('time', 'time', toolbar).setAttribute('aria-label', say('viewer.simulatedTime'));
    this.#addCommand(toolbar, 'quit', this.#options.showQuit);
  }

  #addCommand(toolbar, name, shown) {
    const button = this.#button(label(name), () => this.#tell('command', { name }));
    button.hidden = !shown;
    this.#buttons.set(name, button);
    toolbar.append(button);
  }

  #button(text, pressed) {
    const button = Object.assign(document.createElement('button'), { type: 'button', textContent: text });
    button.addEventListener('click', pressed);
    return button;
  }

  #toggleConsole(button) {
    if (this.#close.console === null) {
      this.#close.console = this.showPanel(say('viewer.console'), this.#parts.console, () => this.#toggleConsole(button));
    } else {
      this.#close.console();
      this.#close.console = null;
    }
    button.setAttribute('aria-pressed', String(this.#close.console !== null));
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

function label(name) {
  switch (name) {
    case 'play': return say('viewer.play');
    case 'pause': return say('viewer.pause');
    case 'step': return say('viewer.step');
    case 'fast': return say('viewer.fast');
    case 'reset': return say('viewer.reset');
    case 'reload': return say('viewer.reload');
    case 'extend': return say('lease.extend');
    default: return say('view.quit');
  }
}
