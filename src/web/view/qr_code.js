// Draws the QR code of a link, with the npm package qr, and copies links. Touches the DOM.

import { say } from './texts.js';

const SVG = 'http://www.w3.org/2000/svg';

// `library` is where the package is. Resolves to null in a build without it (npm was missing): the link alone has to do. A module that the
// network did not bring is asked for once more, by another address, since browsers may remember that it did not come.
export async function drawQrCode(link, library) {
  const found = await import(library).catch(() => import(`${library}?again`)).catch(() => null);
  if (found === null)
    return null;
  const rows = found.default(link, 'raw', { ecc: 'medium', border: 4 });
  const path = document.createElementNS(SVG, 'path');
  path.setAttribute('d', rows.flatMap((row, y) => row.map((dark, x) => (dark ? `M${x} ${y}h1v1h-1z` : ''))).join(''));
  const picture = document.createElementNS(SVG, 'svg');
  picture.setAttribute('viewBox', `0 0 ${rows.length} ${rows.length}`);
  picture.setAttribute('class', 'qr');
  picture.setAttribute('role', 'img');
  picture.setAttribute('data-say-label', 'class.qr');
  picture.setAttribute('aria-label', say('class.qr'));
  picture.append(path);
  return picture;
}

// Browsers give pages without TLS no clipboard, but copy what is selected in a field. Resolves to whether it was copied.
export async function copyField(field) {
  field.select();
  try {
    await navigator.clipboard.writeText(field.value);
    return true;
  } catch {
    return document.execCommand('copy');
  }
}

// Nobody else can open a link to this machine's own name for itself.
export const isOfThisMachine = (host) => /^(localhost|.*\.localhost|127\..*|\[::1\])$/.test(host);
