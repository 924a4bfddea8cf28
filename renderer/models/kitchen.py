"""Kitchen units: base and wall units, sinks, dishwashers, corners, tall units, islands; fronts look along +x and worktops are flat."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, rounded_box, slab, sweep
from renderer.models.bathroom import build_washing_machine
from renderer.models.cabinets import PANEL_M, Front, bar_handle, fronts, knob
from renderer.models.model import Model, Parts, Pieces, Size, fitted, halved
from renderer.models.tables import soft_body

WORKTOP_M = 0.04

PLINTH_M = 0.1

OVERHANG_M = 0.03

GRIP_M = 0.022


def _case(back: float, front: float, half: float, low: float, high: float) -> Mesh:
    """Return sides, bottom and back of a unit without top."""
    return blocks(
        [(back, -half, low), (back, half - PANEL_M, low), (back, -half + 0.004, low), (back, -half + 0.004, low + 0.004)],
        [(front, -half + PANEL_M, high), (front, half, high), (front, half - 0.004, low + PANEL_M), (back + 0.008, half - 0.004, high)],
        0.002,
    )


def columns(width: float, about: float = 0.5) -> list[float]:
    """Return the edges of a unit's columns along y."""
    return [float(edge) for edge in np.linspace(-0.5 * width + 0.001, 0.5 * width - 0.001, max(1, round(width / about)) + 1)]


def _handles(x: float, drawers: Sequence[Front], doors: Sequence[Front], style: str, reach: float, at_top: bool = True) -> Mesh:
    """Return bars (flat fronts), knobs (framed fronts) or grip channels along the edges (handleless ones).

    Doors have them near the upper edge, or near the lower one of wall units.
    """
    if style == "handleless":
        spans = [(a.left, a.right, a.high - 0.02 if at_top else a.low + 0.002) for a in (*drawers, *doors)]
        return blocks([(x - 0.034, y0, z) for y0, _, z in spans], [(x - 0.014, y1, z + 0.019) for _, y1, z in spans], 0.003)
    pieces = []
    for a in drawers:
        y, z, width = 0.5 * (a.left + a.right), a.high - min(0.05, 0.5 * (a.high - a.low)), a.right - a.left
        pieces.append(bar_handle(x, y, z, 0.55 * width, reach) if style == "flat" else knob(x, y, 0.5 * (a.low + a.high), reach))
    for k, a in enumerate(doors):
        y = a.right - 0.04 if k % 2 == 0 else a.left + 0.04
        z = a.high - 0.13 if at_top else a.low + 0.13
        pieces.append(bar_handle(x, y, z, 0.16, reach, upright=True) if style == "flat" else knob(x, y, z, reach))
    return merged(*pieces)


def base_unit(rng: np.random.Generator, size_m: Size, worktop_z: float, style: str, only_doors: bool) -> Parts:
    """Return body, fronts, handles and plinth of a base unit whose worktop's upper side lies at ``worktop_z``."""
    depth, width, _ = size_m
    back, half = -0.5 * depth, 0.5 * width
    front = 0.5 * depth - OVERHANG_M
    low, high = min(PLINTH_M, 0.13 * worktop_z), worktop_z - WORKTOP_M
    top = high - 0.004
    drawers, doors = [], []
    for a, b in itertools.pairwise(columns(width)):
        kind = 0 if only_doors else int(rng.integers(3))
        if kind == 1:
            levels = low + (top - low) * np.array([0.0, 0.4, 0.78, 1.0])
            drawers += [Front(a, b, float(z0), float(z1)) for z0, z1 in itertools.pairwise(levels)]
        else:
            split = top if only_doors else low + 0.78 * (top - low)
            doors.append(Front(a, b, low, split))
            drawers += [] if only_doors else [Front(a, b, split, top)]
    cut = GRIP_M if style == "handleless" else 0.0
    shut = [a._replace(high=a.high - cut) for a in (*drawers, *doors)]
    return {
        "body": _case(back, front - 0.019 - 0.6 * cut, half, low, high + 0.001),
        "fronts": fronts(front, shut, 0.019, framed=style == "framed"),
        "handles": _handles(front, drawers, doors, style, OVERHANG_M - 0.004),
        "plinth": block((back + 0.02, -half, 0.0), (front - 0.06, half, low + 0.002), 0.001),
    }


