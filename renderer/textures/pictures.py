"""Pictures that are mapped once over a part: art for frames, and what screens show.

Rows run upward: v = 0 is the lower edge of the picture.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.kernel import entry
from renderer.textures.noise import Field, coordinates, noise, smooth_step
from renderer.textures.pattern import Color, Generator, Picture, Request

Rgb = NDArray[np.floating[Any]]


class Canvas:
    """A picture while it is painted: its colours, and coordinates x and y in units of its shorter side, the origin in the lower left."""

    def __init__(self, request: Request, ground: Color | Rgb) -> None:
        u, v = coordinates(request.shape)
        self.width, self.height = max(1.0, request.aspect), max(1.0, 1.0 / request.aspect)
        self.x, self.y = (u * np.float32(self.width)), (v * np.float32(self.height))
        self.soft = 1.2 * max(self.width / request.shape[1], self.height / request.shape[0])
        self.rgb: Rgb = np.broadcast_to(np.asarray(ground, np.float32), (*request.shape, 3)).astype(np.float32)

    def paint(self, cover: Field, color: Color | Rgb) -> None:
        """Lay a colour over the picture where ``cover`` is above 0."""
        share, ink = np.broadcast_to(cover, self.rgb.shape[:2]), np.asarray(color, np.float32)
        if ink.ndim == 1:
            _paint(np.ascontiguousarray(share, np.float32), ink, self.rgb)
        else:
            self.rgb += share[..., None] * (ink - self.rgb)

    def disc(self, x: float, y: float, rx: float, ry: float, turn: float = 0.0) -> Field:
        """Return the cover of an ellipse."""
        cover = np.zeros(self.rgb.shape[:2], np.float32)
        shape = np.array([x, y, math.cos(turn), math.sin(turn), 1.0 / rx, 1.0 / ry, self.soft / min(rx, ry)], np.float32)
        _cover_disc(self.x.ravel(), self.y.ravel(), shape, cover)
        return cover

    def box(self, x0: float, x1: float, y0: float, y1: float) -> Field:
        """Return the cover of an upright rectangle."""
        s = 0.5 * self.soft
        across = smooth_step(x0 - s, x0 + s, self.x) * smooth_step(x1 + s, x1 - s, self.x)
        cover: Field = across * smooth_step(y0 - s, y0 + s, self.y) * smooth_step(y1 + s, y1 - s, self.y)
        return cover

    def fill(self, x0: float, x1: float, y0: float, y1: float, color: Color | Rgb, share: float = 1.0) -> None:
        """Paint an upright rectangle, quickly: only its own texels are touched."""
        rows, columns = self.rgb.shape[:2]
        left, right = max(0, int(x0 / self.width * columns) - 1), min(columns, int(x1 / self.width * columns) + 3)
        low, high = max(0, int(y0 / self.height * rows) - 1), min(rows, int(y1 / self.height * rows) + 3)
        if left >= right or low >= high:
            return
        box = np.array([x0, x1, y0, y1, self.soft, share], np.float32)
        _fill_box(self.x[0, left:right], self.y[low:high, 0], box, np.asarray(color, np.float32), self.rgb[low:high, left:right])

    def below(self, line: Field) -> Field:
        """Return the cover of what lies below a line of heights."""
        return smooth_step(0.5 * self.soft, -0.5 * self.soft, (self.y - line))


@entry
def _paint(cover: NDArray[np.float32], ink: NDArray[np.float32], rgb: NDArray[np.float32]) -> None:
    for row in range(cover.shape[0]):
        for column in range(cover.shape[1]):
            share = cover[row, column]
            if share != np.float32(0.0):
                for k in range(3):
                    rgb[row, column, k] += share * (ink[k] - rgb[row, column, k])


@entry
def _cover_disc(x: NDArray[np.float32], y: NDArray[np.float32], disc: NDArray[np.float32], cover: NDArray[np.float32]) -> None:
    """Fill the cover of an ellipse; ``disc``: centre x, y; cosine, sine of its turn; reciprocal radii; half width of its soft rim."""
    one, zero = np.float32(1.0), np.float32(0.0)
    soft = disc[6]
    outer = (one + soft) * (one + soft)
    for row in range(cover.shape[0]):
        dy = y[row] - disc[1]
        for column in range(cover.shape[1]):
            dx = x[column] - disc[0]
            a, b = (dx * disc[2] + dy * disc[3]) * disc[4], (dy * disc[2] - dx * disc[3]) * disc[5]
            square = a * a + b * b
            if square < outer:
                t = min(max((one + soft - np.sqrt(square)) / (np.float32(2.0) * soft), zero), one)
                cover[row, column] = t * t * (np.float32(3.0) - np.float32(2.0) * t)


@entry
def _fill_box(
    x: NDArray[np.float32], y: NDArray[np.float32], box: NDArray[np.float32], ink: NDArray[np.float32], rgb: NDArray[np.float32]
) -> None:
    """Paint an upright rectangle on its own texels; ``box``: x0, x1, y0, y1, width of the soft rim, share."""
    one, zero = np.float32(1.0), np.float32(0.0)
    soft, half = box[4], np.float32(0.5) * box[4]
    for row in range(len(y)):
        low = min(max((y[row] - box[2] + half) / soft, zero), one)
        high = min(max((box[3] - y[row] + half) / soft, zero), one)
        upright = low * low * (np.float32(3.0) - np.float32(2.0) * low) * high * high * (np.float32(3.0) - np.float32(2.0) * high)
        for column in range(len(x)):
            left = min(max((x[column] - box[0] + half) / soft, zero), one)
            right = min(max((box[1] - x[column] + half) / soft, zero), one)
            across = left * left * (np.float32(3.0) - np.float32(2.0) * left) * right * right * (np.float32(3.0) - np.float32(2.0) * right)
            share = box[5] * upright * across
            for k in range(3):
                rgb[row, column, k] += share * (ink[k] - rgb[row, column, k])


def _mix(a: Color | Rgb, b: Color | Rgb, share: float | Field) -> Rgb:
    first, second = np.asarray(a, np.float32), np.asarray(b, np.float32)
    weight = np.asarray(share, np.float32)
    weight = weight[..., None] if weight.ndim else weight
    mixed: Rgb = first + weight * (second - first)
    return mixed


def _inks(rng: np.random.Generator, request: Request) -> list[Rgb]:
    """Return a paper white, the given colours, and darker and lighter relatives of them, at least six."""
    inks = [np.asarray(color, np.float32) for color in request.colors]
    relatives = [_mix(color, (0.9, 0.86, 0.78), 0.6) for color in inks] + [_mix(color, (0.02, 0.025, 0.04), 0.65) for color in inks]
    order = rng.permutation(len(relatives))
    return [np.array([0.86, 0.82, 0.74], np.float32), *inks, *(relatives[k] for k in order)]


def _ridge(rng: np.random.Generator, count: int, rough: float) -> Field:
    """Return a skyline (1, count) of mean 0 and about unit height."""
    spectrum = rng.standard_normal(count // 2 + 1) + 1j * rng.standard_normal(count // 2 + 1)
    frequency = np.arange(count // 2 + 1, dtype=np.float64)
    spectrum[1:] /= el.power(frequency[1:], rough)
    spectrum[0] = 0.0
    spectrum[60:] = 0.0
    line = np.fft.irfft(spectrum, count).astype(np.float32)  # versions of numpy differ in last digits
    skyline: Field = (line / max(float(line.std()), 1e-9))[None, :]
    return skyline


def landscape(rng: np.random.Generator, request: Request) -> Picture:
    """Paint a landscape: a glowing sky, a sun or moon, ridges that fade into haze, perhaps water or a foreground of grass."""
    inks = _inks(rng, request)
    dusk, haze = inks[1 + int(rng.integers(len(request.colors)))], _mix(inks[0], (0.95, 0.75, 0.5), float(rng.uniform(0.0, 0.7)))
    canvas = Canvas(request, (0.5, 0.5, 0.5))
    horizon = canvas.height * float(rng.uniform(0.32, 0.55))
    up = el.power(np.clip((canvas.y - horizon) / (canvas.height - horizon), 0.0, 1.0), 0.7)
    canvas.rgb = np.broadcast_to(_mix(haze, _mix(dusk, (0.35, 0.5, 0.7), 0.35), up), canvas.rgb.shape).copy()
    clouds = smooth_step(0.2, 1.8, noise(rng, request.shape, 1.0, 20.0, 1.4, (2.5, 1.0))) * smooth_step(0.05, 0.4, up)
    canvas.paint(0.55 * clouds, (0.95, 0.92, 0.88))
    sun_x = canvas.width * float(rng.uniform(0.2, 0.8))
    sun = float(rng.uniform(0.05, 0.1))
    canvas.paint(canvas.disc(sun_x, horizon + 0.22 * canvas.height, sun, sun), _mix((1.0, 0.95, 0.8), haze, 0.2))
    layers = int(rng.integers(3, 6))
    near = _mix(dusk, (0.03, 0.06, 0.05), 0.75)
    for k in range(layers):
        depth = (k + 1) / layers
        line = horizon * (1.05 - 0.75 * el.power(depth, 1.3)) + canvas.height * (0.085 - 0.035 * depth) * _ridge(rng, request.shape[1], 1.2)
        tone = _mix(_mix(haze, dusk, 0.4), near, depth)
        canvas.paint(canvas.below(line), _mix(tone, haze, 0.25 * np.clip((line - canvas.y) * -0.0 + (1.0 - depth), 0.0, 1.0)))
    stroke = noise(rng, request.shape, 8.0, 90.0, 0.5, (2.5, 1.0))
    return _painted(rng, canvas, stroke, 0.05)


def abstract(rng: np.random.Generator, request: Request) -> Picture:
    """Paint colour fields: overlapping rounded shapes, a brush line or two, the grain of a brush."""
    inks = _inks(rng, request)
    canvas = Canvas(request, inks[0])
    blur = noise(rng, request.shape, 1.0, 5.0, 1.5)
    for k in range(int(rng.integers(4, 8))):
        x, y = canvas.width * float(rng.uniform(0.1, 0.9)), canvas.height * float(rng.uniform(0.1, 0.9))
        rx, ry = (float(rng.uniform(0.16, 0.46)) for _ in range(2))
        ink = inks[1 + k % (len(inks) - 1)]
        dx, dy = (canvas.x - x) / rx, (canvas.y - y) / ry
        power = float(rng.choice([2.0, 2.0, 5.0]))
        reach = el.power(el.power(np.abs(dx), power) + el.power(np.abs(dy), power), 1.0 / power) + 0.10 * blur
        soft = canvas.soft / min(rx, ry)
        canvas.paint(float(rng.uniform(0.75, 1.0)) * smooth_step(1.0 + soft, 1.0 - soft, reach), ink)
    for _ in range(int(rng.integers(1, 4))):
        line = canvas.height * (0.5 + 0.28 * _ridge(rng, request.shape[1], 2.2))
        thick = float(rng.uniform(0.006, 0.03))
        canvas.paint(smooth_step(thick, 0.6 * thick, np.abs(canvas.y - line)), inks[-1 - int(rng.integers(3))])
    return _painted(rng, canvas, noise(rng, request.shape, 6.0, 120.0, 0.5, (3.0, 1.0)), 0.06)


def geometric(rng: np.random.Generator, request: Request) -> Picture:
    """Paint rectangles cut from the canvas again and again, with lines between or arcs inside, in flat colours."""
    inks = _inks(rng, request)
    canvas = Canvas(request, inks[0])
    fields = [(0.0, canvas.width, 0.0, canvas.height)]
    for _ in range(int(rng.integers(6, 13))):
        fields.sort(key=lambda f: -(f[1] - f[0]) * (f[3] - f[2]))
        x0, x1, y0, y1 = fields.pop(0)
        share = float(rng.uniform(0.3, 0.7))
        if x1 - x0 > y1 - y0:
            cut = x0 + share * (x1 - x0)
            fields += [(x0, cut, y0, y1), (cut, x1, y0, y1)]
        else:
            cut = y0 + share * (y1 - y0)
            fields += [(x0, x1, y0, cut), (x0, x1, cut, y1)]
    arcs = rng.random() < 0.5
    line = 0.0 if arcs else float(rng.uniform(0.006, 0.014))
    for k, (x0, x1, y0, y1) in enumerate(fields):
        if line:
            canvas.fill(x0, x1, y0, y1, (0.03, 0.03, 0.035))
        canvas.fill(x0 + line, x1 - line, y0 + line, y1 - line, inks[int(rng.integers(len(inks)))])
        if arcs and k % 2:
            cx, cy = (x0, x1)[int(rng.integers(2))], (y0, y1)[int(rng.integers(2))]
            reach = min(x1 - x0, y1 - y0)
            for ring in range(3):
                radius = reach * (1.0 - 0.3 * ring)
                canvas.paint(canvas.box(x0, x1, y0, y1) * canvas.disc(cx, cy, radius, radius), inks[int(rng.integers(len(inks)))])
    return _painted(rng, canvas, noise(rng, request.shape, 20.0, 200.0, 0.2), 0.03)


def botanical(rng: np.random.Generator, request: Request) -> Picture:
    """Paint a pressed plant on paper: a bent stem, pairs of leaves, perhaps blossoms."""
    inks = _inks(rng, request)
    canvas = Canvas(request, inks[0])
    green = _mix(inks[1], (0.05, 0.14, 0.05), float(rng.uniform(0.3, 0.8)))
    bend, base = float(rng.uniform(-0.16, 0.16)), 0.5 * canvas.width
    top, pairs = 0.88 * canvas.height, int(rng.integers(5, 10))

    def stem(y: float | Field) -> float | Field:
        t = y / canvas.height
        return base + bend * (t - 0.3) + 0.5 * bend * t * t

    here = np.abs(canvas.x - np.asarray(stem(canvas.y)))
    canvas.paint(smooth_step(0.009, 0.005, here) * canvas.box(0.0, canvas.width, 0.08 * canvas.height, top), green)
    for k in range(pairs):
        y = canvas.height * (0.2 + 0.66 * k / pairs)
        length = 0.22 * (1.0 - 0.55 * k / pairs)
        for side in (-1.0, 1.0):
            turn = 0.5 * math.pi - side * float(rng.uniform(0.7, 1.05))
            x = float(stem(y)) + 0.9 * length * math.cos(turn)
            leaf = canvas.disc(x, y + 0.9 * length * math.sin(turn), length, 0.28 * length, turn)
            canvas.paint(leaf, _mix(green, inks[0], float(rng.uniform(0.0, 0.3))))
            middle = canvas.disc(x, y + 0.9 * length * math.sin(turn), 0.97 * length, 0.02 * length + 0.002, turn)
            canvas.paint(0.6 * middle, inks[0])
    if rng.random() < 0.5:
        for k in range(8):
            angle = 0.25 * math.pi * k
            canvas.paint(canvas.disc(float(stem(top)) + 0.06 * math.cos(angle), top + 0.06 * math.sin(angle), 0.055, 0.03, angle), inks[2])
        canvas.paint(canvas.disc(float(stem(top)), top, 0.035, 0.035), inks[-1])
    return _painted(rng, canvas, noise(rng, request.shape, 20.0, 200.0, 0.3), 0.02)


def poster(rng: np.random.Generator, request: Request) -> Picture:
    """Print a poster: one large shape over a ground in two colours, a title and lines of small text."""
    inks = _inks(rng, request)
    ground, shape = inks[int(rng.integers(3))], inks[3 % len(inks)]
    canvas = Canvas(request, ground)
    split = canvas.height * float(rng.uniform(0.25, 0.4))
    canvas.fill(0.0, canvas.width, 0.0, split, inks[1])
    x, y = canvas.width * float(rng.uniform(0.35, 0.65)), canvas.height * 0.6
    for ring in range(int(rng.integers(1, 5))):
        radius = 0.36 - 0.085 * ring
        canvas.paint(canvas.disc(x, y, radius, radius), shape if ring % 2 == 0 else ground)
    for k in range(int(rng.integers(0, 7))):
        canvas.fill(0.0, canvas.width, split + 0.035 * k, split + 0.035 * k + 0.014, inks[2])
    dark = np.array([0.03, 0.03, 0.04], np.float32)
    _text(rng, canvas, (0.09, canvas.width - 0.09, 0.62 * split, 0.84 * split), 1, dark)
    _text(rng, canvas, (0.09, 0.6 * canvas.width, 0.16 * split, 0.50 * split), 4, dark)
    return _painted(rng, canvas, noise(rng, request.shape, 30.0, 200.0, 0.2), 0.012)


def _text(rng: np.random.Generator, canvas: Canvas, area: tuple[float, float, float, float], lines: int, ink: Rgb) -> None:
    """Print lines of strokes that read as text from some way off."""
    x0, x1, y0, y1 = area
    pitch = (y1 - y0) / lines
    for k in range(lines):
        low = y0 + pitch * (lines - 1 - k) + 0.2 * pitch
        x, end = x0, x1 - (x1 - x0) * float(rng.uniform(0.0, 0.45)) * (lines > 1)
        while x < end:
            word = pitch * float(rng.uniform(0.8, 3.2))
            step = 0.42 * pitch
            for stem in np.arange(x, min(x + word, end), step):
                canvas.fill(float(stem), float(stem) + 0.62 * step, low, low + 0.55 * pitch, ink, 0.85)
            x += word + 0.45 * pitch


def _painted(rng: np.random.Generator, canvas: Canvas, stroke: Field, depth: float) -> Picture:
    """Return the canvas with the marks of the brush in shade and height."""
    rgb = np.clip(canvas.rgb * (1.0 + depth * stroke)[..., None], 0.0, 1.0)
    return Picture(rgb, (0.04 * stroke), (0.3 * stroke))


ART: tuple[Callable[[np.random.Generator, Request], Picture], ...] = (landscape, abstract, geometric, botanical, poster)


def art(rng: np.random.Generator, request: Request) -> Picture:
    """Paint a picture of any kind; plants and posters only where it stands upright."""
    kinds = ART if request.aspect < 1.0 else tuple(kind for kind in ART if kind not in (botanical, poster))
    return kinds[int(rng.integers(len(kinds)))](rng, request)


def television(rng: np.random.Generator, request: Request) -> Picture:
    """Show a broadcast: a landscape with a caption bar."""
    colors: tuple[Color, ...] = ((0.08, 0.25, 0.5), (0.5, 0.25, 0.08), (0.12, 0.3, 0.1))
    shown = landscape(rng, request._replace(colors=colors))
    canvas = Canvas(request, (0.0, 0.0, 0.0))
    canvas.rgb = shown.rgb
    canvas.fill(0.08, 0.08 + 0.55 * canvas.width, 0.09, 0.22, (0.03, 0.06, 0.16), 0.85)
    _text(rng, canvas, (0.12, 0.5 * canvas.width, 0.11, 0.20), 1, np.array([0.9, 0.9, 0.92], np.float32))
    return Picture(canvas.rgb)


def desktop(rng: np.random.Generator, request: Request) -> Picture:
    """Show a computer at work: wallpaper, a task bar, windows with text, code or a chart."""
    hue = rng.random(3)
    canvas = Canvas(request, (0.0, 0.0, 0.0))
    slope = 0.6 * canvas.x / canvas.width + 0.4 * canvas.y / canvas.height
    wave = 0.16 * el.sin(7.0 * canvas.x + 2.0 * el.sin(4.0 * canvas.y + 6.0 * float(rng.random())))
    canvas.rgb = np.broadcast_to(_mix(0.30 * hue + 0.02, 0.5 * np.roll(hue, 1) + 0.08, slope + wave), canvas.rgb.shape).copy()
    for _ in range(int(rng.integers(1, 4))):
        w, h = canvas.width * float(rng.uniform(0.35, 0.62)), canvas.height * float(rng.uniform(0.42, 0.72))
        x, y = float(rng.uniform(0.04, max(0.05, canvas.width - w - 0.04))), float(rng.uniform(0.10, max(0.11, canvas.height - h - 0.04)))
        night = rng.random() < 0.5
        paper, ink = ((0.013, 0.015, 0.02), (0.5, 0.52, 0.55)) if night else ((0.86, 0.87, 0.88), (0.08, 0.08, 0.09))
        canvas.fill(x - 0.012, x + w + 0.018, y - 0.022, y + h + 0.008, (0.0, 0.0, 0.0), 0.35)
        canvas.fill(x, x + w, y, y + h, paper)
        canvas.fill(x, x + w, y + h - 0.045, y + h, _mix(paper, (0.25, 0.27, 0.3), 0.5))
        rows = int(rng.integers(12, 20))
        pitch = (h - 0.09) / rows
        for k in range(rows):
            start = x + 0.03 + 0.03 * int(rng.integers(0, 4)) * night
            stop = min(x + w - 0.02, start + w * float(rng.uniform(0.15, 0.85)))
            low = y + 0.02 + k * pitch
            tone = (0.1 + 0.6 * rng.random(3)) if night else np.asarray(ink, np.float32)
            if rng.random() < 0.85:
                _text(rng, canvas, (start, stop, low, low + pitch), 1, tone)
        if not night:
            for k in range(8):
                bar = 0.35 * h * float(rng.uniform(0.2, 1.0))
                left = x + 0.62 * w + 0.035 * k * w / 0.9
                canvas.fill(left, left + 0.024 * w, y + 0.05, y + 0.05 + bar, 0.15 + 0.5 * hue)
    canvas.fill(0.0, canvas.width, 0.0, 0.055, (0.02, 0.022, 0.028), 0.85)
    for k in range(7):
        canvas.paint(canvas.disc(0.4 * canvas.width + 0.062 * k, 0.0275, 0.018, 0.018), (0.1 + 0.7 * rng.random(3)))
    return Picture(np.clip(canvas.rgb, 0.0, 1.0))


INKS = ((0.85, 0.42, 0.25), (0.25, 0.45, 0.75), (1.2, 1.0, 0.5))

GENERATORS = {
    "art": Generator(art, shape=(256, 256), tints=INKS, once=True, variants=0, inked=True),
    "television": Generator(television, shape=(256, 256), once=True, variants=24),
    "desktop": Generator(desktop, shape=(512, 512), once=True, variants=24),
}
