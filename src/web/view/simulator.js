// The connection to one simulator: text messages both ways; in its mode "mjpeg" the picture by HTTP, in its modes "w3d" and "x3d" the
// scene as messages. No DOM.

import { socketToWeb } from './address.js';
import { say } from './texts.js';
import { Watch } from './watch.js';

const OTHER_SPELLING_MS = 3000;

export class Simulator extends EventTarget {
  #url;
  #socket;
  #size;
  #told = ''; // to the simulator, of the size
  #stream;
  #spelling = 0; // the timer of trying the other one
  #watch = new Watch(() => this.#fallSilent());
  #loaded = false;
  #mode = 'paused';
  #hidden = false;
  #silent = false;
  #probing = false;
  #isLive = false; // something has come of what goes on now

  // Of somebody who only watches: nothing follows the first message, which says so in the modes that know it (`;broadcast`).
  silent = false;

  // Connects at once. `url` has no trailing slash; `size` is {width, height} of the wanted picture in pixels.
  // Events: message {from: 'simulator', text} (each as it came), joined (pictures were asked for), picture {url, viewOnly}, ready,
  // mode ('paused' | 'running' | 'fast'), time (ms), progress {text, percent}, world (file name),
  // output {stream, line}, silent (nothing arrives, though it runs), heard (something does again, also
  // after probe()), closed {code}. With the `stream` 'w3d' or 'x3d' instead of picture: scene {url}, where the files of the
  // scene are, and then what Scene.receive() takes: model {text} (empty: the world is deleted), update {time, updates, labels},
  // label {id, ...}, node {parent, text}, delete {id}. All arrive as CustomEvents.
  constructor(url, size, stream = 'mjpeg') {
    super();
    this.#url = url;
    this.#size = size;
    this.#socket = new WebSocket(`${url}/`);
    this.#stream = stream;
    this.#socket.onopen = () => this.#join();
    this.#socket.onmessage = ({ data }) => typeof data === 'string' && this.#receive(data);
    this.#socket.onclose = ({ code }) => {
      this.#watch.stop();
      this.#tell('closed', { code });
    };
  }

  send(message) {
    if (!this.silent && this.#socket.readyState === WebSocket.OPEN)
      this.#socket.send(message);
  }

  // A negative time means: run until told otherwise.
  play() { this.send('real-time:-1'); }
  fast() { this.send('fast:-1'); }
  pause() { this.send('pause'); }
  step() { this.send('step'); }
  reset() { this.send('reset'); }
  reload() { this.send('reload'); }

  // A size that the simulator knows is not said again: it would draw another picture for it.
  resize(size) {
    this.#size = size;
    if (this.#stream !== 'mjpeg' || sizeText(size) === this.#told)
      return;
    this.send(`resize: ${sizeText(size)}`);
    this.#told = sizeText(size);
  }

  get loaded() { return this.#loaded; }

  // Whether the page is hidden, and wants no pictures: then nothing need arrive.
  set hidden(hidden) {
    this.#hidden = hidden;
    this.#watchOver();
  }

  // What the simulator has said to somebody who has passed it on.
  hear(message) { this.#receive(message); }

  // The event `heard` follows if the simulator is still there.
  probe() {
    this.#probing = true;
    this.#told = '';
    this.resize(this.#size);
  }

  close() {
    clearTimeout(this.#spelling);
    this.#watch.stop();
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
  }

  #join() {
    if (this.#stream === 'mjpeg') {
      this.#told = sizeText(this.#size);
      this.#socket.send(`mjpeg: ${this.#told}`);
      return this.#tell('joined');
    }
    // Without "broadcast" a simulation that runs would pause. Webots up to R2023b says x3d, newer ones w3d; each ignores the
    // other's word.
    this.#socket.send(`${this.#stream};broadcast`);
    const other = this.#stream === 'w3d' ? 'x3d' : 'w3d';
    this.#spelling = setTimeout(() => this.#socket.send(`${other};broadcast`), OTHER_SPELLING_MS);
    this.#tell('scene', { url: `${socketToWeb(this.#url)}/` });
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  // While it runs, it tells the time of each picture; a fast simulation draws none.
  #watchOver() {
    if (this.#loaded && this.#mode === 'running' && !this.#hidden)
      this.#watch.start();
    else
      this.#watch.stop();
  }

  #fallSilent() {
    this.#silent = true;
    this.#tell('silent');
  }

  // Only these messages come with each picture, or change of the scene: others, such as printed lines, say nothing about them.
  #noteLife(message) {
    const isLive = /^(?:time|application\/json):/.test(message);
    this.#isLive ||= isLive;
    if (isLive)
      this.#watch.heard();
    if (this.#probing || (this.#silent && (isLive || this.#mode !== 'running')))
      this.#endSilence();
  }

  #endSilence() {
    this.#silent = this.#probing = false;
    this.#watchOver();
    this.#tell('heard');
  }

  #receive(received) {
    const message = this.#isLive ? received : withoutTimes(received);
    if (message === '')
      return;
    this.#tell('message', { from: 'simulator', text: message });
    this.#noteLife(message);
    clearTimeout(this.#spelling);
    const [, prefix, rest] = /^([a-z/ -]+?)(?:: ?|$)([^]*)/i.exec(message) ?? [null, '', ''];
    switch (prefix) {
      case 'model': return this.#tell('model', { text: rest });
      case 'application/json': return this.#update(rest);
      case 'label': return this.#label(rest);
      case 'node': return this.#addNode(rest);
      case 'delete': return this.#tell('delete', { id: Number(rest) });
      case 'multimedia': return this.#showPicture(rest);
      case 'scene load completed': return this.#finishLoading();
      case 'pause': case 'paused by client': return this.#pausedAt(rest);
      case 'real-time': case 'run': return this.#setMode('running');
      case 'fast': return this.#setMode('fast');
      case 'time': return this.#setTime(rest);
      case 'reset finished': return this.#setTime('0');
      case 'delete world': return this.#unload();
      case 'loading': return this.#load(rest);
      case 'world': return this.#tell('world', rest.split(':')[0]);
      case 'stdout': case 'stderr': case 'robot': return this.#print(message);
    }
  }

  // The changes since the last one; "poses" is what they were called before R2023.
  #update(rest) {
    let state;
    try {
      state = JSON.parse(rest);
    } catch {
      return;
    }
    const list = (value) => (Array.isArray(value) ? value.filter((item) => typeof item === 'object' && item !== null) : []);
    const { time, updates, poses, labels } = state ?? {};
    this.#tell('update', { time, updates: list(updates ?? poses), labels: list(labels) });
    if (typeof time === 'number')
      this.#tell('time', time);
  }

  // As it was up to 2020: "<id>;<font>;<colour>;<size>;<x>;<y>;<text>".
  #label(rest) {
    const [id, font, color, size, x, y, ...words] = rest.split(';');
    this.#tell('label', { id, font, color, size, x, y, text: words.join(';') });
  }

  // "<parent>:<xml>"
  #addNode(rest) {
    const colon = rest.indexOf(':');
    this.#tell('node', { parent: Number(rest.slice(0, colon)), text: rest.slice(colon + 1) });
  }

  // "mjpeg <mode> " makes this page the one that controls the view; "mjpeg <mode> <width> <height>" a spectator.
  #showPicture(rest) {
    const words = rest.trim().split(/\s+/);
    if (words[0] !== 'mjpeg')
      return;
    this.#tell('picture', { url: `${socketToWeb(this.#url)}/mjpeg`, viewOnly: words.length >= 4 });
  }

  #setMode(mode) {
    this.#mode = mode;
    this.#watchOver();
    this.#tell('mode', mode);
    if (this.#silent && mode !== 'running')
      this.#endSilence(); // it was paused meanwhile, and need not say anything
  }

  // A world may take minutes to load.
  #unload() {
    this.#loaded = false;
    this.#told = '';
    this.#watchOver();
    if (this.#stream !== 'mjpeg')
      this.#tell('model', { text: '' });
    this.#tell('progress', { text: say('simulator.loading'), percent: null });
  }

  #finishLoading() {
    this.#loaded = true;
    this.#watchOver();
    this.resize(this.#size);
    this.#tell('ready');
  }

  #pausedAt(time) {
    this.#setMode('paused');
    this.#setTime(time);
  }

  // The simulator prints six significant digits, hence sometimes an exponent.
  #setTime(number) {
    const time = Number(number);
    if (number !== '' && Number.isFinite(time))
      this.#tell('time', time);
  }

  #load(rest) {
    this.#told = ''; // it may know no size before its world is there
    const [, status, percent] = /^(.*?)(?::\s*(\d+(?:\.\d+)?)\s*%?)?$/s.exec(rest);
    this.#tell('progress', { text: status, percent: percent === undefined ? null : Number(percent) });
  }

  // One message may carry several lines, each with a prefix of its own or continuing the one before.
  #print(message) {
    let stream = 'stdout';
    for (const line of message.replace(/\n$/, '').split('\n')) {
      const [, prefix, rest] = /^(?:(stdout|stderr|robot):)?(.*)$/s.exec(line);
      stream = prefix ?? stream;
      if (stream !== 'robot')
        this.#tell('output', { stream, line: rest });
    }
  }
}

// Webots keeps what it says while nobody is connected, as one message, with a line for each picture that was fetched meanwhile.
function withoutTimes(message) {
  const isOfMany = /^(?:time|stdout|stderr|robot):.*\n/.test(message);
  return !isOfMany ? message : message.split('\n').filter((line) => !/^time: [\d.e+-]+$/.test(line)).join('\n');
}

export const sizeText = ({ width, height }) => `${width}x${height}`;
