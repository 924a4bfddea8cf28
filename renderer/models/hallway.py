"""Hallway things: coat racks, wall hooks, shoe racks, umbrella stands, light switches; those on walls look along +x."""

from __future__ import annotations

import itertools
import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, sheet, slab, sweep
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import wrinkles


def _crook(reach: float, rise: float, bar: float) -> Mesh:
    """Return a hook that goes forward along +x from the origin and bends up to ``rise``, with a round end."""
    path = [(0.0, 0.0, 0.0), (0.55 * reach, 0.0, -0.1 * rise), (0.9 * reach, 0.0, 0.25 * rise), (reach, 0.0, rise)]
    ball = lathe([(0.0, -1.6 * bar), (1.2 * bar, -1.1 * bar), (1.7 * bar, 0.0), (1.2 * bar, 1.1 * bar), (0.0, 1.6 * bar)], 8)
    return merged(sweep(path, bar, 7), moved(ball, reach, 0.0, rise))


def _coat(rng: np.random.Generator, top: float, low: float, half: float, deep: float) -> Mesh:
    """Return a coat that hangs from a hook at (0, 0, top): narrow shoulders, folds that grow towards the hem."""
    v, turn = np.linspace(0.0, 1.0, 16), np.linspace(0.0, 2.0 * math.pi, 41)
    vv, aa = np.meshgrid(v, turn, indexing="ij")
    spread = np.interp(vv, [0.0, 0.05, 0.16, 0.5, 1.0], [0.12, 0.3, 0.62, 0.8, 1.0])
    folds = 1.0 + 0.16 * vv * np.cos(7.0 * aa + rng.uniform(0.0, 6.28)) + 0.07 * vv * np.cos(12.0 * aa + 3.0 * vv)
    soft = 1.0 + 0.04 * wrinkles(rng, np.cos(aa) + vv, np.sin(aa) + vv, 6, 0.5, 1.5)
    radius = spread * folds * soft
    y, x = half * radius * np.cos(aa), deep * radius * np.sin(aa)
    z = top - (top - low) * vv - 0.02 * np.abs(np.cos(aa)) * (vv > 0.0)
    rings = np.dstack([x, y, z])
    rings[:, -1] = rings[:, 0]
    skin = sheet(rings[:, ::-1], rings[:, ::-1] * (0.9, 0.9, 1.0) - (0.0, 0.0, 0.004))
    return skin


