// Reads the stream of pictures, which tells when each one arrives, and hands the last one out. No DOM.
//
// Behind a gateway the pictures of all simulations have one origin, to which a browser opens six connections by HTTP, but many WebSockets:
// there they come by a WebSocket. Elsewhere they are read by fetch(): those of simulators that send no Access-Control-Allow-Origin (as
// Webots for /mjpeg) by pages of their own origin alone; for others the stream ends without a `status`.

import { MultipartReader } from './multipart.js';

const BEHIND_GATEWAY = /\/simulation\/[a-z]{28}\/\d+\/mjpeg$/; // protocol, section 13.12

// Whether these pictures come through a gateway of ours.
export const isBehindGateway = (url) => BEHIND_GATEWAY.test(url);

export class PictureStream {
  #abort = new AbortController();

  // Begins to read. `arrived` gets each part, {type, bytes}; `ended` is called once, unless the stream is closed, with the
  // {status} of the answer: null without one that could be read. `early`: another WebSocket is being opened there, and browsers open
  // one after the other: until ours brings something, the first pictures are read by fetch().
  constructor(url, { arrived, ended, early = false }) {
    this.#read(url, arrived, ended, early);
  }

  close() {
    this.#abort.abort();
  }

  async #read(url, arrived, ended, early) {
    const { signal } = this.#abort;
    const take = taker(arrived);
    let status = null;
    try {
      status = isBehindGateway(url) ? await this.#hear(url, early ? this.#untilHeard(url, arrived, take) : take) : null;
      if (status === null && !signal.aborted) // A proxy may let requests through, but no WebSockets.
        await this.#fetch(url, take, (answered) => { status = answered; });
    } catch { /* It ends in the same way. */ }
    if (!signal.aborted)
      ended({ status });
  }

  // Until its end; returns null if it has not begun.
  #hear(url, take) {
    const socket = new WebSocket(url.replace('http', 'ws'));
    socket.binaryType = 'arraybuffer';
    this.#abort.signal.addEventListener('abort', () => socket.close());
    return new Promise((resolve) => {
      let status = null;
      socket.onopen = () => { status = 200; };
      socket.onclose = () => resolve(status);
      socket.onmessage = ({ data }) => {
        if (this.#abort.signal.aborted)
          return;
        try {
          take(new Uint8Array(data));
        } catch { // It is no stream of pictures.
          socket.close();
        }
      };
    });
  }

  // Reads by fetch() until something is taken.
  #untilHeard(url, arrived, take) {
    const first = new AbortController();
    this.#abort.signal.addEventListener('abort', () => first.abort());
    this.#fetch(url, taker(arrived), () => {}, first.signal).catch(() => {}); // The WebSocket shows what is wrong.
    return (piece) => {
      first.abort();
      take(piece);
    };
  }

  async #fetch(url, take, answered, signal = this.#abort.signal) {
    const response = await fetch(url, { signal, cache: 'no-store' });
    answered(response.status);
    const body = response.ok ? response.body.getReader() : null;
    for (let piece = await body?.read(); piece?.done === false; piece = await body.read())
      take(piece.value);
  }
}

function taker(arrived) {
  const parts = new MultipartReader();
  return (piece) => parts.push(piece).forEach(arrived);
}
