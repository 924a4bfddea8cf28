"""Repeating ornament for wallpaper and printed cloth: flowers, damask, leaves, lattices; the cloth of books; packaging."""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.kernel import entry
from renderer.textures.noise import Field, coordinates, noise, smooth_step
from renderer.textures.pattern import Generator, Pattern, Request

PRINT = ((0.62, 0.62, 0.62), (1.18, 1.18, 1.18), (0.8, 0.84, 0.74))


class _Stamp:
    """Weights of a tile while motifs are stamped on it, each round a point, across the tile's edges as well."""

    def __init__(self, request: Request) -> None:
        self.weights = np.zeros((3, *request.shape), np.float32)
        self._shape = request.shape

    def near(self, x: float, y: float, reach: float) -> tuple[tuple[int, int], Field, Field]:
        """Return the first row and column of the texels within ``reach`` of (x, y), and the texels' offsets along u and v, all in tiles."""
        height, width = self._shape
        columns = np.arange(math.floor((x - reach) * width), math.ceil((x + reach) * width) + 1)
        rows = np.arange(math.floor((y - reach) * height), math.ceil((y + reach) * height) + 1)
        du = ((columns + 0.5) / width - x).astype(np.float32)[None, :]
        dv = ((rows + 0.5) / height - y).astype(np.float32)[:, None]
        return (int(rows[0]), int(columns[0])), du, dv

    def put(self, first: tuple[int, int], color: int, cover: Field) -> None:
        """Paint a colour (0 to 2) over what is there, from a first row and column on."""
        _put(self.weights, first[0], first[1], color, np.ascontiguousarray(cover, np.float32))


@entry
def _put(weights: NDArray[np.float32], first_row: int, first_column: int, color: int, cover: NDArray[np.float32]) -> None:
    _, height, width = weights.shape
    for i in range(cover.shape[0]):
        row = (first_row + i) % height
        for j in range(cover.shape[1]):
            share = cover[i, j]
            if share != np.float32(0.0):
                column = (first_column + j) % width
                for k in range(3):
                    weights[k, row, column] *= np.float32(1.0) - share
                weights[color, row, column] += share


def _flower(stamp: _Stamp, x: float, y: float, size: float, turn: float, petals: int, colors: tuple[int, int]) -> None:
    first, du, dv = stamp.near(x, y, 1.1 * size)
    radius, angle = np.sqrt(du * du + dv * dv), el.arctan2(dv, du) + turn
    soft = 0.045 * size
    lobe = np.abs(el.cos(0.5 * petals * angle))
    outer = size * (0.62 + 0.38 * el.power(lobe, 0.6))
    stamp.put(first, colors[0], smooth_step(outer + soft, outer - soft, radius) * (0.78 + 0.22 * smooth_step(0.2, 0.7, radius / size)))
    veins = smooth_step(0.16, 0.02, np.abs(el.sin(0.5 * petals * angle))) * smooth_step(0.75 * size, 0.3 * size, radius)
    stamp.put(first, colors[1], 0.45 * veins)
    stamp.put(first, colors[1], smooth_step(0.26 * size + soft, 0.26 * size - soft, radius))


def _leaf(stamp: _Stamp, x: float, y: float, size: float, turn: float, color: int) -> None:
    first, du, dv = stamp.near(x, y, 1.05 * size)
    along = (du * math.cos(turn) + dv * math.sin(turn)) / size
    across = (-du * math.sin(turn) + dv * math.cos(turn)) / size
    half = 0.30 * np.clip(1.0 - along**2, 0.0, 1.0) * (1.0 - 0.35 * along)
    inside = smooth_step(0.03, -0.03, np.abs(across) - half) * (np.abs(along) < 1.0)
    rib = smooth_step(0.05, 0.015, np.abs(across)) + 0.5 * smooth_step(0.12, 0.02, np.abs(el.sin(9.0 * (along - 1.2 * np.abs(across)))))
    stamp.put(first, color, inside * (1.0 - 0.45 * np.clip(rib, 0.0, 1.0)))


