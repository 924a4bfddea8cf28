"""Cloth, carpet, knits, leather, paper and rugs: what soft surfaces are made of."""

import math
from functools import partial

import numpy as np

import kernel_cache.elementary as el
from renderer.textures.noise import Field, cells, coordinates, noise, per_cell, smooth_step
from renderer.textures.pattern import Generator, Pattern, Request
from renderer.textures.pictures import Canvas


def _weave(rng: np.random.Generator, request: Request, across: int, over: int, step: int) -> tuple[Field, Field, Field]:
    """Return which threads lie on top (1 along u, 0 along v), the height of the cloth and the tone of the threads.

    ``across`` threads a tile each way; each passes over ``over`` threads, and neighbours are set off by ``step``: 1 and 1 is plain weave,
    2 and 1 twill.
    """
    u, v = coordinates(request.shape)
    bend = 0.12 * noise(rng, request.shape, 2.0, 12.0, 1.0)
    x, y = u * across + bend, v * across + bend.T if bend.shape[0] == bend.shape[1] else v * across
    i, j = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    fx, fy = (x - np.floor(x) - 0.5) * 2.0, (y - np.floor(y) - 0.5) * 2.0
    phase = (i + step * j) % (2 * over)
    lying = phase < over
    cross_round, along_round = np.where(lying, fy, fx), np.where(lying, fx, fy)
    height = np.sqrt(np.clip(1.0 - 0.85 * cross_round**2, 0.0, 1.0)) * (1.0 - 0.35 * along_round**2 / over)
    thick = rng.normal(0.0, 1.0, (2, across))
    tone = np.where(lying, thick[0][j % across], thick[1][i % across])
    return lying * np.float32(1.0), height, tone


def weave(rng: np.random.Generator, request: Request, over: int, step: int, second: float) -> Pattern:
    """Draw woven cloth seen close: rounded threads, uneven as linen; ``second`` is the share of the second colour in the cross threads."""
    lying, height, tone = _weave(rng, request, 32, over, step)
    fuzz = noise(rng, request.shape, 10.0, 120.0, 0.3)
    shade = (0.72 + 0.36 * height) * (1.0 + 0.06 * tone + 0.03 * fuzz)
    return Pattern((second * (1.0 - lying),), shade, None, (height - 1.0 + 0.08 * fuzz))


