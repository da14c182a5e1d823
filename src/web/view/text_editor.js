// A text of a program with line numbers, for the viewer, for views and for websites that have an editor of their own: CodeMirror, where these pages
// were built with it, or else a plain text field. Touches the DOM.

import { PlainText } from './plain_text.js';

// `change()` is called when the user, and nobody else, has changed the text; `run()` at Ctrl+S and Ctrl+Enter; `phrases()` returns CodeMirror's own
// words in the language of the page. What comes has:
//   element           for the page, with the class `program-text`
//   isPlain           whether it is a text field
//   show(text, path)  of another file: what was done to the one before cannot be undone in it
//   text
//   readOnly, label   can be set; it is read-only first
//   mark(line)        where something is wrong, from 1 on; null: nowhere
//   reveal(line)      scrolls there
//   focus()
export async function createTextEditor(events) {
  try {
    const { CodeMirrorText } = await import(new URL('code_mirror.js', import.meta.url).href);
    return new CodeMirrorText(events);
  } catch (error) {
    console.info(`A plain text field instead of CodeMirror: ${error.message}`);
    return new PlainText(events);
  }
}
