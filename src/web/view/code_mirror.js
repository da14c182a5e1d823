// The text of a program in CodeMirror: colours, indentation, search and undo. A bundle of its own (cmake/bundle.cmake), loaded by text_editor.js,
// which says what its members are. In a shadow tree, so that its styles need no permission of the page around it. Touches the DOM.

import { defaultKeymap, history, historyKeymap, indentWithTab } from '@codemirror/commands';
import { cpp } from '@codemirror/lang-cpp';
import { python } from '@codemirror/lang-python';
import { HighlightStyle, bracketMatching, indentOnInput, indentUnit, syntaxHighlighting } from '@codemirror/language';
import { highlightSelectionMatches, search, searchKeymap } from '@codemirror/search';
import { Compartment, EditorState, StateEffect, StateField, Transaction } from '@codemirror/state';
import { Decoration, EditorView, highlightActiveLine, highlightActiveLineGutter, keymap, lineNumbers } from '@codemirror/view';
import { tags } from '@lezer/highlight';

const LANGUAGES = [[/\.py$/, python], [/\.(c|cc|cpp|cxx|h|hh|hpp)$/, cpp]];

const HIGHLIGHTS = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword, tags.processingInstruction], color: 'var(--accent)', fontWeight: '600' },
  { tag: [tags.number, tags.bool, tags.null], color: 'var(--accent)' },
  { tag: [tags.string, tags.special(tags.string), tags.character], color: 'var(--good)' },
  { tag: tags.comment, color: 'var(--quiet)', fontStyle: 'italic' },
  { tag: [tags.function(tags.definition(tags.variableName)), tags.definition(tags.className)], fontWeight: '600' },
  { tag: tags.invalid, color: 'var(--bad)' },
]);

const THEME = EditorView.theme({
  '&': { height: '100%', color: 'var(--text)', fontSize: 'inherit' },
  '&.cm-focused': { outline: '2px solid var(--accent)', outlineOffset: '-2px' },
  '.cm-scroller': { font: '.86rem/1.5 var(--mono)' },
  '.cm-content': { caretColor: 'var(--text)', outline: 'none' },
  '.cm-gutters': { background: 'var(--panel)', color: 'var(--quiet)', borderRight: '1px solid var(--line)' },
  '.cm-activeLine, .cm-activeLineGutter': { background: 'color-mix(in srgb, var(--notice) 50%, transparent)' },
  '.cm-wrong': { background: 'var(--warning)', boxShadow: 'inset 3px 0 var(--bad)' },
  '.cm-panels': { background: 'var(--page)', color: 'var(--text)' },
  '.cm-panels-bottom': { borderTop: '1px solid var(--line)' },
  '.cm-button, .cm-textfield': { background: 'var(--panel)', color: 'var(--text)', borderColor: 'var(--line)', font: 'inherit' },
  '.cm-searchMatch': { background: 'var(--warning)', outline: '1px solid var(--warning-line)' },
  '.cm-searchMatch-selected': { background: 'var(--warning-line)' },
});

const mark = StateEffect.define(); // a line, or null
const marks = StateField.define({
  create: () => Decoration.none,
  update(lines, { effects, changes, state }) {
    const effect = effects.findLast((each) => each.is(mark));
    if (effect === undefined)
      return lines.map(changes);
    const exists = effect.value >= 1 && effect.value <= state.doc.lines;
    return exists ? Decoration.set(Decoration.line({ class: 'cm-wrong' }).range(state.doc.line(effect.value).from)) : Decoration.none;
  },
  provide: (field) => EditorView.decorations.from(field),
});

export class CodeMirrorText {
  #element = document.createElement('div');
  #view;
  #writable = new Compartment();
  #labelled = new Compartment();
  #isReadOnly = true;
  #label = '';
  #extensions;
  #phrases;

  constructor({ change, run, phrases }) {
    this.#phrases = phrases;
    this.#element.className = 'program-text code-mirror';
    const root = this.#element.attachShadow({ mode: 'open' });
    this.#extensions = [
      lineNumbers(), highlightActiveLine(), highlightActiveLineGutter(), history(), indentOnInput(), bracketMatching(), indentUnit.of('    '),
      EditorState.tabSize.of(4), syntaxHighlighting(HIGHLIGHTS), highlightSelectionMatches(), search(), marks, THEME,
      // Escape, then Tab leaves the text.
      keymap.of([...['Mod-s', 'Mod-Enter'].map((key) => ({ key, run: () => (run?.(), run !== undefined) })), ...searchKeymap, ...historyKeymap,
        ...defaultKeymap, indentWithTab]),
      EditorView.updateListener.of(({ docChanged, transactions }) => {
        if (docChanged && transactions.some((transaction) => transaction.annotation(Transaction.userEvent) !== undefined))
          change();
      }),
    ];
    this.#view = new EditorView({ root, state: this.#state('', '') });
    root.append(this.#view.dom);
    this.#view.dom.style.height = '100%';
  }

  get element() { return this.#element; }
  get isPlain() { return false; }
  get text() { return this.#view.state.doc.toString(); }

  show(text, path) { this.#view.setState(this.#state(text, path)); }

  set readOnly(yes) {
    this.#isReadOnly = yes;
    this.#view.dispatch({ effects: this.#writable.reconfigure(this.#writability()) });
  }

  set label(text) {
    this.#label = text;
    this.#view.dispatch({ effects: this.#labelled.reconfigure(this.#labels()) });
  }

  mark(line) { this.#view.dispatch({ effects: mark.of(line) }); }

  reveal(line) {
    const { doc } = this.#view.state;
    this.#view.dispatch({ effects: EditorView.scrollIntoView(doc.line(Math.min(Math.max(line, 1), doc.lines)).from, { y: 'center' }) });
  }

  focus() { this.#view.focus(); }

  #state(text, path) {
    const [, language] = LANGUAGES.find(([names]) => names.test(path)) ?? [];
    return EditorState.create({ doc: text, extensions: [...this.#extensions, this.#writable.of(this.#writability()), this.#labelled.of(this.#labels()), language?.() ?? []] });
  }

  #writability() { return [EditorState.readOnly.of(this.#isReadOnly), EditorView.editable.of(!this.#isReadOnly)]; }

  // With a place in the order of Tab, so that keys scroll what cannot be edited.
  #labels() {
    return [EditorView.contentAttributes.of({ 'aria-label': this.#label, tabindex: '0' }), EditorState.phrases.of(this.#phrases?.() ?? {})];
  }
}
