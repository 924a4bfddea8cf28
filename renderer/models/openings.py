"""Doors and windows, built into a hole of a wall.

Frame of an opening: origin on the wall's inner face at the middle of the hole's lower edge, x into the room, y along the wall, z up;
the wall fills x from -thickness to 0.  Casings and sills stand out of the hole; every joint is covered, so that no light passes beside the
pane.

"""

import itertools
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

import kernel_cache.elementary as el
from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, make_mesh, membrane, merged, mirrored, moved, rod, sweep
from renderer.models.model import Parts

Pair = tuple[float, float]

SASH_M = 0.028
"""Half the thickness of a window's sash."""

EMBED_M = 0.004
"""How far frames reach into the wall, so that no crack stays open."""


class Hole(NamedTuple):
    """An opening to fill: inner size, the wall's thickness, room above it, the hinge's side and where the leaf opens to."""

    width_m: float
    height_m: float
    thickness_m: float
    headroom_m: float
    hinge: Literal["start", "end"]
    swing: Literal["in", "out"]


class OpeningModel(NamedTuple):
    """A family of doors or windows; ``styles`` lists the known ones, the first is the default."""

    build: Callable[[np.random.Generator, Hole, str], Parts]
    styles: tuple[str, ...]


def build_door(rng: np.random.Generator, hole: Hole, style: str) -> Parts:
    """Return a closed door: lining, casing and stops (``frame``), ``leaf``, lever handles and hinges (``handle``)."""
    half, top, deep = 0.5 * hole.width_m, hole.height_m, hole.thickness_m
    lining = 0.022
    casing = min(rng.uniform(0.06, 0.08), hole.headroom_m + lining)
    thick = min(0.04, 0.4 * deep)
    front = -0.006 if hole.swing == "in" else -deep + thick + 0.006
    behind = (front - thick - 0.002 - 0.022, front - thick - 0.002) if hole.swing == "in" else (front + 0.002, front + 0.024)
    inner = half - lining
    frame = merged(
        _surround(-deep, 0.001, half + EMBED_M, inner, top + EMBED_M, top - lining, 0.0),
        _surround(-0.004, 0.014, inner + casing, inner + 0.006, top - lining + casing, top - lining - 0.006 + 0.012, 0.0),
        _surround(behind[0], behind[1], inner + 0.002, inner - 0.016, top - lining + 0.002, top - lining - 0.016, 0.0),
        block((-deep, -half - EMBED_M, -EMBED_M), (0.0, half + EMBED_M, 0.003), 0.001),
        block((behind[0], -inner, 0.0), (behind[1], inner, 0.016), 0.002),
    )
    gap = 0.003
    leaf = _leaf(rng, front, thick, inner - gap, 0.006, top - lining - gap, style)
    side = 1.0 if hole.hinge == "start" else -1.0
    lever_y = -side * (inner - gap - 0.065)
    lever = _lever(rng, side)
    lever_z = min(1.04, 0.5 * top)
    handles = [moved(lever, front, lever_y, lever_z), moved(mirrored(lever, "x"), front - thick, lever_y, lever_z)]
    hinge_x = front + 0.004 if hole.swing == "in" else front - thick - 0.004
    pins = [
        rod((hinge_x, side * (inner - 0.001), z - 0.045), (hinge_x, side * (inner - 0.001), z + 0.045), 0.007, segments=8)
        for z in (0.12 * top, 0.5 * top, 0.88 * top)
    ]
    return {"frame": frame, "leaf": leaf, "handle": merged(*handles, *pins)}


