// Saves what is shown of a simulation as a file of the visitor. Touches the DOM.

import { say } from './texts.js';

const LARGEST = { width: 8192, height: 8192 };

// `display` is a Picture or a Scene. Resolves to '', or to a sentence that says why there is no file.
export async function saveScreenshot(display, name) {
  let picture;
  try {
    picture = (await display?.snapshot?.(LARGEST)) ?? null;
  } catch {
    return say('viewer.noScreenshot'); // Some simulators let no script read what they show.
  }
  if (picture === null)
    return say('viewer.noPictureYet');
  const address = URL.createObjectURL(await picture.convertToBlob({ type: 'image/png' }));
  const link = Object.assign(document.createElement('a'), { href: address, download: `${name || 'simulation'}.png` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 60000); // Browsers may read it later.
  return '';
}
