// A chart for each factor: numbers as lines with bands, names as marks with bars.  All charts of a metric have one vertical scale.

const WIDE = 380, HIGH = 242, LEFT = 52, RIGHT = 12, TOP = 24, BOTTOM = 42;
const LOG_FROM = 20; // ratio of the largest to the smallest value from which an axis may be logarithmic

/** Returns where the columns of a factor stand across a chart, and the texts of the axis: [x, text]. */
function across(factor, dots) {
  const inner = WIDE - LEFT - RIGHT;
  if (!factor.places.length) {
    const step = inner / factor.columns.length;
    const at = (k) => LEFT + step * (k + 0.5);
    return { of: at, at: factor.columns.map((_, k) => at(k)), texts: factor.columns.map((text, k) => [at(k), text]), step, base: factor.base === null ? null : at(factor.base) };
  }
  const known = factor.places.filter((place) => place !== null), own = known.length < factor.places.length ? 44 : 0;
  const places = [...known, ...dots.map(([value]) => value), ...(factor.base_value === null ? [] : [factor.base_value])];
  const low = Math.min(...places), high = Math.max(...places), log = isLogarithmic(known, low, high);
  const on = log ? Math.log : (value) => value;
  const of = (value) => LEFT + 10 + own + ((inner - 20 - own) * (on(value) - on(low))) / (on(high) - on(low) || 1);
  const values = factor.binned ? (log ? powers(low, high) : ticks(low, high, 5)) : known;
  const at = factor.places.map((place) => (place === null ? LEFT + 18 : of(place)));
  const texts = [...(own ? [[at[0], factor.columns[0]]] : []), ...values.map((value) => [of(value), say(value)])];
  const base = factor.base_value !== null ? of(factor.base_value) : factor.base === null ? null : at[factor.base];
  return { of, at, texts, step: inner / values.length, log, base };
}

/** Returns whether values are spread much more evenly over a logarithmic axis than over a plain one. */
function isLogarithmic(values, low, high) {
  if (low <= 0 || high / low < LOG_FROM) return false;
  const middle = values.length / 2, half = [Math.floor(middle - 0.5), Math.ceil(middle - 0.5)].map((k) => [...values].sort((a, b) => a - b)[k]);
  const off = (on) => Math.abs((on(half[0]) + on(half[1]) - on(low) - on(high)) / (on(high) - on(low)));
  return off(Math.log) < 0.5 * off((value) => value);
}

/** Returns the vertical range of all charts of a metric. */
function rangeOf(curves, shown) {
  const values = shown.flatMap((k) => Object.values(curves[k] || EMPTY)).flatMap(({ points, dots }) => [...points.filter(Boolean).flatMap((point) => point.slice(0, 3)), ...dots.map(([, value]) => value)]);
  return padded(values.filter((value) => value !== null));
}

/** Draws the chart of a factor; `own` has points and dots by evaluation. */
function drawChart(parent, factor, metric, own, shown, [low, high]) {
  const figure = element('figure', null, parent, 'chart');
  element('figcaption', withUnit(factor.label, factor.unit && `(${factor.unit})`), figure);
  const drawing = shape('svg', { viewBox: `0 0 ${WIDE} ${HIGH}`, role: 'img', tabindex: 0 }, figure);
  drawing.setAttribute('aria-label', `${spaced(metric.name)} against ${factor.label}; arrow keys read the values`);
  const axis = across(factor, shown.flatMap((k) => (own[k] ? own[k].dots : [])));
  const y = (value) => TOP + ((HIGH - TOP - BOTTOM) * (high - value)) / (high - low);
  for (const value of ticks(low, high, 5)) {
    shape('line', { x1: LEFT, x2: WIDE - RIGHT, y1: y(value), y2: y(value), class: 'grid' }, drawing);
    label(say(value), LEFT - 6, y(value) + 4, 'axis', drawing, 'end');
  }
  let free = -Infinity;
  for (const [x, text] of axis.texts) {
    const half = 3.1 * Math.min(text.length, 14);
    if (x - half < free) continue;
    free = x + half + 6;
    label(text.length > 14 ? `${text.slice(0, 13)}…` : text, x, HIGH - BOTTOM + 17, 'axis', drawing);
  }
  label(`${withUnit(spaced(metric.name), metric.unit && `(${metric.unit})`)}, ${metric.lower ? 'lower' : 'higher'} is better`, 4, 11, 'axis', drawing, 'start');
  label([factor.binned ? 'bins' : '', axis.log ? 'logarithmic scale' : ''].filter(Boolean).join(', '), WIDE - RIGHT, 11, 'axis', drawing, 'end');
  if (axis.base !== null) {
    shape('line', { x1: axis.base, x2: axis.base, y1: TOP, y2: HIGH - BOTTOM, class: 'base' }, drawing);
    label('base', axis.base, HIGH - BOTTOM + 31, 'axis base-name', drawing);
  }
  const place = (k, column) => axis.at[column] + (factor.places.length ? 0 : (shown.indexOf(k) - (shown.length - 1) / 2) * Math.min(14, (0.7 * axis.step) / shown.length));
  for (const k of shown.filter((number) => own[number])) drawSeries(drawing, factor, own[k], k, axis, y, (column) => place(k, column));
  listenToChart(figure, drawing, factor, metric, own, shown, axis);
}

