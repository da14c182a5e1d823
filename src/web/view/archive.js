// Several files as one, a zip archive. A bundle of its own (cmake/bundle.cmake), for it needs a library.

import { strToU8, zipSync } from 'fflate';

// `texts`: [path, text] of each.
export function archive(texts) {
  return new Blob([zipSync(Object.fromEntries(texts.map(([path, text]) => [path, strToU8(text)])))], { type: 'application/zip' });
}
