"""Case furniture with drawers and doors: nightstands, dressers, china cabinets, wardrobes; fronts look along +x."""

import itertools
from typing import NamedTuple

import numpy as np

from renderer.geometry.lofts import points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated, sheet
from renderer.models.model import Model, Parts, Pieces, Size

GAP_M = 0.003

PANEL_M = 0.018


class Front(NamedTuple):
    """A rectangle of the front plane: y from ``left`` to ``right``, z from ``low`` to ``high``."""

    left: float
    right: float
    low: float
    high: float


def case_places(size_m: Size, reach: float, lip: float) -> tuple[float, float, float, float, float]:
    """Return where a case lies in its box: x of its back and of its fronts' outer faces, half its width, its depth, and the handles' reach.

    Handles stand ``reach`` before the case, less in shallow boxes; fronts lie ``lip`` behind the case's front edge.
    """
    depth, width, _ = size_m
    reach = min(reach, 0.045 * depth)
    back, body_depth = -0.5 * depth, depth - reach
    return back, back + body_depth - lip, 0.5 * width, body_depth, reach


def carcass(depth: float, width: float, low: float, high: float, top_overhang: float = 0.0, back_x: float | None = None) -> Mesh:
    """Return sides, bottom, back and top of a case whose back lies at ``back_x`` and which is ``depth`` deep."""
    x0 = -0.5 * depth if back_x is None else back_x
    x1 = x0 + depth - top_overhang
    half = 0.5 * width
    side = half - top_overhang
    return blocks(
        points(x0, [-side, side - PANEL_M, -side + 0.004, -side + 0.004, -half], [low, low, low, low + 0.004, high - 0.022]),
        points(
            [x1, x1, x1, x0 + 0.008, x0 + depth],
            [-side + PANEL_M, side, side - 0.004, side - 0.004, half],
            [high - 0.02, high - 0.02, low + PANEL_M, high - 0.02, high],
        ),
        0.002,
    )


def fronts(x: float, areas: list[Front], thickness: float = 0.018, framed: bool = False) -> Mesh:
    """Return drawer or door fronts whose outer face lies at ``x``; ``framed`` gives them a raised frame round a sunken field."""
    shut = [Front(a.left + GAP_M / 2, a.right - GAP_M / 2, a.low + GAP_M / 2, a.high - GAP_M / 2) for a in areas]
    if not framed:
        return blocks([(x - thickness, a.left, a.low) for a in shut], [(x, a.right, a.high) for a in shut], 0.0025)
    low: list[tuple[float, float, float]] = []
    high: list[tuple[float, float, float]] = []
    for a in shut:
        rim = min(0.065, 0.2 * min(a.right - a.left, a.high - a.low))
        low += [
            (x - thickness, a.left + rim * 0.9, a.low + rim * 0.9),
            (x - thickness, a.left, a.low),
            (x - thickness, a.right - rim, a.low),
        ]
        high += [(x - 0.008, a.right - rim * 0.9, a.high - rim * 0.9), (x, a.left + rim, a.high), (x, a.right, a.high)]
        low += [(x - thickness, a.left + rim, a.low), (x - thickness, a.left + rim, a.high - rim)]
        high += [(x, a.right - rim, a.low + rim), (x, a.right - rim, a.high)]
    return blocks(low, high, 0.003)


def bar_handle(x: float, y: float, z: float, length: float, reach: float, upright: bool = False) -> Mesh:
    """Return a round bar on two studs that stands ``reach`` off the front plane at ``x``."""
    radius = min(0.005, 0.3 * reach)
    offset = 0.5 * length - 0.012
    out = x + reach - radius

    def at(s: float, px: float) -> tuple[float, float, float]:
        return (px, y, z + s) if upright else (px, y + s, z)

    bar = rod(at(-0.5 * length, out), at(0.5 * length, out), radius, segments=8)
    return merged(bar, *(rod(at(s, x - 0.002), at(s, out), 0.8 * radius, segments=8) for s in (-offset, offset)))


def knob(x: float, y: float, z: float, reach: float) -> Mesh:
    """Return a turned knob that stands ``reach`` off the front plane at ``x``."""
    r = min(0.015, 0.75 * reach)
    profile = points(
        [0.0, 0.5 * r, 0.4 * r, 0.95 * r, r, 0.8 * r, 0.0], [0.0, 0.0, 0.45 * reach, 0.62 * reach, 0.78 * reach, 0.95 * reach, reach]
    )
    return moved(rotated(lathe(profile, 14), "y", np.pi / 2), x, y, z)


def pulls(x: float, areas: list[Front], kind: str, reach: float) -> Mesh:
    """Return a handle of the kind "bar", "knob" or "cup" in the middle of each front."""
    rows: list[Mesh] = []
    for a in areas:
        y, z, width = 0.5 * (a.left + a.right), 0.5 * (a.low + a.high), a.right - a.left
        if kind == "bar":
            rows.append(bar_handle(x, y, z, min(0.16, 0.45 * width), reach))
        elif kind == "knob":
            spots = (y,) if width < 0.55 else (y - 0.25 * width, y + 0.25 * width)
            rows += [knob(x, spot, z, reach) for spot in spots]
        else:
            half = min(0.07, 0.25 * width)
            rows.append(block((x - 0.001, y - half, a.high - 0.018), (x + reach, y + half, a.high - 0.006), 0.002))
    return merged(*rows)


