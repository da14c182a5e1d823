// Translates scenes of Webots (x3d, w3d and exported .x3d files) into standard X3D. What differs is in the tables below. Needs the
// browser's parser of XML, and touches no page.
//
// Webots' node n12 becomes a node of that name, or a wrapper of it that has the fields which change. FIELDS tells which field of which
// node an update means.

const QUARTER = Math.PI / 2;

// Nodes with a place of their own: solids, robots and devices. Whatever else has a translation counts as well.
const POSES = new Set(['Transform', 'Pose', 'Solid', 'Robot', 'Accelerometer', 'Altimeter', 'Camera', 'Charger', 'Compass', 'Connector',
  'Display', 'DistanceSensor', 'Emitter', 'Fluid', 'GPS', 'Gyro', 'InertialUnit', 'LED', 'Lidar', 'LightSensor', 'Pen', 'Radar', 'RangeFinder',
  'Receiver', 'Speaker', 'TouchSensor', 'Track', 'TrackWheel', 'VacuumGripper']);
// Nodes that only hold others.
const GROUPS = new Set(['Group', 'Slot', 'Propeller', 'HingeJoint', 'Hinge2Joint', 'SliderJoint', 'BallJoint']);
// Geometries that stand along z in Webots since R2022a, and along y in X3D.
const UPRIGHT = new Set(['Cylinder', 'Cone', 'Capsule']);
// What is not drawn, but told about: it needs files in formats that are not read here.
const FROM_FILES = new Set(['Mesh', 'CadShape']);

// Attributes that are copied: [name in Webots, name in X3D, Webots' default where it differs from X3D's].
const same = (...names) => names.map((name) => [name, name]);
const ATTRIBUTES = {
  Transform: same('translation', 'rotation', 'scale'),
  Material: same('ambientIntensity', 'diffuseColor', 'specularColor', 'emissiveColor', 'shininess', 'transparency'),
  PhysicalMaterial: [['baseColor', 'baseColor'], ['metalness', 'metallic', '1'], ['roughness', 'roughness', '0'], ['transparency', 'transparency'],
    ['emissiveColor', 'emissiveColor'], ['normalMapFactor', 'normalScale'], ['occlusionMapStrength', 'occlusionStrength']],
  TextureTransform: same('center', 'rotation', 'scale', 'translation'),
  Box: same('size'),
  Sphere: same('radius'),
  Cone: same('bottomRadius', 'height', 'side', 'bottom'),
  Cylinder: same('radius', 'height', 'side', 'bottom', 'top'),
  IndexedFaceSet: [...same('coordIndex', 'normalIndex', 'texCoordIndex', 'ccw', 'creaseAngle', 'normalPerVertex'), ['solid', 'solid', 'false']],
  IndexedLineSet: same('coordIndex'),
  PointSet: [],
  Coordinate: same('point'),
  TextureCoordinate: same('point'),
  Normal: same('vector'),
  Color: same('color'),
  DirectionalLight: [...same('on', 'color', 'intensity', 'ambientIntensity'), ['direction', 'direction', '0 0 -1']],
  PointLight: same('on', 'color', 'intensity', 'ambientIntensity', 'location', 'attenuation', 'radius'),
  SpotLight: [...same('on', 'color', 'intensity', 'ambientIntensity', 'location', 'attenuation', 'radius', 'beamWidth', 'cutOffAngle'),
    ['direction', 'direction', '0 0 -1']],
  Background: same('skyColor'),
  Fog: [...same('color', 'visibilityRange'), ['fogType', 'fogType']],
};
const CHILDREN = { IndexedFaceSet: ['Coordinate', 'Normal', 'TextureCoordinate'], IndexedLineSet: ['Coordinate'], PointSet: ['Coordinate', 'Color'] };
const LIGHTS = new Set(['DirectionalLight', 'PointLight', 'SpotLight']);
const FLAGS = new Set(['on', 'side', 'bottom', 'top', 'ccw', 'solid', 'normalPerVertex']);

// Textures of a PBRAppearance by what Webots calls their role ("type" up to R2023a), and their place in X3D.
const TEXTURES = { baseColor: 'baseTexture', normal: 'normalTexture', occlusion: 'occlusionTexture', emissiveColor: 'emissiveTexture' };