def floral(rng: np.random.Generator, request: Request, count: int, leaves: int) -> Pattern:
    """Draw flowers with leaves, scattered evenly; colours: petals, hearts, leaves."""
    stamp = _Stamp(request)
    places: list[tuple[float, float]] = []
    for _ in range(count):
        tries = rng.random((12, 2))
        if places:
            gap = np.abs((tries[:, None] - np.array(places)[None] + 0.5) % 1.0 - 0.5)
            tries = tries[np.argsort(-np.linalg.norm(gap, axis=2).min(axis=1), kind="stable")]
        places.append((float(tries[0, 0]), float(tries[0, 1])))
    petals = int(rng.integers(5, 9))
    size = 0.32 / math.sqrt(count)
    for x, y in places:
        grown = size * float(rng.uniform(0.45, 1.1))
        turn = float(rng.uniform(0.0, 2 * math.pi))
        for k in range(leaves):
            way = turn + 2 * math.pi * (k + float(rng.uniform(-0.25, 0.25))) / leaves
            _leaf(stamp, x + 1.45 * grown * math.cos(way), y + 1.45 * grown * math.sin(way), 0.85 * grown, way, 2)
        if petals:
            _flower(stamp, x, y, grown, turn, petals, (0, 1))
    return _printed(rng, request, tuple(stamp.weights))


