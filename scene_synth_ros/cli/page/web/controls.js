// What the user does: address, keys, controls; and the start of the page.

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
