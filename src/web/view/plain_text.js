// The text of a program in a text field, for text_editor.js, which says what its members are: line numbers and indentation, and no library.
// Touches the DOM.

const INDENTATION = '    ';

export class PlainText {
  #element = document.createElement('div');
  #numbers = document.createElement('div');
  #field = document.createElement('textarea');
  #change;
  #run;
  #wrong = null;

  constructor({ change, run }) {
    this.#change = change;
    this.#run = run;
    this.#element.className = 'program-text';
    Object.assign(this.#numbers, { className: 'numbers', ariaHidden: 'true' });
    Object.assign(this.#field, { spellcheck: false, wrap: 'off', autocapitalize: 'none', autocomplete: 'off', readOnly: true });
    this.#element.append(this.#numbers, this.#field);
    this.#field.addEventListener('input', () => this.#changed());
    this.#field.addEventListener('scroll', () => { this.#numbers.scrollTop = this.#field.scrollTop; });
    this.#field.addEventListener('keydown', (event) => this.#press(event));
  }

  get element() { return this.#element; }
  get isPlain() { return true; }
  get text() { return this.#field.value; }

  show(text, _path) {
    this.#field.value = text;
    this.#field.scrollTo(0, 0);
    this.#wrong = null;
    this.#number();
  }

  set readOnly(yes) { this.#field.readOnly = yes; }
  set label(text) { this.#field.setAttribute('aria-label', text); }

  mark(line) {
    this.#wrong = line;
    this.#number();
  }

  reveal(line) {
    const { scrollHeight, clientHeight } = this.#field;
    this.#field.scrollTop = scrollHeight * (line / this.#numbers.childElementCount) - clientHeight / 2;
  }

  focus() { this.#field.focus(); }

  // Tab indents; Escape, then Tab leaves the text, as in other editors.
  #press(event) {
    const { key, ctrlKey, metaKey, shiftKey } = event;
    const escaped = this.#field.dataset.escaped !== undefined;
    delete this.#field.dataset.escaped;
    if (this.#field.readOnly)
      return;
    if (this.#run !== undefined && (ctrlKey || metaKey) && (key === 's' || key === 'Enter'))
      this.#run();
    else if (key === 'Escape')
      return void (this.#field.dataset.escaped = '');
    else if (key === 'Tab' && !escaped)
      this.#indent(shiftKey);
    else if (key === 'Enter' && !ctrlKey && !metaKey)
      this.#breakLine();
    else
      return;
    event.preventDefault();
  }

  // By an edit command, so that the browser's own Undo knows of it.
  #insert(text) {
    if (!document.execCommand('insertText', false, text))
      this.#field.setRangeText(text, this.#field.selectionStart, this.#field.selectionEnd, 'end');
    this.#changed();
  }

  #breakLine() {
    const { value, selectionStart } = this.#field;
    const line = value.slice(value.lastIndexOf('\n', selectionStart - 1) + 1, selectionStart);
    const [indentation] = /^[ \t]*/.exec(line);
    this.#insert(`\n${indentation}${/:\s*(#.*)?$/.test(line) ? INDENTATION : ''}`);
  }

  #indent(back) {
    const { value, selectionStart, selectionEnd } = this.#field;
    const begin = value.lastIndexOf('\n', selectionStart - 1) + 1;
    const lines = value.slice(begin, selectionEnd);
    if (!back && !lines.includes('\n'))
      return this.#insert(INDENTATION);
    const moved = lines.split('\n').map((line) => (back ? line.replace(/^( {1,4}|\t)/, '') : INDENTATION + line)).join('\n');
    this.#field.setSelectionRange(begin, selectionEnd);
    this.#insert(moved);
    this.#field.setSelectionRange(begin, begin + moved.length);
  }

  #changed() {
    this.#number();
    this.#change();
  }

  #number() {
    const count = this.#field.value.split('\n').length;
    this.#numbers.replaceChildren(...Array.from({ length: count }, (_, i) => {
      const number = document.createElement('span');
      number.textContent = i + 1;
      number.classList.toggle('wrong', i + 1 === this.#wrong);
      return number;
    }));
    this.#numbers.scrollTop = this.#field.scrollTop;
  }
}
