// The style sheets that our pages link, for what has a shadow tree of its own. No DOM.

import { fetchAgain } from './fetch_again.js';

const SHEETS = ['tokens.css', 'simulation.css'];
const EDITOR = 'editor.css';

let style = '';

// Views wait for it before they are built. If it fails, they have the browser's own look.
export async function loadSharedStyle() {
  try {
    const answers = await Promise.all(SHEETS.map((sheet) => fetchAgain(new URL(sheet, import.meta.url))));
    style = (await Promise.all(answers.map((answer) => (answer.ok ? answer.text() : '')))).join('\n');
  } catch (error) {
    console.warn(`The style cannot be loaded: ${error.message}`);
  }
}

export const sharedStyle = () => style;

// Of the editor for programs; '' if it cannot be loaded.
export async function editorStyle() {
  const answer = await fetchAgain(new URL(EDITOR, import.meta.url)).catch(() => null);
  return answer?.ok ? answer.text() : '';
}
