// What the simulation prints: the last lines only, always as text, never as markup.

const MOST_LINES = 1000;
const LONGEST_LINE = 4000;
const TERMINAL_COLOURS = /\x1b\[[0-9;]*[mK]/g;

export const withoutColours = (text) => text.replace(TERMINAL_COLOURS, '');

export class Console {
  #list;
  #pending = [];
  #frame = 0;

  constructor(list) {
    this.#list = list;
  }

  // Lines are shown with the next screen refresh, so that a flood of them costs one layout.
  print(stream, line) {
    this.#pending.push([stream, withoutColours(line).slice(0, LONGEST_LINE)]);
    if (this.#pending.length > MOST_LINES)
      this.#pending.shift();
    this.#frame ||= requestAnimationFrame(() => this.#flush());
  }

  clear() {
    this.#pending = [];
    this.#list.replaceChildren();
  }

  #flush() {
    this.#frame = 0;
    const list = this.#list;
    const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 8;
    list.append(...this.#pending.splice(0).map(element));
    while (list.childElementCount > MOST_LINES)
      list.firstElementChild.remove();
    if (atEnd)
      list.scrollTop = list.scrollHeight;
  }
}

function element([stream, line]) {
  const item = document.createElement('div');
  item.className = stream;
  item.textContent = line;
  return item;
}
