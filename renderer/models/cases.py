"""Low and high case furniture of living and dining rooms: media units, sideboards, china cabinets, wall shelves."""

from __future__ import annotations

import itertools

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rotated, sheet
from renderer.models.cabinets import PANEL_M, Front, carcass, fronts, pulls, splayed_legs, square_legs
from renderer.models.model import Model, Parts, Size, fitted


def build_tv_stand(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a long low unit: open bays over drawers on a plinth, slatted doors on splayed legs, or wide drawers on metal runners."""
    depth, width, height = size_m
    reach = min(0.016, 0.045 * depth)
    back, half, body_depth = -0.5 * depth, 0.5 * width, depth - reach
    front = back + body_depth - 0.004
    leg = {"open": 0.12, "slatted": 0.32, "runners": 0.3}[style] * height
    inner = half - PANEL_M - 0.005
    count = max(2, round(width / 0.55))
    edges = np.linspace(-inner, inner, count + 1)
    low, top = leg + 0.02, height - 0.025
    body = [carcass(body_depth, width, leg, height, 0.005, back)]
    body.append(_uprights(edges[1:-1], back + 0.006, front - 0.02, leg + 0.004, height - 0.02))
    if style == "open":
        split = low + 0.5 * (top - low)
        body.append(block((back + 0.006, -inner, split - 0.009), (front - 0.02, inner, split + 0.009), 0.002))
        areas = [Front(float(a), float(b), low - 0.004, split + 0.004) for a, b in itertools.pairwise(edges)]
        drawers = fronts(front, areas)
        legs = block((back + 0.03, -half + 0.04, 0.0), (front - 0.04, half - 0.04, leg + 0.002))
    elif style == "runners":
        levels = np.linspace(low - 0.004, top, 2 if height < 0.45 else 3)
        sides = [(float(edges[0]), float(edges[len(edges) // 2])), (float(edges[len(edges) // 2]), float(edges[-1]))]
        areas = [Front(a, b, float(z0), float(z1)) for a, b in sides for z0, z1 in itertools.pairwise(levels)]
        drawers = fronts(front, areas)
        legs = _runners(back + 0.03, front - 0.03, half - 0.16 * width, leg)
    else:
        areas = [Front(float(a), float(b), low - 0.004, top) for a, b in itertools.pairwise(edges)]
        drawers = _slatted(front, areas)
        legs = splayed_legs(back, front, half, leg, 0.03, 0.019)
    handles = pulls(front, areas, "cup", reach + 0.002)
    return fitted({"body": merged(*body), "drawers": drawers, "handles": handles, "legs": legs}, size_m)


def _uprights(ys: np.ndarray, x0: float, x1: float, low: float, high: float) -> Mesh:
    """Return upright boards inside a case at the given y, or a strip at the back where there are none."""
    spots = ys if len(ys) else np.zeros(1)
    return blocks([(x0, y - 0.009, low) for y in spots], [(x1, y + 0.009, high) for y in spots], 0.002)


def _runners(x0: float, x1: float, half_w: float, height: float, bar: float = 0.016) -> Mesh:
    """Return two rectangular loops of flat steel that stand across the depth."""
    low, high = [], []
    for y in (-half_w, half_w):
        low += [(x0, y - 0.02, 0.0), (x1 - bar, y - 0.02, 0.0), (x0, y - 0.02, 0.0), (x0, y - 0.02, height - bar)]
        high += [(x0 + bar, y + 0.02, height), (x1, y + 0.02, height), (x1, y + 0.02, bar), (x1, y + 0.02, height + 0.001)]
    return blocks(low, high, 0.002)


def _slatted(x: float, areas: list[Front]) -> Mesh:
    """Return doors of upright slats on a board."""
    low, high = [], []
    for a in areas:
        low.append((x - 0.018, a.left + 0.0015, a.low + 0.0015))
        high.append((x - 0.008, a.right - 0.0015, a.high - 0.0015))
        count = max(4, round((a.right - a.left) / 0.022))
        edges = np.linspace(a.left + 0.002, a.right - 0.002, count + 1)
        low += [(x - 0.009, s + 0.002, a.low + 0.002) for s in edges[:-1]]
        high += [(x, e - 0.004, a.high - 0.002) for e in edges[1:]]
    return blocks(low, high, 0.0015)


def build_sideboard(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a sideboard: drawers between doors; plain on a plinth, framed on feet, or mid-century on splayed legs."""
    depth, width, height = size_m
    reach = min(0.02, 0.045 * depth)
    back, half, body_depth = -0.5 * depth, 0.5 * width, depth - reach
    front = back + body_depth - 0.006
    leg = {"plain": 0.07, "framed": 0.1, "midcentury": min(0.2, 0.26 * height)}[style]
    inner = half - PANEL_M - 0.007
    count = max(2, round(width / rng.uniform(0.42, 0.52)))
    edges = [float(edge) for edge in np.linspace(-inner, inner, count + 1)]
    low, top = leg + 0.01, height - 0.028
    drawer_column = int(rng.integers(count))
    doors, drawers = [], []
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        if k == drawer_column:
            levels = np.linspace(low, top, max(2, round((top - low) / 0.2)) + 1)
            drawers += [Front(a, b, float(z0), float(z1)) for z0, z1 in itertools.pairwise(levels)]
        else:
            doors.append(Front(a, b, low, top))
    knob = {"plain": "bar", "framed": "knob", "midcentury": "cup"}[style]
    legs = {
        "plain": lambda: block((back + 0.03, -half + 0.03, 0.0), (front - 0.05, half - 0.03, leg + 0.002)),
        "framed": lambda: square_legs(back, front, half, leg, 0.055, 0.004),
        "midcentury": lambda: splayed_legs(back, front, half, leg, 0.03, 0.02),
    }[style]()
    return fitted(
        {
            "body": carcass(body_depth, width, leg, height, 0.007, back),
            "drawers": fronts(front, [*doors, *drawers], framed=style == "framed"),
            "handles": merged(pulls(front, drawers, knob, reach + 0.005), pulls(front, doors, knob, reach + 0.005)),
            "legs": legs,
        },
        size_m,
    )


def glazed_fronts(x: float, areas: list[Front], rim: float, bars: int) -> tuple[Mesh, Mesh]:
    """Return door frames with ``bars`` cross bars whose outer face lies at ``x``, and their panes."""
    low, high, pane_low, pane_high = [], [], [], []
    for a in areas:
        left, right, bottom, top = a.left + 0.0015, a.right - 0.0015, a.low + 0.0015, a.high - 0.0015
        low += [(x - 0.018, left, bottom), (x - 0.018, right - rim, bottom)]
        high += [(x, left + rim, top), (x, right, top)]
        for z in np.linspace(bottom, top - rim, bars + 2):
            thin = 0.25 * rim if bottom < z < top - rim else 0.0
            low.append((x - 0.017, left + 0.9 * rim, z + thin))
            high.append((x - 0.001 - 0.5 * thin, right - 0.9 * rim, z + rim - thin))
        pane_low.append((x - 0.011, left + 0.8 * rim, bottom + 0.8 * rim))
        pane_high.append((x - 0.007, right - 0.8 * rim, top - 0.8 * rim))
    return blocks(low, high, 0.003), blocks(pane_low, pane_high, 0.001)


def build_china_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a cabinet with glass doors over cupboards, with china on its shelves.

    It has cross bars and a plinth, or is plain on tall legs, or has arched doors under a cornice.
    """
    depth, width, height = size_m
    reach = min(0.018, 0.045 * depth)
    back, half, body_depth = -0.5 * depth, 0.5 * width, depth - reach
    front = back + body_depth - 0.006
    classic = style != "modern"
    crowned = style == "crowned"
    leg = 0.07 if classic else 0.12
    split = leg + (0.36 if classic else 0.3) * (height - leg)
    inner = half - PANEL_M - 0.007
    count = max(1, round(width / 0.45))
    edges = [float(edge) for edge in np.linspace(-inner, inner, count + 1)]
    crown = 0.09 if crowned else 0.0
    glass = [Front(a, b, split + 0.004, height - 0.03 - crown) for a, b in itertools.pairwise(edges)]
    wood = [Front(a, b, leg + 0.012, split - 0.004) for a, b in itertools.pairwise(edges)]
    frames, panes = glazed_fronts(front, glass, 0.045 if classic else 0.028, 1 if crowned else 2 if classic else 0)
    if crowned:
        frames = merged(frames, *(_spandrel(front, a, 0.045) for a in glass), _cornice(back, front + 0.004, half, height, crown))
    levels = np.linspace(split, height - 0.024, max(2, round((height - split) / 0.33)) + 1)
    shelves = blocks(
        [(back + 0.006, -inner, z - 0.009) for z in levels[:-1]], [(front - 0.025, inner, z + 0.009) for z in levels[:-1]], 0.002
    )
    legs = (
        block((back + 0.02, -half + 0.015, 0.0), (front - 0.02, half - 0.015, leg + 0.002))
        if classic
        else square_legs(back, front, half, leg, 0.04, 0.01)
    )
    china = [
        _china(rng, (y0 + 0.05, y1 - 0.05), float(z0) + 0.009, 0.6 * float(z1 - z0), 0.5 * (back + front) - 0.01, 0.32 * body_depth)
        for z0, z1 in itertools.pairwise(levels)
        for y0, y1 in itertools.pairwise(edges)
    ]
    return fitted(
        {
            "body": merged(carcass(body_depth, width, leg, height - 0.3 * crown, 0.006, back), shelves),
            "doors": merged(frames, fronts(front, wood, framed=classic)),
            "panes": panes,
            "handles": pulls(front, wood, "knob" if classic else "bar", reach + 0.005),
            "china": merged(*china),
            "legs": legs,
        },
        size_m,
    )


def _spandrel(x: float, area: Front, rim: float) -> Mesh:
    """Return the filling between a door's straight frame and an arch within it."""
    left, right, top = area.left + 0.9 * rim, area.right - 0.9 * rim, area.high - rim
    y = np.linspace(left, right, 21)
    rise = min(0.6 * (right - left), 0.16)
    arch = top + 0.004 - rise * (1.0 - np.sqrt(np.clip(1.0 - (2.0 * (y - left) / (right - left) - 1.0) ** 2, 0.0, 1.0))) - 0.006
    front = np.stack(
        [np.column_stack([np.full(21, x - 0.002), y, arch]), np.column_stack([np.full(21, x - 0.002), y, np.full(21, top + 0.01)])], 1
    )
    return sheet(front, front - np.array([0.014, 0.0, 0.0]))


def _cornice(back: float, front: float, half: float, top: float, tall: float) -> Mesh:
    """Return stepped mouldings that carry the top of a cabinet: frieze, hollow and cap."""
    steps = ((-0.4, 0.45, 0.012), (0.45, 0.72, 0.006), (0.72, 1.0, 0.0))
    return blocks(
        [(back, -half + inset, top - tall + a * tall) for a, _, inset in steps],
        [(front - inset, half - inset, top - tall + b * tall) for _, b, inset in steps],
        0.003,
    )


def _china(rng: np.random.Generator, span: tuple[float, float], z: float, room: float, x: float, reach: float) -> Mesh:
    """Return a row of plates' piles, bowls and jugs on a shelf, ``span`` in y."""
    pieces: list[Mesh] = []
    y = span[0]
    while y < span[1] - 0.02 or not pieces:
        r = min(reach, rng.uniform(0.045, 0.085))
        kind = int(rng.integers(3))
        if kind == 0:
            count = int(rng.integers(2, 6))
            plate = [(0.0, 0.0), (0.6 * r, 0.0), (r, 0.012), (r, 0.016), (0.6 * r, 0.006), (0.0, 0.006)]
            pieces += [moved(lathe(plate, 18), x, y + r, z + 0.008 * k) for k in range(count)]
        elif kind == 1:
            h = min(room, 0.9 * r)
            bowl = [(0.0, 0.0), (0.5 * r, 0.0), (0.8 * r, 0.4 * h), (r, h), (0.96 * r, h), (0.7 * r, 0.4 * h), (0.0, 0.15 * h)]
            pieces.append(moved(lathe(bowl, 18), x, y + r, z))
        else:
            h = min(room, 2.2 * r)
            jug = [(0.0, 0.0), (0.5 * r, 0.0), (0.7 * r, 0.3 * h), (0.6 * r, 0.6 * h), (0.35 * r, 0.85 * h), (0.45 * r, h), (0.0, 0.95 * h)]
            pieces.append(moved(lathe(jug, 18), x, y + 0.7 * r, z))
        y += 2.0 * r + rng.uniform(0.01, 0.05)
        if y + 0.09 > span[1]:
            break
    return merged(*pieces)


def build_wall_shelf(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a shelf on a wall: a board on brackets, or a box open to the front; its top is flat."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    if style == "box":
        board = min(0.018, 0.2 * height)
        low = [(-half_d, -half_w, 0.0), (-half_d, -half_w, height - board), (-half_d, -half_w, 0.0), (-half_d, half_w - board, 0.0)]
        high = [
            (half_d - 0.002, half_w, board),
            (half_d, half_w, height),
            (half_d - 0.002, -half_w + board, height - 0.002),
            (half_d - 0.002, half_w, height - 0.002),
        ]
        back = block((-half_d, -half_w + 0.003, 0.003), (-half_d + 0.005, half_w - 0.003, height - 0.003), 0.001)
        return fitted({"board": blocks(low, high, 0.0015), "brackets": back}, size_m)
    board = min(0.026, 0.35 * height)
    under = height - board
    top = block((-half_d, -half_w, under), (half_d, half_w, height), 0.002)
    pieces = []
    slope = np.arctan2(under - 0.016, 0.8 * depth)
    for y in (-0.36 * width, 0.36 * width):
        pieces.append(
            blocks(
                [(-half_d, y - 0.012, 0.0), (-half_d, y - 0.012, under - 0.007)],
                [(-half_d + 0.007, y + 0.012, under), (half_d - 0.02, y + 0.012, under + 0.001)],
                0.001,
            )
        )
        length = float(np.hypot(under - 0.016, 0.8 * depth))
        strut = rotated(block((0.0, y - 0.006, -0.004), (length, y + 0.006, 0.004), 0.001), "y", -float(slope))
        pieces.append(moved(strut, -half_d + 0.004, 0.0, 0.008))
    return fitted({"board": top, "brackets": merged(*pieces)}, size_m)


MODELS = {
    "tv_stand": Model(build_tv_stand, ("open", "slatted", "runners")),
    "sideboard": Model(build_sideboard, ("plain", "framed", "midcentury")),
    "china_cabinet": Model(build_china_cabinet, ("classic", "modern", "crowned")),
    "wall_shelf": Model(build_wall_shelf, ("bracket", "box")),
}
