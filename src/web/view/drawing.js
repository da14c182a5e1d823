// Pictures of worlds. Of a world of which there is none it draws one: a floor, some boxes and a robot on its way, always the same for the same address.
// The colours are those of the page (drawing.css). Touches the DOM.

const SVG = 'http://www.w3.org/2000/svg';
const TONES = 6;
const WIDE = 6; // of the floor, in units
const DEEP = 4;
const UNIT = 26;
const ORIGIN = { x: 134, y: 43 };

// Where a point of the world is in the picture, seen from above at a corner.
const at = (x, y, z = 0) => [ORIGIN.x + (x - y) * UNIT, ORIGIN.y + (x + y) * UNIT / 2 - z * UNIT].map((value) => value.toFixed(1)).join(',');

// The same numbers from 0 to 1 for the same text (FNV-1a, then mulberry32).
function numbersOf(text) {
  let state = 2166136261;
  for (let i = 0; i < text.length; ++i)
    state = Math.imul(state ^ text.charCodeAt(i), 16777619);
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
  };
}

function shape(parent, name, className, attributes) {
  const element = document.createElementNS(SVG, name);
  element.setAttribute('class', className);
  for (const [key, value] of Object.entries(attributes))
    element.setAttribute(key, value);
  parent.append(element);
}

const face = (parent, className, points) => shape(parent, 'polygon', className, { points: points.join(' ') });

function box(parent, { x, y, wide, deep, high }) {
  const [right, front] = [x + wide, y + deep];
  face(parent, 'left', [at(x, front), at(right, front), at(right, front, high), at(x, front, high)]);
  face(parent, 'right', [at(right, y), at(right, front), at(right, front, high), at(right, y, high)]);
  face(parent, 'top', [at(x, y, high), at(right, y, high), at(right, front, high), at(x, front, high)]);
}

function floor(parent) {
  face(parent, 'floor', [at(0, 0), at(WIDE, 0), at(WIDE, DEEP), at(0, DEEP)]);
  for (let x = 1; x < WIDE; ++x)
    shape(parent, 'path', 'grid', { d: `M${at(x, 0)}L${at(x, DEEP)}` });
  for (let y = 1; y < DEEP; ++y)
    shape(parent, 'path', 'grid', { d: `M${at(0, y)}L${at(WIDE, y)}` });
  box(parent, { x: 0, y: -0.15, wide: WIDE, deep: 0.15, high: 0.45 });
  box(parent, { x: -0.15, y: -0.15, wide: 0.15, deep: DEEP + 0.15, high: 0.45 });
}

function robot(parent, { x, y }) {
  const [middle, ground] = at(x, y).split(',').map(Number);
  shape(parent, 'ellipse', 'shadow', { cx: middle, cy: ground + 2, rx: 17, ry: 8.5 });
  shape(parent, 'rect', 'wheel', { x: middle - 16, y: ground - 9, width: 6, height: 13, rx: 3 });
  shape(parent, 'rect', 'wheel', { x: middle + 10, y: ground - 9, width: 6, height: 13, rx: 3 });
  shape(parent, 'path', 'body', { d: `M${middle - 14} ${ground - 18}v14a14 7 0 0 0 28 0v-14z` });
  shape(parent, 'ellipse', 'head', { cx: middle, cy: ground - 18, rx: 14, ry: 7 });
  shape(parent, 'circle', 'eye', { cx: middle - 5, cy: ground - 6, r: 2.4 });
  shape(parent, 'circle', 'eye', { cx: middle + 5, cy: ground - 6, r: 2.4 });
}

// Free squares of the floor, and the robot's way over one side of it.
function scene(next) {
  const isAhead = next() < 0.5; // the way is in front of the boxes, or behind them
  const row = isAhead ? DEEP - 0.8 : 0.9;
  const turn = 1.2 + next() * 3;
  const end = { x: 1.1 + next() * (WIDE - 2.2), y: row };
  const boxes = [];
  const count = 2 + Math.floor(next() * 3);
  for (let i = 0; i < count; ++i) {
    const [wide, deep] = [0.5 + next() * 0.7, 0.5 + next() * 0.5];
    const left = 0.3 + (i + 0.1 + next() * 0.3) * (WIDE - 0.6) / count;
    boxes.push({ x: Math.min(left, WIDE - wide - 0.2), y: (isAhead ? 0.3 : 1.9) + next() * 0.7, wide, deep, high: 0.4 + next() * 1.1 });
  }
  return { isAhead, end, boxes, way: `M${at(turn, isAhead ? DEEP : 0)}Q${at(turn, row)} ${at(end.x, row)}` };
}

// `text`: the address of the world; `number`: its place in the list, so that neighbours differ in colour. The picture is nothing to read.
function drawing(text, number) {
  const next = numbersOf(text);
  const picture = document.createElementNS(SVG, 'svg');
  picture.setAttribute('viewBox', '0 0 320 180');
  picture.setAttribute('preserveAspectRatio', 'xMidYMid slice');
  picture.setAttribute('aria-hidden', 'true');
  picture.setAttribute('class', `drawing tone-${number % TONES}`);
  const { isAhead, end, boxes, way } = scene(next);
  shape(picture, 'rect', 'sky', { width: 320, height: 180 });
  floor(picture);
  shape(picture, 'path', 'way', { d: way });
  if (!isAhead)
    robot(picture, end);
  for (const each of boxes.sort((one, other) => one.x + one.y - other.x - other.y))
    box(picture, each);
  if (isAhead)
    robot(picture, end);
  return picture;
}

// The picture of a world of the list at the address `list`: its own, or a drawing: until there is one, and where it does not arrive.
export function worldPicture({ url, picture }, number, list) {
  const drawn = drawing(url, number);
  if (picture === undefined)
    return drawn;
  const image = new Image();
  image.alt = '';
  image.addEventListener('error', () => image.replaceWith(drawn));
  image.src = new URL(picture, list).href;
  return image;
}