// The part of a node's name that has the fields of a material, where an update of its appearance belongs to.
export const MATERIAL = '-material';

export class SceneTranslation {
  #base;
  #upright = true;
  #held = 0;
  #kinds = new Map(); // of the nodes that have a name, what they have become

  // `base`: the address that those of textures are relative to.
  constructor(base) {
    this.#base = base;
    this.unknown = new Set(); // names of nodes that are not drawn
    this.viewpoint = null; // {name, fieldOfView}, its angle as Webots has it
    this.hasLights = false;
    this.title = '';
    this.basicTimeStep = 32;
  }

  // What Webots calls up: z since R2022a, y before.
  get zUp() { return this.#upright; }

  // The whole world, from the text of "model:" or of a file.
  world(text) {
    const xml = parse(text);
    const scene = xml.getElementsByTagName('Scene')[0] ?? xml.documentElement;
    this.#kinds.clear();
    this.#readWorldInfo(xml, scene);
    return x3d(this.#all(scene));
  }

  // What "node:" adds, to be put into the node that it names.
  nodes(text) {
    return x3d(this.#all(parse(text).documentElement));
  }

  #readWorldInfo(xml, scene) {
    const info = scene.getElementsByTagName('WorldInfo')[0];
    const version = [...xml.getElementsByTagName('meta')].find((meta) => meta.getAttribute('name') === 'version')?.getAttribute('content');
    this.#upright = info?.getAttribute('coordinateSystem') ? info.getAttribute('coordinateSystem') === 'ENU' : !(/^R\d{4}/.test(version ?? '') && version < 'R2022');
    this.title = info?.getAttribute('title') ?? '';
    this.basicTimeStep = Number(info?.getAttribute('basicTimeStep')) || 32;
  }

  #all(parent, ...rest) {
    return [...parent.children].map((child) => this.#node(child, ...rest)).join('');
  }

  #node(node) {
    const kind = node.tagName;
    if (node.getAttribute('role') === 'boundingObject')
      return '';
    const use = this.#use(node);
    if (kind === 'Shape')
      return this.#shape(node, use);
    if (POSES.has(kind) || (!(kind in ATTRIBUTES) && node.hasAttribute('translation')))
      return use ?? this.#element('Transform', node, '', turned(node, this.#all(node)));
    if (GROUPS.has(kind))
      return use ?? this.#element('Group', node, '', this.#all(node));
    if (kind === 'Billboard')
      return use ?? this.#heldBeforeTheCamera(node);
    if (LIGHTS.has(kind)) {
      this.hasLights = true;
      return use ?? this.#element(kind, node, ' global="true"');
    }
    if (kind === 'Viewpoint')
      return this.#viewpoint(node);
    if (kind === 'Background')
      return this.#element(kind, node);
    if (kind === 'Fog')
      return this.#element(kind, node).replace('EXPONENTIAL2', 'EXPONENTIAL');
    if (FROM_FILES.has(kind))
      this.unknown.add(kind);
    else if (this.#isGeometry(kind)) // a node that was added to a shape
      return this.#geometry(node);
    else if (kind === 'PBRAppearance' || kind === 'Appearance')
      return this.#appearance(node);
    return '';
  }

  // The element that names another one, where this does.
  #use(node, containerField = '') {
    const use = node.getAttribute('USE');
    if (use === null)
      return null;
    const name = named(use);
    const kind = this.#kinds.get(name);
    return kind === undefined ? '' : `<${kind} USE="${name}"${containerField}></${kind}>`;
  }

  #element(kind, node, more = '', content = '') {
    return `<${kind}${this.#name(node, kind)}${attributes(kind, node)}${more}>${content}</${kind}>`;
  }