function drawSeries(drawing, factor, { points, dots }, k, axis, y, x) {
  const group = shape('g', { class: `series e${k}` }, drawing);
  for (const [value, mean] of dots) shape('circle', { cx: axis.of(value), cy: y(mean), r: 1.8, class: `dot e${k}` }, group);
  const known = points.map((point, column) => [column, point]).filter(([, point]) => point);
  const sure = known.filter(([, point]) => point[1] !== null);
  if (factor.places.length) {
    const joined = known.filter(([column]) => factor.places[column] !== null), inside = sure.filter(([column]) => factor.places[column] !== null);
    const upper = inside.map(([column, point]) => `${x(column)},${y(point[2])}`), lower = inside.map(([column, point]) => `${x(column)},${y(point[1])}`).reverse();
    if (inside.length > 1) shape('polygon', { points: [...upper, ...lower].join(' '), class: `band e${k}` }, group);
    shape('polyline', { points: joined.map(([column, point]) => `${x(column)},${y(point[0])}`).join(' '), class: `line e${k}` }, group);
  }
  for (const [column, point] of sure) {
    if (!factor.places.length || factor.places[column] === null) shape('line', { x1: x(column), x2: x(column), y1: y(point[1]), y2: y(point[2]), class: `stem e${k}` }, group);
  }
  for (const [column, point] of known) mark(k, x(column), y(point[0]), group);
}

/** Tells the values of a column where the pointer is, or that the arrow keys choose. */
function listenToChart(figure, drawing, factor, metric, own, shown, axis) {
  const rule = shape('line', { y1: TOP, y2: HIGH - BOTTOM, class: 'rule', visibility: 'hidden' }, drawing);
  const tip = element('output', null, figure, 'tip');
  tip.hidden = true;
  let column = null;
  const read = (wanted) => {
    column = wanted;
    rule.setAttribute('visibility', wanted === null ? 'hidden' : 'visible');
    tip.hidden = wanted === null;
    if (wanted === null) return;
    for (const end of ['x1', 'x2']) rule.setAttribute(end, axis.at[wanted]);
    tip.replaceChildren();
    element('b', withUnit(factor.columns[wanted], factor.places.length ? factor.unit : '') + (factor.base === wanted ? ', base' : ''), tip);
    for (const k of shown) {
      const point = own[k] && own[k].points[wanted];
      if (!point) continue;
      const line = element('div', null, tip);
      key(k, line);
      element('span', `${sayInterval(point)}${metric.unit ? ` ${metric.unit}` : ''}, ${plural(point[3], 'room')}, ${plural(point[4], 'frame')}`, line);
    }
    tip.classList.toggle('left', axis.at[wanted] > WIDE / 2);
  };
  const follow = (event) => {
    const box = drawing.getBoundingClientRect(), x = ((event.clientX - box.left) / box.width) * WIDE;
    read(axis.at.reduce((best, place, k) => (Math.abs(place - x) < Math.abs(axis.at[best] - x) ? k : best), 0));
  };
  drawing.addEventListener('pointermove', follow);
  drawing.addEventListener('pointerdown', follow);
  drawing.addEventListener('pointerleave', () => read(null));
  drawing.addEventListener('blur', () => read(null));
  drawing.addEventListener('keydown', (event) => {
    const last = axis.at.length - 1, step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === 'Escape') read(null);
    if (!step) return;
    event.preventDefault();
    read(column === null ? (step > 0 ? 0 : last) : Math.min(Math.max(column + step, 0), last));
  });
}

/** Draws the mark of an evaluation beside a text. */
function key(number, parent) {
  const drawing = shape('svg', { viewBox: '0 0 14 14', class: 'key', 'aria-hidden': 'true' }, parent);
  mark(number, 7, 7, drawing);
}
