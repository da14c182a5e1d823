// Lists of worlds: what each is called in the language of the page; and the worlds of a repository, or of a folder in one, whose address
// somebody has pasted: the session server of the page has a machine look. No DOM.

import { explain } from './refusals.js';
import { inOurLanguage, say } from './texts.js';

export const titleOf = ({ title, titles }) => inOurLanguage(titles) || title;
export const aboutOf = ({ text, texts }) => inOurLanguage(texts) || text;

// `server`: the session server, with a slash at its end. Resolves to {worlds, trouble}: as in the gallery's list, and '' or what is wrong.
export async function worldsOf(server, address) {
  let answer;
  try {
    const response = await fetch(`${server}viewer/worlds/list`, { method: 'POST', body: address });
    answer = await response.json();
  } catch {
    return { worlds: [], trouble: say('gallery.unanswered') };
  }
  const { worlds, error, code, values } = answer;
  if (!Array.isArray(worlds))
    return { worlds: [], trouble: explain(String(error ?? ''), typeof code === 'string' ? { code, values: values ?? {} } : null).text };
  return { worlds, trouble: worlds.length === 0 ? say('gallery.noneIn', { address }) : '' };
}
