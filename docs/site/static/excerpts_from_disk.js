// The search shows the sentence around a word, for which Sphinx fetches each page that it has found. A browser refuses that to a page that was
// opened from disk: there the texts of all pages come as a script, which conf.py makes (keep_texts).
if (location.protocol === 'file:') {
  const folder = new URL('.', location.href).href;
  const fetchAsEver = fetch;
  const texts = new Promise((resolve) => {
    const script = document.createElement('script');
    script.src = '_static/page_texts.js';
    script.onload = () => resolve(globalThis.pageTexts);
    script.onerror = () => resolve({});
    document.head.append(script);
  });
  globalThis.fetch = async (address, options) => {
    const name = new URL(address, location.href).href.slice(folder.length);
    const text = (await texts)[name];
    return text === undefined ? fetchAsEver(address, options) : new Response(`<div role="main">${text}</div>`);
  };
}