def splayed_legs(x0: float, x1: float, half_w: float, height: float, splay: float = 0.03, radius: float = 0.017) -> Mesh:
    """Return four tapered round legs that lean outward, standing inside the footprint."""
    rods = []
    for x, sx in ((x0 + 0.05, -1.0), (x1 - 0.05, 1.0)):
        for sy in (-1.0, 1.0):
            y = sy * (half_w - 0.05)
            rods.append(rod((x + sx * splay, y + sy * splay, 0.0), (x, y, height + 0.004), 0.62 * radius, radius))
    return merged(*rods)


def square_legs(x0: float, x1: float, half_w: float, height: float, side: float = 0.035, inset: float = 0.012) -> Mesh:
    """Return four square legs near the corners of the footprint."""
    corners = [(x, y) for x in (x0 + inset, x1 - inset - side) for y in (-half_w + inset, half_w - inset - side)]
    return blocks([(x, y, 0.0) for x, y in corners], [(x + side, y + side, height + 0.002) for x, y in corners], 0.004)


def _rows(left: float, right: float, low: float, high: float, count: int, grow: float = 0.0) -> list[Front]:
    """Split a rectangle into ``count`` drawers, the lower ones taller by ``grow`` each."""
    weight = 1.0 + grow * np.arange(count)[::-1]
    edges = low + (high - low) * np.concatenate([[0.0], np.cumsum(weight) / weight.sum()])
    return [Front(left, right, float(a), float(b)) for a, b in itertools.pairwise(edges)]


