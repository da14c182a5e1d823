// The design tokens for what has a shadow tree of its own, from the file that pages link. No DOM.

import { fetchAgain } from './fetch_again.js';

let sheet = '';

// Views wait for it before they are built. If it fails, they have the browser's own colours.
export async function loadTokens() {
  try {
    const response = await fetchAgain(new URL('tokens.css', import.meta.url));
    sheet = response.ok ? await response.text() : '';
  } catch (error) {
    console.warn(`The design tokens cannot be loaded: ${error.message}`);
  }
}

export const tokens = () => sheet;
