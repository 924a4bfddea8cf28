"""Things on walls: pictures, mirrors, radiators, curtains, coat hooks, light switches; they look along +x, the wall is behind them."""

import math

import numpy as np

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import (
    block,
    blocks,
    flat_quads,
    lathe,
    membrane,
    merged,
    moved,
    repeated,
    rod,
    rotated,
    rounded_box,
    sheet,
    slab,
    stretched,
    sweep,
)
from renderer.models.model import Model, Pieces, Size, halved

ART_COLORS = 5


def molding(width: float, height: float, rim: float, profile: list[tuple[float, float]]) -> Mesh:
    """Return a mitred rectangular frame; ``profile`` is the closed section: x off the wall, share of ``rim`` inward."""
    rings = []
    for x, share in profile:
        half_w, half_h = 0.5 * width - share * rim, 0.5 * height - share * rim
        rings.append([(x, s * half_w, 0.5 * height + t * half_h) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    points = np.asarray(rings, np.float64)
    count = len(profile)
    quads = []
    for k in range(count):
        for c in range(4):
            d, n = (c + 1) % 4, (k + 1) % count
            quads.append([points[k, c], points[k, d], points[n, d], points[n, c]])
    return flat_quads(np.asarray(quads))


def build_picture(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a framed picture with mat: a landscape of ridges, an abstract of fields, circles, or a canvas for a painted texture."""
    depth, width, height = size_m
    rim = min(0.035, 0.09 * min(width, height))
    x0 = -0.5 * depth
    front = 0.5 * depth
    frame = molding(
        width, height, rim, [(x0, 0.0), (front - 0.3 * depth, 0.0), (front, 0.25), (front, 0.6), (front - 0.4 * depth, 1.0), (x0, 1.0)]
    )
    face = front - 0.5 * depth
    mat = block((x0 + 0.001, -0.5 * width + 0.8 * rim, 0.8 * rim), (face, 0.5 * width - 0.8 * rim, height - 0.8 * rim), 0.0005)
    border = rim + rng.uniform(0.10, 0.17) * min(width, height)
    half, low, high = 0.5 * width - border, border, height - border
    if style == "print":
        area = np.array([(-half, low), (half, low), (half, high), (-half, high)])
        return {"frame": frame, "mat": mat, "canvas": standing(area, face - 0.001, face + 0.0006)}
    fields = {"landscape": landscape, "abstract": _abstract, "circles": _circles}[style](rng, half, low, high)
    thick = 0.0006
    parts = {"frame": frame, "mat": mat}
    for k in range(ART_COLORS):
        layer = [standing(outline, face - 0.001, face + thick * (1 + k)) for outline in fields[k]]
        parts[f"art_{k}"] = merged(*layer)
    return parts


def standing(outline: Array, x0: float, x1: float) -> Mesh:
    """Return the thin plate over an outline (n, 2) of (y, z), counter-clockwise seen from +x.

    The outline may be a strip (n, 2, 2) of low and high points instead, from +y to -y.
    """
    if outline.ndim == 3:
        faces = [np.concatenate([np.full((*outline.shape[:2], 1), x), outline], axis=2)[::-1] for x in (x1, x0)]
        return sheet(faces[0], faces[1])
    plate = slab(outline, x0, x1)
    order = [2, 0, 1]
    return plate._replace(vertices=np.ascontiguousarray(plate.vertices[:, order]), normals=np.ascontiguousarray(plate.normals[:, order]))


def _rectangle(y0: float, y1: float, z0: float, z1: float) -> Array:
    return np.array([(y0, z0), (y1, z0), (y1, z1), (y0, z1)])


def _circle(y: float, z: float, radius: float, count: int = 28) -> Array:
    angle = np.arange(count) * (2.0 * math.pi / count)
    return np.column_stack([y + radius * el.cos(angle), z + radius * el.sin(angle)])


def landscape(rng: np.random.Generator, half: float, low: float, high: float) -> list[list[Array]]:
    """Return the layers of a picture of half width ``half``: sky, sun and three ridges that come nearer, as outlines (n, 2) of (y, z)."""
    tall = high - low
    sun = 0.09 * min(2 * half, tall) * rng.uniform(0.8, 1.5)
    fields = [[_rectangle(-half, half, low, high)], [_circle(rng.uniform(-0.5, 0.5) * half, low + 0.74 * tall, sun)]]
    for k in range(3):
        y = np.linspace(half, -half, 18)
        level = low + tall * (0.52 - 0.16 * k)
        waves = sum(rng.uniform(0.3, 1.0) / f * el.sin(f * 2.2 * y / half + rng.uniform(0, 6.3)) for f in (1, 2, 3, 5))
        ridge = level + 0.06 * tall * np.asarray(waves)
        fields.append([np.stack([points(y, low), np.column_stack([y, ridge])], axis=1)])
    return fields


def _abstract(rng: np.random.Generator, half: float, low: float, high: float) -> list[list[Array]]:
    """Overlapping upright and lying fields of colour."""
    fields = [[_rectangle(-half, half, low, high)]]
    for _ in range(ART_COLORS - 1):
        pieces = []
        for _ in range(int(rng.integers(1, 4))):
            y = np.sort(rng.uniform(-half, half, 2))
            z = np.sort(rng.uniform(low, high, 2))
            y[1], z[1] = max(y[1], y[0] + 0.15 * half), max(z[1], z[0] + 0.08 * (high - low))
            pieces.append(
                _rectangle(y[0], min(y[1], half), z[0], min(z[1], high))
                if y[0] < half * 0.98 and z[0] < high * 0.995
                else _rectangle(-half, 0.0, low, 0.5 * (low + high))
            )
        fields.append(pieces)
    return fields


def _circles(rng: np.random.Generator, half: float, low: float, high: float) -> list[list[Array]]:
    """Nested and scattered discs with a line of leaves, in the manner of mid-century prints."""
    fields = [[_rectangle(-half, half, low, high)]]
    radius = 0.5 * min(2 * half, high - low)
    for k in range(ART_COLORS - 1):
        pieces = []
        for _ in range(int(rng.integers(1, 3))):
            r = radius * rng.uniform(0.16, 0.5) * (1.0 - 0.15 * k)
            pieces.append(_circle(rng.uniform(-half + r, half - r), rng.uniform(low + r, high - r), r))
        fields.append(pieces)
    return fields


def build_wall_mirror(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a mirror with a moulded rectangular, a round or an arched frame."""
    depth, width, height = size_m
    x0, front = -0.5 * depth, 0.5 * depth
    glass_x = x0 + 0.55 * depth
    if style == "rectangular":
        rim = min(rng.uniform(0.025, 0.05), 0.12 * width)
        frame = molding(
            width, height, rim, [(x0, 0.0), (front - 0.3 * depth, 0.0), (front, 0.3), (front, 0.7), (glass_x - 0.001, 1.0), (x0, 1.0)]
        )
        glass = block((x0 + 0.001, -0.5 * width + 0.8 * rim, 0.8 * rim), (glass_x, 0.5 * width - 0.8 * rim, height - 0.8 * rim), 0.0005)
        return {"frame": frame, "glass": glass}
    if style == "round":
        ring = lathe(
            [(0.94, x0), (1.0, x0), (1.0, front - 0.2 * depth), (0.985, front), (0.955, front), (0.94, front - 0.2 * depth)],
            48,
            closed=True,
        )
        disc = lathe([(0.0, x0 + 0.001), (0.95, x0 + 0.001), (0.95, glass_x), (0.0, glass_x)], 48)
        frame, glass = (
            stretched(rotated(mesh, "y", math.pi / 2), (1.0, 0.5 * width, 0.5 * height), (0.0, 0.0, 0.5 * height)) for mesh in (ring, disc)
        )
        return {"frame": frame, "glass": glass}
    rim = 0.018
    outer = _arch(0.5 * width, height)
    inner = _arch(0.5 * width - rim, height - 2 * rim) + np.array([0.0, rim])
    return {"frame": _band(outer, inner, x0, front), "glass": standing(0.5 * (outer + inner), x0 + 0.001, glass_x)}


def _arch(half: float, height: float) -> Array:
    """Return the outline of a rectangle under a half-ellipse, counter-clockwise from the lower left."""
    rise = min(half, 0.5 * height)
    angle = np.linspace(0.0, math.pi, 25)
    top = np.column_stack([half * el.cos(angle), height - rise + rise * el.sin(angle)])
    return np.vstack([[(-half, 0.0), (half, 0.0)], top])


def _band(outer: Array, inner: Array, x0: float, x1: float) -> Mesh:
    """Return the frame between two outlines (n, 2) of equal length."""
    loops = [points(x, line) for x, line in ((x0, outer), (x1, outer), (x1, inner), (x0, inner))]
    pieces = []
    for a, b in zip(loops, loops[1:] + loops[:1], strict=True):
        pieces.append(flat_quads(np.stack([a, np.roll(a, -1, axis=0), np.roll(b, -1, axis=0), b], axis=1)))
    return merged(*pieces)


def build_radiator(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a panel radiator with ribs and grille, columns of cast sections, or flat bars; valve and pipe at one end."""
    depth, width, height, half_d, half_w = halved(size_m)
    side = 1.0 if rng.random() < 0.5 else -1.0
    low = 0.09 * height
    valve = merged(
        rod((0.0, side * (half_w - 0.03), 0.0), (0.0, side * (half_w - 0.03), low + 0.05), 0.009),
        rod((0.0, side * (half_w - 0.045), low + 0.04), (0.0, side * half_w, low + 0.04), 0.019),
    )
    if style == "column":
        count = max(3, round((width - 0.03) / 0.052))
        ys = np.linspace(-half_w + 0.045, half_w - 0.045, count)
        tube = rod((0.0, 0.0, low + 0.03), (0.0, 0.0, height - 0.03), 0.014, segments=8)
        tubes = repeated(tube, [(x, y, 0.0) for y in ys for x in (-half_d + 0.016, half_d - 0.016)])
        heads = blocks(
            [(-half_d, y - 0.021, z) for y in ys for z in (low, height - 0.055)],
            [(half_d, y + 0.021, z + 0.055) for y in ys for z in (low, height - 0.055)],
            0.016,
        )
        return {"panel": [tubes, heads], "valve": valve}
    if style == "bars":
        count = max(3, round((height - low) / 0.085))
        zs = np.linspace(low, height, count + 1)
        flats = blocks([(half_d - 0.016, -half_w, z + 0.004) for z in zs[:-1]], [(half_d, half_w, z - 0.004) for z in zs[1:]], 0.004)
        risers = blocks(
            [(-half_d + 0.2 * depth, s * (half_w - 0.06) - 0.018, low) for s in (-1.0, 1.0)],
            [(half_d - 0.014, s * (half_w - 0.06) + 0.018, height - 0.004) for s in (-1.0, 1.0)],
            0.006,
        )
        hung = blocks(
            [(-half_d, s * (half_w - 0.06) - 0.012, 0.6 * height) for s in (-1.0, 1.0)],
            [(half_d - 0.03, s * (half_w - 0.06) + 0.012, 0.6 * height + 0.05) for s in (-1.0, 1.0)],
        )
        return {"panel": [flats, risers, hung], "valve": valve}
    pitch = 0.034
    count = max(4, round((width - 0.06) / pitch))
    ys = np.linspace(-half_w + 0.05, half_w - 0.05, count)
    panels = [block((x, -half_w + 0.02, low), (x + 0.014, half_w - 0.02, height - 0.012), 0.005) for x in (half_d - 0.018, -half_d + 0.012)]
    ribs = blocks([(half_d - 0.008, y - 0.009, low + 0.05) for y in ys], [(half_d, y + 0.009, height - 0.06) for y in ys], 0.004)
    slots = blocks(points(-half_d + 0.012, ys - 0.002, height - 0.012), points(half_d - 0.005, ys + 0.004, height - 0.002), 0.001)
    sides = blocks(
        [(-half_d + 0.008, s * half_w - (0.022 if s > 0 else 0.0), low - 0.002) for s in (-1.0, 1.0)]
        + [(-half_d + 0.01, -half_w + 0.01, height - 0.012), (half_d - 0.02, -half_w + 0.01, height - 0.012)],
        [(half_d - 0.003, s * half_w + (0.022 if s < 0 else 0.0), height) for s in (-1.0, 1.0)]
        + [(-half_d + 0.03, half_w - 0.01, height - 0.001), (half_d - 0.003, half_w - 0.01, height - 0.001)],
        0.003,
    )
    brackets = blocks(
        [(-half_d, s * 0.6 * half_w - 0.02, 0.3 * height) for s in (-1.0, 1.0)],
        [(-half_d + 0.014, s * 0.6 * half_w + 0.02, 0.8 * height) for s in (-1.0, 1.0)],
    )
    return {"panel": [*panels, ribs, slots, sides, brackets], "valve": valve}


def build_curtain(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return two curtains drawn to the sides, hanging free, gathered by bands, or below a pelmet; the middle half stays open."""
    depth, width, height, half_d, half = halved(size_m)
    bar = min(0.014, 0.16 * depth)
    rod_z = height - 1.6 * bar
    cloth_half = 0.5 * width - 2.6 * bar
    span = min(rng.uniform(0.2, 0.25) * width, 0.55)
    top = rod_z - 1.2 * bar
    hangings = []
    bands = []
    for s in (-1.0, 1.0):
        edge = s * cloth_half
        low, high = sorted((edge, edge - s * span))
        hangings.append(_hanging(rng, (low, high), edge, half_d - 0.004, top, style == "tied"))
        if style == "tied":
            bands.append(_tie(edge - s * 0.21 * span, 0.23 * span, half_d - 0.003, 0.42 * height))
    pole = [rod((0.0, -half + 1.8 * bar, rod_z), (0.0, half - 1.8 * bar, rod_z), 0.8 * bar, segments=14)]
    ball = lathe(
        [
            (1.6 * bar * math.cos(a) if abs(a) < 1.57 else 0.0, 1.6 * bar * math.sin(a))
            for a in np.linspace(-0.5 * math.pi, 0.5 * math.pi, 9)
        ],
        16,
    )
    pole += [moved(ball, y=s * (half - 1.6 * bar), z=rod_z) for s in (-1.0, 1.0)]
    for s in (-1.0, 1.0):
        y = s * (half - 4.5 * bar)
        pole.append(rod((-half_d, y, rod_z), (0.0, y, rod_z), 0.5 * bar, segments=10))
        pole.append(
            moved(
                rotated(lathe([(0.0, 0.0), (1.5 * bar, 0.0), (1.5 * bar, 0.004), (0.0, 0.004)], 16), "y", 0.5 * math.pi), -half_d, y, rod_z
            )
        )
    spots = cloth_half - np.linspace(0.04, 0.96, 7) * span
    rings = repeated(_ring(0.0, rod_z, 1.15 * bar, 0.22 * bar), [(0.0, s * y, 0.0) for s in (-1.0, 1.0) for y in spots])
    parts = {"cloth": merged(*hangings, *bands), "rod": merged(*pole, rings)}
    if style == "pelmet":
        parts["pelmet"] = _pelmet(half_d, half, height)
    return parts


def _pelmet(half_d: float, half: float, height: float) -> Mesh:
    """Return a board with a scalloped lower edge that hides the rod, and its returns to the wall."""
    drop = min(0.24, 0.12 * height)
    count = max(3, round(2.0 * half / 0.34))
    y = np.linspace(-half, half, 8 * count + 1)
    low = height - drop + 0.3 * drop * (1.0 - el.power(np.abs(el.sin(0.5 * math.pi * count * (y / half + 1.0))), 0.7))
    z = low[:, None] + (height - low)[:, None] * np.linspace(0.0, 1.0, 4)
    yy = np.broadcast_to(y[:, None], z.shape)
    face = np.dstack([np.full_like(z, half_d), yy, z])
    board = sheet(face, face - np.array([0.012, 0.0, 0.0]))
    ends = blocks(
        [(-half_d, -half, height - drop), (-half_d, half - 0.012, height - drop), (-half_d, -half, height - 0.012)],
        [(half_d - 0.004, -half + 0.012, height), (half_d - 0.004, half, height), (half_d - 0.002, half, height)],
        0.002,
    )
    return merged(board, ends)


def _ring(y: float, z: float, radius: float, bar: float) -> Mesh:
    """Return a ring round the rod with an eye to the cloth below."""
    loop = [(radius + bar * math.cos(a), bar * math.sin(a)) for a in np.arange(6) * (math.pi / 3)]
    ring = moved(rotated(lathe(loop, 14, closed=True), "x", 0.5 * math.pi), 0.0, y, z)
    return merged(ring, rod((0.0, y, z - 0.95 * radius), (0.0, y, z - 1.9 * radius), 0.8 * bar, segments=6))


def _hanging(rng: np.random.Generator, span: tuple[float, float], edge: float, reach: float, top: float, tied: bool) -> Mesh:
    """Return one curtain between two y: pleats that are tight at the top and swing out below; ``tied`` draws it to ``edge`` at a band."""
    width = span[1] - span[0]
    pleats = max(3, round(width / rng.uniform(0.075, 0.095)))
    columns, rows = 12 * pleats + 1, 14
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, rows), indexing="ij")
    phase = rng.uniform(0.0, 2.0 * math.pi, 3)
    drift = 0.35 * el.sin(2.0 * math.pi * (1.3 * u + 0.5 * v) + phase[0]) * (1.0 - v)
    angle = 2.0 * math.pi * pleats * u + drift
    open_m = np.interp(v, [0.0, 0.6, 1.0], [1.0, 0.9, 0.6])
    uneven = 0.82 + 0.18 * el.sin(2.0 * math.pi * 1.7 * u + phase[1])
    amplitude = reach * open_m * uneven
    x = amplitude * el.sin(angle)
    y = span[0] + width * u + 0.085 * width / pleats * el.sin(2.0 * angle) * open_m
    z = top * v
    if tied:
        pinch = el.exp(-(((v - 0.42) / 0.16) ** 2)) + el.exp(-(((v - 0.42) / 0.3) ** 2)) * (v > 0.42)
        pull = 0.58 * np.minimum(pinch, 1.0)
        y = y + pull * (edge - y)
    return membrane(np.dstack([np.clip(x, -reach, reach), y, z]))


def _tie(y: float, half: float, reach: float, z: float) -> Mesh:
    """Return a cloth band round a gathered curtain, higher at the wall's side."""
    turn = np.arange(25) * (2.0 * math.pi / 24)
    ring = np.column_stack([reach * el.cos(turn), y + 1.02 * half * el.sin(turn)])
    heights = np.array([-0.03, 0.03])
    outer = np.stack([points(ring, z + h) for h in heights], axis=1)
    inner = outer.copy()
    inner[:, :, 0] *= 0.9
    inner[:, :, 1] = y + (inner[:, :, 1] - y) * 0.95
    return sheet(outer, inner)


def crook(reach: float, rise: float, bar: float) -> Mesh:
    """Return a hook that goes forward along +x from the origin and bends up to ``rise``, with a round end."""
    path = [(0.0, 0.0, 0.0), (0.55 * reach, 0.0, -0.1 * rise), (0.9 * reach, 0.0, 0.25 * rise), (reach, 0.0, rise)]
    ball = lathe([(0.0, -1.6 * bar), (1.2 * bar, -1.1 * bar), (1.7 * bar, 0.0), (1.2 * bar, 1.1 * bar), (0.0, 1.6 * bar)], 8)
    return merged(sweep(path, bar, 7), moved(ball, reach, 0.0, rise))


def build_wall_hooks(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a row of double hooks on a board, or of turned wooden pegs."""
    depth, width, height, half_d, half = halved(size_m)
    board_low = 0.35 * height if style == "hooks" else 0.2 * height
    thick = min(0.018, 0.25 * depth)
    board = rounded_box((-half_d, -half, board_low), (-half_d + thick, half, height), 0.006)
    count = max(2, round(width / 0.14))
    ys = np.linspace(-half, half, 2 * count + 1)[1::2]
    x = -half_d + thick - 0.001
    pieces = []
    for y in ys:
        if style == "pegs":
            length = depth - thick
            peg = lathe([(0.0, 0.0), (0.012, 0.0), (0.007, 0.4 * length), (0.013, 0.85 * length), (0.011, length), (0.0, length)], 14)
            pieces.append(moved(rotated(peg, "y", 0.5 * math.pi - 0.25), x, float(y), 0.55 * height))
            continue
        rise = 0.3 * height
        pieces.append(moved(crook(depth - thick, rise, 0.005), x, float(y), 0.65 * height))
        pieces.append(moved(crook(0.6 * (depth - thick), 0.18 * height, 0.005), x, float(y), 0.1 * height + 0.005))
        pieces.append(block((x, float(y) - 0.009, 0.1 * height - 0.012), (x + 0.005, float(y) + 0.009, 0.85 * height), 0.002))
    return {"board": board, "hooks": pieces}


MODELS = {
    "picture": Model(build_picture, ("landscape", "abstract", "circles", "print")),
    "wall_mirror": Model(build_wall_mirror, ("rectangular", "round", "arched")),
    "radiator": Model(build_radiator, ("panel", "column", "bars")),
    "curtain": Model(build_curtain, ("free", "tied", "pelmet")),
    "wall_hooks": Model(build_wall_hooks, ("hooks", "pegs")),
}
