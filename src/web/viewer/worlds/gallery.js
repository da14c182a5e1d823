// The gallery: the worlds that this site shows, each a link that starts it in the viewer. What there is says list.json; with `?of=` in the address
// of the page it is the worlds of that repository, or folder of one.

import { folderIn, sessionServerOf, webToSocket } from '../view/address.js';
import { Availability, lightText } from '../view/availability.js';
import { worldPicture } from '../view/drawing.js';
import { fetchAgain } from '../view/fetch_again.js';
import { loadPageTexts, offerLanguages } from '../view/page_texts.js';
import { say } from '../view/texts.js';
import { aboutOf, titleOf, worldsOf } from '../view/world_lists.js';

await loadPageTexts();

const UPDATE_MS = 10000; // machines that have just been started tell their worlds soon

const page = document.body;
const folder = new URLSearchParams(location.search).get('of') ?? '';
let shown = '';
let sayFolder = () => '';
let listed = [];
const element = (id) => document.getElementById(id);
const copyOf = (id) => element(id).content.cloneNode(true).firstElementChild;
const startOf = (url) => `../?${new URLSearchParams({ url, start: '' })}`;
const listOf = (address) => `./?${new URLSearchParams({ of: address })}`;

function sayLight() {
  const text = lightText(page.dataset.site, 'room' in page.dataset);
  if (element('light-text').textContent !== text)
    element('light-text').textContent = text;
}

function card(world, number) {
  const text = aboutOf(world);
  const item = copyOf('card');
  const link = item.querySelector('a');
  link.href = startOf(world.url);
  link.setAttribute('aria-describedby', `about-${number}`);
  item.querySelector('.picture').prepend(worldPicture(world, number, location));
  item.querySelector('.name').textContent = titleOf(world);
  const about = item.querySelector('.about');
  about.id = `about-${number}`;
  about.textContent = text ?? '';
  about.hidden = text === undefined;
  return item;
}

// Worlds of one group stand together, in the order of the list; those of none are the first ones.
function show(worlds) {
  listed = worlds;
  const href = document.activeElement?.href; // of the card that has the focus, which it keeps
  const groups = new Map([['', []]]);
  worlds.forEach((world, number) => {
    const group = world.group ?? '';
    groups.set(group, [...groups.get(group) ?? [], card(world, number)]);
  });
  element('groups').replaceChildren(...Array.from(groups).filter(([, cards]) => cards.length > 0).map(([name, cards]) => {
    const section = copyOf('group');
    section.querySelector('h2').textContent = name;
    section.querySelector('h2').hidden = name === '';
    section.querySelector('ul').append(...cards);
    return section;
  }));
  Array.from(element('groups').querySelectorAll('a')).find((link) => link.href === href)?.focus({ preventScroll: true });
  element('nothing').hidden = worlds.length > 0;
  page.dataset.worlds = worlds.length;
}

const askedList = () => fetchAgain('list.json', { cache: 'no-cache' }).then((response) => (response.ok ? response.json() : {})).catch(() => ({}));

async function update() {
  const { worlds, site } = await askedList();
  page.toggleAttribute('data-room', site?.waiting === true);
  sayLight();
  const text = JSON.stringify(worlds ?? []);
  if (text === shown || (worlds === undefined && shown !== ''))
    return;
  shown = text;
  show(worlds ?? []);
}

function tell(says) {
  sayFolder = says;
  element('folder-text').textContent = says();
}

// In place of the site's own worlds.
async function look(server) {
  element('lead').hidden = true;
  element('folder').hidden = false;
  element('address').value = folder;
  tell(() => say('gallery.looking', { address: folder }));
  page.dataset.looking = '';
  const { worlds, trouble } = await worldsOf(server, folder);
  tell(() => (trouble === '' ? say('gallery.worldsOf', { address: folder }) : ''));
  element('trouble').textContent = trouble;
  element('trouble').hidden = trouble === '';
  show(worlds);
  element('nothing').hidden = true;
  delete page.dataset.looking;
}

const ownServer = sessionServerOf(new URL('../..', location.href));
new Availability((value, state) => {
  page.dataset.availability = value;
  page.dataset.site = state;
  sayLight();
}).follow(webToSocket(ownServer));
offerLanguages(element('language'), () => {
  sayLight();
  tell(sayFolder);
  if (listed.length > 0)
    show(listed);
});
element('other').addEventListener('submit', (event) => {
  event.preventDefault();
  const url = element('address').value.trim();
  const place = folderIn(url);
  if (url !== '')
    location.assign(place === '' ? startOf(url) : listOf(place));
});
if (folder !== '') {
  page.toggleAttribute('data-room', (await askedList()).site?.waiting === true);
  sayLight();
  await look(ownServer);
} else {
  await update();
  setInterval(() => document.hidden || update(), UPDATE_MS);
}
