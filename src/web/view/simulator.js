// The connection to one simulator, in its "mjpeg" mode: text messages both ways, the picture by HTTP. No DOM.

import { socketToWeb } from './address.js';
import { say } from './texts.js';
import { Watch } from './watch.js';

export class Simulator extends EventTarget {
  #url;
  #socket;
  #size;
  #watch = new Watch(() => this.#fallSilent());
  #loaded = false;
  #mode = 'paused';
  #hidden = false;
  #silent = false;

  // Of somebody who only watches: nothing follows the first message, which says so in the modes that know it (`;broadcast`).
  silent = false;

  // Connects at once. `url` has no trailing slash; `size` is {width, height} of the wanted picture in pixels.
  // Events: message {from: 'simulator', text} (each as it came), picture {url, viewOnly}, ready,
  // mode ('paused' | 'running' | 'fast'), time (ms), progress {text, percent}, world (file name),
  // output {stream, line}, silent (nothing arrives, though it runs), heard (something does again, also
  // after probe()), closed {code}. All arrive as CustomEvents.
  constructor(url, size) {
    super();
    this.#url = url;
    this.#size = size;
    this.#socket = new WebSocket(`${url}/`);
    this.#socket.onopen = () => this.#socket.send(`mjpeg: ${text(this.#size)}`);
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

  resize(size) {
    this.#size = size;
    this.send(`resize: ${text(size)}`);
  }

  get loaded() { return this.#loaded; }

  // Whether the page is hidden, and wants no pictures: then nothing need arrive.
  set hidden(hidden) {
    this.#hidden = hidden;
    this.#watchOver();
  }

  // The event `heard` follows if the simulator is still there.
  probe() {
    this.#silent = true;
    this.resize(this.#size);
  }

  close() {
    this.#watch.stop();
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
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

  #hear() {
    this.#watch.heard();
    if (!this.#silent)
      return;
    this.#silent = false;
    this.#watchOver();
    this.#tell('heard');
  }

  #receive(message) {
    this.#tell('message', { from: 'simulator', text: message });
    this.#hear();
    const [, prefix, rest] = /^([a-z -]+?)(?:: ?|$)([^]*)/i.exec(message) ?? [null, '', ''];
    switch (prefix) {
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
      case 'stdout': case 'stderr': return this.#print(message);
    }
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
  }

  // A world may take minutes to load.
  #unload() {
    this.#loaded = false;
    this.#watchOver();
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

const text = ({ width, height }) => `${width}x${height}`;
