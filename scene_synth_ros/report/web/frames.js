// The worst frames: colour, truth, estimate over truth with a border that moves, error with its scale, and what makes the frame again.

function tile(parent, name, source, text, reason) {
  const figure = element('figure', null, parent, name);
  element('figcaption', name, figure);
  const stage = element('div', null, figure, 'stage');
  if (source) picture(source, text, stage);
  else element('p', reason || 'no picture', stage, 'missing');
  return stage;
}

function picture(source, text, parent) {
  const node = element('img', null, parent);
  node.alt = text;
  node.src = source;
  return node;
}

/** Lays the estimate over the truth, and a border between them that pointer and keys move. */
function compare(stage, images, text) {
  const upper = picture(images.estimate, `estimate, ${text}`, stage);
  const line = element('i', null, stage, 'border');
  for (const name of ['estimate', 'truth']) element('span', name, stage, `corner ${name}`);
  const slider = element('input', null, stage);
  Object.assign(slider, { type: 'range', min: 0, max: 100, step: 1, value: 50 });
  slider.setAttribute('aria-label', 'share of the estimate that covers the truth, percent');
  const move = () => {
    upper.style.clipPath = `inset(0 ${100 - slider.value}% 0 0)`;
    line.style.left = `${slider.value}%`;
  };
  slider.addEventListener('input', move);
  move();
}

function scale(parent, legend) {
  const box = element('div', null, parent, 'scale');
  if (legend.ticks.length) {
    const ramp = element('div', null, box, 'ramp');
    ramp.style.background = `linear-gradient(to right, ${legend.colors.slice(0, -1).map(rgb).join(', ')})`;
    const list = element('ol', null, box);
    for (const text of legend.ticks) element('li', text.replace('-', MINUS), list);
  }
  legend.colors.slice(-legend.names.length).forEach((color, k) => {
    swatch(color, box);
    element('span', legend.names[k], box);
  });
}

/** Shows a command with a button that copies it. */
function commandLine(text, parent) {
  const box = element('div', null, parent, 'command');
  const code = element('code', text, box);
  const button = element('button', 'Copy', box);
  button.type = 'button';
  button.setAttribute('aria-label', 'copy the command');
  button.addEventListener('click', async () => {
    button.textContent = (await copy(text, code)) ? 'Copied' : 'Selected';
    setTimeout(() => (button.textContent = 'Copy'), 1500);
  });
}

/** Copies a text; where the browser does not let scripts, selects it for the user's own keys and returns false. */
async function copy(text, node) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const range = document.createRange();
    range.selectNodeContents(node);
    getSelection().removeAllRanges();
    getSelection().addRange(range);
    return document.execCommand('copy');
  }
}

function drawFrame(parent, frame, place, metric) {
  const box = element('article', null, parent, 'frame');
  const head = element('h3', null, box);
  element('span', `${place}. ${frame.room_type || 'room'}, ${spaced(frame.metric)} ${withUnit(say(frame.value), metric.unit)}`, head);
  const chips = element('p', null, box, 'chips');
  element('span', frame.place, chips).title = `stamp ${frame.stamp} ns`;
  for (const [name, unit, value] of frame.factors) element('span', `${name} ${withUnit(value, unit)}`, chips, 'chip');
  const images = frame.images, text = `${frame.task}, ${frame.place}`, legend = data.legends[frame.task];
  const row = element('div', null, box, 'tiles');
  if (Object.keys(images).length) tile(row, 'colour', images.color, `colour, ${text}`);
  if (images.truth) {
    tile(row, 'truth', images.truth, `truth, ${text}`);
    const stage = tile(row, 'estimate', images.estimate && images.truth, `truth, ${text}`, frame.no_estimate);
    if (images.estimate) compare(stage, images, text);
    const error = tile(row, 'error', images.error, `error, ${text}`, frame.no_estimate);
    if (images.error && legend) scale(error.parentNode, legend);
  }
  if (frame.words) element('p', frame.words, box, 'hint');
  commandLine(frame.command, box);
}

function fillFrames(task, shown) {
  const place = by('frames');
  place.replaceChildren();
  const own = data.frames.filter((frame) => frame.task === task.name && shown.includes(frame.evaluation));
  const names = [...new Set(own.map((frame) => spaced(frame.metric)))];
  by('frames-metric').textContent = names.length ? `by ${names.join(', ')}` : '';
  const legend = data.legends[task.name];
  const colors = data.pictures[task.name] ? ` Colours of truth and estimate: ${data.pictures[task.name]}.` : '';
  const meaning = colors + (legend && legend.words ? ` Error: ${legend.words}; one scale for all frames.` : '');
  by('frames-hint').textContent = own.length ? `The worst frame of each of the worst rooms. The command makes the frame's bag again.${meaning}` : 'Single frames have no values of this task.';
  for (const k of shown) {
    const rows = own.filter((frame) => frame.evaluation === k);
    if (!rows.length) continue;
    if (data.evaluations.length > 1) {
      const head = element('h3', null, place, 'of');
      key(k, head);
      element('span', data.evaluations[k].title, head);
    }
    rows.forEach((frame, n) => drawFrame(place, frame, n + 1, task.metrics.find((metric) => metric.name === frame.metric)));
  }
}