def build_coat_rack(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
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
    profile = [
        (0.0, bottom),
        (pole_r, bottom),
        (pole_r, knob_z - 0.03),
        (0.6 * pole_r, knob_z),
        (1.3 * pole_r, height - 0.015),
        (0.0, height),
    ]
    pieces.append(lathe(profile, 20))
    hooks = []
    for tier, count, share in ((height - 0.14, 4, 0.8), (height - 0.42, 4, 0.62)):
        for k in range(count):
            a = 2.0 * math.pi * (k + (0.5 if tier < height - 0.2 else 0.0)) / count
            hooks.append(moved(rotated(_crook(share * r, 0.09, 0.008), "z", a), z=tier))
    coats = []
    for side, tier in ((0.0, height - 0.16), (math.pi, height - 0.2)):
        a = side + rng.uniform(-0.2, 0.2)
        low = height * rng.uniform(0.3, 0.42)
        coat = _coat(rng, tier, low, 0.62 * r, 0.36 * r)
        coats.append(moved(rotated(coat, "z", a), 0.52 * r * math.cos(a), 0.52 * r * math.sin(a)))
    return fitted({"pole": merged(*pieces), "hooks": merged(*hooks), "coat_0": coats[0], "coat_1": coats[1]}, size_m)


def build_wall_hooks(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a row of double hooks on a board, or of turned wooden pegs."""
    depth, width, height = size_m
    half_d, half = 0.5 * depth, 0.5 * width
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
        pieces.append(moved(_crook(depth - thick, rise, 0.005), x, float(y), 0.65 * height))
        pieces.append(moved(_crook(0.6 * (depth - thick), 0.18 * height, 0.005), x, float(y), 0.1 * height + 0.005))
        pieces.append(block((x, float(y) - 0.009, 0.1 * height - 0.012), (x + 0.005, float(y) + 0.009, 0.85 * height), 0.002))
    return fitted({"board": board, "hooks": merged(*pieces)}, size_m)


def build_shoe(rng: np.random.Generator, length: float, tall: float) -> tuple[Mesh, Mesh]:
    """Return upper and sole of a shoe whose toe points along +x, its heel at x = 0, standing on z = 0."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 10), np.linspace(-1.0, 1.0, 8), indexing="ij")
    half = 0.16 * length * np.interp(u, [0.0, 0.12, 0.4, 0.72, 0.92, 1.0], [0.45, 0.8, 0.78, 1.05, 0.75, 0.25])
    ridge = tall * np.interp(u, [0.0, 0.08, 0.3, 0.5, 0.8, 1.0], [0.75, 1.0, 0.95, 0.62, 0.42, 0.2])
    z = 0.16 * tall + (ridge - 0.16 * tall) * np.sqrt(np.clip(1.0 - v**4, 0.0, 1.0))
    top = np.dstack([length * u, half * v, z])
    upper = sheet(top, np.dstack([length * u, half * v, np.full_like(u, 0.1 * tall)]))
    x, side = length * (1.02 * u[:, 0] - 0.01), 1.06 * half[:, 0]
    outline = np.vstack([np.column_stack([x, -side]), np.column_stack([x, side])[::-1]])
    return upper, slab(outline, 0.0, 0.18 * tall)


def build_shoe_rack(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a low rack with pairs of shoes on its boards: slats between end frames, or an open cabinet; its top is flat."""
    depth, width, height = size_m
    half_d, half = 0.5 * depth, 0.5 * width
    board = 0.02
    side = 0.022
    tiers = max(1, round((height - board) / 0.24))
    levels = [float(z) for z in np.linspace(0.06, height, tiers + 1)[:-1]]
    frame = [block((-half_d, -half, height - board), (half_d, half, height), 0.002)]
    if style == "cabinet":
        frame += [
            block(
                (-half_d, s * half - (side if s > 0 else 0.0), 0.0),
                (half_d - 0.003, s * half + (side if s < 0 else 0.0), height - board + 0.002),
            )
            for s in (-1.0, 1.0)
        ]
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
    return fitted(
        {"frame": merged(*frame), "shelves": shelves, "shoes_0": merged(*shoes[0]), "shoes_1": merged(*spare), "soles": merged(*soles)},
        size_m,
    )


def build_umbrella_stand(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a tall open vessel, or a frame of hoops on a tray, with two umbrellas."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    rim = 0.66 * height
    if style == "vessel":
        wall = 0.006
        profile = [(0.0, 0.0), (0.86 * r, 0.0), (0.88 * r, 0.01), (0.86 * r, 0.4 * rim), (r, rim - 0.006), (r, rim), (r - wall, rim)]
        body = lathe([*profile, (0.86 * r - wall, 0.4 * rim), (0.86 * r - wall, 0.02), (0.0, 0.02)], 40)
    else:
        tray = lathe([(0.0, 0.0), (0.98 * r, 0.0), (r, 0.03), (0.96 * r, 0.03), (0.94 * r, 0.008), (0.0, 0.008)], 36)
        hoops = [lathe([(0.95 * r, z), (r, z), (r, z + 0.012), (0.95 * r, z + 0.012)], 36, closed=True) for z in (0.45 * rim, rim - 0.012)]
        bars = [
            rod(
                (0.975 * r * math.cos(a), 0.975 * r * math.sin(a), 0.01),
                (0.975 * r * math.cos(a), 0.975 * r * math.sin(a), rim - 0.004),
                0.005,
                segments=6,
            )
            for a in np.arange(8) * (math.pi / 4)
        ]
        body = merged(tray, *hoops, *bars)
    cloths, grips = [], []
    for k, s in enumerate((-1.0, 1.0)):
        top = height * (1.0 if k == 0 else 0.93)
        start, end = np.array([-0.25 * s * r, -0.35 * s * r, 0.03]), np.array([0.25 * s * r, 0.42 * s * r, 0.82 * top])
        t = np.array([0.0, 0.08, 0.2, 0.5, 0.8, 0.95, 1.0])
        girth = np.array([0.004, 0.005, 0.016, 0.026, 0.022, 0.014, 0.005]) * min(1.0, r / 0.1)
        cloths.append(sweep(start + t[:, None] * (end - start), girth, 10))
        q = 0.03 * min(1.0, r / 0.1)
        turn = np.linspace(0.0, math.pi, 7)
        bow = np.column_stack([end[0] - q + q * np.cos(turn), np.full(7, end[1]), top - q - 0.006 + q * np.sin(turn)])
        path = np.vstack([end, bow, bow[-1] - (0.0, 0.0, 0.8 * q)])
        grips.append(sweep(path, 0.22 * q, 8))
    return fitted({"body": body, "umbrella_0": cloths[0], "umbrella_1": cloths[1], "handles": merged(*grips)}, size_m)


def build_light_switch(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a plate with one rocker, or with two side by side."""
    depth, width, height = size_m
    half_d, half = 0.5 * depth, 0.5 * width
    face = -half_d + 0.6 * depth
    plate = rounded_box((-half_d, -half, 0.0), (face, half, height), 0.3 * depth, 3)
    edges = np.linspace(-0.72 * half, 0.72 * half, (1 if style == "one" else 2) + 1)
    rockers = []
    for a, b in itertools.pairwise(edges):
        body = block((face - 0.3 * depth, a + 0.01 * width, 0.14 * height), (half_d, b - 0.01 * width, 0.86 * height), 0.12 * depth)
        points = body.vertices.copy()
        points[:, 0] -= np.where(points[:, 0] > face, 0.22 * depth * np.clip(points[:, 2] / height, 0.0, 1.0), 0.0).astype(np.float32)
        rockers.append(body._replace(vertices=points))
    return fitted({"plate": plate, "rocker": merged(*rockers)}, size_m)


MODELS = {
    "coat_rack": Model(build_coat_rack, ("feet", "plate", "tripod")),
    "wall_hooks": Model(build_wall_hooks, ("hooks", "pegs")),
    "shoe_rack": Model(build_shoe_rack, ("slats", "cabinet")),
    "umbrella_stand": Model(build_umbrella_stand, ("vessel", "hoops")),
    "light_switch": Model(build_light_switch, ("one", "two")),
}
