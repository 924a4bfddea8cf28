// What all pages begin with: their contents, elements, and faults told on the page.  Texts of a user's files are set as text, never as markup.

const NS = 'http://www.w3.org/2000/svg';
const EMPTY = Object.freeze(Object.create(null));
// objects without a prototype: a name such as "constructor" is found only where the contents have it
const plain = (_, value) => (value && typeof value === 'object' && !Array.isArray(value) ? Object.assign(Object.create(null), value) : value);
const data = JSON.parse(document.getElementById('data').textContent, plain);
const root = document.documentElement;
const by = (id) => document.getElementById(id);

function tell(error) {
  by('error').hidden = false;
  by('error').textContent = `The page has a fault: ${error.message || error}`;
  root.dataset.error = String(error.message || error);
}
window.addEventListener('error', (event) => tell(event.error || event.message));
window.addEventListener('unhandledrejection', (event) => tell(event.reason));

function element(name, text, parent, kind) {
  const node = document.createElement(name);
  if (text !== undefined && text !== null) node.textContent = text;
  if (kind) node.className = kind;
  if (parent) parent.append(node);
  return node;
}

function shape(name, attributes, parent) {
  const node = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (parent) parent.append(node);
  return node;
}

const count = new Intl.NumberFormat('en');
/** Fills a cell with a name that may break after a slash. */
const path = (name) => (cell) => cell.append(...name.split(/(?<=\/)/).flatMap((piece) => [piece, document.createElement('wbr')]));
const rgb = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

function swatch(color, parent) {
  const node = element('span', '', parent, 'swatch');
  node.style.background = rgb(color);
  return node;
}