def build_nightstand(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a bedside cabinet: two or three drawers, one drawer over an open shelf, or a mid-century box on splayed legs."""
    _, width, height = size_m
    back, front, half, body_depth, reach = case_places(size_m, 0.018, 0.004)
    leg = {"drawers": 0.05, "shelf": 0.12, "midcentury": 0.28}[style] * height
    inner = half - PANEL_M - 0.006
    body = [carcass(body_depth, width, leg, height, 0.006, back)]
    top = height - 0.024
    if style == "drawers":
        areas = _rows(-inner, inner, leg + 0.006, top, 2 if height < 0.52 else 3)
        legs = block((back + 0.02, -half + 0.02, 0.0), (front - 0.03, half - 0.02, leg + 0.002))
    elif style == "shelf":
        split = leg + 0.55 * (top - leg)
        areas = [Front(-inner, inner, split, top)]
        body.append(block((back + 0.004, -inner - 0.002, split - 0.02), (front - 0.008, inner + 0.002, split - 0.003), 0.002))
        legs = square_legs(back, front, half, leg, 0.034)
    else:
        areas = _rows(-inner, inner, leg + 0.02, top, 1 if height < 0.5 else 2)
        legs = splayed_legs(back, front, half, leg)
    handles = pulls(front, areas, str(rng.choice(("bar", "knob"))) if style != "midcentury" else "cup", reach + 0.004)
    return {"body": body, "drawers": fronts(front, areas, framed=style == "shelf"), "handles": handles, "legs": legs}


def build_dresser(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a chest of drawers: classic with framed fronts and knobs, modern with bars, mid-century on splayed legs."""
    _, width, height = size_m
    back, front, half, body_depth, reach = case_places(size_m, 0.02, 0.006)
    leg = {"classic": 0.09, "modern": 0.07, "midcentury": min(0.2, 0.25 * height)}[style]
    columns = max(1, round(width / rng.uniform(0.55, 0.75)))
    count = max(2, round((height - leg) / rng.uniform(0.2, 0.26)))
    inner = half - PANEL_M - 0.008
    edges = np.linspace(-inner, inner, columns + 1)
    areas = [area for a, b in itertools.pairwise(edges) for area in _rows(float(a), float(b), leg + 0.012, height - 0.028, count, 0.12)]
    legs = {
        "classic": lambda: merged(
            square_legs(back, front, half, leg, 0.05, 0.006),
            block((back + 0.02, -half + 0.03, 0.04), (front - 0.01, half - 0.03, leg + 0.001)),
        ),
        "modern": lambda: block((back + 0.03, -half + 0.03, 0.0), (front - 0.05, half - 0.03, leg + 0.002)),
        "midcentury": lambda: splayed_legs(back, front, half, leg, 0.035, 0.022),
    }[style]()
    kind = {"classic": "knob", "modern": "bar", "midcentury": "cup"}[style]
    return {
        "body": carcass(body_depth, width, leg, height, 0.008, back),
        "drawers": fronts(front, areas, framed=style == "classic"),
        "handles": pulls(front, areas, kind, reach + 0.006),
        "legs": legs,
    }


def build_wardrobe(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a wardrobe with hinged flat doors, panelled doors with cornice, or sliding doors with mirrors."""
    depth, width, height = size_m
    reach = 0.028 if style != "mirrored" else 0.004
    back, half = -0.5 * depth, 0.5 * width
    body_depth = depth - reach
    plinth = rng.uniform(0.06, 0.09)
    front = back + body_depth - (0.012 if style == "panelled" else 0.002)
    x_body = front - back - 0.019
    low, high = plinth + 0.004, height - (0.07 if style == "panelled" else 0.02)
    body = [carcass(x_body, width - (0.03 if style == "panelled" else 0.0), plinth, height - 0.004, 0.0, back)]
    if style == "panelled":
        body.append(block((back, -half + 0.008, height - 0.065), (front - 0.004, half - 0.008, height - 0.03), 0.01))
        body.append(block((back, -half, height - 0.032), (front + 0.01, half, height), 0.008))
    else:
        body.append(block((back, -half, height - 0.019), (front, half, height), 0.002))
    inner = half - (0.016 if style == "panelled" else 0.001)
    count = 2 if style == "mirrored" and width < 2.2 else max(1, round(width / 0.5))
    edges = np.linspace(-inner, inner, count + 1)
    doors = [Front(float(a), float(b), low, high) for a, b in itertools.pairwise(edges)]
    parts = {"body": merged(*body), "plinth": block((back + 0.01, -half + 0.02, 0.0), (front - 0.06, half - 0.02, plinth + 0.002))}
    if style == "mirrored":
        return parts | _sliding_doors(front, doors)
    if style == "panelled":
        split = low + 0.36 * (high - low)
        areas = [Front(d.left, d.right, a, b) for d in doors for a, b in ((low, split), (split - GAP_M, high))]
        parts["doors"] = fronts(front, areas, 0.02, framed=True)
    else:
        parts["doors"] = fronts(front, doors)
    handles = []
    for i, door in enumerate(doors):
        y = door.right - 0.045 if i % 2 == 0 and i + 1 < count else door.left + 0.045
        z = min(1.05, 0.5 * (low + high))
        handles.append(knob(front, y, z, reach) if style == "panelled" else bar_handle(front, y, z, 0.32, reach, upright=True))
    parts["handles"] = merged(*handles)
    return parts


def _sliding_doors(front: float, doors: list[Front]) -> Parts:
    """Doors behind each other in turns, mirror glass within slim frames that serve as handles."""
    rims: list[Mesh] = []
    panes_low, panes_high = [], []
    rim = 0.028
    for i, d in enumerate(doors):
        x = front - 0.019 * (i % 2) - 0.002
        left, right = d.left - 0.012 * (i % 2), d.right + 0.012 * (i % 2)
        rims.append(
            blocks(
                points(x - 0.017, [left, right - rim, left + rim, left + rim], [d.low, d.low, d.low, d.high - rim]),
                [(x, left + rim, d.high), (x, right, d.high), (x, right - rim, d.low + rim), (x, right - rim, d.high)],
                0.003,
            )
        )
        panes_low.append((x - 0.012, left + 0.9 * rim, d.low + 0.9 * rim))
        panes_high.append((x - 0.006, right - 0.9 * rim, d.high - 0.9 * rim))
    grips = [block((front - 0.004, doors[0].right - 0.02, 0.9), (front + 0.004, doors[0].right - 0.008, 1.15))]
    return {"doors": merged(*rims), "mirror": blocks(panes_low, panes_high, 0.001), "handles": merged(*grips)}


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


def build_china_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a cabinet with glass doors over cupboards, with china on its shelves.

    It has cross bars and a plinth, or is plain on tall legs, or has arched doors under a cornice.
    """
    _, width, height = size_m
    back, front, half, body_depth, reach = case_places(size_m, 0.018, 0.006)
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
    shelves = blocks(points(back + 0.006, -inner, levels[:-1] - 0.009), points(front - 0.025, inner, levels[:-1] + 0.009), 0.002)
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
    return {
        "body": [carcass(body_depth, width, leg, height - 0.3 * crown, 0.006, back), shelves],
        "doors": [frames, fronts(front, wood, framed=classic)],
        "panes": panes,
        "handles": pulls(front, wood, "knob" if classic else "bar", reach + 0.005),
        "china": china,
        "legs": legs,
    }


def _spandrel(x: float, area: Front, rim: float) -> Mesh:
    """Return the filling between a door's straight frame and an arch within it."""
    left, right, top = area.left + 0.9 * rim, area.right - 0.9 * rim, area.high - rim
    y = np.linspace(left, right, 21)
    rise = min(0.6 * (right - left), 0.16)
    arch = top + 0.004 - rise * (1.0 - np.sqrt(np.clip(1.0 - (2.0 * (y - left) / (right - left) - 1.0) ** 2, 0.0, 1.0))) - 0.006
    front = np.stack([points(x - 0.002, y, arch), points(x - 0.002, y, top + 0.01)], 1)
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


MODELS = {
    "nightstand": Model(build_nightstand, ("drawers", "shelf", "midcentury")),
    "dresser": Model(build_dresser, ("modern", "classic", "midcentury")),
    "china_cabinet": Model(build_china_cabinet, ("classic", "modern", "crowned")),
    "wardrobe": Model(build_wardrobe, ("hinged", "panelled", "mirrored")),
}
