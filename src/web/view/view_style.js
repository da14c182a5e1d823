// How View looks: a style sheet of its own, which the page around it neither sees nor changes, but for the properties that tokens.css
// names, and its color-scheme. No DOM.

export const STYLE = `
:host {
  display: block;
  width: 100%;
  height: 100%;
  min-height: 14rem;
  color: var(--text);
  font: 0.9375rem/1.4 var(--font);
}
* { box-sizing: border-box; }
[hidden] { display: none !important; }
.view { display: flex; flex-direction: column; width: 100%; height: 100%; min-height: inherit; overflow: hidden; background: var(--panel); border: 1px solid var(--line); border-radius: 6px; }
.stage { position: relative; flex: 1 1 14rem; min-height: 8rem; overflow: hidden; background: var(--screen); }
.display { position: absolute; inset: 0; }
.labels { position: absolute; inset: 0; overflow: hidden; container-type: size; pointer-events: none; }
.labels span { position: absolute; white-space: pre; text-shadow: 0 0 2px #000, 0 0 2px #000; }
.thumbnail { position: absolute; inset: 0; width: 100%; height: 100%; object-fit: cover; opacity: 0.35; }
.message { position: absolute; left: 50%; top: 50%; width: min(34rem, 92%); max-height: 92%; overflow: auto; transform: translate(-50%, -50%); padding: 0.75rem 1rem; border-radius: 6px; background: var(--panel); color: var(--text); text-align: center; }
.message p { margin: 0; overflow-wrap: anywhere; }
.message.problem p { color: var(--bad); font-weight: 600; }
.message .hint { margin-top: 0.4rem; font-weight: 400; }
.message .offer:not(:empty) { margin-top: 0.6rem; }
.unseen { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
.message progress { width: 100%; margin-top: 0.5rem; accent-color: var(--accent); }
.notice { display: flex; gap: 0.5rem; align-items: center; padding: 0.35rem 0.5rem; border-top: 1px solid var(--line); }
.notice p { flex: 1; margin: 0; font-weight: 600; }
.toolbar { display: flex; flex-wrap: wrap; gap: 0.25rem; align-items: center; padding: 0.35rem; border-top: 1px solid var(--line); }
.toolbar time { margin: 0 0.5rem 0 auto; font-variant-numeric: tabular-nums; }
button, select { font: inherit; min-height: 2rem; padding: 0.2rem 0.6rem; color: inherit; background: transparent; border: 1px solid var(--line); border-radius: 4px; }
button:not(:disabled) { cursor: pointer; }
button:not(:disabled):hover, select:hover { border-color: var(--accent); }
button:disabled { opacity: 0.55; }
button:focus-visible, select:focus-visible, .console:focus-visible { outline: 3px solid var(--accent); outline-offset: 1px; }
button[aria-pressed="true"] { border-color: var(--accent); box-shadow: inset 0 -3px 0 var(--accent); }
select { max-width: 14rem; background: var(--panel); }
a { color: var(--accent); padding: 0.2rem 0.6rem; }
.mobile button, .mobile select { min-height: 2.75rem; }
.panels { display: flex; flex-wrap: wrap; gap: 0.35rem; max-height: 50%; overflow: auto; }
.panels section { flex: 1 1 18rem; display: flex; flex-direction: column; min-height: 10rem; border-top: 1px solid var(--line); }
.panels header { display: flex; align-items: center; gap: 0.35rem; padding: 0.25rem 0.5rem; }
.panels header p { flex: 1; margin: 0; font-weight: 600; }
.panels iframe { flex: 1; width: 100%; min-height: 9rem; border: 0; background: #fff; color-scheme: light; }
.console { flex: 1; min-height: 6rem; max-height: 16rem; overflow: auto; padding: 0.25rem 0.5rem; font: 0.8125rem/1.35 var(--mono); white-space: pre-wrap; overflow-wrap: anywhere; }
.console .stderr { color: var(--bad); }
@media (max-height: 30rem) { .toolbar :is(button, select) { padding-inline: 0.4rem; } } /* one row on a telephone on its side */
:host(:fullscreen) .view { border: 0; border-radius: 0; }
`;

// For a page that leaves the size of <webots-view> open. The page's own style goes before.
export const ELEMENT_STYLE = ':host { display: grid; aspect-ratio: 16 / 10; min-height: 14rem; } :host([hidden]) { display: none; } ::slotted(*) { min-height: 0; }';

// Constructed sheets need no permission of a page's Content-Security-Policy.
export function adopt(root, css) {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  root.adoptedStyleSheets = [...root.adoptedStyleSheets, sheet];
}
