// The live 3D scene of a simulation, or one from a file, drawn in the browser. Touches the DOM.
//
// The library that draws, X_ITE, is fetched when the first scene is shown; a build may lack it. See docs/decisions/012-scenes.md.

import { Animation } from './animation.js';
import { fetchAgain } from './fetch_again.js';
import { Labels } from './labels.js';
import { Player } from './player.js';
import { shrink } from './snapshot.js';
import { say } from './texts.js';
import { fieldOf, SceneTranslation } from './x3d_scene.js';

const LIBRARY = new URL('x_ite/x_ite.min.mjs', import.meta.url);
const MAX_PIXELS = 1920 * 1200; // As of pictures: more costs much, and shows little.
const MAX_WAITING = 100000; // nodes with updates that are not shown yet, and nodes to add or to remove
const NARROWEST = 3 / 4; // width to height
const FILL = 0.4; // of the light that comes from all sides; Webots takes that from the background

let library = null; // a promise
let drawable; // whether the browser has WebGL 2
let embedded; // whether the server has the library; not known while it cannot be asked

export class Scene {
  #container;
  #surface = document.createElement('div');
  #layer = document.createElement('div');
  #labels = new Labels(this.#layer);
  #player = null;
  #problem = document.createElement('p');
  #told;
  #X3D = null;
  #browser = null;
  #canvas = null;
  #base = '';
  #translation = null;
  #world = null;
  #nodes = new Map(); // by their names
  #updates = new Map(); // fields by the number of the node, to be shown in the next frame
  #frame = 0;
  #work = Promise.resolve(); // what is loaded, added and removed, one after the other
  #waiting = 0;
  #shown = 0; // counts what is shown and hidden: work for an earlier one is dropped