def build_garage_door(rng: np.random.Generator, hole: Hole, style: str) -> Parts:
    """Return a closed overhead door: lining, casing and threshold (``frame``), ``leaf`` of hinged sections or slats, ``handle``."""
    half, top, deep = 0.5 * hole.width_m, hole.height_m, hole.thickness_m
    lining, gap, thick = 0.03, 0.004, min(0.045, 0.5 * deep)
    casing = min(0.07, hole.headroom_m + lining)
    back = -0.5 * deep - 0.5 * thick
    inner, high = half - lining, top - lining
    frame = merged(
        _surround(-deep, 0.001, half + EMBED_M, inner, top + EMBED_M, high, 0.0),
        _surround(-0.004, 0.012, inner + casing, inner + 0.006, high + casing, high + 0.006, 0.0),
        _surround(back - 0.014, back - 0.002, inner + 0.002, inner - 0.04, high + 0.002, high - 0.04, 0.0),
        _surround(back + thick + 0.002, back + thick + 0.03, inner + 0.002, inner - 0.03, high + 0.002, high - 0.03, 0.0),
        block((-deep, -half - EMBED_M, -EMBED_M), (0.0, half + EMBED_M, 0.003), 0.001),
    )
    count = round(high / 0.09) if style == "slats" else max(4, round(high / rng.uniform(0.48, 0.56)))
    levels = np.linspace(0.005, high - gap, count + 1)
    low_rows = [(back, -inner + gap, z + 0.001) for z in levels[:-1]]
    high_rows = [(back + thick, inner - gap, z - 0.001) for z in levels[1:]]
    core = block((back + 0.012, -inner + gap + 0.002, levels[0] + 0.002), (back + thick - 0.012, inner - gap - 0.002, levels[-1] - 0.002))
    pieces = [blocks(low_rows, high_rows, 0.009 if style == "slats" else 0.004), core]
    if style == "cassettes":
        columns = np.linspace(-inner + 0.08, inner - 0.08, max(3, round(2.0 * inner / 0.6)) + 1)
        fields = [(a, b, c, d) for a, b in itertools.pairwise(columns) for c, d in itertools.pairwise(levels)]
        pieces.append(
            blocks(
                [(back + thick - 0.01, a + 0.04, c + 0.08) for a, _, c, _ in fields],
                [(back + thick + 0.009, b - 0.04, d - 0.08) for _, b, _, d in fields],
                0.006,
            )
        )
    plate = block((back + thick - 0.004, -0.03, levels[1] + 0.08), (back + thick + 0.012, 0.03, levels[1] + 0.2), 0.003)
    grip_x = back + thick + 0.012
    grip = sweep(points([grip_x, grip_x + 0.022, grip_x + 0.022, grip_x], [-0.08, -0.05, 0.05, 0.08], levels[1] + 0.14), 0.009, 8)
    return {"frame": frame, "leaf": merged(*pieces), "handle": merged(plate, grip)}


def _surround(x0: float, x1: float, outer: float, inner: float, top: float, inner_top: float, low: float) -> Mesh:
    """Return two jambs and a head between half widths ``inner`` and ``outer``."""
    return blocks(
        [(x0, -outer, low - 0.001), (x0, inner, low - 0.001), (x0, -outer, inner_top)],
        [(x1, -inner, inner_top + 0.002), (x1, outer, inner_top + 0.002), (x1, outer, top)],
        0.003,
    )


def _leaf(rng: np.random.Generator, front: float, thick: float, half: float, low: float, high: float, style: str) -> Mesh:
    back = front - thick
    sunk = 0.008
    core = block((back + sunk, -half + 0.002, low + 0.002), (front - sunk, half - 0.002, high - 0.002))
    if style == "flush":
        # A smooth leaf, or one with some grooves across.
        edges = np.linspace(low, high, 1 + int(rng.integers(1, 6)))
        boards = blocks([(back, -half, z + 0.0015) for z in edges[:-1]], [(front, half, z - 0.0015) for z in edges[1:]], 0.002)
        return merged(boards, core)
    if style == "planked":
        count = max(3, round(2.0 * half / rng.uniform(0.09, 0.13)))
        edges = np.linspace(-half, half, count + 1)
        planks = blocks([(back, y + 0.001, low) for y in edges[:-1]], [(front, y - 0.001, high) for y in edges[1:]], 0.004)
        return merged(planks, core)
    stile, rail, middle = 0.115, 0.12, 0.5 * (low + high) - 0.05
    levels = [(low, low + 1.5 * rail), (middle - 0.6 * rail, middle + 0.6 * rail), (high - rail, high)]
    mullion = [(-0.05, 0.05)] if half > 0.34 else []
    low_rows = (
        [(back, -half, low), (back, half - stile, low)]
        + [(back, -half + stile, a) for a, _ in levels]
        + [(back, a, low + rail) for a, _ in mullion]
    )
    high_rows = (
        [(front, -half + stile, high), (front, half, high)]
        + [(front, half - stile, b) for _, b in levels]
        + [(front, b, high - 0.5 * rail) for _, b in mullion]
    )
    columns = [(-half + stile, -0.05), (0.05, half - stile)] if mullion else [(-half + stile, half - stile)]
    margin = 0.035
    fields = [(a, b, c[1], d[0]) for a, b in columns for c, d in itertools.pairwise(levels)]
    raised = blocks(
        [(back + 0.003, a + margin, c + margin) for a, _, c, _ in fields],
        [(front - 0.003, b - margin, d - margin) for _, b, _, d in fields],
        0.009,
    )
    return merged(blocks(low_rows, high_rows, 0.004), raised, core)


