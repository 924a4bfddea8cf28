// The viewer: which room, frame, camera and pixel is shown, and all that changes with them.

const root = document.documentElement;
const by = (id) => document.getElementById(id);
const state = { room: 0, frame: 0, camera: 0, view: 'all', point: null, kept: false, chosen: null, playing: 0, turn: 0 };
const NONE = '–';
const PIXEL_ROWS = ['pixel', 'distance', 'normal', 'class', 'object', 'in map, m'];
let tiles = [], pixelCells = {}, showCounts = () => {}, shown = { images: {}, camera: null };

function tell(error) {
  by('error').hidden = false;
  by('error').textContent = `The page has a fault: ${error.message || error}`;
  root.dataset.error = String(error.message || error);
}
window.addEventListener('error', (event) => tell(event.error || event.message));
window.addEventListener('unhandledrejection', (event) => tell(event.reason));

const room = () => data.rooms[state.room];
const cameraRow = () => data.cameras[state.camera] || { name: '', layers: [] };
const frameOf = () => (room() ? room().frames[state.frame] : undefined);
const cameraOf = () => (frameOf() ? frameOf().cameras[cameraRow().name] : undefined);
const labelsOf = (layer) => (room() && room().labels[layer]) || {};

// Where the pointer is, as shares of the image, to columns and rows: of the image shown (k), and of the bag's image (x, y).
function pixelAt(image, point) {
  const [width, height] = image.shown;
  const column = Math.min(Math.floor(point.u * width), width - 1), line = Math.min(Math.floor(point.v * height), height - 1);
  const x = Math.floor(((column + 0.5) * image.width) / width), y = Math.floor(((line + 0.5) * image.height) / height);
  return { k: 4 * (line * width + column), x, y };
}

/** Returns the first image of a layer in the page, so that its tile has its shape from the start; undefined if there is none. */
function anyImage(layer) {
  const frames = data.rooms.flatMap((one) => one.frames).map((frame) => frame.cameras[cameraRow().name]);
  return frames.map((camera) => camera && camera.images[layer]).find(Boolean);
}

function makeTile(name, meaning, shape) {
  const figure = element('figure', null, by('tiles'));
  const caption = element('figcaption', null, figure);
  element('span', name, caption, 'layer').title = meaning;
  const value = element('span', '', caption, 'value');
  const stage = element('div', null, figure, 'stage');
  if (shape) stage.style.aspectRatio = `${shape.width} / ${shape.height}`;
  const canvas = element('canvas', null, stage);
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', `${name}: ${meaning}`);
  const upper = element('canvas', null, stage, 'upper');
  upper.setAttribute('aria-hidden', 'true');
  const missing = element('p', '', stage, 'missing');
  const cross = ['across', 'down'].map((kind) => element('i', null, stage, kind));
  stage.addEventListener('pointermove', (event) => state.kept || point(event, stage));
  stage.addEventListener('pointerleave', () => state.kept || movePoint(null));
  stage.addEventListener('click', (event) => {
    state.kept = !state.kept;
    point(event, stage);
    remember();
  });
  return { name, figure, value, stage, canvas, upper, missing, cross };
}

function point(event, stage) {
  const box = stage.getBoundingClientRect();
  const inside = (value) => Math.min(Math.max(value, 0), 0.999999);
  movePoint({ u: inside((event.clientX - box.left) / box.width), v: inside((event.clientY - box.top) / box.height) });
}

function movePoint(to) {
  state.point = to;
  showPoint();
}