  // Makes an element in `container`, whose size the scene takes. `told` is called with a sentence when something cannot be shown.
  constructor(container, { told = () => {} } = {}) {
    this.#container = container;
    this.#told = told;
    this.#surface.hidden = true;
    Object.assign(this.#surface.style, { position: 'relative', width: '100%', height: '100%', overflow: 'hidden', touchAction: 'none' });
    Object.assign(this.#layer.style, { position: 'absolute', inset: '0', pointerEvents: 'none', overflow: 'hidden', containerType: 'size' });
    Object.assign(this.#problem.style, { position: 'absolute', inset: '0', margin: '0', padding: '1rem', display: 'grid', placeItems: 'center', textAlign: 'center' });
    this.#problem.hidden = true;
    this.#surface.setAttribute('role', 'application');
    this.#surface.append(this.#layer, this.#problem);
    container.prepend(this.#surface);
    new ResizeObserver(() => this.#fit()).observe(container);
  }

  // The element that shows the scene: for an id, a class or a description.
  get element() { return this.#surface; }

  // In device pixels.
  get size() {
    const { clientWidth: width, clientHeight: height } = this.#container;
    const scale = this.#scale();
    return { width: Math.max(1, Math.round(width * scale)), height: Math.max(1, Math.round(height * scale)) };
  }

  // Resolves to a sentence that says why this build, this browser or the network does not let scenes be shown, or to an empty one.
  static async missing() {
    drawable ??= document.createElement('canvas').getContext('webgl2') !== null;
    if (!drawable)
      return say('scene.noWebgl');
    return await hasLibrary() ? '' : sayWithoutLibrary();
  }

  // `source` is {url}: the address of the simulator, which the files of the scene are relative to. The scene comes by receive().
  // Messages need not be sent: everybody has a camera of their own.
  show({ url }) {
    this.#begin(new URL('./', url.replace(/\/*$/, '/')).href);
    this.#do((shown) => this.#prepare(shown));
  }

  // Shows an exported scene, and the animation beside it (file.json for file.x3d), if there is one. `animation` may name another
  // one: {url, play, loop}. Resolves when the scene is shown; an Error has a sentence for people.
  open(url, animation = null) {
    const address = new URL(url, document.baseURI);
    this.#begin(new URL('./', address).href);
    const shown = this.#shown;
    return new Promise((resolve, reject) => {
      this.#do(async () => {
        try {
          await this.#prepare(shown);
          await this.#load(await read(address), shown);
          await this.#animate(address, animation, shown);
          resolve();
        } catch (error) {
          reject(new Error(sentence(error)));
          throw error;
        }
      });
    });
  }

  // Of what open() has opened; null without an animation.
  get player() { return this.#player; }

  // Says what this is, in the language of the page.
  sayName() {
    this.#surface.setAttribute('aria-label', say('scene.name'));
    this.#player?.sayNames();
  }

  // The scene in at most this many pixels, as an OffscreenCanvas; null while there is none. What is drawn can be read until the frame
  // is shown, so this waits for the next one, which a hidden page does not have.
  async snapshot(limits) {
    if (this.#world === null || this.#waiting !== 0)
      return null;
    await this.#browser.nextFrame();
    return this.#world === null ? null : shrink(this.#browser.getContext().canvas, limits);
  }

  hide() {
    this.#forget();
    this.#surface.hidden = true;
  }

  // An event of Simulator: model {text}, update {updates, labels}, label {id, ...}, node {parent, text}, delete {id}.
  receive(type, detail) {
    switch (type) {
      case 'model': return this.#do((shown) => this.#load(detail.text, shown));
      case 'node': return this.#do(() => this.#add(detail.parent, detail.text));
      case 'delete': return this.#do(() => this.#remove(detail.id));
      case 'label': return this.#labels.show([detail]);
      case 'update':
        this.#labels.show(detail.labels);
        return detail.updates.forEach((update) => this.#note(update));
    }
  }

  // --- what is done one after the other

  #do(action) {
    if (this.#waiting >= MAX_WAITING)
      return;
    ++this.#waiting;
    const shown = this.#shown;
    this.#work = this.#work.then(async () => {
      if (shown === this.#shown)
        await action(shown);
    }).catch((error) => this.#fail(error, shown)).finally(() => {
      --this.#waiting;
      this.#askForFrame();
    });
  }

  #fail(error, shown) {
    if (shown !== this.#shown)
      return;
    this.#problem.textContent = sentence(error);
    this.#problem.hidden = false;
    this.#told(this.#problem.textContent);
    console.error(error);
  }

  async #prepare(shown) {
    if (this.#browser !== null)
      return;
    if (document.createElement('canvas').getContext('webgl2') === null)
      throw new SceneError(say('scene.noWebgl'));
    library ??= import(LIBRARY).then(withoutFonts, async () => {
      library = null;
      await hasLibrary();
      throw new SceneError(sayWithoutLibrary());
    });
    const { default: X3D } = await library;
    if (shown !== this.#shown)
      return;
    this.#X3D = X3D;
    this.#canvas = document.createElement('x3d-canvas');
    for (const name of ['splashScreen', 'notifications', 'contextMenu', 'timings'])
      this.#canvas.setAttribute(name, 'false');
    Object.assign(this.#canvas.style, { display: 'block', width: '100%', height: '100%', border: 'none', outline: 'none' });
    this.#surface.prepend(this.#canvas);
    this.#browser = X3D.getBrowser(this.#canvas);
    this.#browser.setBrowserOption('StraightenHorizon', false);
  }

  async #load(text, shown) {
    this.#clear();
    if (text.trim() === '' || this.#browser === null)
      return;
    const translation = new SceneTranslation(this.#base);
    const world = await this.#read(translation.world(text));
    if (shown !== this.#shown)
      return world.dispose();
    const old = this.#world;
    this.#translation = translation;
    this.#world = world;
    this.#remember(world);
    this.#light();
    this.#fit();
    await this.#browser.replaceWorld(world);
    old?.dispose();
    if (translation.unknown.size !== 0)
      this.#told(say('scene.partly', { nodes: [...translation.unknown].join(', ') }));
  }

  #read(text) {
    return this.#browser.createX3DFromString(text);
  }

  // Without a light of its own a world is lit from the camera; otherwise a little from all sides, as Webots does.
  #light() {
    const navigation = this.#world.createNode('NavigationInfo');
    navigation.type = new this.#X3D.MFString('EXAMINE', 'ANY');
    navigation.headlight = !this.#translation.hasLights;
    this.#world.rootNodes.push(navigation);
    if (navigation.headlight)
      return;
    for (const side of [1, -1]) {
      const light = this.#world.createNode('DirectionalLight');
      light.direction = new this.#X3D.SFVec3f(side * 0.8, side * 0.5, side * -0.3);
      light.intensity = FILL;
      light.global = true;
      this.#world.rootNodes.push(light);
    }
  }

  // Adds what the server has made, to the node `parent`, or to the world (0).
  async #add(parent, text) {
    if (this.#world === null)
      return;
    const added = await this.#read(this.#translation.nodes(text));
    const children = parent === 0 ? this.#world.rootNodes : this.#node(`n${parent}`)?.children;
    if (children === undefined)
      return added.dispose();
    this.#remember(added);
    children.push(...added.rootNodes);
  }

  #remove(id) {
    const name = `n${id}`;
    const node = this.#node(name);
    if (node === null)
      return;
    this.#nodes.delete(name);
    this.#updates.delete(id);
    node.dispose();
  }

  // --- updates: only the latest of each field is shown

  #note({ id, ...fields }) {
    const known = this.#updates.get(id);
    if (known !== undefined)
      Object.assign(known, fields);
    else if (this.#updates.size < MAX_WAITING)
      this.#updates.set(id, fields);
    this.#askForFrame();
  }

  #askForFrame() {
    if (this.#frame === 0 && this.#updates.size !== 0 && this.#waiting === 0)
      this.#frame = requestAnimationFrame(() => this.#apply());
  }

  #apply() {
    this.#frame = 0;
    if (this.#waiting !== 0 || this.#world === null)
      return; // #do() asks for a frame again
    for (const [id, fields] of this.#updates)
      for (const name in fields)
        this.#set(`n${id}`, name, fields[name]);
    this.#updates.clear();
  }

  #set(name, webotsField, text) {
    const target = fieldOf(webotsField);
    const node = this.#target(name, target);
    if (node !== null)
      node[target.field] = this.#value(target, String(text));
  }

  // The node that has the field, if there is one.
  #target(name, target) {
    const node = target === null ? null : this.#node(name + target.suffix) ?? this.#node(name);
    return node !== null && target.field in node ? node : null;
  }

  #value({ field, kind }, text) {
    const X3D = this.#X3D;
    if (kind === 'flag')
      return !/^(false|0)$/i.test(text.trim());
    if (kind === 'orientation')
      return new X3D.SFRotation(...numbers(this.#translation.orientation(text)));
    const values = numbers(text);
    switch (kind) {
      case 'rotation': return new X3D.SFRotation(...values);
      case 'colour': return field === 'skyColor' ? new X3D.MFColor(new X3D.SFColor(...values)) : new X3D.SFColor(...values);
      case 'vector': return new X3D.SFVec3f(...values);
      default: return values[0];
    }
  }

  #node(name) {
    return this.#nodes.get(name) ?? null;
  }

  #remember(scene) {
    for (const node of scene.namedNodes)
      this.#nodes.set(node.getNodeName(), node);
  }

  // --- an animation

  async #animate(address, animation, shown) {
    const file = animation?.url === undefined ? new URL(address) : new URL(animation.url, document.baseURI);
    if (animation?.url === undefined)
      file.pathname = file.pathname.replace(/\.[^./]*$/, '.json');
    const response = await fetch(file).catch(() => null);
    if (animation?.url === undefined && !response?.ok)
      return; // there is none
    let moves;
    try {
      moves = new Animation(await response.json(), (id, name) => this.#written(id, name));
    } catch {
      throw new SceneError(say('scene.noAnimation', { file: file.href }));
    }
    if (shown !== this.#shown)
      return;
    this.#player = new Player(this.#surface, moves, ({ updates, labels }) => {
      this.#labels.show(labels);
      updates.forEach((update) => this.#note(update));
    }, animation ?? {});
  }

  // A field of a node as it is now, as updates have it.
  #written(id, webotsField) {
    const target = fieldOf(webotsField);
    const node = this.#target(`n${id}`, target);
    return node === null || target.kind === 'orientation' ? undefined : String(node[target.field]);
  }

  // ---

  #clear() {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.#updates.clear();
    this.#nodes.clear();
    this.#labels.clear();
    this.#problem.hidden = true;
  }

  #begin(base) {
    this.#forget();
    this.#base = base;
    this.sayName();
    this.#surface.hidden = false;
  }

  #forget() {
    ++this.#shown;
    this.#player?.close();
    this.#player = null;
    this.#clear();
    const [browser, world] = [this.#browser, this.#world];
    this.#world = this.#translation = null;
    if (world !== null)
      this.#work = this.#work.then(() => browser.replaceWorld(null)).then(() => world.dispose(), console.error);
  }

  #scale() {
    const { clientWidth, clientHeight } = this.#container;
    return Math.min(devicePixelRatio, Math.sqrt(MAX_PIXELS / Math.max(1, clientWidth * clientHeight)));
  }

