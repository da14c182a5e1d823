// Reads the stream of pictures, which tells when each one arrives, and hands the last one out. No DOM.
//
// Behind a gateway the pictures of all simulations have one origin, to which a browser opens six connections by HTTP, but many WebSockets:
// there they come by a WebSocket. Elsewhere they are read by fetch(): those of simulators that send no Access-Control-Allow-Origin (as
// Webots for /mjpeg) by pages of their own origin alone; for others the stream ends without a `status`.

import { MultipartReader } from './multipart.js';

const BEHIND_GATEWAY = /\/simulation\/[a-z]{28}\/\d+\/mjpeg$/; // protocol, section 13.12

export class PictureStream {
  #abort = new AbortController();

  // Begins to read. `arrived` gets each part, {type, bytes}; `ended` is called once, unless the stream is closed, with the
  // {status} of the answer: null without one that could be read.
  constructor(url, { arrived, ended }) {
    this.#read(url, arrived, ended);
  }

  close() {
    this.#abort.abort();
  }

  async #read(url, arrived, ended) {
    const { signal } = this.#abort;
    const take = taker(arrived);
    let status = null;
    try {
      status = BEHIND_GATEWAY.test(url) ? await this.#hear(url, take) : null;
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

  async #fetch(url, take, answered) {
    const response = await fetch(url, { signal: this.#abort.signal, cache: 'no-store' });
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
