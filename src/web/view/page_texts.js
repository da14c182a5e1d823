// Puts texts into a page, and lets people choose their language. Touches the DOM.
//
// Attributes whose values are keys of texts:
//   data-say              the element's text
//   data-say-label        its aria-label
//   data-say-placeholder  its placeholder
//   data-say-title        its title

import { LANGUAGES, loadTexts, say, textLanguage } from './texts.js';

const CHOICE = 'webots_cloud.language';
const ATTRIBUTES = [['data-say-label', 'aria-label'], ['data-say-placeholder', 'placeholder'], ['data-say-title', 'title']];

// Loads the texts of the language that was chosen on this browser, or else of the browser's, and puts them into the page. Without texts
// nobody can use it: the script at its beginning is told.
export async function loadPageTexts() {
  const choice = remembered();
  if (!await loadTexts(choice === null ? undefined : [choice]))
    dispatchEvent(new Event('incomplete'));
  translate(document);
}

// Puts the texts into all elements below `root`.
export function translate(root) {
  if (root === document)
    document.documentElement.lang = textLanguage();
  for (const element of root.querySelectorAll('[data-say]'))
    element.textContent = say(element.dataset.say);
  for (const [name, attribute] of ATTRIBUTES) {
    for (const element of root.querySelectorAll(`[${name}]`))
      element.setAttribute(attribute, say(element.getAttribute(name)));
  }
}

// Fills `select` with the languages, each in its own words. `changed` is called when another one was chosen and the page speaks it.
export function offerLanguages(select, changed = () => {}) {
  select.replaceChildren(...Object.entries(LANGUAGES).map(([language, name]) => {
    const option = new Option(name, language, false, language === textLanguage());
    option.lang = language;
    return option;
  }));
  select.addEventListener('change', async () => {
    remember(select.value);
    await loadTexts([select.value]);
    translate(document);
    changed();
  });
}

// Browsers may keep nothing, for instance in a private window: then the choice ends with the page.
function remembered() {
  try {
    return localStorage.getItem(CHOICE);
  } catch {
    return null;
  }
}

function remember(language) {
  try {
    localStorage.setItem(CHOICE, language);
  } catch { /* See above. */ }
}
