"""Bathroom fixtures: toilet, bathtub, shower cabin, washbasin, washing machine; their fronts look along +x."""

import itertools
import math

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.lofts import arc, bent, disc, egg, loft, lying, oval, points, ring
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rounded_box, sweep
from renderer.models.cabinets import Front, bar_handle, fronts, knob
from renderer.models.model import CORNERS, Model, Parts, Pieces, Size, halved
from scene_description.products import norm


def build_toilet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a close-coupled toilet on a foot, a bowl with straight skirt before a slim cistern, or one that hangs on a boxed cistern."""
    depth, _, height, half_d, half_w = halved(size_m)
    rim = min(0.42, 0.56 * height)
    hung = style == "hung"
    tank_depth = (0.29 if style == "close_coupled" else 0.22) * depth
    back, front = -half_d + 0.72 * tank_depth, half_d
    foot = {"skirted": [0.98, 0.98, 0.99], "hung": [0.5, 0.62, 0.86]}.get(style, [0.62, 0.6, 0.72])
    wide = {"skirted": [0.6, 0.64, 0.78], "hung": [0.5, 0.6, 0.8]}.get(style, [0.5, 0.46, 0.56])
    levels = (0.24, 0.3, 0.6) if hung else (0.0, 0.12, 0.5)
    bowl_back = -half_d + 0.1 * depth
    rings = [
        *(egg(bowl_back, back + foot[k] * (front - back) - 0.02, wide[k] * half_w, levels[k] * rim) for k in range(3)),
        egg(bowl_back, front - 0.02, 0.93 * half_w, 0.82 * rim),
        egg(bowl_back, front - 0.005, 0.97 * half_w, 0.92 * rim),
        egg(bowl_back, front - 0.005, 0.97 * half_w, rim),
        egg(back + 0.28 * (front - back), front - 0.055, 0.72 * half_w, rim),
        egg(back + 0.3 * (front - back), front - 0.07, 0.66 * half_w, 0.86 * rim),
        egg(back + 0.4 * (front - back), front - 0.16, 0.4 * half_w, 0.55 * rim),
        egg(back + 0.44 * (front - back), front - 0.2, 0.26 * half_w, 0.46 * rim),
    ]
    water = egg(back + 0.36 * (front - back), front - 0.12, 0.5 * half_w, 0.62 * rim)
    tank, lid, button = (_boxed_cistern if hung else _cistern)(half_d, half_w, tank_depth, rim, height)
    hinge = merged(*(disc("y", (back + 0.03 * depth, s * 0.3 * half_w, rim + 0.012), 0.012, 0.05, 10) for s in (-1.0, 1.0)))
    flush = merged(button, hinge)
    return {
        "bowl": [loft(rings), loft([water - (0.0, 0.0, 0.004), water])],
        "cistern": [tank, lid],
        "seat": _toilet_seat(rng, back, front, half_w, rim, -half_d + tank_depth),
        "flush": flush,
    }


def _cistern(half_d: float, half_w: float, deep: float, rim: float, height: float) -> tuple[Mesh, Mesh, Mesh]:
    """Tank, lid and button of a cistern that stands on the bowl."""
    tank = rounded_box((-half_d, -0.94 * half_w, rim - 0.02), (-half_d + deep, 0.94 * half_w, height - 0.05), 0.035, 3)
    lid = rounded_box((-half_d, -half_w, height - 0.055), (-half_d + deep + 0.012, half_w, height - 0.012), 0.014, 2)
    return tank, lid, disc("z", (-half_d + 0.5 * deep, 0.0, height - 0.006), 0.1 * half_w + 0.012, 0.012, 20, 0.003)


def _boxed_cistern(half_d: float, half_w: float, deep: float, rim: float, height: float) -> tuple[Mesh, Mesh, Mesh]:
    """The boarded or tiled box before the wall that a bowl hangs on, its top board, and the plate with two keys."""
    front, low = -half_d + deep, max(height - 0.17, rim + 0.06)
    high, reach = height - 0.05, 0.46 * half_w
    box = block((-half_d, -half_w, 0.0), (front, half_w, height - 0.02), 0.002)
    board = block((-half_d, -half_w, height - 0.021), (front + 0.006, half_w, height), 0.003)
    keys = blocks(
        [(front, -reach, low), (front, -0.9 * reach, low + 0.012), (front, 0.1 * reach, low + 0.012)],
        [(front + 0.006, reach, high), (front + 0.01, -0.1 * reach, high - 0.012), (front + 0.01, 0.9 * reach, high - 0.012)],
        0.002,
    )
    return box, board, keys


def _toilet_seat(rng: np.random.Generator, back: float, front: float, half_w: float, rim: float, tank_front: float) -> Mesh:
    """The ring to sit on and the lid, shut on two of five toilets, else leaning at the cistern."""
    length = front - back
    z = rim + 0.002
    outer = [egg(back + 0.12 * length, front, half_w, z), egg(back + 0.12 * length, front, half_w, z + 0.016)]
    top = egg(back + 0.13 * length, front - 0.008, 0.96 * half_w, z + 0.022)
    if rng.random() < 0.4:
        lid = [egg(back + 0.1 * length, front, half_w, z + 0.024), egg(back + 0.1 * length, front, half_w, z + 0.038)]
        lid.append(egg(back + 0.14 * length, front - 0.03, 0.88 * half_w, z + 0.045))
        return merged(loft([*outer, top]), loft(lid))
    hole = (back + 0.3 * length, front - 0.09 * length, 0.6 * half_w)
    seat = loft([*outer, top, egg(*hole, z + 0.022), egg(*hole, z), outer[0]])
    flat = [egg(0.0, 0.9 * length, 0.98 * half_w, h) for h in (0.0, 0.014)]
    upright = [np.column_stack([-loop[:, 2], loop[:, 1], loop[:, 0]]) for loop in flat]
    lean = 0.08
    tilted = [
        np.column_stack([tank_front + 0.04 + loop[:, 0] - lean * loop[:, 2], loop[:, 1], rim + 0.02 + 0.8 * loop[:, 2]]) for loop in upright
    ]
    return merged(seat, loft(tilted))


def build_bathtub(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a tub built in behind panels, a free-standing oval one, or one with rolled rim on four feet; with waste, overflow and tap."""
    depth, width, height, half_d, half_w = halved(size_m)
    tap_top = min(0.14, 0.18 * height)
    rim = height - tap_top
    end = 1.0 if rng.random() < 0.5 else -1.0
    built_in = style == "built_in"
    power = 5.0 if built_in else 2.6
    edge = 0.06 if built_in else 0.025
    inner = [
        oval(half_d - edge, half_w - 1.3 * edge, rim, power=power, points=48),
        oval(half_d - edge - 0.012, half_w - 1.3 * edge - 0.015, rim - 0.012, power=power, points=48),
        oval(0.86 * (half_d - edge), 0.9 * (half_w - edge), 0.55 * rim, y=end * 0.01 * width, power=power, points=48),
        oval(0.74 * (half_d - edge), 0.8 * (half_w - edge), 0.27 * rim, y=end * 0.03 * width, power=power, points=48),
        oval(0.6 * (half_d - edge), 0.72 * (half_w - edge), 0.2 * rim, y=end * 0.04 * width, power=power, points=48),
    ]
    if built_in:
        lip = 26.0
        outer = [oval(half_d, half_w, z, power=lip, points=48) for z in (rim - 0.045, rim - 0.006)]
        outer.append(oval(half_d - 0.006, half_w - 0.006, rim, power=lip, points=48))
        base = [oval(0.66 * half_d, 0.8 * half_w, 0.02, power=power, points=48), oval(half_d - 0.03, half_w - 0.03, rim - 0.045, points=48)]
        apron = block((-half_d + 0.01, -half_w + 0.008, 0.0), (half_d - 0.012, half_w - 0.008, 0.14 * rim), 0.004)
        panels = blocks(
            [(half_d - 0.03, -half_w + 0.006, 0.0), (-half_d, -half_w + 0.006, 0.0), (-half_d, half_w - 0.03, 0.0)],
            points([half_d - 0.012, half_d - 0.013, half_d - 0.013], [half_w - 0.006, -half_w + 0.03, half_w - 0.006], rim - 0.03),
            0.004,
        )
        parts = {"basin": loft([*base, *outer, *inner]), "panel": merged(panels, apron)}
    elif style == "clawfoot":
        low = 0.15 * rim
        outer = [
            oval(half_d * a, half_w * b, z, power=power, points=48)
            for a, b, z in ((0.5, 0.62, low), (0.7, 0.8, low + 0.03), (0.84, 0.9, 0.5 * rim))
        ]
        for step in range(6):
            turn = math.pi * (step / 5.0 - 0.5)
            out = 0.022 * math.cos(turn) if step < 5 else 0.0
            outer.append(oval(half_d - 0.022 + out, half_w - 0.022 + out, rim - 0.022 + 0.022 * math.sin(turn), power=power, points=48))
        feet = [_claw_foot(sx, sy, 0.56 * half_d, 0.62 * half_w, 1.4 * low + 0.03) for sx, sy in CORNERS]
        parts = {"basin": loft([*outer, *inner]), "panel": merged(*feet)}
    else:
        outer = [
            oval(0.74 * half_d, 0.84 * half_w, 0.0, power=power, points=48),
            oval(0.78 * half_d, 0.87 * half_w, 0.04, power=power, points=48),
            oval(0.9 * half_d, 0.94 * half_w, 0.5 * rim, power=power, points=48),
            oval(half_d - 0.004, half_w - 0.004, rim - 0.03, power=power, points=48),
            oval(half_d, half_w, rim - 0.01, power=power, points=48),
            oval(half_d - 0.008, half_w - 0.008, rim, power=power, points=48),
        ]
        parts = {"basin": loft([*outer, *inner]), "panel": loft([0.98 * outer[0] + (0, 0, 0.001), 0.96 * outer[1] + (0, 0, 0.004)])}
    reach = 0.17 * depth
    tap = _bath_tap(-half_d + 0.5 * edge, rim, reach, tap_top)
    drain = disc("z", (0.0, end * 0.42 * half_w, 0.2 * rim + 0.003), 0.028, 0.006, 20)
    overflow = disc("y", (0.0, end * 0.885 * half_w, 0.66 * rim), 0.03, 0.014, 20, 0.003)
    return parts | {"tap": [tap, drain, overflow]}


