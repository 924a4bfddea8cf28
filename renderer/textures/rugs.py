"""Rugs, woven over their whole size: bordered ones with a field or a medallion, and flat ones with bands."""

from __future__ import annotations

import math

import numpy as np

from renderer.textures.noise import noise, smooth_step
from renderer.textures.pattern import Generator, Pattern, Request
from renderer.textures.pictures import Canvas


def rug(rng: np.random.Generator, request: Request) -> Pattern:
    """Weave a rug: guard stripes, a border with a running motif, a field with a lattice of small figures or a medallion."""
    canvas = Canvas(request, (0.0, 0.0, 0.0))
    x, y = np.broadcast_arrays(canvas.x, canvas.y)
    rim = np.minimum(np.minimum(x, canvas.width - x), np.minimum(y, canvas.height - y))
    broad = float(rng.uniform(0.11, 0.17))
    first, second, third = (np.zeros(request.shape, np.float32) for _ in range(3))
    border = smooth_step(broad + canvas.soft, broad - canvas.soft, rim)
    lines = np.zeros(request.shape, np.float32)
    for place, wide in ((0.022, 0.006), (0.24 * broad, 0.005), (0.86 * broad, 0.006), (1.12 * broad, 0.004)):
        lines = np.maximum(lines, smooth_step(wide + canvas.soft, wide, np.abs(rim - place)))
    pitch = 0.55 * broad
    at_side = np.minimum(x, canvas.width - x) < np.minimum(y, canvas.height - y)
    along = np.where(at_side, y, x)
    half = np.where(at_side, np.float32(0.5 * canvas.height), np.float32(0.5 * canvas.width))
    count = np.maximum(1.0, np.round(2.0 * half / pitch))
    step = ((along * count / (2.0 * half)) % 1.0) - 0.5
    off = (rim - 0.55 * broad) / pitch
    figure = smooth_step(0.40, 0.34, np.abs(step) + 0.9 * np.abs(off)) - 0.9 * smooth_step(0.20, 0.15, np.abs(step) + 0.9 * np.abs(off))
    third = np.clip(figure, 0.0, 1.0) * border
    cx, cy = x - 0.5 * canvas.width, y - 0.5 * canvas.height
    cell = float(rng.uniform(0.11, 0.18))
    kind = int(rng.integers(3))
    gx, gy = (cx / cell + 0.5) % 1.0 - 0.5, (cy / cell + 0.5) % 1.0 - 0.5
    diamond = np.abs(gx) + np.abs(gy)
    small = smooth_step(0.30, 0.26, diamond) - smooth_step(0.18, 0.14, diamond) + smooth_step(0.08, 0.05, diamond)
    trellis = smooth_step(0.035, 0.02, np.abs(np.abs(gx) + np.abs(gy) - 0.5))
    field = np.maximum(small, 0.7 * trellis)
    if kind:
        reach = np.abs(cx) / (0.40 * canvas.width) + np.abs(cy) / (0.40 * canvas.height)
        scallop = reach + 0.04 * np.cos(24.0 * np.arctan2(cy, cx))
        medallion = smooth_step(0.78, 0.76, scallop)
        ring = smooth_step(0.03, 0.02, np.abs(scallop - 0.70)) + smooth_step(0.02, 0.012, np.abs(scallop - 0.36))
        core = smooth_step(0.30, 0.28, scallop)
        field = np.where(medallion > 0.5, np.maximum(ring, 0.8 * small * (scallop < 0.62)), field)
        second = np.maximum(second, (medallion * (1.0 - core) * 0.9) * (1.0 - border))
    inside = 1.0 - border
    third = np.maximum(third, np.clip(field, 0.0, 1.0) * inside)
    third = np.clip(np.maximum(third, lines), 0.0, 1.0)
    first = border * (1.0 - third)
    second = second * (1.0 - third)
    pile = noise(rng, request.shape, 40.0, 220.0, 0.0)
    wear = noise(rng, request.shape, 1.0, 12.0, 1.0)
    knots = 0.03 * np.cos(2 * math.pi * 128 * canvas.y / canvas.height)
    shade = 1.0 + 0.05 * pile + 0.03 * wear + knots
    return Pattern(tuple(w for w in (first, second, third)), shade, None, (0.3 * pile))


def kilim(rng: np.random.Generator, request: Request) -> Pattern:
    """Weave a flat rug: bands across with stepped diamonds, zigzags and plain stripes."""
    canvas = Canvas(request, (0.0, 0.0, 0.0))
    x, y = np.broadcast_arrays(canvas.x, canvas.y)
    long = canvas.height >= canvas.width
    along, across, length = (y, x, canvas.height) if long else (x, y, canvas.width)
    layers = [np.zeros(request.shape, np.float32) for _ in range(3)]
    bands = 2 * int(rng.integers(5, 9)) + 1
    kinds = rng.integers(0, 5, bands // 2 + 1)
    place = along / length * bands
    band = np.minimum(np.floor(place), bands - 1).astype(np.int32)
    inside = place - band - 0.5
    kind = kinds[np.minimum(band, bands - 1 - band)]
    tooth = np.abs((across * bands / length) % 1.0 - 0.5)
    stepped = np.floor(tooth * 8.0) / 8.0
    diamond = stepped + np.floor(np.abs(inside) * 8.0) / 8.0
    zigzag = np.abs(inside + 0.5 * stepped - 0.12)
    layers[0] = np.where(kind == 0, 1.0, np.where(kind == 2, (diamond < 0.45), 0.0)) + (kind == 3) * (zigzag < 0.14)
    layers[1] = np.where(kind == 1, 1.0, 0.0) * (diamond >= 0.4) + (kind == 2) * (diamond < 0.2)
    layers[2] = (kind == 1) * (diamond < 0.4) + (kind == 4) * (np.abs(np.abs(inside) - 0.25) < 0.09) + (np.abs(inside) > 0.44)
    layers[2] = np.clip(layers[2], 0.0, 1.0)
    layers[1] = np.clip(layers[1], 0.0, 1.0) * (1.0 - layers[2])
    layers[0] = np.clip(layers[0], 0.0, 1.0) * (1.0 - layers[2]) * (1.0 - layers[1])
    yarn = noise(rng, request.shape, 10.0, 180.0, 0.3, (6.0, 1.0))
    ridge = np.cos(2 * math.pi * 128 * canvas.y / canvas.height)
    shade = 1.0 + 0.05 * yarn + 0.03 * ridge
    return Pattern(tuple(w for w in layers), shade, None, (0.25 * yarn + 0.2 * ridge))


TINTS = ((0.45, 0.42, 0.42), (1.5, 1.3, 1.1), (1.9, 1.8, 1.6))

GENERATORS = {
    "rug": Generator(rug, shape=(512, 512), tints=TINTS, once=True, variants=24),
    "kilim": Generator(kilim, shape=(512, 512), tints=TINTS, once=True, variants=24),
}
