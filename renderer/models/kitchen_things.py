"""Things on worktops and dining tables: small machines, pots, knives, boards, plates, glasses, fruit, wine; fronts look along +x."""

from __future__ import annotations

import math

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, slab, sweep
from renderer.models.cabinets import bar_handle
from renderer.models.kitchen import turned_knob
from renderer.models.model import Model, Pieces, Size, halved
from renderer.models.small_things import bowl_body
from renderer.models.tables import soft_body


def build_microwave(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a microwave: a window in its door, and a panel with buttons or two knobs."""
    depth, width, height, half_d, half = halved(size_m)
    reach = min(0.025, 0.08 * depth)
    front = half_d - reach
    body = [rounded_box((-half_d, -half, 0.012), (front - 0.02, half, height), 0.008, 2)]
    body += [
        block((x - 0.015, y - 0.015, 0.0), (x + 0.015, y + 0.015, 0.016))
        for x in (-0.7 * half_d, 0.5 * half_d)
        for y in (-0.8 * half, 0.8 * half)
    ]
    split = half - 0.25 * width
    door = rounded_box((front - 0.022, -half + 0.002, 0.016), (front, split - 0.002, height - 0.004), 0.006, 1)
    panel = rounded_box((front - 0.022, split + 0.001, 0.016), (front, half - 0.002, height - 0.004), 0.006, 1)
    glass = rounded_box(
        (front - 0.004, -half + 0.05 * width, 0.17 * height), (front + 0.0015, split - 0.11 * width, 0.87 * height), 0.002, 1
    )
    handle = bar_handle(front, split - 0.045 * width, 0.52 * height, 0.7 * height, reach, upright=True)
    y = 0.5 * (split + half)
    display = block((front - 0.002, y - 0.085 * width, 0.78 * height), (front + 0.001, y + 0.085 * width, 0.9 * height), 0.0005)
    if style == "knobs":
        buttons = merged(*(turned_knob(front, y, z * height, 0.07 * width, 0.9 * reach) for z in (0.57, 0.27)))
    else:
        cells = [(y + 0.058 * width * i, (0.68 - 0.115 * j) * height) for i in (-1, 0, 1) for j in range(5)]
        a, b = 0.022 * width, 0.04 * height
        buttons = blocks([(front - 0.002, u - a, v - b) for u, v in cells], [(front + 0.002, u + a, v + b) for u, v in cells], 0.001)
    return {"body": [*body, door, panel], "glass": [glass, display], "handle": handle, "buttons": buttons}


def build_toaster(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a toaster with two slots along y, a lever and a dial; round-shouldered or square."""
    depth, width, height, half_d, half = halved(size_m)
    knob_m = min(0.03, 0.1 * width)
    radius = {"round": 0.27, "square": 0.1}[style] * min(depth, height)
    body = rounded_box((-half_d, -half, 0.05 * height), (half_d, half - knob_m, height), radius, 5)
    foot = block((-0.6 * half_d, -0.75 * half, 0.0), (0.6 * half_d, 0.75 * half - knob_m, 0.1 * height), 0.004)
    span = (0.5 if style == "round" else 0.62) * half
    middle = -0.5 * knob_m
    slots = blocks(
        [(x - 0.085 * depth, middle - span, height - 0.06 * height) for x in (-0.17 * depth, 0.17 * depth)],
        [(x + 0.085 * depth, middle + span, height + 0.0015) for x in (-0.17 * depth, 0.17 * depth)],
        0.0008,
    )
    end = half - knob_m
    groove = block((-0.012, end - 0.004, 0.3 * height), (0.012, end + 0.0015, 0.8 * height), 0.0008)
    lever = block((-0.03, end - 0.002, 0.66 * height), (0.03, half, 0.74 * height), 0.005)
    dial = rotated(lathe([(0.0, 0.0), (0.016, 0.0), (0.013, 0.5 * knob_m), (0.0, 0.5 * knob_m)], 18), "x", -0.5 * math.pi)
    return {"body": body, "slots": [slots, groove, foot], "lever": [lever, moved(dial, 0.0, end - 0.001, 0.2 * height)]}


def build_kettle(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a kettle whose spout looks along +y: electric on a base with its handle behind, or for the hob with one over its lid."""
    depth, width, height = size_m
    along_x = depth > width
    short, long = (width, depth) if along_x else (depth, width)
    r = min(0.5 * short, 0.34 * long)
    if style == "electric":
        base = lathe([(0.0, 0.0), (1.02 * r, 0.0), (1.02 * r, 0.05 * height), (0.9 * r, 0.075 * height), (0.0, 0.075 * height)], 32)
        low, top = 0.08 * height, 0.9 * height
        profile = [(0.0, low), (0.97 * r, low), (r, low + 0.03 * height), (0.93 * r, 0.4 * height), (0.72 * r, top), (0.7 * r, top)]
        body = lathe([*profile, (0.6 * r, 0.94 * height), (0.0, 0.955 * height)], 36)
        spout = sweep(
            [(0.0, 0.5 * r, 0.74 * height), (0.0, 0.9 * r, 0.82 * height), (0.0, 1.08 * r, 0.9 * height)],
            [0.34 * r, 0.24 * r, 0.13 * r],
            14,
        )
        z = np.array([0.88, 0.92, 0.86, 0.6, 0.3, 0.2]) * height
        y = -np.array([0.62, 1.1, 1.55, 1.62, 1.4, 0.9]) * r
        handle = sweep(points(0.0, y, z), 0.12 * r, 10, 1.3)
        lid = lathe([(0.0, 0.94 * height), (0.14 * r, 0.95 * height), (0.12 * r, height), (0.0, height)], 16)
        parts = {"body": merged(body, spout), "handle": merged(handle, lid), "base": base}
    else:
        top = 0.62 * height
        profile = [(0.0, 0.0), (0.92 * r, 0.0), (r, 0.04 * height), (r, 0.18 * height), (0.85 * r, 0.4 * height), (0.55 * r, 0.56 * height)]
        crown = [(0.45 * r, top), (0.3 * r, top + 0.02 * height), (0.0, top + 0.025 * height)]
        body = lathe([*profile, *crown], 36)
        spout = sweep(
            [(0.0, 0.7 * r, 0.22 * height), (0.0, 1.2 * r, 0.4 * height), (0.0, 1.45 * r, 0.56 * height)],
            [0.24 * r, 0.16 * r, 0.11 * r],
            12,
        )
        angle = np.linspace(0.0, math.pi, 13)
        path = points(0.0, 0.8 * r * el.cos(angle), 0.42 * height + 0.54 * height * el.sin(angle))
        bead = lathe(
            [(0.0, 0.0), (0.1 * r, 0.01 * height), (0.13 * r, 0.05 * height), (0.08 * r, 0.09 * height), (0.0, 0.095 * height)], 14
        )
        foot = lathe([(0.0, 0.0), (0.9 * r, 0.0), (0.93 * r, 0.012), (0.0, 0.012)], 32)
        parts = {
            "body": merged(body, spout),
            "handle": merged(sweep(path, 0.075 * r, 10), moved(bead, z=top + 0.02 * height)),
            "base": foot,
        }
    turn = -0.5 * math.pi if along_x else 0.0
    return {name: rotated(mesh, "z", turn) for name, mesh in parts.items()}


def build_coffee_maker(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a filter machine with a jug on its plate, or an espresso machine with a filter holder over a grid."""
    _, width, height, half_d, half = halved(size_m)
    tower = rounded_box((-half_d, -half, 0.0), (-0.2 * half_d, half, height), 0.015, 1)
    head = rounded_box((-half_d, -half, 0.7 * height), (half_d, half, height), 0.018, 2)
    base = rounded_box((-half_d, -half, 0.0), (half_d, half, 0.09 * height), 0.01, 1)
    x = 0.4 * half_d
    if style == "drip":
        r = min(0.52 * half_d, 0.72 * half)
        z0, z1 = 0.1 * height, 0.58 * height
        wall = 0.03 * r
        outer = [(0.0, z0), (0.8 * r, z0), (r, z0 + 0.3 * (z1 - z0)), (0.95 * r, z0 + 0.6 * (z1 - z0)), (0.6 * r, z1)]
        inner = [(0.6 * r - wall, z1), (0.95 * r - wall, z0 + 0.6 * (z1 - z0)), (r - wall, z0 + 0.3 * (z1 - z0)), (0.78 * r, z0 + wall)]
        jug = moved(lathe([*outer, *inner, (0.0, z0 + wall)], 24), x)
        level = z0 + rng.uniform(0.3, 0.55) * (z1 - z0)
        rise = [(0.0, z0 + 1.2 * wall), (0.77 * r, z0 + 1.2 * wall), (0.95 * r, z0 + 0.3 * (z1 - z0)), (0.95 * r, level), (0.0, level)]
        path = [(x, 0.55 * r, z1 - 0.01), (x, 1.25 * r, z1 - 0.01), (x, 1.3 * r, 0.6 * z1), (x, 0.98 * r, 0.45 * z1)]
        lid = moved(lathe([(0.0, z1 - 0.003), (0.64 * r, z1 - 0.003), (0.62 * r, z1 + 0.01), (0.0, z1 + 0.02)], 24), x)
        cone = moved(lathe([(0.0, 0.62 * height), (0.3 * r, 0.62 * height), (0.75 * r, 0.71 * height), (0.0, 0.71 * height)], 24), x)
        trim = merged(sweep(path, 0.1 * r, 8), lid, turned_knob(half_d - 0.001, -0.55 * half, 0.84 * height, 0.08 * width, 0.008))
        return {"body": [tower, head, base, cone], "trim": trim, "jug": jug, "coffee": moved(lathe(rise, 24), x)}
    group = lathe([(0.0, 0.6 * height), (0.3 * half, 0.6 * height), (0.34 * half, 0.71 * height), (0.0, 0.71 * height)], 24)
    holder = lathe(
        points(
            [0.0, 0.16 * half, 0.28 * half, 0.28 * half, 0.0], [0.52 * height, 0.53 * height, 0.56 * height, 0.61 * height, 0.61 * height]
        ),
        24,
    )
    grip = rod((x, 0.0, 0.58 * height), (half_d - 0.002, 0.35 * half, 0.565 * height), 0.09 * half, 0.12 * half, 10)
    count = 9
    bars = blocks(
        [(-0.1 * half_d, -0.85 * half + 1.7 * half * k / count, 0.085 * height) for k in range(count)],
        [(0.94 * half_d, -0.85 * half + 1.7 * half * (k + 0.6) / count, 0.1 * height) for k in range(count)],
        0.001,
    )
    keys = [turned_knob(half_d - 0.002, y * half, 0.86 * height, 0.07 * width, 0.012) for y in (-0.55, 0.0, 0.55)]
    wand = rod((0.8 * half_d, -0.75 * half, 0.71 * height), (0.9 * half_d, -0.8 * half, 0.35 * height), 0.004, segments=8)
    return {"body": [tower, head, base], "trim": [grip, *keys], "metal": [moved(group, x), moved(holder, x), bars, wand]}


def build_cooking_pot(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a pot with lid and two ears along y, or a pan with a long handle along its longer side."""
    depth, width, height = size_m
    along_x = depth > width
    short, long = (width, depth) if along_x else (depth, width)
    if style == "pot":
        r = min(0.5 * short, 0.42 * long)
        top = 0.74 * height
        wall = 0.03 * r
        outer = points(
            [0.0, 0.92 * r, 0.97 * r, 0.97 * r, r, 0.96 * r], [0.0, 0.0, 0.04 * height, top, top + 0.02 * height, top + 0.025 * height]
        )
        body = lathe([*outer, (0.96 * r - wall, 0.1 * height), (0.0, 0.08 * height)], 36)
        lid = points(
            [0.0, 0.99 * r, 0.97 * r, 0.6 * r, 0.0],
            [top + 0.026 * height, top + 0.026 * height, top + 0.045 * height, 0.85 * height, 0.88 * height],
        )
        cap = points(
            [0.0, 0.08 * r, 0.09 * r, 0.19 * r, 0.17 * r, 0.0], [0.86 * height, 0.87 * height, 0.92 * height, 0.96 * height, height, height]
        )
        ears = []
        for s in (-1.0, 1.0):
            z = top - 0.12 * height
            path = points(
                [-0.3 * r, -0.27 * r, 0.27 * r, 0.3 * r], [s * 0.9 * r, s * 1.13 * r, s * 1.13 * r, s * 0.9 * r], [z, z + 0.01, z + 0.01, z]
            )
            ears.append(sweep(path, 0.05 * r, 8))
        parts = {"body": body, "lid": lathe(lid, 36), "handles": merged(*ears, lathe(cap, 18))}
    else:
        r = min(0.5 * short, 0.32 * long)
        top = 0.75 * height
        wall = 0.03 * r
        outer = points(
            [0.0, 0.75 * r, 0.84 * r, r, r - wall, 0.82 * r - wall, 0.0], [0.0, 0.0, 0.08 * height, top, top, 0.14 * height, 0.1 * height]
        )
        y1 = long - r
        path = points(0.0, [0.92 * r, 1.15 * r, 0.5 * (r + y1), y1], [0.6 * top, 0.85 * height, 0.92 * height, 0.9 * height])
        parts = {
            "body": lathe(outer, 36),
            "lid": _glass_lid(0.97 * r, 0.72 * height, height),
            "handles": sweep(path, [0.06 * r, 0.07 * r, 0.09 * r, 0.09 * r], 10, 0.7),
        }
    turn = -0.5 * math.pi if along_x else 0.0
    return {name: rotated(mesh, "z", turn) for name, mesh in parts.items()}


def _glass_lid(r: float, low: float, high: float) -> Mesh:
    """Return a flat lid with a button."""
    rise = high - low
    return lathe(
        points(
            [0.0, r, r, 0.5 * r, 0.12 * r, 0.15 * r, 0.0], [low, low, low + 0.15 * rise, low + 0.4 * rise, low + 0.45 * rise, high, high]
        ),
        36,
    )


def build_knife_block(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a block of wood that leans towards the cook, with the handles of seven knives; slanted or nearly upright."""
    depth, width, height = size_m
    lean = 0.34 if style == "slanted" else 0.1
    deep, wide = 0.55 * depth, width
    tall = 0.7 * height
    outline = [(0.0, 0.0), (deep, deep * math.tan(lean)), (deep, tall), (0.0, tall)]
    body = rotated(slab(outline, -0.5 * wide, 0.5 * wide), "x", 0.5 * math.pi)
    spots = [(0.2, -0.26), (0.2, 0.26), (0.48, -0.28), (0.48, 0.0), (0.48, 0.28), (0.78, -0.2), (0.78, 0.2)]
    handles, blades = [], []
    for u, v in spots:
        x, y = u * deep, v * wide
        length = 0.34 * height * rng.uniform(0.8, 1.0) * (1.1 - 0.45 * u)
        collar = tall + 0.02 * height
        blades.append(block((x - 0.075 * deep, y - 0.03 * wide, tall - 0.004), (x + 0.075 * deep, y + 0.03 * wide, collar), 0.0005))
        low, high = (x - 0.085 * deep, y - 0.055 * wide, collar - 0.001), (x + 0.085 * deep, y + 0.055 * wide, tall + length)
        handles.append(block(low, high, 0.03 * wide))
    parts = {"body": body, "handles": merged(*handles), "blades": merged(*blades)}
    return {name: rotated(mesh, "y", lean) for name, mesh in parts.items()}


def build_cutting_board(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a lying board with a kitchen knife on it, plain or with a grip that has a hole, along its longer side."""
    depth, width, height = size_m
    along_x = depth > width
    short, long = (width, depth) if along_x else (depth, width)
    top = 0.7 * height
    a, b = 0.5 * short, 0.5 * long
    if style == "paddle":
        b = 0.39 * long
    edge = min(0.004, 0.25 * top) / a
    board = [soft_body([(0.0, 0.0), (1.0 - edge, 0.0), (1.0, 0.3 * top), (1.0, 0.7 * top), (1.0 - edge, top), (0.0, top)], a, b, 9.0, 48)]
    if style == "paddle":
        grip = rounded_box((-0.24 * a, b - 0.02, 0.0), (0.24 * a, long - b - 0.05 * long, top), 0.4 * top)
        r = 0.29 * a
        eye = lathe([(0.45 * r, 0.0), (r, 0.0), (r, top), (0.45 * r, top)], 20, closed=True)
        board += [grip, moved(eye, y=long - b - r)]
    knife_y = 0.6 * b
    steel = slab([(0.0, -knife_y), (0.018, -0.1 * knife_y), (0.02, 0.25 * knife_y), (0.0, 0.25 * knife_y)], top, top + 0.0015)
    handle = rounded_box((-0.002, 0.25 * knife_y, top), (0.018, 0.25 * knife_y + 0.5 * b, height), 0.4 * (height - top))
    turn = rng.uniform(-0.3, 0.3)
    knife = [moved(rotated(mesh, "z", turn), 0.25 * a) for mesh in (steel, handle)]
    parts = {"board": merged(*board), "blade": knife[0], "handle": knife[1]}
    angle = -0.5 * math.pi if along_x else 0.0
    return {name: rotated(mesh, "z", angle) for name, mesh in parts.items()}


def build_plate(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a plate: a rim round a flat middle, or one even curve; the part ``band`` is a line of colour on it."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    wall = min(0.004, 0.25 * height)
    if style == "rimmed":
        lower = [(0.0, 0.0), (0.55 * r, 0.0), (0.66 * r, 0.35 * height), (r, height - 0.5 * wall)]
        upper = [(0.995 * r, height), (0.66 * r, 0.35 * height + wall), (0.56 * r, wall), (0.0, wall)]
        band_at = [(0.93 * r, 0.87 * height), (0.97 * r, 0.93 * height)]
    else:
        lower = [(0.0, 0.0), (0.5 * r, 0.0), (0.75 * r, 0.12 * height), (0.92 * r, 0.5 * height), (r, height - 0.3 * wall)]
        upper = [(0.985 * r, height), (0.9 * r, 0.5 * height + wall), (0.73 * r, 0.12 * height + wall), (0.5 * r, wall), (0.0, wall)]
        band_at = [(0.955 * r, 0.8 * height), (0.975 * r, 0.9 * height)]
    (r0, z0), (r1, z1) = band_at
    lift = 0.8 * wall
    band = lathe([(r0, z0), (r1, z1), (r1, z1 + lift), (r0, z0 + lift)], 40, closed=True)
    return {"body": lathe(lower + upper, 40), "band": band}


def build_drinking_glass(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an empty glass: a tumbler with a thick bottom, or a wine glass on a stem."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    wall = min(0.0025, 0.08 * r)
    if style == "tumbler":
        base = rng.uniform(0.78, 0.9)
        profile = [(0.0, 0.0), (base * r, 0.0), (r, height - 0.001), (r - 0.5 * wall, height), (r - wall, height - 0.001)]
        return {"body": lathe([*profile, (base * r - wall, 0.09 * height), (0.0, 0.08 * height)], 32)}
    stem, foot = rng.uniform(0.42, 0.5) * height, 0.88 * r
    lower = [(0.0, 0.0), (foot, 0.0), (foot, 0.0015), (0.3 * foot, 0.02 * height), (0.003, 0.07 * height), (0.003, 0.93 * stem)]
    angle = np.linspace(0.2, 0.5 * math.pi, 6)
    swell = stem + 0.42 * (height - stem)
    cup = [(r * math.sin(a), stem + (swell - stem) * (1.0 - math.cos(a))) for a in angle]
    rim = points(
        [0.9 * r, 0.74 * r, 0.74 * r - 0.5 * wall, 0.74 * r - wall], [stem + 0.75 * (height - stem), height - 0.001, height, height - 0.001]
    )
    inner = [(0.9 * r - wall, stem + 0.75 * (height - stem))]
    inner += [((r - wall) * math.sin(a), stem + wall + (swell - stem - wall) * (1.0 - math.cos(a))) for a in angle[::-1]]
    return {"body": lathe([*lower, *cup, *rim, *inner, (0.0, stem + wall)], 28)}


def _apple(r: float) -> Mesh:
    """Return a round fruit, dented at both ends."""
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 8)[1:-1]
    side = [(r * math.pow(math.cos(a), 0.8), r * (0.92 * math.sin(a) + 0.05)) for a in angle]
    return lathe([(0.0, -0.8 * r), *side, (0.0, 0.72 * r)], 11)


def _orange(r: float) -> Mesh:
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 8)
    return lathe([(max(r * math.cos(a), 0.0) if abs(a) < 1.57 else 0.0, 0.96 * r * math.sin(a)) for a in angle], 11)


def _banana(length: float) -> Mesh:
    t = np.linspace(-1.0, 1.0, 9)
    path = points(0.5 * length * t, 0.0, 0.24 * length * t**2)
    radius = 0.095 * length * np.array([0.3, 0.75, 0.95, 1.0, 1.0, 1.0, 0.95, 0.7, 0.25])
    return sweep(path, radius, 6)


def build_fruit_bowl(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a bowl of apples and oranges with bananas on top."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    rim = 0.62 * height
    fruit_r = min(0.28 * r, 0.3 * height)
    bowl = bowl_body(r, rim, style == "footed", 22)
    apples, oranges = [], []
    turn = rng.uniform(0.0, 2.0 * math.pi)
    for k in range(5):
        a = turn + 2.0 * math.pi * k / 5
        at = (0.55 * r * math.cos(a), 0.55 * r * math.sin(a), rim + 0.05 * height)
        if k % 2:
            oranges.append(moved(_orange(0.95 * fruit_r), *at))
        else:
            tipped = rotated(rotated(_apple(fruit_r), "x", rng.uniform(-0.7, 0.7)), "y", rng.uniform(-0.7, 0.7))
            apples.append(moved(tipped, *at))
    oranges.append(moved(_orange(fruit_r), 0.0, 0.0, rim + 0.02 * height))
    bunch = []
    for k in range(3):
        one = rotated(_banana(1.15 * r), "x", 0.35 * (k - 1))
        bunch.append(moved(rotated(one, "z", turn + 0.25 * (k - 1)), 0.03 * r * k, 0.1 * r * (k - 1), rim + 0.15 * height))
    return {"bowl": bowl, "apples": apples, "oranges": oranges, "bananas": bunch}


def build_wine_bottle(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a wine bottle with label and capsule: straight with high shoulders, or with sloping shoulders."""
    depth, width, height = size_m
    r = 0.5 * min(depth, width)
    neck = 0.36 * r
    body = [(0.0, 0.02 * height), (0.6 * r, 0.0), (0.94 * r, 0.0), (r, 0.015 * height)]
    if style == "straight":
        shoulder = points(
            [r, 0.94 * r, 0.7 * r, 0.46 * r, neck], [0.6 * height, 0.65 * height, 0.695 * height, 0.73 * height, 0.78 * height]
        )
    else:
        heights = np.array([0.42, 0.5, 0.6, 0.69, 0.8]) * height
        shoulder = points([r, 0.96 * r, 0.76 * r, 0.52 * r, neck], heights)
    glass = lathe([*body, *shoulder, (0.95 * neck, 0.97 * height), (0.0, 0.97 * height)], 28)
    low, high = (0.14, 0.46) if style == "straight" else (0.1, 0.36)
    top = high * height - rng.uniform(0.0, 0.05) * height
    label = lathe([(0.95 * r, low * height), (1.006 * r, low * height), (1.006 * r, top), (0.95 * r, top)], 28, closed=True)
    start = 0.8 * height
    capsule = points(
        [0.0, 1.04 * neck, 1.04 * neck, 1.14 * neck, 1.14 * neck], [start, start, 0.95 * height, 0.955 * height, 0.985 * height]
    )
    return {"glass": glass, "label": label, "capsule": lathe([*capsule, (1.0 * neck, height), (0.0, height)], 24)}


MODELS = {
    "microwave": Model(build_microwave, ("buttons", "knobs")),
    "toaster": Model(build_toaster, ("round", "square")),
    "kettle": Model(build_kettle, ("electric", "hob")),
    "coffee_maker": Model(build_coffee_maker, ("drip", "espresso")),
    "cooking_pot": Model(build_cooking_pot, ("pot", "pan")),
    "knife_block": Model(build_knife_block, ("slanted", "upright")),
    "cutting_board": Model(build_cutting_board, ("plain", "paddle")),
    "plate": Model(build_plate, ("rimmed", "coupe")),
    "drinking_glass": Model(build_drinking_glass, ("tumbler", "wine")),
    "fruit_bowl": Model(build_fruit_bowl, ("round", "footed")),
    "wine_bottle": Model(build_wine_bottle, ("straight", "sloping")),
}
