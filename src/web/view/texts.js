// What people read, in their language. One file for each language in texts/, all with the same keys; {name} in a text is
// replaced by a value. No DOM.

import { fetchAgain } from './fetch_again.js';

// The languages that there are, each in its own words.
export const LANGUAGES = { en: 'English', de: 'Deutsch', es: 'Español', fr: 'Français', it: 'Italiano', ja: '日本語', zh: '中文' };

let texts = {};
let language = 'en';

// Loads the first of the wanted languages (as in navigator.languages) that there is, or English. If that fails, the texts stay as they are,
// and it resolves to false.
export async function loadTexts(wanted = globalThis.navigator?.languages ?? []) {
  const found = wanted.map((name) => name.toLowerCase().split('-')[0]).find((name) => Object.hasOwn(LANGUAGES, name)) ?? 'en';
  try {
    const response = await fetchAgain(new URL(`texts/${found}.json`, import.meta.url));
    texts = await response.json();
    language = found;
    return true;
  } catch (error) {
    console.warn(`The texts in "${found}" cannot be loaded: ${error.message}`);
    return false;
  }
}

// The language of say(): for the `lang` of elements, for numbers and for dates.
export const textLanguage = () => language;

// Whether there is such a text: servers may be newer than the page.
export const knows = (key) => Object.hasOwn(texts, key);

// Of a project's text by language, which may be anything: the one in ours, else the one for everybody, or in English, or any.
export function inOurLanguage(texts) {
  if (typeof texts !== 'object' || texts === null)
    return '';
  const found = [language, '', 'en', ...Object.keys(texts)].find((name) => Object.hasOwn(texts, name) && typeof texts[name] === 'string');
  return found === undefined ? '' : texts[found];
}

// A text without a translation would be read by nobody: tests look for these, here the key is shown.
export function say(key, values = {}) {
  return (texts[key] ?? key).replace(/\{(\w+)\}/g, (_, name) => values[name] ?? '');
}
