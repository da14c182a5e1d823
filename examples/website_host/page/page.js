// The page: shows a simulation, and lets who has signed in change its controller. View and editor come from the session server.

const element = (id) => document.getElementById(id);
const say = (text, isProblem = false) => {
  element('status').textContent = text;
  element('status').classList.toggle('problem', isProblem);
};

// How it is shown: `?mode=w3d` for a scene that the browser draws; by default it is a picture.
const MODE = new URLSearchParams(location.search).get('mode') ?? undefined;

const files = new Map(); // texts of the controller's files, by name
let view = null;
let editor = null;
let project = null; // of the simulation that runs
let site = null;
let changed = false; // since the file was saved

async function main() {
  site = await getSite();
  for (const { name, title } of site.projects)
    element('project').append(new Option(title, name));
  element('hint').textContent = site.hint;
  showUser();
  element('sign-in').addEventListener('submit', signIn);
  element('sign-out').addEventListener('submit', signOut);
  element('start').addEventListener('click', start);
  element('save').addEventListener('click', save);
  element('reset').addEventListener('click', () => {
    view.reset();
    say('The simulation begins again.');
  });
  element('file').addEventListener('change', () => showFile(element('file').value));
  addEventListener('beforeunload', (event) => changed && event.preventDefault());
  await loadView();
  refresh();
}

async function getSite() {
  const response = await fetch('/site.json');
  if (!response.ok)
    throw new Error(await response.text());
  return response.json();
}

// What shows simulations and what edits text are those of the session server's own pages.
async function loadView() {
  const folder = `${site.sessionServer.replace(/^ws/, 'http')}/view`;
  try {
    const modules = ['webots_view.js', 'availability.js', 'poster.js', 'texts.js', 'text_editor.js'].map((name) => import(`${folder}/${name}`));
    const [{ View }, { Availability, siteText }, { showPoster }, { loadTexts }, { createTextEditor }] = await Promise.all(modules);
    await loadTexts();
    showPoster(element('poster'));
    editor = await createTextEditor({ change: edited });
    editor.label = 'Text of the controller';
    element('editor').append(editor.element);
    element('plain').hidden = !editor.isPlain;
    view = new View(element('view'), matchMedia('(pointer: coarse)').matches);
    const show = (_, state) => element('availability').textContent = siteText(state);
    new Availability(show).follow(`${site.sessionServer}/`);
  } catch (error) {
    throw new Error(`The session server at ${folder} can not be reached. Please try again later.`, { cause: error });
  }
  view.showQuit = false; // there is a button of the page, which starts, too
  view.offersStart = false;
  view.runOnLoad = true;
  view.setTimeout(600);
  view.onready = () => view.getController(project.controller);
  view.oncontroller = receiveFile;
  view.onstate = refresh;
  view.onclose = refresh;
}

function edited() {
  changed = true;
  refresh();
}

function showUser() {
  const { user } = site;
  element('sign-in').hidden = user !== undefined;
  element('sign-out').hidden = user === undefined;
  element('user').textContent = user === undefined ? '' : `Signed in as ${user.name}`;
  // Sent to the simulation server, which asks this website for the user's project.
  Object.assign(globalThis.webots ??= {}, { User1Id: user?.id, User1Name: user?.name, User1Authentication: user?.authentication });
}

async function signIn(event) {
  event.preventDefault();
  const response = await fetch('/ajax/sign-in', { method: 'POST', body: new URLSearchParams(new FormData(event.target)) });
  if (!response.ok)
    return say(await response.text(), true);
  site = await getSite();
  showUser();
  refresh();
  say(isOpen() ? 'You are signed in. Stop and start the simulation to change its controller.' : 'You are signed in.');
}

async function signOut(event) {
  event.preventDefault();
  const response = await fetch('/ajax/sign-out', { method: 'POST', body: new URLSearchParams(new FormData(event.target)) });
  if (!response.ok)
    return say(await response.text(), true);
  site = await getSite();
  showUser();
  refresh();
  say('You are signed out.');
}

const WORDS = { starting: 'Cancel', waiting: 'Leave the line', paused: 'Stop', running: 'Stop', fast: 'Stop', lost: 'Stop' };
const isOpen = () => view !== null && view.state in WORDS;
const isRunning = () => isOpen() && !['starting', 'waiting'].includes(view.state);

function start({ detail: clicks }) {
  if (clicks > 1)
    return; // a second click, which would undo the first
  if (isOpen()) {
    view.close();
    return;
  }
  element('poster')?.remove(); // the view has its own
  project = site.projects.find(({ name }) => name === element('project').value);
  files.clear();
  element('file').replaceChildren();
  editor.show('', '');
  changed = false;
  say('');
  view.open(`${site.sessionServer}/${project.name}/worlds/${project.world}`, MODE);
  refresh();
}

// The simulator sends the files of the controller, the main one first.
function receiveFile({ controller, file, content }) {
  if (controller !== project.controller)
    return;
  if (!files.has(file))
    element('file').append(new Option(file, file));
  files.set(file, content);
  if (files.size === 1)
    showFile(file);
  refresh();
}

function showFile(name) {
  editor.show(files.get(name), name);
  changed = false;
  element('file').value = name;
  refresh();
}

async function save() {
  const name = element('file').value;
  const text = editor.text;
  element('save').disabled = true;
  try {
    await view.saveController(project.controller, name, text); // to the website, then to the simulator
    files.set(name, text);
    changed = editor.text !== text;
    say(`${name} is saved. Reset the simulation to see what it does.`);
  } catch (error) {
    say(`${name} is not saved. ${error.message}`, true);
  }
  refresh();
}

function refresh() {
  const mayEdit = isRunning() && site.user !== undefined && files.size > 0;
  element('start').disabled = view === null;
  element('start').textContent = isOpen() ? WORDS[view.state] : 'Start';
  element('start').classList.toggle('leave', isOpen());
  element('project').disabled = isOpen();
  element('file').disabled = files.size < 2 || changed;
  element('save').disabled = !mayEdit || !changed;
  element('reset').disabled = !isRunning();
  if (editor !== null)
    editor.readOnly = !mayEdit;
}

main().catch((error) => {
  console.error(error);
  say(error.message, true);
});
