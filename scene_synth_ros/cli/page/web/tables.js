// The tables of the page and the legend.

/** Fills the table of a room's objects; returns what writes the visible pixels of a frame and marks the chosen one. */
function objectTable(room, choose) {
  const table = document.getElementById('objects');
  const labels = room.labels.instance || {};
  const rows = fillTable(
    table,
    ['id', 'object', 'class', 'depth width height, m', 'position x y z, m', 'on', 'visible px'],
    room.objects.map((item) => [
      item.id,
      (cell) => {
        const button = element('button', null, cell, 'object');
        button.type = 'button';
        swatch((labels[item.id] || { color: [128, 128, 128] }).color, button);
        element('span', item.category.replaceAll('_', ' '), button);
        button.addEventListener('click', () => choose(item.id));
      },
      item.class,
      numbers(item.size, 2),
      numbers(item.position, 2),
      item.on.replaceAll('_', ' '),
      '–',
    ]),
    [0, 3, 4, 6],
    'The bag describes no objects of this room.',
  );
  sortable(table);
  document.getElementById('objects-hint').textContent = room.objects.length ? `${room.objects.length} with doors and windows; choose one to see where it is` : '';
  return (counts, chosen) => {
    room.objects.forEach((item, k) => {
      const seen = counts ? counts[item.id] || 0 : null;
      rows[k].lastChild.textContent = seen === null ? '–' : count.format(seen);
      rows[k].classList.toggle('unseen', seen === 0);
      rows[k].classList.toggle('chosen', item.id === chosen);
      rows[k].querySelector('button').setAttribute('aria-pressed', item.id === chosen);
    });
  };
}

/** Writes the classes of a frame, the largest share first. */
function fillLegend(list, counts, labels) {
  list.replaceChildren();
  const rows = Object.entries(counts || {}).sort((a, b) => b[1] - a[1]);
  const all = rows.reduce((sum, [, pixels]) => sum + pixels, 0);
  if (!rows.length) element('li', 'no ids in this frame', list, 'empty');
  for (const [id, pixels] of rows) {
    const line = element('li', null, list), row = labels[id];
    swatch(row.color, line);
    element('span', `${id} ${row.name || 'no label'}`, line, 'label');
    element('span', count.format(pixels), line, 'number');
    element('span', `${((100 * pixels) / all).toFixed(1)} %`, line, 'number');
  }
}

function fillRunTables() {
  fillTable(document.getElementById('run'), ['', ''], data.run, [], 'The bag says nothing of its run.');
  const parameters = document.getElementById('parameters');
  fillTable(parameters, ['node', 'parameter', 'value', 'default'], data.parameters.map(([node, ...rest]) => [path(node), ...rest]), [], 'None, or the bag does not hold them.');
  const topics = document.getElementById('topics');
  const rows = data.topics.map(([name, type, messages, size]) => [path(name), path(type), count.format(messages), (size / 1e6).toFixed(2)]);
  fillTable(topics, ['topic', 'type', 'messages', 'MB, unpacked'], rows, [2, 3], 'The bag holds no topics.');
  sortable(topics);
}

function fillScale() {
  const steps = Array.from({ length: 25 }, (_, k) => `${rgb(distanceColor((k / 24) * farM))} ${((100 * k) / 24).toFixed(1)}%`);
  document.getElementById('distance-bar').style.background = `linear-gradient(to right, ${steps.join(', ')})`;
  const ticks = document.getElementById('distance-ticks');
  for (let m = 0; m <= farM; m++) element('li', m === farM ? `${m} m and more` : `${m}`, ticks);
}
