// A tile for each layer, and what is told of the pixel pointed at.

const NONE = '–';
const PIXEL_ROWS = ['pixel', 'distance', 'normal', 'class', 'object', 'in map, m'];

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
