// What a simulation writes over its picture. Touches the DOM.
//
// `label:<id>;<font>;<colour>;<size>;<x>;<y>;<text>` (old simulators), and the labels of a state: objects with id, font, rgba
// ("r,g,b,a" from 0 to 1), size, x, y (both from 0 to 1 of the picture) and text. An empty text takes a label away.

const MOST = 200;
const LONGEST = 1000;

export class Labels {
  #layer;
  #labels = new Map();

  // `layer` covers the picture.
  constructor(layer) {
    this.#layer = layer;
  }

  // Takes the simulator's messages; those without labels change nothing.
  receive(message) {
    if (message.startsWith('label:'))
      return this.#set(parseLabel(message.slice('label:'.length)));
    if (message.startsWith('application/json:'))
      stateLabels(message).forEach((label) => this.#set(label));
    else if (message.startsWith('delete world') || message.startsWith('model:'))
      this.clear();
  }

  // Labels of a state, as objects; one without a text is taken away.
  show(labels) {
    for (const { id, font, rgba, color, size, x, y, text } of labels)
      this.#set(label(id, font, rgba ?? color, size, x, y, text));
  }

  clear() {
    this.#labels.clear();
    this.#layer.replaceChildren();
  }

  #set({ id, font, colour, size, x, y, text }) {
    if (text === '') {
      this.#labels.get(id)?.remove();
      return this.#labels.delete(id);
    }
    let element = this.#labels.get(id);
    if (element === undefined) {
      if (this.#labels.size >= MOST)
        return;
      element = this.#layer.appendChild(document.createElement('span'));
      this.#labels.set(id, element);
    }
    element.textContent = text.slice(0, LONGEST);
    Object.assign(element.style, { position: 'absolute', whiteSpace: 'pre', left: `${100 * x}%`, top: `${100 * y}%`, color: colour, fontFamily: `${JSON.stringify(font)}, sans-serif`,
      fontSize: `${100 * size}cqh` }); // set from a script, which a Content-Security-Policy allows
  }
}

function stateLabels(message) {
  try {
    const { labels } = JSON.parse(message.slice('application/json:'.length));
    return Array.isArray(labels) ? labels.map(({ id, font, rgba, size, x, y, text }) =>
      label(id, font, rgba, size, x, y, text)) : [];
  } catch {
    return []; // whoever shows the state says so
  }
}

function parseLabel(rest) {
  const [id, font, colour, size, x, y, ...text] = rest.split(';');
  return label(id, font, colour, size, x, y, text.join(';'));
}

const label = (id, font, colour, size, x, y, text) =>
  ({ id: String(id), font: String(font), colour: cssColour(String(colour)), size: part(size), x: part(x), y: part(y), text: String(text ?? '') });

const part = (number) => Math.min(1, Math.max(0, Number(number) || 0));

// "1,0,0,1" or "rgba(1,0,0,1)": red.
function cssColour(text) {
  const [red = 0, green = 0, blue = 0, alpha = 1] = text.replace(/^rgba?\(|\)$/g, '').split(',').map(Number).map(part);
  return `rgb(${[red, green, blue].map((value) => Math.round(255 * value)).join(' ')} / ${alpha})`;
}