def _lever(rng: np.random.Generator, side: float) -> Mesh:
    """Return plate and lever on the face x = 0, and a rose for the key; the lever points towards the hinge (``side`` of y)."""
    plate = (
        merged(*(rod((-0.002, 0.0, z), (0.007, 0.0, z), 0.026, segments=18) for z in (0.0, -0.09)))
        if rng.random() < 0.6
        else block((-0.002, -0.02, -0.14), (0.006, 0.02, 0.05), 0.002)
    )
    path = [(0.0, 0.0, 0.0), (0.042, 0.0, 0.0), (0.05, side * 0.008, 0.0), (0.052, side * 0.03, 0.0), (0.05, side * 0.125, 0.0)]
    return merged(plate, sweep(path, [0.009, 0.009, 0.0095, 0.0085, 0.008], 10))


def build_window(rng: np.random.Generator, hole: Hole, style: str) -> Parts:
    """Return a window: fixed frame and sashes with mullions (``frame``), inner ``sill``, ``pane`` (one quad), ``handle``.

    Styles with a net, a blind or slats have that as ``dressing``, on a ``rail``.
    """
    half, top, deep = 0.5 * hole.width_m, hole.height_m, hole.thickness_m
    frame_half, sill_top = min(0.032, 0.3 * deep), 0.022
    middle = -deep + 1.08 * frame_half
    border = min(0.05, 0.15 * min(hole.width_m, top))
    low, high = sill_top + border * 0.6, top - border
    x = (middle - frame_half, middle + frame_half)
    casing = _window_rim(x, (half + EMBED_M, half - border), (-EMBED_M, low), (top + EMBED_M, high))
    kind, _, dressing = style.partition("_")
    sashes = {"single": 1, "double": 3 if hole.width_m > 1.9 else 2, "grid": 2}[kind]
    edges = np.linspace(-(half - border), half - border, sashes + 1)
    rim = min(0.055, 0.2 * float(edges[1] - edges[0]))
    pieces = [casing]
    for a, b in itertools.pairwise(edges):
        pieces += _sash(middle, (float(a), float(b)), (low, high), rim, kind == "grid")
    nose = rng.uniform(0.03, 0.05)
    sill = merged(
        block((middle + frame_half - 0.004, -half - EMBED_M, -EMBED_M), (0.01, half + EMBED_M, sill_top), 0.002),
        block((0.0, -half - 0.045, -0.008), (nose, half + 0.045, sill_top), 0.007),
    )
    handle = _window_handle(middle + SASH_M + 0.012, 0.0 if sashes == 2 else float(edges[1]) - 0.5 * rim, 0.5 * (low + high))
    y, z0, z1 = half + 0.5 * EMBED_M, -0.5 * EMBED_M, top + 0.5 * EMBED_M
    corners = [(middle, -y, z0), (middle, y, z0), (middle, y, z1), (middle, -y, z1)]
    pane = make_mesh(corners, [(1.0, 0.0, 0.0)] * 4, [(0, 1, 2), (0, 2, 3)])
    window = {"frame": merged(*pieces), "sill": sill, "pane": pane, "handle": handle}
    if dressing:
        rail, cloth = _DRESSINGS[dressing](rng, half - 0.006, sill_top + 0.004, top - 0.002)
        window |= {"rail": rail, "dressing": cloth}
    return window