def build_kitchen_counter(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return base units with drawers and doors under a worktop: flat fronts with bars, framed ones with knobs, or grip channels."""
    depth, width, height = size_m
    worktop = block((-0.5 * depth, -0.5 * width, height - WORKTOP_M), (0.5 * depth, 0.5 * width, height), 0.002)
    return {**base_unit(rng, size_m, height, style, False), "worktop": worktop}


def build_sink_counter(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a base unit with a sunken sink, draining grooves and a tap that stands above the worktop.

    The worktop is 0.9 m high; 0.87 m in boxes lower than 1 m, or less in still lower ones.
    """
    depth, width, height, half_d, half_w = halved(size_m)
    tap_m = min(0.34, max(0.06 * height, height - (0.9 if height > 1.0 else 0.871)))
    z = height - tap_m
    a, b = 0.30 * depth, min(0.27, 0.36 * width)
    drain = width > 0.85
    x, y = 0.04 * depth, (-0.5 * half_w + 0.02 if drain else 0.0)
    low = z - WORKTOP_M
    worktop = blocks(
        [(-half_d, -half_w, low), (-half_d, y + b, low), (-half_d, y - b - 0.001, low), (x + a, y - b - 0.001, low)],
        [(half_d, y - b, z), (half_d, half_w, z), (x - a, y + b + 0.001, z), (half_d, y + b + 0.001, z)],
        0.001,
    )
    rim_a, rim_b = a + 0.022, b + 0.022
    deep = min(0.17, 0.25 * z)
    ra, wall = (a - 0.006) / rim_a, 0.012 / rim_a
    rim = [(ra, z + 0.0008), (1.0, z + 0.0008), (1.0, z + 0.003), (1.0 - wall, z + 0.005), (ra - 0.2 * wall, z + 0.004)]
    outside = [(0.0, z - deep - 0.003), (0.9 * ra, z - deep - 0.003), (ra, z - 0.9 * deep)]
    inside = [(ra - 0.5 * wall, z - 0.85 * deep), (0.86 * ra, z - deep), (0.0, z - deep - 0.001)]
    basin = moved(soft_body([*outside, *rim, *inside], rim_a, rim_b, 10.0, 56), x, y)
    r = 0.035
    plug = lathe([(0.0, 0.0), (r, 0.0), (r, 0.003), (0.8 * r, 0.004), (0.6 * r, 0.001), (0.0, 0.001)], 20)
    sink = [basin, moved(plug, x, y, z - deep - 0.001)]
    if drain:
        start, end = y + b + 0.05, half_w - 0.06
        count = max(4, round(2.0 * a / 0.045))
        xs = x - 0.9 * a + 1.8 * a * np.arange(count) / count
        sink.append(blocks(points(xs, start, z), points(xs + 0.012, end, z + 0.003), 0.001))
    parts = base_unit(rng, size_m, z, style, True)
    parts["worktop"] = worktop
    parts["sink"] = merged(*sink)
    parts["tap"] = kitchen_tap(-half_d + 0.5 * (x - a - 0.02 + half_d), y, z, height, 0.9 * a)
    return parts


def kitchen_tap(x: float, y: float, z: float, top: float, reach: float) -> Mesh:
    """Return a mixer on a worktop at z that reaches ``reach`` forward, up to ``top``: arched, or straight and low under 15 cm."""
    tall = top - z
    if tall < 0.15:
        column = lathe([(0.0, 0.0), (0.026, 0.0), (0.024, 0.8 * tall), (0.02, 0.86 * tall), (0.0, 0.86 * tall)], 20)
        spout = rod((x, y, 0.55 * tall + z), (x + reach, y, 0.68 * tall + z), 0.013, 0.011, 12)
        nozzle = rod((x + reach - 0.014, y, 0.62 * tall + z), (x + reach - 0.014, y, 0.3 * tall + z), 0.01, 0.009, 12)
        paddle = block((x - 0.012, y - 0.01, z + 0.86 * tall), (x + 0.07, y + 0.01, top), 0.003)
        return merged(moved(column, x, y, z), spout, nozzle, paddle)
    r = min(0.013, 0.11 * tall)
    bend = min(0.5 * reach, 0.45 * tall)
    angle = np.linspace(math.pi, 0.0, 9)
    arch = [(x + bend + bend * math.cos(t), y, top - r - bend + bend * math.sin(t)) for t in angle]
    tip = arch[-1]
    path = [(x, y, z + 0.25 * tall), (x, y, z + 0.4 * tall), *arch, (tip[0] + 0.002, y, max(z + 0.3 * tall, tip[2] - 0.25 * tall))]
    foot = lathe(
        points([0.0, 2.0 * r, 2.0 * r, 1.6 * r, 1.6 * r, 1.1 * r, 0.0], [0.0, 0.0, 0.006, 0.012, 0.34 * tall, 0.37 * tall, 0.37 * tall]), 20
    )
    lever = rod((x, y + 1.2 * r, z + 0.2 * tall), (x + 0.01, y + 5.5 * r, z + 0.33 * tall), 0.5 * r, 0.35 * r, 8)
    return merged(moved(foot, x, y, z), sweep(path, r, 12), lever)


def build_wall_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a hanging unit with flat doors and bars, framed doors and knobs, or plain doors gripped from below."""
    depth, width, height = size_m
    back, half = -0.5 * depth, 0.5 * width
    reach = min(0.026, 0.09 * depth) if style != "handleless" else 0.0
    front = 0.5 * depth - reach
    edges = columns(width, 0.45)
    doors = [Front(a, b, 0.001, height - (0.03 if style == "framed" else 0.001)) for a, b in itertools.pairwise(edges)]
    body = [_case(back, front - 0.019, half, 0.0, height), block((back, -half, height - PANEL_M), (front - 0.019, half, height), 0.002)]
    if style == "framed":
        body.append(block((back, -half, height - 0.028), (front + 0.004, half, height), 0.006))
    return {
        "body": body,
        "fronts": fronts(
            front, doors if style != "handleless" else [a._replace(low=GRIP_M) for a in doors], 0.019, framed=style == "framed"
        ),
        "handles": _handles(front, [], doors, style, reach, at_top=False),
    }


def build_dishwasher(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a dishwasher under a worktop: its panel above the door, with a bar or a recessed grip, or hidden behind a framed front."""
    depth, width, height = size_m
    back, half = -0.5 * depth, 0.5 * width
    front = 0.5 * depth - OVERHANG_M
    low, high = min(PLINTH_M, 0.13 * height), height - WORKTOP_M
    split = high - min(0.12, 0.16 * high)
    body = block((back + 0.01, -half + 0.004, low), (front - 0.02, half - 0.004, high + 0.001))
    door = rounded_box((front - 0.03, -half + 0.003, low + 0.004), (front, half - 0.003, split - 0.003), 0.006)
    panel = rounded_box((front - 0.03, -half + 0.003, split), (front, half - 0.003, high - 0.004), 0.006)
    z = 0.5 * (split + high)
    if style == "integrated":
        door = fronts(front, [Front(-half + 0.002, half - 0.002, low + 0.002, split - 0.002)], 0.02, framed=True)
    if style in ("bar", "integrated"):
        handle = bar_handle(front, 0.0, split - 0.045, 1.5 * half, OVERHANG_M - 0.004)
    else:
        handle = rounded_box((front - 0.01, -0.35 * half, split - 0.02), (front + 0.012, 0.35 * half, split + 0.004), 0.005)
    keys = [(0.55 + 0.08 * k) * half for k in range(5)]
    display = blocks(
        [(front - 0.002, -0.8 * half, z - 0.012), *((front - 0.002, y - 0.012 * half, z - 0.008) for y in keys)],
        [(front + 0.0008, -0.45 * half, z + 0.012), *((front + 0.001, y + 0.012 * half, z + 0.008) for y in keys)],
        0.0004,
    )
    return {
        "body": body,
        "door": [door, panel],
        "handle": handle,
        "display": display,
        "plinth": block((back + 0.02, -half, 0.0), (front - 0.06, half, low + 0.002), 0.001),
        "worktop": block((-0.5 * depth, -half, high), (0.5 * depth, half, height), 0.002),
    }


def turned_knob(x: float, y: float, z: float, r: float, reach: float) -> Mesh:
    """Return a control knob with a ridge on the front plane at ``x``."""
    cap = rotated(lathe([(0.0, 0.0), (r, 0.0), (0.9 * r, 0.6 * reach), (0.0, 0.6 * reach)], 18), "y", 0.5 * math.pi)
    return merged(moved(cap, x, y, z), block((x + 0.2 * reach, y - 0.2 * r, z - 0.85 * r), (x + reach, y + 0.2 * r, z + 0.85 * r), 0.001))


_WALL_UNIT_DEPTH_M = 0.35

_DOOR_M = 0.019


def build_kitchen_corner(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return the closed base unit in a corner: its back and its right side at walls, units against its front and its left side."""
    del rng
    return corner_unit(size_m, style)


def corner_unit(size_m: Size, style: str, clad_m: float = 0.0) -> Parts:
    """Return body, plinth and worktop of a corner unit, with room for cladding on its right side."""
    half_d, half_w, high = 0.5 * size_m[0], 0.5 * size_m[1], size_m[2] - WORKTOP_M
    low = min(PLINTH_M, 0.13 * size_m[2])
    cut = OVERHANG_M + (0.6 * GRIP_M if style == "handleless" else 0.0)
    right = -half_w + clad_m
    return {
        "body": block((-half_d, right, low), (half_d - cut, half_w - cut, high + 0.001), 0.002),
        "plinth": block((-half_d + 0.02, right + 0.02, 0.0), (half_d - 0.09, half_w - 0.09, low + 0.002), 0.001),
        "worktop": block((-half_d, -half_w, high), (half_d, half_w, size_m[2]), 0.002),
    }


def build_corner_wall_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a hanging unit with its back and its right side at walls and a door across the corner between its neighbours' fronts."""
    del rng
    depth, width, height, half_d, half_w = halved(size_m)
    beside = min(_WALL_UNIT_DEPTH_M - 0.026, 0.7 * min(depth, width))
    outline = [(-half_d, -half_w), (half_d, -half_w), (half_d, -half_w + beside), (-half_d + beside, half_w), (-half_d, half_w)]
    # the door stands on the line between the third and the fourth point
    (ax, ay), (bx, by) = outline[2], outline[3]
    angle, wide = math.atan2(by - ay, bx - ax) - 0.5 * math.pi, math.hypot(bx - ax, by - ay)
    low = GRIP_M if style == "handleless" else 0.004
    door = fronts(_DOOR_M, [Front(-0.5 * wide + 0.014, 0.5 * wide - 0.014, low, height - 0.003)], _DOOR_M, framed=style == "framed")
    if style == "flat":
        pull = bar_handle(_DOOR_M, -0.5 * wide + 0.06, 0.13, 0.16, 0.024, upright=True)
    elif style == "framed":
        pull = knob(_DOOR_M, -0.5 * wide + 0.06, 0.1, 0.024)
    else:
        pull = block((0.0, -0.5 * wide + 0.02, 0.0), (_DOOR_M - 0.006, 0.5 * wide - 0.02, GRIP_M - 0.002), 0.002)
    middle = 0.5 * (ax + bx), 0.5 * (ay + by)
    turned = [moved(rotated(mesh, "z", angle), *middle) for mesh in (door, pull)]
    return {"body": slab(outline, 0.0, height), "fronts": turned[0], "handles": turned[1]}


def _tall_fronts(x: float, areas: list[Front], style: str) -> Parts:
    """Return doors one above the other with their handles on the left, or grips along an edge."""
    handles = []
    for area in areas:
        tall = area.high - area.low
        if style == "handleless":
            handles.append(block((x - 0.03, area.left, area.low + 0.002), (x - 0.012, area.left + 0.019, area.high - 0.002), 0.002))
        elif style == "flat":
            length = min(0.4 * tall, 0.5)
            handles.append(bar_handle(x, area.right - 0.05, 0.5 * (area.low + area.high), length, OVERHANG_M - 0.004, upright=True))
        else:
            handles.append(knob(x, area.right - 0.05, 0.5 * (area.low + area.high), OVERHANG_M - 0.004))
    cut = GRIP_M if style == "handleless" else 0.0
    shut = [area._replace(left=area.left + cut) for area in areas]
    return {"fronts": fronts(x, shut, _DOOR_M, framed=style == "framed"), "handles": merged(*handles)}


def _tower(size_m: Size, style: str) -> Parts:
    """Return case and plinth of a tall unit."""
    half_d, half_w, height = 0.5 * size_m[0], 0.5 * size_m[1], size_m[2]
    cut = OVERHANG_M + _DOOR_M + (0.6 * GRIP_M if style == "handleless" else 0.0)
    return {
        "body": block((-half_d, -half_w, PLINTH_M), (half_d - cut, half_w, height), 0.002),
        "plinth": block((-half_d + 0.02, -half_w, 0.0), (half_d - 0.09, half_w, PLINTH_M + 0.002), 0.001),
    }


def build_oven_tower(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a tall unit with an oven at the height of the worktop and a smaller one above it, doors below and above these."""
    del rng
    half_w, height, front = 0.5 * size_m[1], size_m[2], 0.5 * size_m[0] - OVERHANG_M
    levels = [PLINTH_M, 0.34 * height, 0.62 * height, 0.8 * height, height - 0.002]
    areas = [Front(-half_w, half_w, levels[0], levels[1]), Front(-half_w, half_w, levels[3], levels[4])]
    ovens, panes, pulls = [], [], []
    for low, high in ((levels[1], levels[2]), (levels[2], levels[3])):
        ovens.append(rounded_box((front - 0.04, -half_w + 0.003, low + 0.003), (front, half_w - 0.003, high - 0.003), 0.004))
        strip = 0.2 * (high - low)
        panes.append(block((front - 0.004, -0.86 * half_w, low + 0.04), (front + 0.002, 0.86 * half_w, high - strip - 0.045), 0.001))
        panes.append(
            block((front - 0.002, -0.25 * half_w, high - 0.75 * strip), (front + 0.001, 0.25 * half_w, high - 0.35 * strip), 0.0005)
        )
        pulls.append(bar_handle(front, 0.0, high - strip - 0.012, 1.5 * half_w, OVERHANG_M - 0.004))
    parts = {**_tower(size_m, style), **_tall_fronts(front, areas, style)}
    return {**parts, "oven": ovens, "glass": panes, "bars": pulls}


def build_larder(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a tall unit with a long door below a short one, two of each where it is wide."""
    del rng
    half_w, height, front = 0.5 * size_m[1], size_m[2], 0.5 * size_m[0] - OVERHANG_M
    edges = np.linspace(-half_w, half_w, 3 if size_m[1] > 0.65 else 2)
    split = 0.66 * height
    levels = ((PLINTH_M, split), (split, height - 0.002))
    areas = [Front(float(a), float(b), low, high) for low, high in levels for a, b in itertools.pairwise(edges)]
    return {**_tower(size_m, style), **_tall_fronts(front, areas, style)}


def build_built_in_washer(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a front loader between two thin sides under a worktop."""
    depth, width, height = size_m
    half_d, half_w, high = 0.5 * depth, 0.5 * width, height - WORKTOP_M
    inside = (depth - OVERHANG_M, width - 0.02, high - 0.01)
    machine = fitted(build_washing_machine(rng, inside, style), inside)
    parts = {name: moved(mesh, -0.5 * OVERHANG_M + 0.01) for name, mesh in machine.items()}
    back, front = -half_d, half_d - 2.0 * OVERHANG_M
    sides = blocks([(back, -half_w, 0.0), (back, half_w - 0.008, 0.0)], [(front, -half_w + 0.008, high), (front, half_w, high)], 0.001)
    worktop = block((-half_d, -half_w, high), (half_d, half_w, height), 0.002)
    return {**parts, "sides": sides, "worktop": worktop}


_STYLES = ("flat", "framed", "handleless")

_REACH_M = 0.3

_PANEL_M = 0.02

_SLAT_M, _GROOVE_M = 0.045, 0.008


def build_island_counter(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a base unit that stands free: a clad back, and a worktop that reaches out behind it on brackets.

    The back has frames (framed fronts), upright slats (flat ones) or plain panels, down to the floor.
    """
    depth, width, height = size_m
    back = min(_REACH_M, 0.4 * depth) + _PANEL_M - 0.5 * depth
    under, half = height - WORKTOP_M, 0.5 * width
    unit = base_unit(rng, (0.5 * depth - back, width, height), height, style, only_doors=False)
    parts = {name: moved(mesh, 0.5 * (back + 0.5 * depth)) for name, mesh in unit.items()}
    parts["panel"] = moved(rotated(_cladding(width, under, style), "z", math.pi), back)
    reach = back + 0.5 * depth - _PANEL_M
    parts["brackets"] = merged(*(_bracket(back - _PANEL_M, y, under, 0.75 * reach) for y in (-half + 0.14, half - 0.14)))
    parts["worktop"] = block((-0.5 * depth, -half, under), (0.5 * depth, half, height), 0.002)
    return parts


def build_peninsula_corner(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a closed corner unit with its back at a wall and its right side, clad, to the room."""
    half = 0.5 * size_m[1]
    side = rotated(_cladding(size_m[0], size_m[2] - WORKTOP_M, style), "z", -0.5 * math.pi)
    return {**corner_unit(size_m, style, clad_m=_PANEL_M), "panel": moved(side, 0.0, _PANEL_M - half)}


def _cladding(width: float, high: float, style: str) -> Mesh:
    """Return the cladding of a back, from x = 0 towards +x."""
    edges = columns(width, 0.6)
    if style == "framed":
        return fronts(_PANEL_M, [Front(a, b, 0.0, high) for a, b in itertools.pairwise(edges)], _PANEL_M, framed=True)
    if style == "flat":
        count = max(2, round(width / _SLAT_M))
        lines = np.linspace(-0.5 * width, 0.5 * width, count + 1)
        sheet = block((0.0, -0.5 * width, 0.0), (0.4 * _PANEL_M, 0.5 * width, high))
        low = [(0.0, float(y), 0.0) for y in lines[:-1]]
        return merged(sheet, blocks(low, [(_PANEL_M, float(y) - _GROOVE_M, high) for y in lines[1:]], 0.002))
    return blocks([(0.0, a, 0.0) for a in edges[:-1]], [(_PANEL_M, b - 0.003, high) for b in edges[1:]], 0.002)


def _bracket(x: float, y: float, z: float, reach: float) -> Mesh:
    """Return a flat steel angle below the worktop, from the wall at ``x`` backwards."""
    flat = block((x - reach, y - 0.025, z - 0.008), (x, y + 0.025, z), 0.001)
    return merged(flat, block((x - 0.008, y - 0.025, z - 0.2), (x, y + 0.025, z), 0.001))


MODELS = {
    "kitchen_counter": Model(build_kitchen_counter, ("flat", "framed", "handleless")),
    "sink_counter": Model(build_sink_counter, ("flat", "framed", "handleless")),
    "wall_cabinet": Model(build_wall_cabinet, ("flat", "framed", "handleless")),
    "dishwasher": Model(build_dishwasher, ("bar", "grip", "integrated")),
    "kitchen_corner": Model(build_kitchen_corner, _STYLES),
    "corner_wall_cabinet": Model(build_corner_wall_cabinet, _STYLES),
    "oven_tower": Model(build_oven_tower, _STYLES),
    "larder": Model(build_larder, _STYLES),
    "built_in_washer": Model(build_built_in_washer, ("porthole", "inset")),
    "island_counter": Model(build_island_counter, ("flat", "framed", "handleless")),
    "peninsula_corner": Model(build_peninsula_corner, ("flat", "framed", "handleless")),
}
