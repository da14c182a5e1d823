// The worlds of the site's gallery in the form that opens a class: a press puts the address of one into the field. Touches the DOM.

import { worldPicture } from './view/drawing.js';
import { fetchAgain } from './view/fetch_again.js';

const LIST = new URL('../viewer/worlds/list.json', location.href); // whether this is part of a bundle or not

// `place` is hidden while the site lists no worlds. Resolves when they are there.
export async function offerWorlds(place, field) {
  const { worlds } = await fetchAgain(LIST, { cache: 'no-cache' })
    .then((response) => (response.ok ? response.json() : {}))
    .catch(() => ({}));
  const picks = (Array.isArray(worlds) ? worlds : []).map((world, number) => {
    const { url, title } = world;
    const button = document.createElement('button');
    button.type = 'button';
    button.dataset.url = url;
    const name = document.createElement('span');
    name.textContent = title;
    button.append(worldPicture(world, number, LIST), name);
    button.addEventListener('click', () => {
      field.value = url;
      mark();
    });
    return button;
  });
  const mark = () => {
    for (const button of picks)
      button.setAttribute('aria-pressed', String(button.dataset.url === field.value.trim()));
  };
  field.addEventListener('input', mark);
  mark();
  place.replaceChildren(...picks);
  place.hidden = picks.length === 0;
}
