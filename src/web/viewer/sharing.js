// Shows the link with which others start the same world, and its QR code. Touches the DOM.

import { copyField, drawQrCode, isOfThisMachine } from './view/qr_code.js';
import { say } from './view/texts.js';

const element = (id) => document.getElementById(id);

export class Sharing {
  #link;
  #isCopied = false;

  // `link` returns the address to share.
  constructor(link) {
    this.#link = link;
    element('copy').addEventListener('click', async () => {
      this.#isCopied = await copyField(element('link'));
      this.sayAll();
    });
  }

  async open() {
    const link = this.#link();
    this.#isCopied = false;
    element('link').value = link;
    element('link').setSelectionRange(0, 0); // the focus shows where the cursor is
    element('link-local').hidden = !isOfThisMachine(location.hostname);
    element('qr').replaceChildren();
    this.sayAll();
    element('sharing').showModal();
    const picture = await drawQrCode(link, new URL('../class/qr.js', location.href).href);
    if (picture !== null && element('link').value === link)
      element('qr').replaceChildren(picture);
  }

  sayAll() {
    element('copy').textContent = this.#isCopied ? say('class.copied') : say('class.copy');
  }
}
