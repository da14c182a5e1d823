// Pictures for the documentation: few colours, so that a page with several of them stays small.

import { execFileSync } from 'node:child_process';
import { fileURLToPath } from 'node:url';

// Saves what a page or an element shows as docs/images/NAME.png. Needs the package pngquant.
export async function saveDocumentPicture(shown, name) {
  const picture = await shown.screenshot({ scale: 'css' });
  const file = fileURLToPath(new URL(`../../docs/images/${name}.png`, import.meta.url));
  execFileSync('pngquant', ['--speed', '1', '--force', '--strip', '--output', file, '128', '-'], { input: picture });
}