_HANG_X = -0.013
"""Where blinds hang: in the reveal, before the handles of the sashes."""
_NET_X, _NET_FOLD_M = -0.0155, 0.0145
"""Where nets hang, and how far their folds swing to either side, at most."""


def _net(rng: np.random.Generator, half: float, low: float, high: float) -> tuple[Mesh, Mesh]:
    """Return the rod of a net curtain and its cloth in soft folds: down to the sill, over the lower half, or drawn to both sides."""
    state = rng.choice(["whole", "half", "sides"], p=[0.3, 0.25, 0.45])
    rod_z = (low + rng.uniform(0.5, 0.6) * (high - low) if state == "half" else high) - 0.012
    rail = rod((_NET_X, -half - 0.004, rod_z), (_NET_X, half + 0.004, rod_z), 0.005, segments=8)
    drawn = rng.uniform(0.3, 0.55) * half
    spans = [(-half, -half + drawn), (half - drawn, half)] if state == "sides" else [(-half, half)]
    density = 1.0 if state == "sides" else rng.uniform(0.4, 0.75)
    hangings = []
    for a, b in spans:
        folds = max(4, round(density * (b - a) / 0.045))
        u, v = np.meshgrid(np.linspace(0.0, 1.0, 8 * folds + 1), np.linspace(0.0, 1.0, 5), indexing="ij")
        phase = rng.uniform(0.0, 2.0 * np.pi, 2)
        angle = 2.0 * np.pi * folds * u + 0.5 * el.sin(2.0 * np.pi * 3.0 * u + phase[0]) * (1.0 - v)
        deep = _NET_FOLD_M * (0.7 + 0.3 * el.sin(2.0 * np.pi * 1.7 * u + phase[1])) * (1.0 - 0.35 * v)
        hangings.append(membrane(np.dstack([_NET_X + deep * el.sin(angle), a + (b - a) * u, low + (rod_z + 0.004 - low) * v])))
    return rail, merged(*hangings)


def _blind(rng: np.random.Generator, half: float, low: float, high: float) -> tuple[Mesh, Mesh]:
    """Return the tube, brackets and bar of a roller blind and its cloth, let down by some part of the window's height.

    Never by all of it: rooms whose lamps are off would be left in the dark.
    """
    radius, end = 0.016, high - rng.uniform(0.12, 0.65) * (high - low - 0.01)
    tube = rod((_HANG_X - 0.003, -half + 0.01, high - radius), (_HANG_X - 0.003, half - 0.01, high - radius), radius, segments=16)
    caps = blocks(
        [(_HANG_X - 0.016, s * half - 0.006, high - 2.0 * radius) for s in (-1.0, 1.0)],
        [(_HANG_X + 0.013, s * half + 0.006, high) for s in (-1.0, 1.0)],
        0.003,
    )
    x = _HANG_X + radius - 0.009
    bar = block((x - 0.006, -half + 0.014, end - 0.002), (x + 0.004, half - 0.014, end + 0.02), 0.003)
    chain = rod((x, half - 0.006, high - radius), (x, half - 0.006, max(high - 0.9, low + 0.05)), 0.0022, segments=6)
    y, z = np.meshgrid(np.linspace(-half + 0.014, half - 0.014, 2), np.linspace(end + 0.01, high - radius, 2), indexing="ij")
    return merged(tube, caps, bar, chain), membrane(np.dstack([np.full_like(y, x), y, z]))


