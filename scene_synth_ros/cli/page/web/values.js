// Images of the page as numbers: decoded, told in words, painted.  A form is one row of FORMS, as in page_images.py.

const MOST_HELD = 80;
const held = new Map();
const { stops, far_m: farM, no_hit: noHit, most } = data.distances;

/** Returns the RGBA bytes of an image as they were written; the most recent are kept. */
function readImage(image) {
  const known = held.get(image);
  held.delete(image);
  const bytes = known || decode(image);
  held.set(image, bytes);
  if (held.size > MOST_HELD) held.delete(held.keys().next().value);
  return bytes;
}

async function decode(image) {
  const picture = new Image();
  await new Promise((done, fail) => {
    picture.onload = done;
    picture.onerror = () => fail(new Error('an image of the page cannot be decoded'));
    picture.src = `data:${image.type};base64,${image.data}`;
  });
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = image.shown;
  const context = canvas.getContext('2d', { willReadFrequently: true, colorSpace: 'srgb' });
  context.drawImage(picture, 0, 0);
  const bytes = context.getImageData(0, 0, canvas.width, canvas.height).data;
  if (image.sum !== undefined && sumOf(bytes) !== image.sum) {
    throw new Error('this browser gives scripts other pixels than the page holds (protection against fingerprinting?); numbers would be wrong');
  }
  return bytes;
}

function sumOf(bytes) {
  let sum = 0;
  for (let i = 0; i < bytes.length; i += 4) sum += bytes[i] + bytes[i + 1] + bytes[i + 2];
  return sum;
}

const numbers = (values, digits) => values.map((value) => value.toFixed(digits).replace(/^-(?=.*[1-9])/, '−').replace('-', '')).join(' ');
const number = (bytes, i) => (bytes[i] << 8) | bytes[i + 1];

/** Returns metres of a distance's code; NaN where the code does not tell how far: invalid, no hit, beyond all codes. */
function metres(code) {
  return code === 0 || code >= most ? NaN : code / 1000;
}

function metresText(code) {
  if (code === 0) return 'invalid';
  if (code === noHit) return 'no hit';
  return `${code === most ? '≥ ' : ''}${(code / 1000).toFixed(3)} m`;
}

/** Returns a unit vector of its three bytes, null where there is none. */
function direction(bytes, i) {
  const [r, g, b] = [bytes[i], bytes[i + 1], bytes[i + 2]];
  if (!(r || g || b)) return null;
  const vector = [r, g, b].map((byte) => byte / 127.5 - 1);
  const length = Math.hypot(...vector);
  return vector.map((value) => value / length);
}

function distanceColor(m) {
  const place = (Math.min(Math.max(m / farM, 0), 1)) * (stops.length - 1);
  const low = Math.min(Math.floor(place), stops.length - 2);
  return stops[low].map((value, k) => Math.round(value + (stops[low + 1][k] - value) * (place - low)));
}

const pack = ([r, g, b]) => (255 << 24) | (b << 16) | (g << 8) | r;
let distanceColors = null;

const FORMS = {
  picture: {
    text: (bytes, i) => `${bytes[i]} ${bytes[i + 1]} ${bytes[i + 2]}`,
    colors: () => null,
  },
  direction: {
    text(bytes, i) {
      const vector = direction(bytes, i);
      return vector ? numbers(vector, 2) : 'none';
    },
    colors: () => null,
  },
  distance: {
    text: (bytes, i) => metresText(number(bytes, i)),
    colors() {
      if (!distanceColors) {
        distanceColors = new Int32Array(65536).fill(pack([0, 0, 0]));
        for (let code = 1; code < noHit; code++) distanceColors[code] = pack(distanceColor(code / 1000));
      }
      return distanceColors;
    },
  },
  ids: {
    text(bytes, i, labels) {
      const id = number(bytes, i);
      return `${id} ${((labels[id] || {}).name || '').replaceAll('_', ' ')}`;
    },
    colors(labels) {
      const table = new Int32Array(65536).fill(pack([0, 0, 0]));
      for (const [id, row] of Object.entries(labels)) table[Number(id) & 65535] = pack(row.color);
      return table;
    },
  },
};

/** Paints an image, (width, height) as shown; where `keep` is given, pixels of other objects are dimmed. */
function paint(canvas, image, bytes, labels, keep) {
  const [width, height] = image.shown;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const picture = new ImageData(width, height);
  const out = new Int32Array(picture.data.buffer);
  const colors = FORMS[image.form].colors(labels);
  if (colors) for (let k = 0; k < out.length; k++) out[k] = colors[(bytes[4 * k] << 8) | bytes[4 * k + 1]];
  else picture.data.set(bytes);
  if (keep && keep.bytes.length === bytes.length) {
    for (let k = 0; k < out.length; k++) {
      if (number(keep.bytes, 4 * k) !== keep.id) for (let c = 0; c < 3; c++) picture.data[4 * k + c] = 40 + 0.22 * picture.data[4 * k + c];
    }
  }
  canvas.getContext('2d').putImageData(picture, 0, 0);
}