  // Webots' angle of view is that of the longer side, X3D's that of the shorter. On a high and narrow screen as much is seen from side to
  // side as on a tablet: worlds are made for wide ones.
  #fit() {
    const { clientWidth: width, clientHeight: height } = this.#container;
    if (this.#browser === null || width === 0 || height === 0)
      return;
    this.#browser.setBrowserOption('ContentScale', this.#scale());
    const viewpoint = this.#translation?.viewpoint;
    const node = viewpoint ? this.#node(viewpoint.name) : null;
    if (node !== null)
      node.fieldOfView = 2 * Math.atan(Math.tan(viewpoint.fieldOfView / 2) * (width < height ? Math.max(width / height, NARROWEST) : height / width));
  }
}

// An answer that neither a server with the library nor one without it gives, such as that of a proxy whose server is down, says nothing.
async function hasLibrary() {
  embedded ??= await fetchAgain(LIBRARY, { method: 'HEAD' }).then(({ ok, status }) => (ok || status === 404 ? ok : undefined), () => undefined);
  return embedded === true;
}

const sayWithoutLibrary = () => (embedded === false ? say('scene.noLibrary') : say('scene.notLoaded'));

// The fonts of the library's own menus, which are not shown, need not be fetched.
function withoutFonts(module) {
  for (const font of [...document.fonts])
    if (font.family.includes('X_ITE'))
      document.fonts.delete(font);
  return module;
}

class SceneError extends Error {}

const numbers = (text) => text.trim().split(/[\s,]+/).map(Number);

const sentence = (error) => (error instanceof SceneError ? error.message : say('scene.unreadable'));

async function read(address) {
  const response = await fetch(address).catch(() => null);
  if (!response?.ok)
    throw new SceneError(say('scene.noFile', { file: address.href }));
  return response.text();
}
