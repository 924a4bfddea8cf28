// The room from above: free floor, walls, objects, the camera's way, and the camera of the frame.  World metres, north up.

const planBox = document.getElementById('plan');
const VIEW_M = 0.9; // length of the camera's view, on the plan

const flat = (points) => points.map(([x, y]) => `${x},${-y}`).join(' ');

function area(points, kind, parent) {
  return shape('polygon', { points: flat(points), class: kind }, parent);
}

/** Returns what a room without a scene still has of extent: its map and the places of its cameras; null without them. */
function extent(room) {
  const places = room.frames.flatMap((frame) => Object.values(frame.cameras)).filter((camera) => camera.pose).map((camera) => camera.pose.position);
  const xs = places.map((p) => p[0]), ys = places.map((p) => p[1]);
  if (room.map) {
    xs.push(room.map.rectangle[0], room.map.rectangle[2]);
    ys.push(room.map.rectangle[1], room.map.rectangle[3]);
  }
  return xs.length ? [Math.min(...xs) - 0.5, Math.min(...ys) - 0.5, Math.max(...xs) + 0.5, Math.max(...ys) + 0.5] : null;
}

/** Draws a room; `choose(id)` is called with an object that is clicked, `go(frame)` with a place of the camera. */
function drawPlan(room, choose, go) {
  planBox.replaceChildren();
  const view = room.plan ? room.plan.view : extent(room);
  const missing = document.getElementById('no-plan');
  missing.hidden = Boolean(view);
  missing.textContent = view ? '' : 'no plan: the bag holds no scene, map or pose here';
  document.getElementById('plan-scale').textContent = view ? `${(view[2] - view[0]).toFixed(1)} m × ${(view[3] - view[1]).toFixed(1)} m, grid 1 m` : '';
  if (!view) return;
  const [left, bottom, right, top] = view, edge = 0.1;
  planBox.setAttribute('viewBox', `${left - edge} ${-top - edge} ${right - left + 2 * edge} ${top - bottom + 2 * edge}`);
  if (room.plan) {
    area(room.plan.walls, 'walls', planBox);
    area(room.plan.floor, 'floor', planBox);
  }
  if (room.map) {
    const [x0, y0, x1, y1] = room.map.rectangle;
    shape('image', { href: room.map.picture, x: x0, y: -y1, width: x1 - x0, height: y1 - y0, class: 'free', preserveAspectRatio: 'none' }, planBox);
  }
  const grid = shape('g', { class: 'grid' }, planBox);
  for (let x = Math.ceil(left); x <= right; x++) shape('line', { x1: x, x2: x, y1: -top, y2: -bottom }, grid);
  for (let y = Math.ceil(bottom); y <= top; y++) shape('line', { x1: left, x2: right, y1: -y, y2: -y }, grid);
  if (room.plan) drawThings(room, choose);
  drawWay(room, go);
  shape('g', { id: 'camera-now' }, planBox);
  shape('circle', { id: 'point-now', r: 0.06, visibility: 'hidden' }, planBox);
}

function drawThings(room, choose) {
  for (const item of room.plan.openings) area(item.points, item.window ? 'window' : 'door', planBox);
  for (const swing of room.plan.swings) shape('polyline', { points: flat(swing), class: 'swing' }, planBox);
  for (const ends of room.plan.slopes) shape('polyline', { points: flat(ends), class: 'slope' }, planBox);
  for (const item of room.plan.objects) {
    const node = area(item.points, `thing on-${item.kind}`, planBox);
    node.setAttribute('fill', item.color);
    node.dataset.id = item.id;
    shape('title', {}, node).textContent = `${nameOf(room, item.id)} (${item.id})`;
    node.addEventListener('click', () => choose(item.id));
  }
  for (const name of room.plan.names) {
    const node = shape('text', { x: name.x, y: -name.y, 'font-size': name.size, class: 'name' }, planBox);
    node.textContent = name.text;
  }
}

function drawWay(room, go) {
  if (room.plan) shape('polyline', { points: flat(room.plan.path), class: 'way' }, planBox);
  room.frames.forEach((frame, k) => {
    for (const camera of Object.values(frame.cameras)) {
      if (!camera.pose) continue;
      const [x, y] = camera.pose.position;
      shape('circle', { cx: x, cy: -y, r: 0.05, class: 'stop' }, planBox).addEventListener('click', () => go(k));
    }
  });
}

function nameOf(room, id) {
  const row = room.objects.find((item) => item.id === id);
  return row ? row.category.replaceAll('_', ' ') : '';
}

const turn = (rotation, v) => rotation.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);

/** Draws where the camera of the frame is, what it sees, and the point under the pointer (null: none). */
function drawCamera(camera, point) {
  const group = document.getElementById('camera-now'), dot = document.getElementById('point-now');
  if (!group) return;
  group.replaceChildren();
  dot.setAttribute('visibility', point ? 'visible' : 'hidden');
  if (point) [['cx', point[0]], ['cy', -point[1]]].forEach(([key, value]) => dot.setAttribute(key, value));
  if (!camera || !camera.pose) return;
  const [x, y] = camera.pose.position, lens = camera.lens;
  const middle = turn(camera.pose.rotation, [0, 0, 1]);
  if (lens) {
    const columns = Array.from({ length: 9 }, (_, k) => (k / 8) * lens.width - 0.5);
    const rays = columns.map((u) => turn(camera.pose.rotation, [(u - lens.k[2]) / lens.k[0], 0, 1]));
    area([[x, y], ...rays.map((ray) => along([x, y], ray))], 'view', group);
  }
  const tip = along([x, y], middle);
  shape('line', { x1: x, y1: -y, x2: tip[0], y2: -tip[1], class: 'look' }, group);
  shape('circle', { cx: x, cy: -y, r: 0.09, class: 'eye' }, group);
}

// The end of a ray on the plan: straight up or down it has no length, a slanting one is shorter.
function along([x, y], ray) {
  const reach = VIEW_M / Math.max(Math.hypot(...ray), 1e-9);
  return [x + reach * ray[0], y + reach * ray[1]];
}

/** Returns the world point, metres, of a pixel (u, v) at a depth along the optical axis; null where pose or a straight lens misses. */
function worldPoint(camera, u, v, depthM) {
  if (!camera || !camera.pose || !camera.lens || !Number.isFinite(depthM)) return null;
  const [fx, fy, cx, cy] = camera.lens.k;
  const ray = turn(camera.pose.rotation, [((u - cx) / fx) * depthM, ((v - cy) / fy) * depthM, depthM]);
  return ray.map((value, k) => value + camera.pose.position[k]);
}