def foliage(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw branches with leaves that climb along v, in two colours."""
    stamp = _Stamp(request)
    u, v = coordinates(request.shape)
    stems = int(rng.integers(2, 4))
    for s in range(stems):
        x0, phase, sway = (s + 0.5) / stems, float(rng.uniform(0, 2 * math.pi)), 0.22 / stems
        center = x0 + sway * el.sin(2 * math.pi * v + phase)
        line = smooth_step(0.009, 0.004, np.abs((u - center + 0.5) % 1.0 - 0.5))
        stamp.weights[s % 2] = np.maximum(stamp.weights[s % 2], line)
        count = 11
        for k in range(count):
            y = (k + 0.5) / count
            side = 1.0 if k % 2 else -1.0
            x = x0 + sway * math.sin(2 * math.pi * y + phase) + side * 0.16 / stems
            _leaf(stamp, x, y + 0.03, 0.2 / stems, math.pi / 2 - side * float(rng.uniform(0.6, 1.0)), s % 2)
    return _printed(rng, request, tuple(stamp.weights))


def damask(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw damask: an ogee lattice with mirrored palmettes at its crossings and in its fields; glossier where the ornament lies."""
    u, v = coordinates(request.shape)
    lobes, wave = int(rng.integers(3, 6)), float(rng.uniform(0.10, 0.13))
    ornament = np.zeros(request.shape, np.float32)
    for k in range(2):
        x = np.abs((u + 0.5 * k) % 1.0 - 0.5)
        y = (v + 0.5 * k) % 1.0 - 0.5
        ornament = np.maximum(ornament, _palmette(x, y * 1.15, lobes))
    frame = np.abs(np.abs(((u + 0.25) % 0.5) - 0.25) - (0.125 + wave * el.cos(2 * math.pi * v) * np.where(u % 1.0 < 0.5, 1.0, 1.0)))
    band = smooth_step(0.016, 0.010, frame) + 0.8 * smooth_step(0.006, 0.003, np.abs(frame - 0.026))
    beads = smooth_step(0.006, 0.003, np.abs(frame - 0.040)) * (el.sin(2 * math.pi * 28 * v) > 0.0)
    total = np.clip(np.maximum(ornament, np.maximum(band, 0.7 * beads) * (ornament < 0.05)), 0.0, 1.0)
    printed = _printed(rng, request, (total,))
    return printed._replace(roughness=(-0.22 * total), height=0.5 * total if printed.height is None else printed.height + 0.5 * total)


def _palmette(x: Field, y: Field, lobes: int) -> Field:
    """Return the cover of an upright mirrored ornament about the origin of a field; ``x`` is folded at its axis."""
    cover = np.zeros(np.broadcast_shapes(x.shape, y.shape), np.float32)
    for k in range(lobes):
        lean = (k / max(lobes - 1, 1)) * 1.75
        length = 0.205 - 0.07 * k / lobes
        for origin, way in ((-0.02, 1.0), (0.02, -0.62)):
            along = x * math.sin(lean) + (y - origin) * math.cos(lean) * way
            across = x * math.cos(lean) - (y - origin) * math.sin(lean) * way
            share = np.clip(along / (length * (1.0 if way > 0 else 0.8)), 0.0, 1.0)
            half = 0.155 * length * el.sin(math.pi * el.power(share, 1.4)) * (1.0 - 0.3 * np.abs(el.sin(9.0 * share)))
            curl = across + 0.05 * share**2 * (1.0 if k else 0.0)
            leaf = smooth_step(0.004, -0.004, np.abs(curl) - half) * (share > 0.02) * (share < 0.995)
            vein = smooth_step(0.0065, 0.003, np.abs(curl))
            cover = np.maximum(cover, leaf * (1.0 - 0.9 * vein))
    heart = np.sqrt(x * x + y * y)
    cover = np.maximum(cover * (heart > 0.035), smooth_step(0.026, 0.022, heart))
    for k in range(5):
        bx, by = 0.07 + 0.018 * k, -0.155 - 0.018 * (k - 2) ** 2 * 0.6
        cover = np.maximum(cover, smooth_step(0.011, 0.007, np.hypot(x - bx, y - by)))
    return cover


def lattice(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw a geometric lattice: interlaced lines of trellis, waves or scales, in one or two colours."""
    u, v = coordinates(request.shape)
    kind = int(rng.integers(4))
    width = float(rng.uniform(0.05, 0.09))
    if kind == 0:
        field = np.minimum(np.abs((u + v) % 1.0 - 0.5), np.abs((u - v) % 1.0 - 0.5))
    elif kind == 1:
        field = np.abs(np.abs(el.sin(math.pi * u)) * 0.5 - np.abs((v + 0.25 * el.sin(2 * math.pi * u)) % 1.0 - 0.5))
    elif kind == 2:
        field = np.abs(((v * 2.0 + 0.9 * np.abs((2.0 * u) % 1.0 - 0.5)) % 1.0) - 0.5)
    else:
        radius = np.full(request.shape, 9.0, np.float32)
        for k in range(2):
            for dy in (-1.0, -0.5, 0.0, 0.5, 1.0):
                cx = 0.5 * k + (0.25 if (2 * dy) % 2 else 0.0)
                radius = np.minimum(radius, np.abs(np.hypot((u - cx + 0.25) % 0.5 - 0.25, v - dy - 0.25) - 0.25))
        field = radius
    line = smooth_step(width, width - 0.02, field)
    inner = smooth_step(0.35 * width, 0.35 * width - 0.015, field) * (0.8 if rng.random() < 0.4 else 0.0)
    return _printed(rng, request, ((line * (1.0 - inner)), inner))


def _printed(rng: np.random.Generator, request: Request, weights: tuple[Field, ...]) -> Pattern:
    """Return printed paper or cloth: flat colours on a faintly uneven ground."""
    fine = noise(rng, request.shape, 30.0, 200.0, 0.2)
    ink = np.clip(np.sum(weights, axis=0), 0.0, 1.0)
    shade = 1.0 + 0.015 * fine
    full = tuple(np.broadcast_to(w, request.shape) for w in weights)
    return Pattern(full, shade, None, (0.12 * fine + 0.15 * ink))


def spines(rng: np.random.Generator, request: Request) -> Pattern:
    """Print the cloth of books: bands, a label and a title along u, again and again with another layout."""
    first, second = np.zeros(request.shape, np.float32), np.zeros(request.shape, np.float32)
    wide = request.shape[1] // 4
    local, v = coordinates((request.shape[0], wide))
    line, part = np.floor(v * 8.0), (v * 8.0) % 1.0
    middle = (part > 0.3) & (part < 0.7)
    for k in range(4):
        style = int(rng.integers(4))
        bands = np.zeros_like(local)
        for place in rng.uniform(0.04, 0.96, int(rng.integers(2, 5))):
            bands = np.maximum(bands, smooth_step(0.014, 0.008, np.abs(local - float(place))))
        start = float(rng.uniform(0.2, 0.4))
        stop = start + float(rng.uniform(0.25, 0.4))
        letters = ((local > start) & (local < stop) & middle) * (0.5 + 0.5 * np.sign(el.sin(90.0 * local + 7.0 * line)))
        label = ((local > start - 0.05) & (local < stop + 0.05)) if style == 1 else np.zeros_like(local)
        book = slice(k * wide, (k + 1) * wide)
        first[:, book] = np.clip((style != 3) * bands * (1.0 - label) + letters, 0.0, 1.0)
        second[:, book] = label * (1.0 - letters)
    cloth = noise(rng, request.shape, 20.0, 128.0, 0.2)
    weights = (first, (second * 0.9))
    return Pattern(weights, (1.0 + 0.03 * cloth), (-0.15 * first), (0.2 * cloth))


def packaging(rng: np.random.Generator, request: Request) -> Pattern:
    """Print packaging: a field with a wavy edge, a name in block letters on it, a roundel, lines of small print; one pack a tile."""
    u, v = (np.broadcast_to(each, request.shape) for each in coordinates(request.shape))
    texel = 1.0 / min(request.shape)
    low, high = float(rng.uniform(0.42, 0.55)), float(rng.uniform(0.84, 0.96))
    wave = float(rng.uniform(0.0, 0.07)) * el.sin(2.0 * math.pi * (u + float(rng.random())))
    field = smooth_step(low - texel, low + texel, v + wave) * smooth_step(high + texel, high - texel, v)
    # the name: letters of one height and of several widths, with strokes left out of them
    letter = float(rng.uniform(0.07, 0.12))
    middle, tall = 0.5 * (low + high), float(rng.uniform(0.07, 0.12))
    within = (np.abs(v - middle) < tall) & (np.abs(u - 0.5) < float(rng.uniform(0.26, 0.42)))
    place = (u / letter) % 1.0
    bars = np.floor(3.0 * (v - middle) / tall) % 2 == np.floor(u / letter) % 2
    stroke = (place < 0.72) & ~((np.abs(place - 0.36) < 0.16) & bars)
    name = (within & stroke).astype(np.float32)
    # a roundel, and what nobody reads
    x, y, r = float(rng.uniform(0.25, 0.75)), 0.5 * low + 0.06, float(rng.uniform(0.09, 0.16))
    away = np.hypot(u - x, v - y)
    roundel = smooth_step(r + texel, r - texel, away) * (1.0 - smooth_step(0.035, 0.02, np.abs(away - 0.7 * r)))
    line = np.floor(v / 0.035)
    ends = 0.55 + 0.35 * el.sin(5.0 * line + float(rng.uniform(0.0, 6.0)))
    small = (v < 0.17) & ((v / 0.035) % 1.0 < 0.45) & (u > 0.1) & (u < ends) & (el.sin(97.0 * u + 3.0 * line) > -0.5)
    ink = np.clip(name * field + small * (1.0 - roundel), 0.0, 1.0)
    weights = (0.9 * ink, field * (1.0 - ink), 0.9 * roundel * (1.0 - ink) * (1.0 - field))
    return Pattern(tuple(np.asarray(each, np.float32) for each in weights))


GENERATORS = {
    "floral": Generator(partial(floral, count=9, leaves=4), (1.0, 1.0), (512, 512), PRINT),
    "small_floral": Generator(partial(floral, count=22, leaves=2), (1.0, 1.0), (512, 512), PRINT),
    "foliage": Generator(foliage, (1.0, 1.0), (256, 256), PRINT),
    "damask": Generator(damask, (1.0, 1.0), (256, 256), ((1.22, 1.22, 1.22),)),
    "lattice": Generator(lattice, (1.0, 1.0), (256, 256), PRINT),
    "packaging": Generator(packaging, (1.0, 1.0), (128, 128), ((0.12, 0.12, 0.14), (0.5, 0.5, 0.5), (1.5, 1.3, 0.8)), variants=12),
    "spines": Generator(spines, (4.0, 4.0), (256, 512), ((3.2, 2.7, 1.6), (0.3, 0.3, 0.3)), variants=6),
}