  #name(node, kind, suffix = '') {
    const name = nameOf(node);
    if (name === null)
      return '';
    if (suffix === '')
      this.#kinds.set(name, kind);
    return ` DEF="${name}${suffix}"`;
  }

  // Webots' Billboard is where the camera is, and looks where it looks.
  #heldBeforeTheCamera(node) {
    const name = `held${++this.#held}`;
    const route = (from, to) => `<ROUTE fromNode="${name}-eye" fromField="${from}_changed" toNode="${name}" toField="set_${to}"></ROUTE>`;
    const axes = this.#upright ? ` rotation="-1 1 1 ${2 * Math.PI / 3}"` : '';
    return `<ProximitySensor DEF="${name}-eye" size="1e6 1e6 1e6"></ProximitySensor><Transform DEF="${name}">${this.#element('Transform', node, axes, this.#all(node))}`
      + `</Transform>${route('position', 'translation')}${route('orientation', 'rotation')}`;
  }

  #viewpoint(node) {
    const position = node.getAttribute('position') ?? '0 0 10';
    const orientation = this.orientation(node.getAttribute('orientation') ?? '0 0 1 0');
    this.viewpoint = { name: nameOf(node), fieldOfView: Number(node.getAttribute('fieldOfView')) || Math.PI / 4 };
    return `<Viewpoint${this.#name(node, 'Viewpoint')} position="${escaped(position)}" orientation="${orientation}"`
      + ` nearDistance="${numberOr(node.getAttribute('zNear') ?? node.getAttribute('near'), 0.05)}"`
      + ` farDistance="${numberOr(node.getAttribute('zFar') ?? node.getAttribute('far'), 1000)}" centerOfRotation="0 0 0"></Viewpoint>`;
  }

  // Webots' cameras look along x and have z above them since R2022a; those of X3D look along -z and have y above them.
  orientation(text) {
    const [x = 0, y = 0, z = 1, angle = 0] = text.trim().split(/[\s,]+/).map(Number);
    return this.#upright ? axisAngle(product(quaternion(x, y, z, angle), [0.5, 0.5, -0.5, -0.5])).join(' ') : `${x} ${y} ${z} ${angle}`;
  }

  #isGeometry(kind) {
    return kind in CHILDREN || ['Box', 'Sphere', 'Cone', 'Cylinder', 'Plane', 'Capsule', 'ElevationGrid', 'Mesh'].includes(kind);
  }

  #shape(node, use) {
    if (use !== null)
      return use;
    const children = [...node.children];
    const geometry = children.find(({ tagName }) => this.#isGeometry(tagName));
    const appearance = children.find(({ tagName }) => tagName === 'PBRAppearance') ?? children.find(({ tagName }) => tagName === 'Appearance');
    if (geometry === undefined || FROM_FILES.has(geometry.tagName)) {
      if (geometry !== undefined)
        this.unknown.add(geometry.tagName);
      return '';
    }
    const inner = (appearance === undefined ? '' : this.#appearance(appearance)) + this.#geometry(geometry);
    if (!this.#upright || !UPRIGHT.has(geometry.tagName))
      return `<Shape${this.#name(node, 'Shape')}>${inner}</Shape>`;
    // The wrapper has the name: a shape that is used again brings its turn along.
    return `<Transform${this.#name(node, 'Transform')} rotation="1 0 0 ${QUARTER}"><Shape>${inner}</Shape></Transform>`;
  }

  #geometry(node) {
    const use = this.#use(node);
    const kind = node.tagName;
    switch (kind) {
      case 'Plane': return use ?? faces(this.#name(node, 'IndexedFaceSet'), plane(node, this.#upright));
      case 'Capsule': return use ?? faces(this.#name(node, 'IndexedFaceSet'), capsule(node));
      case 'ElevationGrid': return use ?? faces(this.#name(node, 'IndexedFaceSet'), grid(node, this.#upright));
      default: return use ?? this.#element(kind, node, '', this.#parts(node, CHILDREN[kind] ?? []));
    }
  }

  #parts(node, kinds) {
    return [...node.children].filter(({ tagName }) => kinds.includes(tagName))
      .map((child) => this.#use(child) ?? this.#element(child.tagName, child)).join('');
  }

  #appearance(node) {
    if (node.getAttribute('USE') !== null)
      return this.#use(node);
    const physical = node.tagName === 'PBRAppearance';
    const material = [...node.children].find(({ tagName }) => tagName === 'Material');
    let content = '';
    if (physical)
      content += `<PhysicalMaterial${this.#name(node, 'PhysicalMaterial', MATERIAL)}${attributes('PhysicalMaterial', node)}>${this.#textures(node)}</PhysicalMaterial>`;
    else if (material !== undefined)
      content += this.#use(material) ?? this.#element('Material', material);
    for (const child of node.children)
      if (child.tagName === 'TextureTransform' || (!physical && child.tagName === 'ImageTexture'))
        content += this.#use(child) ?? (child.tagName === 'ImageTexture' ? this.#texture(child) : this.#element('TextureTransform', child));
    return `<Appearance${this.#name(node, 'Appearance')}>${content}</Appearance>`;
  }

  #textures(node) {
    return [...node.children].filter(({ tagName }) => tagName === 'ImageTexture').map((child) => {
      const role = (child.getAttribute('role') ?? child.getAttribute('type') ?? '').replace(/Map$/, '');
      if (!(role in TEXTURES))
        return '';
      const place = ` containerField="${TEXTURES[role]}"`;
      return this.#use(child, place) ?? this.#texture(child, place);
    }).join('');
  }

  #texture(node, place = '') {
    const url = this.#address(/[^"'\s][^"']*/.exec(node.getAttribute('url') ?? '')?.[0].trim() ?? '');
    if (url === null)
      return '';
    // Smooth also where they are small.
    const borders = ['S', 'T'].map((side) => ` boundaryMode${side}="${node.getAttribute(`repeat${side}`)?.toLowerCase() === 'false' ? 'CLAMP_TO_EDGE' : 'REPEAT'}"`);
    return `<ImageTexture${this.#name(node, 'ImageTexture')} url="&quot;${escaped(url)}&quot;"${place}><TextureProperties generateMipMaps="true"`
      + ` minificationFilter="AVG_PIXEL_AVG_MIPMAP" magnificationFilter="AVG_PIXEL"${borders.join('')}></TextureProperties></ImageTexture>`;
  }

  // Where a file of the world is, or null: Webots serves the files of its own installation, too, and no other host is asked for
  // anything. Otherwise whoever writes a world would learn who looks at it.
  #address(url) {
    if (url === '')
      return null;
    try {
      const found = new URL(url.replace(/^webots:\/\//, ''), this.#base);
      if (found.origin === new URL(this.#base).origin)
        return found.href;
    } catch { /* no address */ }
    this.unknown.add('ImageTexture');
    return null;
  }
}

// Which node and field of the translation a changed field of Webots means: {suffix of the node's name, field, kind}, or null.
export function fieldOf(name) {
  return FIELDS[name] ?? null;
}

const FIELDS = {
  rotation: { suffix: '', field: 'rotation', kind: 'rotation' },
  orientation: { suffix: '', field: 'orientation', kind: 'orientation' }, // of the viewpoint
  render: { suffix: '', field: 'visible', kind: 'flag' },
  on: { suffix: '', field: 'on', kind: 'flag' },
};
for (const name of ['translation', 'scale', 'direction', 'location', 'attenuation', 'size', 'position'])
  FIELDS[name] = { suffix: '', field: name, kind: 'vector' };
for (const name of ['diffuseColor', 'specularColor', 'color', 'skyColor'])
  FIELDS[name] = { suffix: '', field: name, kind: 'colour' };
for (const name of ['intensity', 'ambientIntensity', 'radius', 'height', 'bottomRadius', 'shininess', 'beamWidth', 'cutOffAngle', 'visibilityRange'])
  FIELDS[name] = { suffix: '', field: name, kind: 'number' };
for (const [from, to] of ATTRIBUTES.PhysicalMaterial) // of the material that an appearance has become, or of the material itself
  FIELDS[from] = { suffix: MATERIAL, field: to, kind: /Color$/.test(from) ? 'colour' : 'number' };

function parse(text) {
  const xml = new DOMParser().parseFromString(text, 'text/xml');
  if (xml.getElementsByTagName('parsererror').length !== 0)
    throw new Error('The scene cannot be read: it is not well-formed XML.');
  return xml;
}

// Webots writes n12 or 12.
const named = (id) => (id.startsWith('n') ? id : `n${id}`);

function nameOf(node) {
  const id = node.getAttribute('id');
  return id !== null && /^n?-?\d+$/.test(id) ? named(id) : null;
}

const x3d = (content) => `<?xml version="1.0" encoding="UTF-8"?><X3D profile="Interchange" version="4.0"><head><component name="EnvironmentalSensor" level="1"/></head><Scene>${content}</Scene></X3D>`;

// To whoever looks, where the demo simulator says so of a node.
const turned = (node, content) => (node.getAttribute('billboard') === 'true' ? `<Billboard axisOfRotation="0 0 0">${content}</Billboard>` : content);

const escaped = (text) => text.replace(/[&<>"]/g, (c) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' })[c]);

const numberOr = (text, fallback) => (text !== null && text !== '' && Number(text) > 0 ? Number(text) : fallback);

function attributes(kind, node) {
  return (ATTRIBUTES[kind] ?? []).map(([from, to, fallback]) => {
    const value = node.getAttribute(from) ?? fallback;
    if (value === undefined)
      return '';
    return ` ${to}="${escaped(FLAGS.has(to) ? String(!/^(0|false)$/i.test(value.trim())) : value)}"`;
  }).join('');
}

// --- geometries that X3D does not have, as faces: {points, texture, index} of texts

function faces(name, { points, texture, index, crease = 0.5 }) {
  return `<IndexedFaceSet${name} solid="false" creaseAngle="${crease}" coordIndex="${index.join(' ')}"><Coordinate point="${points.join(' ')}"></Coordinate>`
    + (texture === undefined ? '' : `<TextureCoordinate point="${texture.join(' ')}"></TextureCoordinate>`) + '</IndexedFaceSet>';
}

function plane(node, upright) {
  const [width = 1, depth = 1] = (node.getAttribute('size') ?? '1 1').trim().split(/[\s,]+/).map(Number);
  const points = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => [x * width / 2, y * depth / 2])
    .map(([x, y]) => (upright ? `${x} ${y} 0` : `${x} 0 ${-y}`));
  return { points, texture: ['0 0', '1 0', '1 1', '0 1'], index: ['0 1 2 3 -1'] };
}

// Along y, as X3D's cylinder; whoever draws it turns it.
function capsule(node) {
  const radius = numberOr(node.getAttribute('radius'), 1);
  const height = numberOr(node.getAttribute('height'), 2);
  const [rings, segments] = [16, 24];
  const points = [];
  const index = [];
  for (let ring = 0; ring <= rings; ++ring) {
    const up = Math.PI * (ring / rings - 0.5);
    const y = radius * Math.sin(up) + (ring * 2 < rings ? -height / 2 : height / 2);
    for (let i = 0; i < segments; ++i) {
      const around = 2 * Math.PI * i / segments;
      points.push(`${radius * Math.cos(up) * Math.cos(around)} ${y} ${radius * Math.cos(up) * Math.sin(around)}`);
      if (ring > 0) {
        const [a, b] = [ring * segments + i, ring * segments + (i + 1) % segments];
        index.push(`${a} ${b} ${b - segments} ${a - segments} -1`);
      }
    }
  }
  return { points, index, crease: 3 };
}

function grid(node, upright) {
  const read = (name, fallback) => numberOr(node.getAttribute(name), fallback);
  const [columns, rows] = [read('xDimension', 0), read('yDimension', read('zDimension', 0))];
  const [width, depth] = [read('xSpacing', 1), read('ySpacing', read('zSpacing', 1))];
  const heights = (node.getAttribute('height') ?? '').trim().split(/[\s,]+/).map(Number);
  const points = [];
  const texture = [];
  const index = [];
  for (let row = 0; row < rows; ++row)
    for (let column = 0; column < columns; ++column) {
      const [x, y, z] = [column * width, row * depth, heights[row * columns + column] || 0];
      points.push(upright ? `${x} ${y} ${z}` : `${x} ${z} ${y}`);
      texture.push(`${column / Math.max(1, columns - 1)} ${row / Math.max(1, rows - 1)}`);
      if (row > 0 && column > 0) {
        const corner = row * columns + column;
        index.push(`${corner - columns - 1} ${corner - columns} ${corner} ${corner - 1} -1`);
      }
    }
  return { points, texture, index, crease: 1 };
}

// --- rotations: [w, x, y, z]

function quaternion(x, y, z, angle) {
  const length = Math.hypot(x, y, z) || 1;
  const s = Math.sin(angle / 2) / length;
  return [Math.cos(angle / 2), x * s, y * s, z * s];
}

function product([a, b, c, d], [e, f, g, h]) {
  return [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
}

function axisAngle([w, x, y, z]) {
  const s = Math.hypot(x, y, z);
  return s < 1e-9 ? [0, 0, 1, 0] : [x / s, y / s, z / s, 2 * Math.atan2(s, w)];
}
