// A small copy of what is shown, as a JPEG of few bytes. No DOM.

const QUALITIES = [0.75, 0.6, 0.45, 0.3, 0.15];

// What `source` (an image or a canvas) shows, in at most this many pixels; the proportions stay. Throws where scripts may not read it.
export function shrink(source, { width, height }) {
  const [fullWidth, fullHeight] = [source.naturalWidth ?? source.width, source.naturalHeight ?? source.height];
  const scale = Math.min(1, width / fullWidth, height / fullHeight);
  const small = new OffscreenCanvas(Math.max(1, Math.round(fullWidth * scale)), Math.max(1, Math.round(fullHeight * scale)));
  const pen = small.getContext('2d', { alpha: false });
  pen.imageSmoothingQuality = 'high';
  pen.drawImage(source, 0, 0, small.width, small.height);
  pen.getImageData(0, 0, 1, 1); // Throws if the source is of another origin that lets nobody read it.
  return small;
}

// Finds the best quality with which pictures of a simulation have at most this many bytes. It is much the same for all of them.
export class JpegEncoder {
  #first = 0; // what was good enough for the last picture

  // Resolves to a Blob, or to null when no quality is low enough.
  async encode(canvas, bytes) {
    let best = null;
    for (let at = Math.max(0, this.#first - 1); at < QUALITIES.length && best === null; ++at) {
      const blob = await canvas.convertToBlob({ type: 'image/jpeg', quality: QUALITIES[at] });
      this.#first = at;
      if (blob.size <= bytes)
        best = blob;
    }
    return best;
  }
}
