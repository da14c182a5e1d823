// How View looks: a style sheet of its own, which the page around it neither sees nor changes, but for the properties that tokens.css
// names, and its color-scheme. No DOM.

// Where nobody says how large a view is, its toolbar is in view, below a heading. On an upright phone the picture stays larger than its
// buttons; on a phone on its side the view has the screen.
const sizeOf = (host) => `
${host} { aspect-ratio: 16 / 10; max-height: calc(100vh - 7rem); max-height: calc(100svh - 7rem); }
@media (max-width: 40rem) { ${host} { aspect-ratio: 3 / 4; } }
@media (max-height: 30rem) { ${host} { max-height: calc(100vh - 1rem); max-height: calc(100svh - 1rem); } }
`;

export const STYLE = `
:host {
  display: block;
  width: 100%;
  height: 100%;
  min-height: 14rem;
  container-type: inline-size;
  color: var(--text);
  font: 0.9375rem/1.4 var(--font);
}
/* In an element that has no height of its own. */
:host([data-free]) { height: auto; }
${sizeOf(':host([data-free])')}
* { box-sizing: border-box; }
[hidden] { display: none !important; }
.view { container-type: inline-size; display: flex; flex-direction: column; width: 100%; height: 100%; min-height: inherit; overflow: hidden; background: var(--panel); border: 1px solid var(--line); border-radius: var(--radius); }
.stage { flex: 1 1 14rem; min-height: 8rem; }
.display { position: absolute; inset: 0; }
.labels { position: absolute; inset: 0; overflow: hidden; container-type: size; pointer-events: none; }
.labels span { position: absolute; white-space: pre; text-shadow: 0 0 2px #000, 0 0 2px #000; }
.notice { display: flex; gap: var(--space-s); align-items: center; padding: 0.35rem 0.5rem; border-top: 1px solid var(--line); background: var(--warning); }
.notice p { flex: 1; margin: 0; font-weight: 600; }
.view[data-state="idle"] :is(.toolbar, .notice, .panels) { display: none; }
.toolbar { flex: none; border-top: 1px solid var(--line); }
.windows { display: contents; }
.notice button, .panels :is(button, select) { font: inherit; min-height: 2rem; padding: 0.2rem 0.6rem; color: inherit; background: transparent; border: 1px solid var(--line); border-radius: var(--radius); cursor: pointer; }
.panels select { background: var(--panel); }
.console:focus-visible, .notice button:focus-visible, .panels button:focus-visible, select:focus-visible { outline: 3px solid var(--accent); outline-offset: 1px; }
.panels { display: flex; flex-wrap: wrap; gap: 0.35rem; max-height: 50%; overflow: auto; }
/* No wider than the view, however long a line of a program is. */
.panels section { flex: 1 1 18rem; display: flex; flex-direction: column; min-width: 0; min-height: 10rem; border-top: 1px solid var(--line); }
.panels header { display: flex; align-items: center; gap: 0.35rem; padding: 0.25rem 0.5rem; }
.panels header p { flex: 1; margin: 0; font-weight: 600; }
.program-editor { flex: 1 1 0; }
/* The editor is beside the picture, or below it, where all of it is higher than the view. */
@container (min-width: 52rem) {
  .view:has(.program-editor) { display: grid; grid-template: minmax(0, 1fr) / minmax(0, 1fr) minmax(22rem, 42%); grid-auto-rows: auto; }
  .view:has(.program-editor) > * { grid-column: 1; }
  .view:has(.program-editor) .stage { grid-row: 1; }
  .view:has(.program-editor) .panels { grid-area: 1 / 2 / span 3; flex-flow: column; max-height: none; min-height: 0; border-left: 1px solid var(--line); }
  .view:has(.program-editor) .panels section { flex: 0 1 11rem; min-height: 7rem; }
  .view:has(.program-editor) .panels section:first-child { border-top: 0; }
  .view:has(.program-editor) .panels section:has(.program-editor) { flex: 1 1 0; min-height: 12rem; }
}
@container (max-width: 52rem) {
  .view:has(.program-editor) { overflow-y: auto; }
  .view:has(.program-editor) .stage { flex: 0 0 14rem; }
  .view:has(.program-editor) .panels { flex: none; max-height: none; overflow: visible; }
  .view:has(.program-editor) .panels section:has(.program-editor) { flex: 1 0 100%; min-height: 28rem; }
  .panels .program-editor { flex-basis: auto; flex-shrink: 0; overflow: visible; } /* the view scrolls, and no part of it once more */
}
.panels iframe { flex: 1; width: 100%; min-height: 9rem; border: 0; background: #fff; color-scheme: light; }
.console { flex: 1; min-height: 6rem; max-height: 16rem; overflow: auto; padding: 0.25rem 0.5rem; font: 0.8125rem/1.35 var(--mono); white-space: pre-wrap; overflow-wrap: anywhere; }
.console .stderr { color: var(--bad); }
:host(:fullscreen) { max-height: none; }
:host(:fullscreen) .view { border: 0; border-radius: 0; }
`;

// For a page that leaves the size of <webots-view> open. The page's own style goes before.
export const ELEMENT_STYLE = `
:host { display: grid; width: 100%; min-height: 14rem; }
:host([hidden]) { display: none; }
::slotted(*) { min-height: 0; }
${sizeOf(':host')}
`;

// Constructed sheets need no permission of a page's Content-Security-Policy.
export function adopt(root, css) {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  root.adoptedStyleSheets = [...root.adoptedStyleSheets, sheet];
}