// Makes the tiles of the camera: one for each layer, the legend, and the one of the overlay.
function makeTiles() {
  by('tiles').replaceChildren();
  const layers = cameraRow().layers;
  tiles = layers.map((layer) => Object.assign(makeTile(layer.name, layer.meaning, anyImage(layer.name)), { layer }));
  const overlay = makeTile('overlay', 'one layer over another', layers.map((layer) => anyImage(layer.name)).find(Boolean));
  overlay.figure.classList.add('over');
  tiles.push(overlay);
  const legend = element('section', null, by('tiles'), 'legend');
  element('h2', 'Classes in the frame', legend);
  element('ul', null, legend).id = 'legend';
  if (!layers.length) element('p', 'The bag holds no images.', by('tiles'), 'empty');
  for (const [id, wanted] of [['lower', 'color'], ['upper', 'semantic']]) {
    by(id).replaceChildren(...layers.map((layer) => Object.assign(new Option(layer.name, layer.name), { title: layer.meaning })));
    if (layers.some((layer) => layer.name === wanted)) by(id).value = wanted;
  }
}

function enterRoom() {
  const now = room();
  if (!now) return;
  by('frame').max = Math.max(now.frames.length - 1, 0);
  const facts = by('room-facts');
  facts.replaceChildren();
  for (const [name, text] of now.facts) {
    const piece = element('span', null, facts);
    element('small', `${name} `, piece);
    element('b', text, piece);
  }
  if (!now.facts.length) element('span', 'no scene description', facts, 'empty');
  drawPlan(now, choose, (frame) => go({ frame }));
  showCounts = objectTable(now, choose);
}

function choose(id) {
  state.chosen = state.chosen === id ? null : id;
  show();
}

// Changes what is shown: room, frame, camera by their place; frames run round within their room.
function go(change) {
  const before = state.room;
  Object.assign(state, change);
  const last = data.rooms.length - 1;
  state.room = Math.min(Math.max(state.room, 0), Math.max(last, 0));
  const frames = room() ? room().frames.length : 0;
  state.frame = frames ? ((state.frame % frames) + frames) % frames : 0;
  if (state.room !== before) {
    state.chosen = null;
    enterRoom();
  }
  remember();
  return show();
}

// Shows the frame.  What is decoded late, when another frame is wanted already, is dropped.
async function show() {
  const turnNow = ++state.turn;
  const camera = cameraOf(), images = {};
  for (const layer of cameraRow().layers) {
    const image = camera && camera.images[layer.name];
    if (image) images[layer.name] = { image, bytes: await readImage(image) };
  }
  if (turnNow !== state.turn) return;
  shown = { images, camera };
  const ids = images.instance, keep = state.chosen !== null && ids ? { id: state.chosen, bytes: ids.bytes } : null;
  for (const tile of tiles) {
    const own = tile.layer ? images[tile.name] : images[by('lower').value];
    tile.missing.textContent = own ? '' : 'no image at this stamp';
    tile.canvas.hidden = !own;
    if (own) paint(tile.canvas, own.image, own.bytes, labelsOf(tile.layer ? tile.name : by('lower').value), keep);
    const upper = tile.layer ? null : images[by('upper').value];
    tile.upper.hidden = !upper;
    if (upper) paint(tile.upper, upper.image, upper.bytes, labelsOf(by('upper').value), keep);
    tile.upper.style.opacity = by('opacity').value / 100;
  }
  showControls();
  showCounts(ids && ids.image.counts, state.chosen);
  fillLegend(by('legend'), images.semantic && images.semantic.image.counts, labelsOf('semantic'));
  document.querySelectorAll('#plan .thing').forEach((node) => node.classList.toggle('chosen', Number(node.dataset.id) === state.chosen));
  showPoint();
  Object.assign(root.dataset, { state: 'ready', room: state.room + 1, frame: state.frame + 1, layers: Object.keys(images).join(' ') });
}

function showControls() {
  const frame = frameOf(), now = room();
  by('room').value = state.room;
  by('camera').value = state.camera;
  by('frame').value = state.frame;
  by('view').value = state.view;
  root.dataset.view = state.view;
  const seconds = frame ? (Number(BigInt(frame.stamp) / 1000n) / 1e6).toFixed(3) : '';
  by('time').textContent = frame ? `frame ${state.frame + 1} of ${now.frames.length}${now.found > now.frames.length ? ` (${now.found} in the bag)` : ''}, ${seconds} s` : 'no frames';
}

