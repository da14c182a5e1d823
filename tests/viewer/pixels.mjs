// The pixels of a PNG file as browsers make screenshots: 8 bits a channel, not interlaced.

import assert from 'node:assert/strict';
import { inflateSync } from 'node:zlib';

const MAGIC = 8; // bytes
const CHANNELS = { 2: 3, 6: 4 }; // RGB and RGBA

export class Pixels {
  #channels;
  #bytes;

  constructor(png) {
    const parts = [];
    for (let at = MAGIC; at < png.length;) {
      const size = png.readUInt32BE(at);
      const kind = png.toString('latin1', at + 4, at + 8);
      const body = png.subarray(at + 8, at + 8 + size);
      if (kind === 'IHDR') {
        this.width = body.readUInt32BE(0);
        this.height = body.readUInt32BE(4);
        this.#channels = CHANNELS[body[9]];
        assert.ok(body[8] === 8 && this.#channels !== undefined && body[12] === 0, 'another kind of PNG');
      } else if (kind === 'IDAT')
        parts.push(body);
      at += 12 + size;
    }
    this.#bytes = this.#unfilter(inflateSync(Buffer.concat(parts)));
  }

  // [red, green, blue], each 0 to 255.
  at(x, y) {
    const start = (Math.floor(y) * this.width + Math.floor(x)) * this.#channels;
    return [...this.#bytes.subarray(start, start + 3)];
  }

  #unfilter(data) {
    const [step, length] = [this.#channels, this.width * this.#channels];
    const out = Buffer.alloc(length * this.height);
    for (let y = 0; y < this.height; ++y) {
      const kind = data[y * (length + 1)];
      for (let i = 0; i < length; ++i) {
        const left = i >= step ? out[y * length + i - step] : 0;
        const up = y > 0 ? out[(y - 1) * length + i] : 0;
        const corner = i >= step && y > 0 ? out[(y - 1) * length + i - step] : 0;
        out[y * length + i] = data[y * (length + 1) + 1 + i] + [0, left, up, (left + up) >> 1, nearest(left, up, corner)][kind];
      }
    }
    return out;
  }
}

// Of the three that which is nearest to left + up - corner; the first of equals.
function nearest(left, up, corner) {
  const guess = left + up - corner;
  return [left, up, corner].reduce((best, value) => (Math.abs(guess - value) < Math.abs(guess - best) ? value : best));
}
