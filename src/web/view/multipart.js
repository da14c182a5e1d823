// Takes a multipart stream of pictures apart (multipart/x-mixed-replace, each part with a Content-Length). No DOM.

const MAX_HEAD = 8192;
const MAX_PART = 32 * 1024 * 1024;
const HEAD_END = [13, 10, 13, 10];

export class MultipartReader {
  #head = [];
  #matched = 0; // bytes of HEAD_END that the head ends with
  #part = null;
  #filled = 0;
  #type = '';

  // Takes the next piece (a Uint8Array) of the stream, and returns the parts that are complete now: [{type, bytes}]. Throws an
  // Error where the stream is not of this kind.
  push(piece) {
    const parts = [];
    let position = 0;
    while (position < piece.length) {
      position = this.#part === null ? this.#readHead(piece, position) : this.#readBody(piece, position);
      if (this.#part !== null && this.#filled === this.#part.length) {
        parts.push({ type: this.#type, bytes: this.#part });
        this.#part = null;
      }
    }
    return parts;
  }

  #readHead(piece, position) {
    while (position < piece.length) {
      const byte = piece[position++];
      this.#head.push(byte);
      this.#matched = byte === HEAD_END[this.#matched] ? this.#matched + 1 : byte === HEAD_END[0] ? 1 : 0;
      if (this.#head.length > MAX_HEAD)
        throw new Error('The stream of pictures has a part without an end of its head.');
      if (this.#matched === HEAD_END.length) {
        this.#begin(String.fromCharCode(...this.#head));
        break;
      }
    }
    return position;
  }

  #begin(head) {
    this.#head = [];
    this.#matched = 0;
    const length = Number(/^content-length:\s*(\d+)\s*$/im.exec(head)?.[1]);
    if (!(length > 0 && length <= MAX_PART))
      throw new Error('The stream of pictures has a part of no known length.');
    this.#type = /^content-type:\s*([\w/+.-]+)/im.exec(head)?.[1] ?? 'image/jpeg';
    this.#part = new Uint8Array(length);
    this.#filled = 0;
  }

  #readBody(piece, position) {
    const some = piece.subarray(position, position + this.#part.length - this.#filled);
    this.#part.set(some, this.#filled);
    this.#filled += some.length;
    return position + some.length;
  }
}
