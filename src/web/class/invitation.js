// How students join: a link, a short code, and a QR code of the link. Touches the DOM.

import { drawQrCode, isOfThisMachine } from './view/qr_code.js';
import { say } from './view/texts.js';
import { element, offerFullscreen, ownServer, setText } from './page.js';

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
    showQrCode(drawn = link);
}

async function showQrCode(link) {
  const picture = await drawQrCode(link, new URL('class/qr.js', ownServer).href);
  if (picture !== null && link === drawn)
    element('qr').replaceChildren(picture);
}
