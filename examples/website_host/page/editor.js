// The editor of the page: CodeMirror, whose modules the import map of the page names, or else a plain text field.

// `change` is called when the user, and nobody else, changes the text.
export async function createEditor(parent, hasCodeMirror, change) {
  if (hasCodeMirror) {
    try {
      return await createCodeMirror(parent, change);
    } catch (error) {
      console.warn('CodeMirror can not be loaded:', error); // the text field will do
    }
  }
  return createTextField(parent, change);
}

const LABEL = 'Text of the controller';

// Colours of CodeMirror's own style that are too pale on white (WCAG asks for a contrast of 4.5), and what takes their places.
const DARKER = { '#e40': '#b30', '#085': '#064', '#f00': '#c00' };

async function createCodeMirror(parent, change) {
  const [{ EditorView, keymap, lineNumbers, highlightActiveLine }, { Compartment, EditorState, Transaction }, commands, language, { python }] =
    await Promise.all([import('@codemirror/view'), import('@codemirror/state'), import('@codemirror/commands'),
      import('@codemirror/language'), import('@codemirror/lang-python')]);
  const writable = new Compartment();
  const extensions = [
    EditorView.cspNonce.of(document.getElementById('script').nonce),
    lineNumbers(),
    highlightActiveLine(),
    commands.history(),
    language.indentOnInput(),
    language.bracketMatching(),
    language.syntaxHighlighting(language.HighlightStyle.define(
      language.defaultHighlightStyle.specs.map((spec) => ({ ...spec, color: DARKER[spec.color] ?? spec.color })))),
    python(),
    language.indentUnit.of('    '),
    keymap.of([...commands.defaultKeymap, ...commands.historyKeymap]),
    EditorView.contentAttributes.of({ 'aria-label': LABEL, tabindex: '0' }), // so that keys scroll what can't be edited
    EditorView.updateListener.of((update) => {
      if (update.docChanged && update.transactions.some((transaction) => transaction.annotation(Transaction.userEvent) !== undefined))
        change();
    }),
  ];
  const readOnly = (yes) => [EditorState.readOnly.of(yes), EditorView.editable.of(!yes)];
  const state = (text, isReadOnly) => EditorState.create({ doc: text, extensions: [...extensions, writable.of(readOnly(isReadOnly))] });
  const view = new EditorView({ parent, state: state('', true) });
  let isReadOnly = true;
  return {
    isPlain: false,
    get text() { return view.state.doc.toString(); },
    set text(text) { view.setState(state(text, isReadOnly)); }, // what was done to another file can't be undone in this one
    set readOnly(yes) {
      isReadOnly = yes;
      view.dispatch({ effects: writable.reconfigure(readOnly(yes)) });
    },
  };
}

function createTextField(parent, change) {
  const field = document.createElement('textarea');
  field.setAttribute('aria-label', LABEL);
  field.spellcheck = false;
  field.readOnly = true;
  field.addEventListener('input', change);
  parent.append(field);
  return {
    isPlain: true,
    get text() { return field.value; },
    set text(text) { field.value = text; },
    set readOnly(yes) { field.readOnly = yes; },
  };
}
