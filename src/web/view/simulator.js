// The connection to one simulator, in its "mjpeg" mode: text messages both ways, the picture by HTTP. No DOM.

import { socketToWeb } from './address.js';

export class Simulator extends EventTarget {
  #url;
  #socket;
  #size;

  // Of somebody who only watches: nothing follows the first message, which says so in the modes that know it (`;broadcast`).
  silent = false;

  // Connects at once. `url` has no trailing slash; `size` is {width, height} of the wanted picture in pixels.
  // Events: message {from: 'simulator', text} (each as it came), picture {url, viewOnly}, ready,
  // mode ('paused' | 'running' | 'fast'), time (ms), progress {text, percent}, world (file name),
  // output {stream, line}, closed {code}. All arrive as CustomEvents.
  constructor(url, size) {
    super();
    this.#url = url;
    this.#size = size;
    this.#socket = new WebSocket(`${url}/`);
    this.#socket.onopen = () => this.#socket.send(`mjpeg: ${text(this.#size)}`);
    this.#socket.onmessage = ({ data }) => typeof data === 'string' && this.#receive(data);
    this.#socket.onclose = ({ code }) => this.#tell('closed', { code });
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

  close() {
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #receive(message) {
    this.#tell('message', { from: 'simulator', text: message });
    const [, prefix, rest] = /^([a-z -]+?)(?:: ?|$)([^]*)/i.exec(message) ?? [null, '', ''];
    switch (prefix) {
      case 'multimedia': return this.#showPicture(rest);
      case 'scene load completed': return this.#finishLoading();
      case 'pause': case 'paused by client': return this.#pausedAt(rest);
      case 'real-time': case 'run': return this.#tell('mode', 'running');
      case 'fast': return this.#tell('mode', 'fast');
      case 'time': return this.#setTime(rest);
      case 'reset finished': return this.#setTime('0');
      case 'delete world': return this.#tell('progress', { text: 'Loading the world', percent: null });
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

  #finishLoading() {
    this.resize(this.#size);
    this.#tell('ready');
  }

  #pausedAt(time) {
    this.#tell('mode', 'paused');
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
