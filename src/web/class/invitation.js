// How students join: a link, a short code, and a QR code of the link. Touches the DOM.

import { say } from './view/texts.js';
import { element, offerFullscreen, setText } from './page.js';

const SVG = 'http://www.w3.org/2000/svg';

let drawn = '';

export function prepareInvitation() {
  offerFullscreen(element('project'), element('invitation'));
  element('copy').hidden = navigator.clipboard === undefined; // browsers have none on pages without TLS
  element('copy').addEventListener('click', async () => {
    await navigator.clipboard.writeText(element('link').href).catch(() => {}); // Nothing says that it was copied then.
    setText('copy', element('link').href === drawn ? say('class.copied') : say('class.copy'));
  });
}

// Shows how to come into the class with this code, in the language of the page.
export function invite(code) {
  const link = new URL(encodeURIComponent(code), new URL('./', location.href)).href;
  element('link').href = link;
  setText('link', link.replace(/^https?:\/\//, ''));
  setText('class-code', code);
  element('link-local').hidden = !isOfThisMachine(location.hostname);
  setText('code-is', say('class.codeIs', { address: new URL('./', link).href.replace(/^https?:\/\//, '') }));
  setText('copy', say('class.copy'));
  if (drawn !== link)
    drawCode(drawn = link);
}

const isOfThisMachine = (host) => /^(localhost|.*\.localhost|127\..*|\[::1\])$/.test(host);

// A build without the library (npm was missing) shows the link and the code alone. A module that the network did not bring is asked for once
// more, by another address, since browsers may remember that it did not come.
async function drawCode(link) {
  const library = await import('./qr.js').catch(() => import('./qr.js?again')).catch(() => null);
  if (library === null || link !== drawn)
    return;
  const rows = library.default(link, 'raw', { ecc: 'medium', border: 4 });
  const path = document.createElementNS(SVG, 'path');
  path.setAttribute('d', rows.flatMap((row, y) => row.map((dark, x) => (dark ? `M${x} ${y}h1v1h-1z` : ''))).join(''));
  const picture = document.createElementNS(SVG, 'svg');
  picture.setAttribute('viewBox', `0 0 ${rows.length} ${rows.length}`);
  picture.setAttribute('role', 'img');
  picture.setAttribute('data-say-label', 'class.qr');
  picture.setAttribute('aria-label', say('class.qr'));
  picture.append(path);
  element('qr').replaceChildren(picture);
}
