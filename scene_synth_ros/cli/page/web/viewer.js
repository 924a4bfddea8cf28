// The viewer: which room, frame, camera and pixel is shown.

const state = { room: 0, frame: 0, camera: 0, view: 'all', point: null, kept: false, chosen: null, playing: 0, turn: 0 };
let tiles = [], pixelCells = {}, showCounts = () => {}, shown = { images: {}, camera: null };

const room = () => data.rooms[state.room];
const cameraRow = () => data.cameras[state.camera] || { name: '', layers: [] };
const frameOf = () => (room() ? room().frames[state.frame] : undefined);
const cameraOf = () => (frameOf() ? frameOf().cameras[cameraRow().name] : undefined);
const labelsOf = (layer) => (room() && room().labels[layer]) || {};

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
