// Numbers as texts, axes and the marks of a chart.  Colours of evaluations are classes e0 to e5.

const MINUS = '\u2212', NONE = '\u2013';
const WIDEST = 1.5; // largest end of an interval that is drawn, times the longest bar
const figures = new Intl.NumberFormat('en', { maximumSignificantDigits: 4, useGrouping: false });

/** Returns a number with four digits, for people. */
function say(value) {
  if (value === null || value === undefined) return NONE;
  const size = Math.abs(value);
  const text = size && (size < 1e-3 || size >= 1e6) ? value.toExponential(2) : figures.format(value);
  return text.replace('-', MINUS);
}

/** Returns a value with its interval; digits that the interval leaves open are left out. */
function sayInterval([value, low, high]) {
  if (low === null || low === undefined) return say(value);
  const places = (size) => 1 - Math.floor(Math.log10(size)), digits = places((high - low) / 2);
  const text = (number, least) => (least > 6 || !Number.isFinite(least) ? say(number) : number.toFixed(Math.max(least, 0)).replace('-', MINUS));
  return `${text(value, Math.min(Math.max(digits, value ? places(Math.abs(value)) : 0), digits + 3))}  [${text(low, digits)}, ${text(high, digits)}]`;
}

const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);
const spaced = (name) => name.replaceAll('_', ' ');
const plural = (number, noun) => `${number} ${noun}${number === 1 ? '' : 's'}`;

/** Returns about `wanted` round numbers that lie between two numbers. */
function ticks(low, high, wanted) {
  const rough = (high - low) / wanted, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(12)));
  return found;
}

/** Returns round numbers between two numbers for a logarithmic axis. */
function powers(low, high) {
  const found = [];
  for (let k = Math.floor(Math.log10(low)); 10 ** k <= high; k++) {
    for (const factor of high / low > 1e3 ? [1] : [1, 3]) found.push(Number((factor * 10 ** k).toPrecision(3)));
  }
  return found.filter((value) => value >= low && value <= high);
}

/** Returns the smallest and largest of some numbers with some room on both sides. */
function padded(values) {
  const low = Math.min(...values), high = Math.max(...values), room = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - room, high + room];
}

const MARKS = [
  (x, y) => shape('circle', { cx: x, cy: y, r: 4 }),
  (x, y) => shape('rect', { x: x - 3.6, y: y - 3.6, width: 7.2, height: 7.2 }),
  (x, y) => shape('polygon', { points: `${x},${y - 5} ${x + 4.6},${y + 3.4} ${x - 4.6},${y + 3.4}` }),
  (x, y) => shape('polygon', { points: `${x},${y - 5.4} ${x + 5.4},${y} ${x},${y + 5.4} ${x - 5.4},${y}` }),
  (x, y) => shape('polygon', { points: `${x},${y + 5} ${x + 4.6},${y - 3.4} ${x - 4.6},${y - 3.4}` }),
  (x, y) => shape('rect', { x: x - 5, y: y - 2.4, width: 10, height: 4.8 }),
];

/** Draws the mark of an evaluation, which tells it apart without colours too. */
function mark(number, x, y, parent) {
  const node = MARKS[number](x, y);
  node.setAttribute('class', `mark e${number}`);
  parent.append(node);
  return node;
}

/** Writes a text into a drawing. */
function label(text, x, y, kind, parent, anchor = 'middle') {
  const node = shape('text', { x, y, class: kind, 'text-anchor': anchor }, parent);
  node.textContent = text;
  return node;
}

/** Fills a table whose rows have a bar for each evaluation: rows are [name, {evaluation: [value, low, high, ...]}, further texts]. */
function barTable(parent, heads, rows, unit, shown) {
  const table = element('table', null, parent, 'bars');
  const cells = rows.flatMap(([, found]) => shown.filter((k) => found[k]).map((k) => found[k]));
  const values = cells.flatMap((cell) => cell.slice(0, 3)).filter((value) => value !== null), most = WIDEST * Math.max(...cells.map(([value]) => Math.abs(value)));
  const low = Math.max(Math.min(0, ...values), -most), high = Math.min(Math.max(0, ...values), most), span = high - low || 1;
  const at = (value) => 2 + (96 * (Math.min(Math.max(value, low), high) - low)) / span;
  fillTable(
    table,
    [heads[0], '', withUnit(heads[1], unit && `(${unit})`), ...heads.slice(2)],
    rows.map(([name, found, ...texts]) => {
      const own = shown.filter((k) => found[k]);
      return [
        name,
        (cell) => {
          cell.className = 'bar';
          const drawing = shape('svg', { viewBox: `0 0 100 ${10 * Math.max(own.length, 1)}`, preserveAspectRatio: 'none', 'aria-hidden': 'true' }, cell);
          drawing.style.height = `${0.95 * Math.max(own.length, 1)}rem`;
          own.forEach((k, line) => {
            const [value, from, to] = found[k], y = 10 * line;
            shape('rect', { x: Math.min(at(0), at(value)), y: y + 1.5, width: Math.abs(at(value) - at(0)), height: 7, class: `fill e${k}` }, drawing);
            if (from !== null && from !== undefined) shape('line', { x1: at(from), x2: at(to), y1: y + 5, y2: y + 5, class: 'whisker' }, drawing);
          });
          shape('line', { x1: at(0), x2: at(0), y1: 0, y2: 10 * Math.max(own.length, 1), class: 'zero' }, drawing);
        },
        (cell) => own.forEach((k) => element('div', sayInterval(found[k]), cell)),
        ...texts.map((text) => (cell) => own.forEach((k) => element('div', text[k] || NONE, cell))),
      ];
    }),
    [],
    'nothing',
  );
  return table;
}
