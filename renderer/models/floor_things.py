"""What stands and lies on floors and about a home: coat racks, shoe racks, rugs, shoes."""

import math

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.cloth import coat
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, sheet, slab, stretched, sweep
from renderer.models.model import Model, Pieces, Size, halved, side_boards
from renderer.models.wall_things import crook


def build_coat_rack(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a standing rack with hooks and two coats: a turned pole on curved feet or a round plate, or three poles leaning together."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    pole_r = 0.02
    pieces: list[Mesh] = []
    if style == "feet":
        for k in range(4):
            path = [(0.01, 0.0, 0.24), (0.35 * r, 0.0, 0.16), (0.75 * r, 0.0, 0.05), (0.98 * r, 0.0, 0.012)]
            pieces.append(rotated(sweep(path, [0.016, 0.016, 0.014, 0.012], 8), "z", 0.5 * math.pi * k))
        bottom = 0.1
    elif style == "plate":
        pieces.append(lathe([(0.0, 0.0), (r, 0.0), (r, 0.012), (0.95 * r, 0.022), (0.0, 0.03)], 40))
        bottom = 0.02
    else:
        for a in (0.3, 0.3 + 2.0 * math.pi / 3.0, 0.3 + 4.0 * math.pi / 3.0):
            foot, head = (
                (0.96 * r * math.cos(a), 0.96 * r * math.sin(a), 0.0),
                (0.1 * r * math.cos(a), 0.1 * r * math.sin(a), height - 0.05),
            )
            pieces.append(rod(foot, head, 0.017, 0.014, 14))
        bottom = height - 0.5
    knob_z = height - 0.035
    profile = points(
        [0.0, pole_r, pole_r, 0.6 * pole_r, 1.3 * pole_r, 0.0], [bottom, bottom, knob_z - 0.03, knob_z, height - 0.015, height]
    )
    pieces.append(lathe(profile, 20))
    hooks = []
    for tier, count, share in ((height - 0.14, 4, 0.8), (height - 0.42, 4, 0.62)):
        for k in range(count):
            a = 2.0 * math.pi * (k + (0.5 if tier < height - 0.2 else 0.0)) / count
            hooks.append(moved(rotated(crook(share * r, 0.09, 0.008), "z", a), z=tier))
    coats = []
    for side, tier in ((0.0, height - 0.16), (math.pi, height - 0.2)):
        a = side + rng.uniform(-0.2, 0.2)
        low = height * rng.uniform(0.3, 0.42)
        cloth = coat(rng, (-0.36 * r, -0.8 * r, low), (0.36 * r, 0.8 * r, tier))
        coats.append(moved(rotated(cloth, "z", a), 0.52 * r * math.cos(a), 0.52 * r * math.sin(a)))
    return {"pole": pieces, "hooks": hooks, "coat_0": coats[0], "coat_1": coats[1]}


def build_shoe(rng: np.random.Generator, length: float, tall: float) -> tuple[Mesh, Mesh]:
    """Return upper and sole of a shoe whose toe points along +x, its heel at x = 0, standing on z = 0."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 10), np.linspace(-1.0, 1.0, 8), indexing="ij")
    half = 0.16 * length * np.interp(u, [0.0, 0.12, 0.4, 0.72, 0.92, 1.0], [0.45, 0.8, 0.78, 1.05, 0.75, 0.25])
    ridge = tall * np.interp(u, [0.0, 0.08, 0.3, 0.5, 0.8, 1.0], [0.75, 1.0, 0.95, 0.62, 0.42, 0.2])
    z = 0.16 * tall + (ridge - 0.16 * tall) * np.sqrt(np.clip(1.0 - el.power(v, 4), 0.0, 1.0))
    top = np.dstack([length * u, half * v, z])
    upper = sheet(top, np.dstack([length * u, half * v, np.full_like(u, 0.1 * tall)]))
    x, side = length * (1.02 * u[:, 0] - 0.01), 1.06 * half[:, 0]
    outline = np.vstack([np.column_stack([x, -side]), np.column_stack([x, side])[::-1]])
    return upper, slab(outline, 0.0, 0.18 * tall)


def build_shoe_rack(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a low rack with pairs of shoes on its boards: slats between end frames, or an open cabinet; its top is flat."""
    depth, _, height, half_d, half = halved(size_m)
    board = 0.02
    side = 0.022
    tiers = max(1, round((height - board) / 0.24))
    levels = [float(z) for z in np.linspace(0.06, height, tiers + 1)[:-1]]
    frame = [block((-half_d, -half, height - board), (half_d, half, height), 0.002)]
    if style == "cabinet":
        frame.append(side_boards(half, side, (-half_d, half_d - 0.003), (0.0, height - board + 0.002)))
        frame.append(block((-half_d, -half + 0.004, 0.04), (-half_d + 0.006, half - 0.004, height - 0.004), 0.001))
        shelves = blocks(
            [(-half_d + 0.002, -half + 0.01, z - 0.018) for z in levels], [(half_d - 0.006, half - 0.01, z) for z in levels], 0.002
        )
    else:
        for s in (-1.0, 1.0):
            y0, y1 = sorted((s * half, s * (half - 0.03)))
            frame += [block((x, y0, 0.0), (x + 0.03, y1, height - board + 0.002)) for x in (-half_d, half_d - 0.03)]
        count = max(3, round(depth / 0.06))
        xs = np.linspace(-half_d + 0.004, half_d - 0.004, count + 1)
        gap = 0.25 * (xs[1] - xs[0])
        shelves = blocks(
            [(x, -half + 0.008, z - 0.014) for z in levels for x in xs[:-1]],
            [(x - gap, half - 0.008, z) for z in levels for x in xs[1:]],
            0.002,
        )
    shoes: list[list[Mesh]] = [[], []]
    soles: list[Mesh] = []
    room = ((height - board) - levels[0]) / tiers
    for z in levels:
        y = -half + 0.09
        while y + 0.1 < half - 0.02:
            if rng.random() < 0.8 or not soles:
                length, tall = min(0.27 * rng.uniform(0.9, 1.05), 0.93 * depth), min(0.11, 0.55 * room) * rng.uniform(0.75, 1.0)
                color = int(rng.integers(2)) if shoes[0] else 0
                upper, sole = build_shoe(rng, length, tall)
                for shift in (-0.052, 0.052):
                    at = (-0.5 * length + rng.uniform(-0.02, 0.02) * (depth - length), y + shift, z)
                    shoes[color].append(moved(upper, *at))
                    soles.append(moved(sole, *at))
            y += rng.uniform(0.215, 0.25)
    if not soles:
        upper, sole = build_shoe(rng, 0.7 * depth, 0.4 * room)
        shoes[0].append(moved(upper, -0.35 * depth, 0.0, levels[0]))
        soles.append(moved(sole, -0.35 * depth, 0.0, levels[0]))
    spare = shoes[1] or [shoes[0].pop()] if len(shoes[0]) > 1 or shoes[1] else shoes[0]
    return {"frame": frame, "shelves": shelves, "shoes_0": [*shoes[0]], "shoes_1": spare, "soles": soles}


def build_shoes(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a pair of shoes, toes to the front: side by side, or one a step ahead of the other."""
    depth, width, height = size_m
    ahead = {"pair": 0.0, "kicked_off": 0.22}[style] * depth
    uppers: list[Mesh] = []
    soles: list[Mesh] = []
    for side in (-1.0, 1.0):
        upper, sole = build_shoe(rng, depth - ahead, height)
        turn = 0.0 if style == "pair" else side * float(rng.uniform(0.1, 0.3))
        for into, mesh in ((uppers, upper), (soles, sole)):
            into.append(rotated(moved(mesh, -0.5 * (depth - ahead) + 0.5 * side * ahead, side * 0.25 * width), "z", turn))
    return {"uppers": uppers, "soles": soles}


def build_rug(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a rug with border, inner line, pattern and fringe; a striped one; a round one with rings; or one piece for a woven pattern."""
    depth, width, height, half_d, half_w = halved(size_m)
    if style == "round":
        edge = 1.0 - rng.uniform(0.1, 0.2)
        pile = lathe([(0.0, 0.0), (edge, 0.0), (edge, 0.96 * height), (0.0, 0.97 * height)], 56)
        border = lathe([(edge, 0.0), (1.0, 0.0), (1.0, 0.6 * height), (0.99, 0.9 * height), (edge, 0.97 * height)], 56, closed=True)
        rings = [
            lathe([(r, 0.5 * height), (r + 0.05, 0.5 * height), (r + 0.05, height), (r, height)], 48, closed=True)
            for r in np.linspace(0.2, edge - 0.12, 3)
        ]
        scale = (half_d, half_w, 1.0)
        return {name: stretched(mesh, scale, (0, 0, 0)) for name, mesh in (("pile", pile), ("border", border), ("pattern", merged(*rings)))}
    fringe = min(0.06, 0.05 * max(depth, width))
    long_x = depth >= width
    half_d -= fringe * long_x
    half_w -= fringe * (not long_x)
    bevel = 0.35 * height
    count = 44
    spots = np.linspace(-0.985, 0.985, count)
    if long_x:
        threads = [
            ((s * half_d, half_w * t - 0.006, 0.0), (s * (half_d + fringe), half_w * t + 0.006, 0.4 * height))
            for s in (-1.0, 1.0)
            for t in spots
        ]
    else:
        threads = [
            ((half_d * t - 0.006, s * half_w, 0.0), (half_d * t + 0.006, s * (half_w + fringe), 0.4 * height))
            for s in (-1.0, 1.0)
            for t in spots
        ]
    tassels = blocks([np.minimum(a, b) for a, b in threads], [np.maximum(a, b) for a, b in threads], 0.002)
    if style == "woven":
        return {"pile": block((-half_d, -half_w, 0.0), (half_d, half_w, height), bevel), "fringe": tassels}
    edge = rng.uniform(0.07, 0.12) * min(depth, width)
    if style == "striped":
        pile = block((-half_d, -half_w, 0.0), (half_d, half_w, 0.95 * height), bevel)
        stripes = max(5, round(2 * max(half_d, half_w) / 0.16)) | 1
        edges = np.linspace(-1.0, 1.0, 2 * stripes + 1)
        low, high = [], []
        for k in range(1, 2 * stripes, 2):
            a, b = (edges[k], edges[k + 1]) if rng.random() < 0.5 else (edges[k], 0.5 * (edges[k] + edges[k + 1]))
            low.append((a * half_d, -half_w + 0.004, 0.3 * height) if long_x else (-half_d + 0.004, a * half_w, 0.3 * height))
            high.append((b * half_d, half_w - 0.004, height) if long_x else (half_d - 0.004, b * half_w, height))
        return {"pile": pile, "pattern": blocks(low, high, 0.001), "fringe": tassels}
    pile = block((-half_d + edge, -half_w + edge, 0.0), (half_d - edge, half_w - edge, 0.97 * height), 0.001)
    border = _flat_frame(half_d, half_w, edge, 0.0, 0.97 * height, bevel)
    lines = [_flat_frame(half_d - k, half_w - k, 0.018, 0.5 * height, height, 0.001) for k in (0.35 * edge, 1.25 * edge)]
    return {
        "pile": pile,
        "border": border,
        "pattern": [*lines, *_medallions(half_d - 1.6 * edge, half_w - 1.6 * edge, height)],
        "fringe": tassels,
    }


def _flat_frame(half_d: float, half_w: float, rim: float, low: float, high: float, bevel: float) -> Mesh:
    """Return a flat rectangular ring of four bars."""
    return blocks(
        [(-half_d, -half_w, low), (-half_d, half_w - rim, low), (-half_d, -half_w + rim, low), (half_d - rim, -half_w + rim, low)],
        [(half_d, -half_w + rim, high), (half_d, half_w, high), (-half_d + rim, half_w - rim, high), (half_d, half_w - rim, high)],
        bevel,
    )


def _medallions(half_d: float, half_w: float, height: float) -> list[Mesh]:
    """Return diamonds: a large one in the middle, small ones round it."""

    def diamond(x: float, y: float, a: float, b: float) -> Mesh:
        return slab([(x + a, y), (x, y + b), (x - a, y), (x, y - b)], 0.5 * height, height)

    pieces = []
    for size in (0.62, 0.5, 0.3):
        outer = np.array([(half_d * size, 0), (0, half_w * size), (-half_d * size, 0), (0, -half_w * size)])
        inner = 0.93 * outer if size != 0.3 else 0.0 * outer
        if size == 0.3:
            pieces.append(slab(outer, 0.5 * height, height))
        else:
            pieces += [slab([outer[k], outer[(k + 1) % 4], inner[(k + 1) % 4], inner[k]], 0.5 * height, height) for k in range(4)]
    small = 0.09 * min(half_d, half_w)
    pieces += [diamond(sx * 0.82 * half_d, sy * 0.82 * half_w, small, small) for sx in (-1, 1) for sy in (-1, 1)]
    pieces += [diamond(sx * 0.84 * half_d, 0.0, small, small) for sx in (-1, 1)] + [
        diamond(0.0, sy * 0.84 * half_w, small, small) for sy in (-1, 1)
    ]
    return pieces


MODELS = {
    "coat_rack": Model(build_coat_rack, ("feet", "plate", "tripod")),
    "shoe_rack": Model(build_shoe_rack, ("slats", "cabinet")),
    "shoes": Model(build_shoes, ("pair", "kicked_off")),
    "rug": Model(build_rug, ("bordered", "striped", "round", "woven")),
}