// Tells the numbers under the pointer, in every tile and in the list, and draws crosses and the point on the plan.
function showPoint() {
  const texts = {};
  let at = null, world = null, code = 0, ids = {};
  for (const tile of tiles) {
    const own = tile.layer && shown.images[tile.name];
    tile.cross.forEach((line) => (line.hidden = !state.point));
    if (state.point) [tile.cross[0].style.top, tile.cross[1].style.left] = [`${100 * state.point.v}%`, `${100 * state.point.u}%`];
    tile.value.textContent = '';
    if (!own || !state.point) continue;
    const pixel = pixelAt(own.image, state.point);
    at = at || pixel;
    texts[tile.name] = tile.value.textContent = FORMS[own.image.form].text(own.bytes, pixel.k, labelsOf(tile.name));
    if (own.image.form === 'ids') ids[tile.name] = number(own.bytes, pixel.k);
    if (tile.name === 'depth') {
      code = number(own.bytes, pixel.k);
      world = worldPoint(shown.camera, pixel.x, pixel.y, metres(code));
    }
  }
  const distance = texts.depth || texts.range;
  const told = [
    at && `${at.x}, ${at.y}`, distance, texts.normals, texts.semantic, texts.instance,
    world && numbers(world, 3),
  ];
  PIXEL_ROWS.forEach((name, k) => (pixelCells[name].textContent = told[k] || NONE));
  drawCamera(shown.camera, world);
  const name = (layer) => (ids[layer] === undefined ? '' : labelsOf(layer)[ids[layer]].name);
  Object.assign(root.dataset, {
    x: at ? at.x : '', y: at ? at.y : '', depth: distance || '', normal: texts.normals || '', color: texts.color || '',
    class: name('semantic'), object: name('instance'), world: world ? numbers(world, 3) : '',
  });
}

// The address keeps the place: #room=1&frame=2&x=40&y=30, rooms and frames from 1, pixels of the bag's image from 0.
function remember() {
  const words = [`room=${state.room + 1}`, `frame=${state.frame + 1}`];
  if (state.camera) words.push(`camera=${state.camera + 1}`);
  if (state.view !== 'all') words.push(`view=${state.view}`);
  if (state.kept && state.point && root.dataset.x) words.push(`x=${root.dataset.x}`, `y=${root.dataset.y}`);
  if (location.hash !== `#${words.join('&')}`) history.replaceState(null, '', `#${words.join('&')}`);
}

async function followAddress() {
  const words = new URLSearchParams(location.hash.slice(1));
  const whole = (name, otherwise) => (/^\d{1,6}$/.test(words.get(name) || '') ? Number(words.get(name)) : otherwise);
  const camera = Math.min(Math.max(whole('camera', 1) - 1, 0), Math.max(data.cameras.length - 1, 0));
  if (camera !== state.camera || !tiles.length) {
    state.camera = camera;
    makeTiles();
  }
  const wanted = { x: whole('x', null), y: whole('y', null) };
  const view = words.get('view') === 'overlay' ? 'overlay' : 'all';
  state.kept = false;
  await go({ room: whole('room', 1) - 1, frame: Math.max(whole('frame', 1) - 1, 0), view });
  const first = Object.values(shown.images)[0];
  if (first && wanted.x !== null && wanted.y !== null) {
    const share = (value, length) => Math.min((value + 0.5) / length, 0.999999);
    state.kept = true;
    movePoint({ u: share(wanted.x, first.image.width), v: share(wanted.y, first.image.height) });
    remember();
  }
}

function play(on) {
  clearTimeout(state.playing);
  state.playing = 0;
  by('play').textContent = on ? 'Pause' : 'Play';
  by('play').setAttribute('aria-pressed', on);
  const frames = room() ? room().frames : [];
  if (!on || frames.length < 2) return;
  const next = (state.frame + 1) % frames.length;
  const gap = Number(BigInt(frames[next].stamp) - BigInt(frames[state.frame].stamp)) / 1e6;
  state.playing = setTimeout(async () => {
    await go({ frame: next });
    if (state.playing) play(true);
  }, next ? Math.min(Math.max(gap, 80), 1000) : 700);
}