def _slats(rng: np.random.Generator, half: float, low: float, high: float) -> tuple[Mesh, Mesh]:
    """Return the head rail, foot and cords of a slatted blind and its slats, tilted, those that are drawn up in a pile."""
    wide, pitch, head = 0.025, 0.0215, 0.026
    tilt = rng.uniform(-0.8, 0.8)
    room = high - head - low - 0.016
    count = max(4, int(room / pitch))
    down = count if rng.random() < 0.55 else int(rng.uniform(0.15, 0.85) * count)
    hanging = high - head - pitch * (np.arange(down) + 0.8)
    pile = hanging[-1] - 0.6 * pitch - 0.0016 * np.arange(count - down) if down else high - head - 0.0016 * np.arange(count)
    places = np.concatenate([hanging, pile])
    turns = np.concatenate([np.full(down, tilt) + rng.normal(0.0, 0.02, down), np.zeros(count - down)])
    s, y = np.linspace(-0.5, 0.5, 5) * wide, np.linspace(-half + 0.008, half - 0.008, 2)
    bow = 0.0022 * (1.0 - (2.0 * s / wide) ** 2)
    x = _HANG_X - 0.002 + np.outer(el.cos(turns), s) + np.outer(el.sin(turns), bow)
    z = places[:, None] - np.outer(el.sin(turns), s) + np.outer(el.cos(turns), bow)
    slats = [membrane(np.dstack([np.tile(a[:, None], 2), np.tile(y, (5, 1)), np.tile(b[:, None], 2)])) for a, b in zip(x, z, strict=True)]
    foot = float(places[-1]) - 0.014
    rail = [
        block((-0.0275, -half, high - head), (-0.002, half, high), 0.002),
        block((-0.026, -half + 0.008, foot), (-0.004, half - 0.008, foot + 0.012), 0.003),
    ]
    rail += [
        rod((cx, cy, foot + 0.01), (cx, cy, high - head), 0.0009, segments=5)
        for cy in np.array([-0.72, 0.72]) * half
        for cx in (-0.027, -0.003)
    ]
    rail.append(rod((-0.004, -half + 0.05, high - head), (-0.004, -half + 0.05, max(high - 0.8, low + 0.05)), 0.003, segments=6))
    return merged(*rail), merged(*slats)


_DRESSINGS = {"net": _net, "blind": _blind, "slats": _slats}
"""What hangs in a window -> rails and fittings, cloth or slats; made from half the width, lower and upper edge, metres."""


def _sash(x: float, span: tuple[float, float], z: tuple[float, float], rim: float, grid: bool) -> list[Mesh]:
    """Return a wing between two y and two z, with bars across where it is a grid."""
    low, high = z
    center, half = 0.5 * (span[0] + span[1]), 0.5 * (span[1] - span[0])
    wing = _window_rim(
        (x - SASH_M + 0.012, x + SASH_M + 0.012), (half + 0.004, half - rim), (low - 0.004, low + rim), (high + 0.004, high - rim)
    )
    pieces = [moved(wing, y=center)]
    if grid:
        zs = np.linspace(low, high, max(2, round((high - low) / 0.42)) + 1)[1:-1]
        start, end = points(x - 0.014, center - half + rim * 0.9, zs - 0.011), points(x + 0.022, center + half - rim * 0.9, zs + 0.011)
        pieces.append(blocks(start, end, 0.004))
        pieces.append(block((x - 0.014, center - 0.011, low + 0.9 * rim), (x + 0.022, center + 0.011, high - 0.9 * rim), 0.004))
    return pieces


def _window_handle(x: float, y: float, z: float) -> Mesh:
    plate = block((x - 0.002, y - 0.014, z - 0.035), (x + 0.008, y + 0.014, z + 0.035), 0.003)
    lever = sweep(points([x, x + 0.03, x + 0.036, x + 0.034], y, [z, z, z - 0.02, z - 0.11]), [0.007, 0.007, 0.008, 0.007], 8)
    return merged(plate, lever)


def _window_rim(x: Pair, y: Pair, low: Pair, high: Pair) -> Mesh:
    """Return four bars round a light: ``x`` back and front, then outer and inner half width, lower edge and upper edge."""
    (x0, x1), (outer, inner), (bottom, inner_low), (top, inner_top) = x, y, low, high
    return blocks(
        [(x0, -outer, bottom), (x0, inner, bottom), (x0, -inner - 0.002, bottom), (x0, -inner - 0.002, inner_top)],
        [(x1, -inner, top), (x1, outer, top), (x1, inner + 0.002, inner_low), (x1, inner + 0.002, top)],
        0.004,
    )


OPENING_MODELS = {
    "door": OpeningModel(build_door, ("panelled", "flush", "planked")),
    "garage_door": OpeningModel(build_garage_door, ("sections", "cassettes", "slats")),
    "window": OpeningModel(
        build_window, tuple(f"{kind}{after}" for after in ("", "_net", "_blind", "_slats") for kind in ("double", "single", "grid"))
    ),
}
"""Generator name -> model of an opening."""