def _claw_foot(side_x: float, side_y: float, x: float, y: float, height: float) -> Mesh:
    """A curved foot that swells from a ball on the floor to a shoulder under the tub."""
    share = np.linspace(0.0, 1.0, 7)
    swing = 0.018 * el.sin(2.0 * math.pi * share)
    path = np.column_stack([side_x * (x + 0.3 * swing), side_y * (y + swing + 0.03 * share), 0.03 + (height - 0.03) * share])
    ball = lathe([(0.0, 0.0), (0.022, 0.002), (0.034, 0.02), (0.03, 0.042), (0.016, 0.056), (0.0, 0.058)], 12)
    return merged(sweep(path, [0.016, 0.016, 0.018, 0.021, 0.025, 0.029, 0.032], 10), moved(ball, side_x * x, side_y * y))


def _bath_tap(x: float, rim: float, reach: float, tall: float) -> Mesh:
    """A broad spout between two cross handles on the long side of the rim."""
    top = rim + tall
    spout = bent(
        [(x, 0.0, rim - 0.002), (x, 0.0, top - 0.016), (x + reach, 0.0, top - 0.016), (x + reach, 0.0, top - 0.06)], 0.016, 0.05, 12
    )
    handles = []
    for s in (-1.0, 1.0):
        y = s * 0.11
        handles += [rod((x, y, rim - 0.002), (x, y, rim + 0.45 * tall), 0.014), rod((x, y, rim - 0.002), (x, y, rim + 0.008), 0.024)]
        z = rim + 0.5 * tall
        handles += [rod((x - 0.03, y, z), (x + 0.03, y, z), 0.008), rod((x, y - 0.03, z), (x, y + 0.03, z), 0.008)]
    return merged(spout, rod((x, 0.0, rim - 0.002), (x, 0.0, rim + 0.008), 0.028), *handles)