function nudge(dx, dy) {
  const first = Object.values(shown.images)[0];
  if (!first) return;
  const [width, height] = first.image.shown, from = state.point || { u: 0.5, v: 0.5 };
  const inside = (value) => Math.min(Math.max(value, 0), 0.999999);
  state.kept = true;
  movePoint({ u: inside((Math.floor(from.u * width) + dx + 0.5) / width), v: inside((Math.floor(from.v * height) + dy + 0.5) / height) });
  remember();
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const KEYS = {
  ' ': () => play(!state.playing),
  o: () => go({ view: state.view === 'all' ? 'overlay' : 'all' }),
  Escape: () => {
    [state.kept, state.chosen] = [false, null];
    movePoint(null);
    go({});
  },
};

document.addEventListener('keydown', (event) => {
  const target = event.target, field = target.closest('select, input'), pressed = event.key === ' ' && target.closest('button, summary');
  if (event.ctrlKey || event.metaKey || event.altKey || ((field || pressed) && event.key !== 'Escape')) return;
  const arrow = ARROWS[event.key], key = KEYS[event.key];
  if (!arrow && !key) return;
  event.preventDefault();
  if (key) key();
  else if (event.shiftKey) nudge(...arrow);
  else go(arrow[0] ? { frame: state.frame + arrow[0] } : { room: state.room + arrow[1], frame: 0 });
});

function listen() {
  const place = (id) => Number(by(id).value);
  by('room').addEventListener('change', () => go({ room: place('room'), frame: 0 }));
  by('frame').addEventListener('input', () => go({ frame: place('frame') }));
  by('previous').addEventListener('click', () => go({ frame: state.frame - 1 }));
  by('next').addEventListener('click', () => go({ frame: state.frame + 1 }));
  by('play').addEventListener('click', () => play(!state.playing));
  by('view').addEventListener('change', () => go({ view: by('view').value }));
  by('camera').addEventListener('change', () => {
    state.camera = place('camera');
    makeTiles();
    go({});
  });
  for (const id of ['lower', 'upper', 'opacity']) by(id).addEventListener('input', () => show());
  by('free').addEventListener('change', () => planBox.classList.toggle('no-free', !by('free').checked));
  window.addEventListener('hashchange', followAddress);
}

function start() {
  by('title').textContent = data.title;
  const frames = data.rooms.reduce((sum, one) => sum + one.frames.length, 0);
  const some = (here, all, noun) => (here === all ? `${here} ${noun}${here === 1 ? '' : 's'}` : `${here} of ${all} ${noun}s`);
  by('summary').textContent = [some(data.rooms.length, data.rooms_found, 'room'), some(frames, data.frames_found, 'frame')].join(', ');
  if (data.notes.length) {
    by('notes').hidden = false;
    by('notes').querySelector('summary').textContent = `${data.notes.length} note${data.notes.length > 1 ? 's' : ''}`;
    data.notes.forEach((line) => element('li', line, by('notes').querySelector('ul')));
  }
  const title = (one, k) => `${k + 1}: ${(one.facts.find(([name]) => name === 'type') || ['', 'no scene'])[1]}`;
  by('room').replaceChildren(...data.rooms.map((one, k) => new Option(title(one, k), k)));
  by('camera').replaceChildren(...data.cameras.map((one, k) => new Option(one.name, k)));
  by('camera-choice').hidden = data.cameras.length < 2;
  for (const name of PIXEL_ROWS) {
    element('dt', name, by('pixel'));
    pixelCells[name] = element('dd', NONE, by('pixel'));
  }
  fillRunTables();
  fillScale();
  listen();
  enterRoom();
  followAddress();
}

start();
