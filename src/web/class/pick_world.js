// Worlds in the form that opens a class, with their pictures: a press puts the address of one into the field. Touches the DOM.

import { worldPicture } from './view/drawing.js';
import { fetchAgain } from './view/fetch_again.js';
import { titleOf } from './view/world_lists.js';

const LIST = new URL('../viewer/worlds/list.json', location.href); // whether this is part of a bundle or not
const shown = new Map(); // worlds by their places

// Those of the site's gallery. `place` is hidden while it lists none. Resolves when they are there.
export async function offerWorlds(place, field) {
  const { worlds } = await fetchAgain(LIST, { cache: 'no-cache' })
    .then((response) => (response.ok ? response.json() : {}))
    .catch(() => ({}));
  showPicks(place, field, Array.isArray(worlds) ? worlds : []);
  field.addEventListener('input', () => mark(place, field));
}

export function showPicks(place, field, worlds) {
  place.replaceChildren(...worlds.map((world, number) => {
    const { url } = world;
    const button = document.createElement('button');
    button.type = 'button';
    button.dataset.url = url;
    const name = document.createElement('span');
    name.textContent = titleOf(world);
    button.append(worldPicture(world, number, LIST), name);
    button.addEventListener('click', () => {
      field.value = url;
      mark(place, field);
    });
    return button;
  }));
  shown.set(place, worlds);
  place.hidden = worlds.length === 0;
  mark(place, field);
}

// In the language of the page.
export function sayPicks() {
  for (const [place, worlds] of shown)
    worlds.forEach((world, number) => { place.children[number].querySelector('span').textContent = titleOf(world); });
}

function mark(place, field) {
  for (const button of place.children)
    button.setAttribute('aria-pressed', String(button.dataset.url === field.value.trim()));
}
