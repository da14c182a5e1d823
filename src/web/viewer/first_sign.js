// The first sign that a person is at the page, whatever they use: on a telephone nothing rests on a button before it is pressed. Touches the DOM.

const SIGNS = ['pointermove', 'pointerdown', 'keydown', 'wheel', 'scroll', 'focus'];

// Calls `seen` at the first sign, and after that not before the page has been hidden and shown again. While it returns false, it was too
// early, and the next sign counts.
export function onFirstSign(seen) {
  let listening = null;
  const look = () => {
    listening?.abort();
    if (document.hidden)
      return;
    listening = new AbortController();
    const { signal } = listening;
    for (const type of SIGNS)
      addEventListener(type, () => seen() && listening.abort(), { signal, passive: true, capture: true });
  };
  document.addEventListener('visibilitychange', look);
  look();
}
