// What people read, in their language. One file for each language in texts/, all with the same keys; {name} in a text is
// replaced by a value. No DOM.

const LANGUAGES = ['en', 'de', 'es', 'fr', 'it', 'ja', 'zh'];

let texts = {};
let language = 'en';

// Loads the first of the wanted languages (as in navigator.languages) that there is, or English.
export async function loadTexts(wanted = globalThis.navigator?.languages ?? []) {
  language = wanted.map((name) => name.toLowerCase().split('-')[0]).find((name) => LANGUAGES.includes(name)) ?? 'en';
  const response = await fetch(new URL(`texts/${language}.json`, import.meta.url));
  texts = await response.json();
}

// The language of say(): for the `lang` of elements, for numbers and for dates.
export const textLanguage = () => language;

// A text without a translation would be read by nobody: tests look for these, here the key is shown.
export function say(key, values = {}) {
  return (texts[key] ?? key).replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '');
}