def build_shower_cabin(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a tray before wall panels, with glass on two sides, square or with a rounded front corner, or one pane to walk in beside."""
    _, _, height, half_d, half_w = halved(size_m)
    tray_top = min(0.14, 0.07 * height)
    outline = _cabin_outline(half_d, half_w, style)
    tray = [points(outline * s, z) for s, z in ((1.0, 0.0), (1.0, tray_top - 0.004), (0.992, tray_top))]
    tray += [points(outline * s, z) for s, z in ((0.9, tray_top), (0.86, tray_top - 0.05), (0.2, tray_top - 0.06))]
    drain = disc("z", (-0.3 * half_d, 0.0, tray_top - 0.052), 0.045, 0.012, 20)
    walls = blocks(
        [(-half_d, -half_w, tray_top - 0.002), (-half_d, half_w - 0.018, tray_top - 0.002)],
        [(-half_d + 0.018, half_w, height), (half_d - 0.012, half_w, height)],
    )
    if style == "walk_in":
        fixed = _screen(half_d, half_w, tray_top, height)
        fittings = merged(_shower(-half_d + 0.018, 0.28 * half_w, height), drain)
        return {"tray": loft(tray), "walls": walls, **fixed, "fittings": fittings}
    open_side = outline[outline[:, 0] > -half_d + 0.03]
    open_side = open_side[open_side[:, 1] < half_w - 0.03]
    path = 0.975 * np.vstack([(-half_d, -half_w), open_side, (half_d, half_w)])
    rails = [sweep(points(path, z), 0.014, 8) for z in (tray_top + 0.012, height - 0.014)]
    posts_at = path[[0, len(path) // 2, -1]] if style == "square" else path[[0, len(path) // 3, 2 * len(path) // 3, -1]]
    posts = [block((x - 0.012, y - 0.012, tray_top - 0.001), (x + 0.012, y + 0.012, height - 0.002), 0.003) for x, y in posts_at]
    panes = [_pane(a, b, tray_top + 0.02, height - 0.024) for a, b in itertools.pairwise(path)]
    grip = path[len(path) // 2] * 1.0
    handle = rod((grip[0] - 0.01, grip[1] - 0.05, 0.45 * height), (grip[0] - 0.01, grip[1] - 0.05, 0.6 * height), 0.01)
    fittings = merged(_shower(-half_d + 0.018, 0.28 * half_w, height), drain, handle)
    return {"tray": loft(tray), "walls": walls, "frame": [*rails, *posts], "glass": panes, "fittings": fittings}


def _screen(half_d: float, half_w: float, low: float, high: float) -> Parts:
    """One fixed pane at the -y side with its wall profile, foot profile, and a bar that stays it to the opposite wall."""
    y = -half_w + 0.03
    start, end = np.array([-half_d + 0.016, y]), np.array([0.62 * half_d, y])
    frame = [
        block((start[0], y - 0.014, low - 0.001), (start[0] + 0.022, y + 0.014, high - 0.01), 0.003),
        block((start[0], y - 0.01, low - 0.001), (end[0], y + 0.01, low + 0.016), 0.003),
        rod((end[0] - 0.08, y, high - 0.03), (end[0] - 0.08, half_w - 0.016, high - 0.03), 0.009),
        block((end[0] - 0.105, y - 0.012, high - 0.05), (end[0] - 0.055, y + 0.012, high - 0.008), 0.004),
    ]
    return {"frame": merged(*frame), "glass": _pane(start, end, low + 0.006, high - 0.012)}


def _cabin_outline(half_d: float, half_w: float, style: str) -> np.ndarray:
    """Corners (n, 2) of the tray, counter-clockwise; the glazed corner is the one at (+x, -y)."""
    if style != "quadrant":
        bend = np.array([[half_d, -half_w]])
    else:
        r = 0.62 * min(2.0 * half_d, 2.0 * half_w)
        bend = arc((half_d - r, -half_w + r, 0.0), r, -0.5 * math.pi, 0.0, "xy", 14)[:, :2]
    return np.vstack([[(-half_d, half_w), (-half_d, -half_w)], bend, [(half_d, half_w)]])


def _pane(a: np.ndarray, b: np.ndarray, low: float, high: float) -> Mesh:
    """A pane of 6 mm glass between two points of the plan."""
    along = (b - a) / norm(b - a)
    side = 0.003 * np.array([along[1], -along[0]])
    corners = np.array([a + side, b + side, b - side, a - side])
    return loft([points(corners, z) for z in (low, high)])


def _shower(x: float, y: float, height: float) -> Mesh:
    """Mixer bar, riser, head and hose on the back wall."""
    low, high = 0.5 * height, 0.93 * height
    out = x + 0.06
    riser = bent([(out, y, low), (out, y, high), (out + 0.3, y, high)], 0.011, 0.06)
    head = lathe([(0.0, high - 0.05), (0.1, high - 0.05), (0.1, high - 0.04), (0.03, high - 0.025), (0.015, high), (0.0, high)], 24)
    mixer = rod((out, y - 0.13, low), (out, y + 0.13, low), 0.022)
    knobs = [rod((out, y + s * 0.13, low), (out, y + s * 0.17, low), 0.027) for s in (-1.0, 1.0)]
    studs = [rod((x - 0.002, y + s, z), (out, y + s, z), 0.012) for s, z in ((-0.07, low), (0.07, low), (0.0, 0.85 * high))]
    hose = sweep(
        points(
            [out + 0.02, out + 0.04, out + 0.05, out + 0.05, out + 0.03],
            [y + 0.05, y + 0.1, y - 0.02, y - 0.1, y - 0.06],
            [low - 0.01, low - 0.3, low - 0.42, low - 0.1, low + 0.3],
        ),
        0.007,
        8,
    )
    hand = lying(lathe([(0.0, 0.0), (0.04, 0.0), (0.045, 0.012), (0.02, 0.035), (0.0, 0.035)], 18), "x", (out + 0.02, y - 0.06, low + 0.33))
    return merged(riser, moved(head, out + 0.3, y), mixer, *knobs, *studs, hose, hand)


def build_washbasin(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a basin over a vanity with drawers or doors, or a bowl on a wooden top before a ledge; with a tap."""
    depth, width, height, half_d, half_w = halved(size_m)
    tap_top = min(0.16, 0.14 * height)
    rim = height - tap_top
    vessel = style == "vessel"
    slab_top = rim - (0.13 if vessel else 0.05)
    front = half_d - 0.02
    body_low = (0.28 if vessel else rng.uniform(0.0, 0.25)) * rim
    inside = slab_top if vessel else slab_top - 0.05
    body = [block((-half_d, -half_w + 0.012, body_low), (front - 0.02, half_w - 0.012, inside), 0.003)]
    body += [
        block((-half_d, s * (half_w - 0.02) - 0.008, inside - 0.01), (front - 0.02, s * (half_w - 0.02) + 0.008, slab_top))
        for s in (-1.0, 1.0)
    ]
    legs = [
        block((x, y, 0.0), (x + 0.035, y + 0.035, body_low + 0.002))
        for x in (-half_d + 0.03, half_d - 0.1)
        for y in (-half_w + 0.03, half_w - 0.065)
    ]
    if body_low < 0.05:
        legs = [block((-half_d + 0.02, -half_w + 0.02, 0.0), (half_d - 0.08, half_w - 0.02, body_low + 0.06))]
    if style == "doors":
        edges = np.linspace(-half_w + 0.014, half_w - 0.014, 1 + max(1, round(width / 0.42)))
        areas = [Front(float(a), float(b), body_low + 0.004, slab_top - 0.006) for a, b in itertools.pairwise(edges)]
        handles = [knob(front, a.right - 0.04 if k % 2 == 0 else a.left + 0.04, a.high - 0.09, 0.022) for k, a in enumerate(areas)]
    else:
        levels = np.linspace(body_low + 0.004, slab_top - 0.006, 3)
        areas = [Front(-half_w + 0.014, half_w - 0.014, float(a), float(b)) for a, b in itertools.pairwise(levels)]
        handles = [bar_handle(front, 0.0, a.high - 0.035, 0.4 * width, 0.022) for a in areas]
    basin, tap_x = (_vessel if vessel else _inset_basin)(half_d, half_w, slab_top, rim)
    top = block((-half_d, -half_w, slab_top - 0.03), (half_d, half_w, slab_top + 0.002), 0.004)
    ledge = block((-half_d, -half_w, slab_top), (-0.52 * half_d, half_w, rim), 0.004)
    return {
        "body": [*body, *legs, *([top, ledge] if vessel else [])],
        "drawers": fronts(front, areas, 0.018, framed=style == "doors"),
        "handles": handles,
        "basin": basin,
        "tap": [_basin_tap(tap_x, slab_top if vessel else rim, height, 0.3 * depth), disc("z", (0.02, 0, rim - 0.085), 0.024, 0.008, 18)],
    }


def _inset_basin(half_d: float, half_w: float, low: float, rim: float) -> tuple[Mesh, float]:
    """A ceramic slab over the whole vanity with a hollow in it; and where its tap stands."""
    wide = min(0.82 * half_w, 0.34)
    under = [
        oval(0.32 * half_d, 0.57 * wide, rim - 0.098, 0.08 * half_d, 2.4),
        oval(0.53 * half_d, 0.88 * wide, rim - 0.075, 0.12 * half_d, 3.0),
        oval(0.69 * half_d, 1.02 * wide, low, 0.14 * half_d, 3.4),
    ]
    lip = [oval(half_d, half_w, z, power=26.0) for z in (low, rim - 0.006)]
    lip.append(oval(half_d - 0.005, half_w - 0.005, rim, power=26.0))
    bowl = [oval(0.66 * half_d, wide, rim, 0.14 * half_d, 3.4), oval(0.62 * half_d, 0.96 * wide, rim - 0.02, 0.14 * half_d, 3.4)]
    bowl += [
        oval(0.5 * half_d, 0.85 * wide, rim - 0.07, 0.12 * half_d, 3.0),
        oval(0.3 * half_d, 0.55 * wide, rim - 0.09, 0.08 * half_d, 2.4),
    ]
    return loft([*under, *lip, *bowl]), -0.72 * half_d


def _vessel(half_d: float, half_w: float, low: float, rim: float) -> tuple[Mesh, float]:
    """A round bowl on the top; and where its tap stands."""
    r = min(0.68 * half_d, 0.72 * half_w, 0.22)
    x = half_d - 1.1 * r
    wide = min(1.35 * r, 0.9 * half_w)
    shares = ((0.55, low), (0.72, low + 0.02), (0.94, 0.5 * (low + rim)), (1.0, rim - 0.006), (0.985, rim), (0.95, rim - 0.002))
    inside = ((0.88, 0.5 * (low + rim)), (0.66, rim - 0.075), (0.3, rim - 0.09))
    return loft([oval(s * r, s * wide, z, x) for s, z in shares + inside]), max(x - r - 0.035, -half_d + 0.025)


def _basin_tap(x: float, low: float, top: float, reach: float) -> Mesh:
    """A single-lever mixer with an arched spout."""
    z = top - 0.035
    spout = bent([(x, 0.0, low - 0.002), (x, 0.0, z), (x + reach, 0.0, z), (x + reach, 0.0, z - 0.05)], 0.012, 0.05, 12)
    lever = bent([(x, 0.0, z - 0.01), (x, 0.0, top - 0.008), (x + 0.09, 0.0, top - 0.007)], 0.007, 0.015, 8)
    return merged(
        spout, rod((x, 0.0, low - 0.002), (x, 0.0, low + 0.01), 0.025), rod((x, 0, low), (x, 0, low + 0.5 * (z - low)), 0.018), lever
    )


def build_washing_machine(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a front loader: a box with control strip, detergent drawer, knob, display and a round door with porthole."""
    _, width, height, half_d, half_w = halved(size_m)
    front = half_d - 0.03
    radius = min(0.36 * width, 0.27 * height)
    z = 0.46 * height
    case = merged(
        rounded_box((-half_d, -half_w, 0.015), (front, half_w, height - 0.03), 0.014, 2),
        block((-half_d, -half_w, height - 0.032), (front + 0.01, half_w, height), 0.004),
        *(rod((x, y, 0.0), (x, y, 0.02), 0.02) for x in (-half_d + 0.06, front - 0.06) for y in (-half_w + 0.06, half_w - 0.06)),
    )
    strip = [block((front - 0.01, -half_w + 0.006, 0.845 * height), (front + 0.008, half_w - 0.006, height - 0.036), 0.004)]
    strip.append(block((front - 0.01, -half_w + 0.006, 0.022), (front + 0.004, half_w - 0.006, 0.115 * height), 0.003))
    seam = 0.9 * height
    drawer = block((front, -0.92 * half_w, 0.86 * height), (front + 0.014, -0.36 * half_w, height - 0.045), 0.006)
    dial = disc("x", (front + 0.013, 0.06 * half_w, seam), 0.032, 0.03, 24, 0.004)
    display = block((front, 0.34 * half_w, 0.875 * height), (front + 0.0095, 0.86 * half_w, height - 0.055), 0.001)
    door = lying(lathe([(0.74, -0.01), (1.0, -0.01), (1.0, 0.014), (0.93, 0.026), (0.8, 0.026), (0.74, 0.01)], 40, closed=True), "x")
    door = door._replace(vertices=door.vertices * np.array([1.0, radius, radius], np.float32) + np.array([front, 0.0, z], np.float32))
    grip = block((front + 0.018, 0.83 * radius, z - 0.06), (front + 0.03, 0.93 * radius, z + 0.06), 0.006)
    if style == "inset":
        glass_profile = [(0.0, 0.0), (0.77 * radius, 0.0), (0.77 * radius, 0.02), (0.5 * radius, 0.012), (0.0, 0.005)]
    else:
        glass_profile = [(0.0, 0.0), (0.77 * radius, 0.0), (0.76 * radius, 0.018), (0.55 * radius, 0.025), (0.0, 0.028)]
    pane = lying(lathe(glass_profile, 36), "x", (front, 0.0, z))
    seal = ring("x", (front + 0.002, 0.0, z), 1.02 * radius, 0.006, 40, 6)
    trim = merged(door, seal) if style == "inset" else door
    return {"case": case, "panel": [*strip, drawer, grip], "door": [trim, dial], "glass": [pane, display]}


MODELS = {
    "toilet": Model(build_toilet, ("close_coupled", "skirted", "hung")),
    "bathtub": Model(build_bathtub, ("built_in", "oval", "clawfoot")),
    "shower_cabin": Model(build_shower_cabin, ("square", "quadrant", "walk_in")),
    "washbasin": Model(build_washbasin, ("drawers", "doors", "vessel")),
    "washing_machine": Model(build_washing_machine, ("porthole", "inset")),
}
