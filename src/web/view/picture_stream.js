// Reads the stream of pictures by fetch(), which tells when each one arrives, and hands the last one out. No DOM.
// Simulators that send no Access-Control-Allow-Origin (as Webots for /mjpeg) can be read in this way by pages of their own
// origin alone; for others the stream ends without a `status`.

import { MultipartReader } from './multipart.js';

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
    let status = null;
    try {
      const response = await fetch(url, { signal, cache: 'no-store' });
      status = response.status;
      const parts = new MultipartReader();
      const body = response.ok ? response.body.getReader() : null;
      for (let piece = await body?.read(); piece?.done === false; piece = await body.read())
        parts.push(piece.value).forEach(arrived);
    } catch { /* It ends in the same way. */ }
    if (!signal.aborted)
      ended({ status });
  }
}
