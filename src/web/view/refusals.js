// What servers say when they refuse or end something, in words for the person who reads it, and what to do. Beside its sentence a server
// of ours sends a code (docs/messages.md, "Codes of refusals"), for which there is a text: `refusal.noWorld` for "no-world". No DOM.

import { reasonOf } from './python_servers.js';
import { knows, say } from './texts.js';

const FULL = ['no-machine', 'full']; // the session server tells when there is a machine
const BUSY = [...FULL, 'too-fast']; // worth asking again later

// Of a message `reason:`, what it says: {code, values}. Null: nothing that could be understood.
export function parseReason(text) {
  try {
    const { code, values } = JSON.parse(text);
    return typeof code === 'string' ? { code, values: values ?? {} } : null;
  } catch {
    return null;
  }
}

// A sentence, without the word "Error:", and the server's reason, or null. Returns {text, full, busy}: what people are told, whether no
// machine takes a session, or the chosen one no longer does, and whether to ask again later.
export function explain(sentence, reason = null) {
  const told = sentence.trim();
  const { code, values } = reason ?? reasonOf(told) ?? { code: '', values: {} };
  const key = `refusal.${code.replace(/-(\w)/g, (_, letter) => letter.toUpperCase())}`;
  const text = knows(key) ? say(key, { why: told, ...values }) : capitalised(told);
  return { text, full: FULL.includes(code), busy: BUSY.includes(code) };
}

// Unless the first word is a file name or an address.
const capitalised = (text) => text.replace(/^[a-z]+(?= |$)/, (word) => word[0].toUpperCase() + word.slice(1));