def grasscloth(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw paper of woven grass, on half a metre: stalks along u of 2 to 6 mm, each of its own tone, thicker here and thinner there."""
    stalks = noise(rng, request.shape, 20.0, 110.0, 0.2, (16.0, 1.0))
    slubs = smooth_step(1.4, 2.6, noise(rng, request.shape, 20.0, 90.0, 0.0, (5.0, 1.0)))
    threads = noise(rng, request.shape, 60.0, 200.0, 0.0, (1.0, 6.0))
    shade = 1.0 + 0.045 * stalks + 0.012 * threads
    return Pattern((0.5 * slubs,), shade, None, 0.3 * stalks + 0.6 * slubs - 1.0)


def carpet(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw the pile of a carpet: tufts, here and there of another tone, and broad strokes where the pile lies over."""
    found = cells(rng, request.shape, 64, 64, 1.0)
    tone, other = per_cell(rng, found.number, 4096), per_cell(rng, found.number, 4096)
    tuft = np.clip(1.0 - found.nearest, 0.0, 1.0)
    lay = noise(rng, request.shape, 1.0, 9.0, 1.0)
    shade = (0.62 + 0.55 * tuft) * (1.0 + 0.20 * (tone - 0.5) + 0.035 * lay)
    fleck = 0.5 * (other > 0.8) + 0.25 * (other < 0.2)
    return Pattern((fleck,), shade, None, (tuft - 1.0))


def knit(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw stocking stitch, columns of Vs along v; the unit is a stitch's width, a tile has 16 x 16."""
    count = 16
    u, v = coordinates(request.shape)
    bend = 0.10 * noise(rng, request.shape, 2.0, 10.0, 1.0)
    x = u * count + bend
    column = np.floor(x)
    side = (x - column - 0.5) * 2.0
    y = v * count * 1.0 + 0.85 * np.abs(side) + bend
    row = np.floor(y)
    leg_across, leg_along = np.abs(side) - 0.5, (y - row) - 0.5
    height = np.sqrt(np.clip(1.0 - (1.75 * leg_across) ** 2 - (1.7 * leg_along) ** 2, 0.0, 1.0))
    strand = el.cos(2 * math.pi * (2.2 * leg_along + 1.6 * np.sign(side) * leg_across))
    index = ((row.astype(np.int32) % count) * count + column.astype(np.int32) % count) % (count * count)
    tone = per_cell(rng, index, count * count) - 0.5
    shade = (0.55 + 0.5 * height) * (1.0 + 0.05 * strand + 0.08 * tone)
    return Pattern((), shade, None, (height - 1.0 + 0.06 * strand * height))


def ribs(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw the ribs of corduroy along v; the unit is ten ribs."""
    u, _ = coordinates(request.shape)
    fuzz = noise(rng, request.shape, 8.0, 120.0, 0.3, (1.0, 3.0))
    rib = el.power(np.abs(el.sin(math.pi * 10.0 * u + 0.08 * fuzz)), 0.7)
    shade = (0.55 + 0.5 * rib) * (1.0 + 0.04 * fuzz)
    return Pattern((), shade, None, (rib - 1.0 + 0.04 * fuzz))


def velvet(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw velvet: soft patches where the pile was stroked another way."""
    lay = noise(rng, request.shape, 1.0, 10.0, 1.2)
    fine = noise(rng, request.shape, 30.0, 120.0, 0.0)
    return Pattern((), (1.0 + 0.09 * lay + 0.03 * fine), (0.03 * lay), (0.06 * fine))


def _threads(rng: np.random.Generator, request: Request) -> tuple[Field, Field]:
    """Return the shade and height of fine threads, for printed or patterned cloth seen from some way off."""
    u, v = coordinates(request.shape)
    count = request.shape[0] // 4
    fine = 0.5 * el.cos(2 * math.pi * count * u) * el.cos(2 * math.pi * count * v)
    uneven = noise(rng, request.shape, 3.0, 120.0, 0.5)
    return (1.0 + 0.05 * fine + 0.025 * uneven), (0.5 * fine + 0.1 * uneven - 0.5)


def stripes(rng: np.random.Generator, request: Request, most: int, smooth: bool) -> Pattern:
    """Draw stripes along v: one repeat of up to ``most`` bands in the second and third colour, mirrored in itself."""
    u, _ = coordinates(request.shape)
    fold = np.abs(((u + float(rng.random())) % 1.0) - 0.5) * 2.0
    edges = np.sort(rng.uniform(0.08, 0.95, 2 * int(rng.integers(1, most + 1))))
    weights = [np.zeros_like(fold), np.zeros_like(fold)]
    soft = 2.5 / request.shape[1]
    for k, (a, b) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        b = max(b, a + 0.03)
        weights[k % 2] = np.maximum(weights[k % 2], smooth_step(a - soft, a + soft, fold) * smooth_step(b + soft, b - soft, fold))
    full = tuple(np.broadcast_to(w, request.shape) for w in weights)
    if smooth:
        paper = noise(rng, request.shape, 20.0, 120.0, 0.2)
        return Pattern(full, (1.0 + 0.012 * paper), -0.12 * full[0], (0.1 * paper))
    shade, height = _threads(rng, request)
    return Pattern(full, shade, None, height)


def checks(rng: np.random.Generator, request: Request, bands: int) -> Pattern:
    """Draw checked cloth; one band is gingham, more are tartan: the same bands both ways, mixed where they cross as twill does."""
    u, v = coordinates(request.shape)
    soft = 2.0 / request.shape[0]
    lines: list[list[Field]] = [[], []]
    if bands == 1:
        plan = [(0.25, 0.75, 0)]
    else:
        plan = [(float(rng.uniform(0.0, 0.3)), float(rng.uniform(0.42, 0.62)), 0)]
        plan += [(a, a + float(rng.uniform(0.015, 0.05)), int(rng.integers(2))) for a in rng.uniform(0.02, 0.94, bands)]
    for k, place in enumerate((u, v)):
        for color in range(2):
            total = np.zeros_like(place)
            for a, b, c in plan:
                if c == color:
                    total = np.maximum(total, smooth_step(a - soft, a + soft, place) * smooth_step(b + soft, b - soft, place))
            lines[k].append(total)
    first = 0.5 * (lines[0][0] + lines[1][0])
    other = 0.5 * (lines[0][1] + lines[1][1])
    shade, height = _threads(rng, request)
    twill = 0.04 * el.cos(2 * math.pi * (request.shape[0] // 6) * (u + v))
    return Pattern((first * (1.0 - other), other), (shade + twill), None, height)


def dots(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw printed dots or rings on a diamond lattice; the unit is the distance of rows."""
    u, v = coordinates(request.shape)
    radius, ring = float(rng.uniform(0.13, 0.27)), bool(rng.random() < 0.35)
    weights = []
    for k in range(2):
        dx, dy = (u - 0.25 - 0.5 * k + 0.5) % 1.0 - 0.5, (v - 0.25 - 0.5 * k + 0.5) % 1.0 - 0.5
        distance = np.sqrt(dx * dx + dy * dy)
        dot = smooth_step(radius + 0.01, radius - 0.01, distance)
        weights.append(dot - (smooth_step(0.62 * radius, 0.54 * radius, distance) if ring else 0.0))
    second = weights[1] if rng.random() < 0.4 else np.zeros_like(weights[1])
    shade, height = _threads(rng, request)
    return Pattern((weights[0] + weights[1] - second, second), shade, None, height)


def quilted(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw diamond quilting: puffed fields between seams; the unit is the diamond's width."""
    u, v = coordinates(request.shape)
    a, b = np.abs(el.sin(math.pi * (u + v))), np.abs(el.sin(math.pi * (u - v)))
    puff = el.power(np.minimum(a, b), 0.45)
    soft = noise(rng, request.shape, 2.0, 30.0, 0.8)
    return Pattern((), (0.88 + 0.14 * puff + 0.015 * soft), None, (puff - 1.0 + 0.04 * soft))


def leather(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw leather: pebbles between fine creases, worn lighter in patches."""
    fold = 0.25 * noise(rng, request.shape, 3.0, 20.0, 1.0)
    found = cells(rng, request.shape, 44, 44, 1.0)
    pebble = smooth_step(0.0, 0.32, found.second - found.nearest)
    tone = per_cell(rng, found.number, 1936) - 0.5
    worn = noise(rng, request.shape, 1.0, 8.0, 1.2)
    shade = (0.86 + 0.15 * pebble) * (1.0 + 0.05 * worn + 0.04 * tone)
    rough = 0.10 * (1.0 - pebble) - 0.03 * worn
    return Pattern((), shade, rough, (pebble - 1.0 + 0.3 * fold))


def brushed(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw metal brushed along u: streaks in gloss more than in colour."""
    streak = noise(rng, request.shape, 1.0, 120.0, 0.0, (40.0, 1.0))
    broad = noise(rng, request.shape, 1.0, 4.0, 1.0)
    rough = 0.05 * streak + 0.02 * broad
    return Pattern((), (1.0 + 0.03 * streak), rough, (0.15 * streak))


def paper(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw paper or board: fibres at all angles, a cloudy sheet."""
    fibre = noise(rng, request.shape, 10.0, 120.0, 0.2, (4.0, 1.0)) + noise(rng, request.shape, 10.0, 120.0, 0.2, (1.0, 4.0))
    cloud = noise(rng, request.shape, 1.0, 20.0, 1.0)
    return Pattern((), (1.0 + 0.012 * fibre + 0.015 * cloud), None, (0.15 * fibre))


def wicker(rng: np.random.Generator, request: Request) -> Pattern:
    """Draw basketwork: thick canes over and under; a tile has 12 canes each way."""
    lying, height, tone = _weave(rng, request, 12, 1, 1)
    fibre = noise(rng, request.shape, 20.0, 120.0, 0.0, (4.0, 1.0))
    shade = (0.45 + 0.62 * height) * (1.0 + 0.09 * tone + 0.05 * fibre)
    return Pattern((0.15 * lying,), shade, None, (height - 1.0))


CLOTH = ((0.72, 0.70, 0.68), (1.22, 1.22, 1.22), (0.5, 0.5, 0.5))


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
        scallop = reach + 0.04 * el.cos(24.0 * el.arctan2(cy, cx))
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
    knots = 0.03 * el.cos(2 * math.pi * 128 * canvas.y / canvas.height)
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
    ridge = el.cos(2 * math.pi * 128 * canvas.y / canvas.height)
    shade = 1.0 + 0.05 * yarn + 0.03 * ridge
    return Pattern(tuple(w for w in layers), shade, None, (0.25 * yarn + 0.2 * ridge))


TINTS = ((0.45, 0.42, 0.42), (1.5, 1.3, 1.1), (1.9, 1.8, 1.6))


GENERATORS = {
    "weave": Generator(partial(weave, over=1, step=1, second=0.6), (1.0, 1.0), (256, 256), CLOTH, variants=4),
    "twill": Generator(partial(weave, over=2, step=1, second=0.8), (1.0, 1.0), (256, 256), CLOTH, variants=4),
    "grasscloth": Generator(grasscloth, (1.0, 1.0), (512, 512), ((0.8, 0.8, 0.8),), variants=4),
    "carpet": Generator(carpet, (1.0, 1.0), (256, 256), ((0.72, 0.71, 0.7),), variants=4),
    "knit": Generator(knit, (16.0, 16.0), (256, 256), CLOTH, variants=4),
    "ribs": Generator(ribs, (1.0, 1.0), (256, 256), CLOTH, variants=4),
    "velvet": Generator(velvet, (1.0, 1.0), (256, 256), CLOTH, variants=4),
    "stripes": Generator(partial(stripes, most=3, smooth=False), (1.0, 1.0), (256, 256), CLOTH),
    "striped_paper": Generator(partial(stripes, most=2, smooth=True), (1.0, 1.0), (256, 256), ((1.12, 1.12, 1.12), (0.85, 0.85, 0.85))),
    "gingham": Generator(partial(checks, bands=1), (1.0, 1.0), (256, 256), CLOTH),
    "tartan": Generator(partial(checks, bands=4), (1.0, 1.0), (256, 256), CLOTH),
    "dots": Generator(dots, (2.0, 2.0), (256, 256), CLOTH),
    "quilted": Generator(quilted, (1.0, 1.0), (128, 128), (), variants=4),
    "leather": Generator(leather, (1.0, 1.0), (256, 256), (), variants=4),
    "brushed": Generator(brushed, (1.0, 1.0), (256, 256), (), variants=4),
    "paper": Generator(paper, (1.0, 1.0), (256, 256), (), variants=4),
    "wicker": Generator(wicker, (12.0, 12.0), (256, 256), CLOTH),
    "rug": Generator(rug, shape=(512, 512), tints=TINTS, once=True, variants=24),
    "kilim": Generator(kilim, shape=(512, 512), tints=TINTS, once=True, variants=24),
}
