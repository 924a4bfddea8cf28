"""Garage and workshop: workbench, tool cabinet, toolbox, paint can, step ladder; fronts look along +x."""

import itertools

import numpy as np

from renderer.geometry.lofts import bent, disc, loft, points
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rotated
from renderer.models.cabinets import Front, fronts
from renderer.models.model import Model, Pieces, Size, fitted, halved
from renderer.models.storage import build_cardboard_box, build_plastic_crate


def build_workbench(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a bench with thick top and vise on its front: wooden legs over a shelf, a steel frame with drawers, or two drawer blocks."""
    depth, _, height, half_d, half_w = halved(size_m)
    jut = min(0.07, 0.1 * depth)
    front = half_d - jut
    thick = 0.05
    under = height - thick
    side = 0.08 if style == "wooden" else 0.05
    legs = blocks(
        [(x, y, 0.0) for x in (-half_d + 0.01, front - 0.03 - side) for y in (-half_w + 0.01, half_w - 0.01 - side)],
        [
            (x + side, y + side, under + 0.002)
            for x in (-half_d + 0.01, front - 0.03 - side)
            for y in (-half_w + 0.01, half_w - 0.01 - side)
        ],
        0.004,
    )
    rails = [
        block((x, -half_w + 0.02, under - 0.1), (x + 0.03, half_w - 0.02, under + 0.001), 0.003) for x in (-half_d + 0.02, front - 0.07)
    ]
    shelf = 0.2 * height
    rails += [block((x, -half_w + 0.02, shelf - 0.06), (x + 0.03, half_w - 0.02, shelf), 0.003) for x in (-half_d + 0.03, front - 0.08)]
    edges = np.linspace(-half_d + 0.02, front - 0.04, 4)
    board = blocks(points(edges[:-1], -half_w + 0.012, shelf), points(edges[1:] - 0.006, half_w - 0.012, shelf + 0.022), 0.003)
    seams = np.linspace(-half_d, half_d, 5)
    top = blocks([(a, -half_w, under) for a in seams[:-1]], [(b - 0.001, half_w, height) for b in seams[1:]], 0.003)
    stored = _stored(rng, half_d, half_w - side, shelf + 0.022, 0.5 * height)
    end = -1.0 if rng.random() < 0.5 else 1.0
    drawers_side = -end
    hung = (half_w - 0.02 - side, under - 0.1 if style == "wooden" else under, style, height)
    pedestal = _bench_drawers(front - 0.05, drawers_side, *hung)
    if style == "pedestals":
        other = _bench_drawers(front - 0.05, end, *hung)
        pedestal = merged(pedestal[0], other[0]), merged(pedestal[1], other[1])
    parts = {"top": top, "frame": merged(legs, *rails), "shelf": board, "drawers": pedestal[0], "handles": pedestal[1]}
    return parts | stored | {"vise": _vise(half_d, end * (half_w - 0.22), under, min(0.16, 0.2 * height))}


def _bench_drawers(front: float, side: float, reach: float, top: float, style: str, height: float) -> tuple[Mesh, Mesh]:
    """A block of drawers under one end of the top, and its handles."""
    wide = min(0.45, (0.52 if style == "pedestals" else 0.7) * reach)
    y0, y1 = sorted((side * reach, side * (reach - wide)))
    count = {"wooden": 1, "steel": 3, "pedestals": 5}[style]
    low = top - {"wooden": 0.14, "steel": 0.42 * height, "pedestals": 0.66 * height}[style]
    case = block((front - 0.38, y0, low), (front - 0.016, y1, top + 0.002), 0.003)
    levels = np.linspace(low + 0.003, top - 0.003, count + 1)
    areas = [Front(y0 + 0.003, y1 - 0.003, float(a), float(b)) for a, b in itertools.pairwise(levels)]
    handles = [
        block((front - 0.002, 0.5 * (y0 + y1) - 0.07, a.high - 0.04), (front + 0.02, 0.5 * (y0 + y1) + 0.07, a.high - 0.028), 0.003)
        for a in areas
    ]
    return merged(case, fronts(front, areas, 0.016)), merged(*handles)


def _vise(x: float, y: float, z: float, tall: float) -> Mesh:
    """A front vise below the top: fixed and moving jaw, screw and tommy bar."""
    fixed = block((x - 0.16, y - 0.09, z - tall), (x - 0.07, y + 0.09, z + 0.002), 0.006)
    jaw = block((x - 0.045, y - 0.09, z - 0.8 * tall), (x - 0.012, y + 0.09, z - 0.004), 0.006)
    screw = rod((x - 0.12, y, z - 0.5 * tall), (x, y, z - 0.5 * tall), 0.016)
    guides = [rod((x - 0.12, y + s * 0.06, z - 0.55 * tall), (x - 0.02, y + s * 0.06, z - 0.55 * tall), 0.009) for s in (-1.0, 1.0)]
    bar = rod((x - 0.006, y - 0.07, z - 0.62 * tall), (x - 0.006, y + 0.07, z - 0.38 * tall), 0.006)
    return merged(fixed, jaw, screw, *guides, bar)


def _stored(rng: np.random.Generator, half_d: float, reach: float, z: float, room: float) -> dict[str, list[Mesh]]:
    """Cartons with tape and label, lidded tubs and tins on the lower shelf, in any order, at least one of each."""
    parts: dict[str, list[Mesh]] = {"boxes": [], "labels": [], "prints": [], "tubs": [], "tins": []}
    left = list(rng.permutation(3))
    y = -reach + 0.03
    while left or y < reach - 0.2:
        kind = int(left.pop()) if left else int(rng.choice(3, p=(0.5, 0.3, 0.2)))
        wide = min(float(rng.uniform(*((0.12, 0.2), (0.22, 0.38), (0.2, 0.34))[kind])), (reach - y) / (len(left) + 1) - 0.01)
        tall, deep = min(float(rng.uniform(0.12, 0.3)), 0.8 * room), float(rng.uniform(1.0, 1.5)) * half_d
        place = (float(rng.uniform(-0.3, 0.1)) * half_d, y + 0.5 * wide, z)
        if kind == 0:
            r = 0.45 * wide
            rim = [(r, 0.0), (r, tall - 0.004), (1.03 * r, tall - 0.004), (1.03 * r, tall), (0.95 * r, tall), (0.94 * r, tall - 0.008)]
            parts["tins"].append(moved(lathe([(0.0, 0.0), *rim, (0.0, tall - 0.008)], 20), *place))
        else:
            build, style = ((build_cardboard_box, "closed"), (build_plastic_crate, "lidded"))[kind - 1]
            turn, size = float(rng.normal(0.0, 0.03)), (deep, wide, tall)
            for name, mesh in fitted(build(rng, size, style), size).items():
                parts[_STORED_AS[name] if kind == 1 else "tubs"].append(moved(rotated(mesh, "z", turn), *place))
        y += wide + float(rng.uniform(0.01, 0.12))
    return parts


_STORED_AS = {"body": "boxes", "tape": "labels", "label": "labels", "print": "prints"}
"""Part of a carton -> part of the bench that it belongs to."""


def build_tool_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a rolling cabinet of flat drawers with full-width grips, or one with drawers over a door, on castors."""
    _, _, height, half_d, half_w = halved(size_m)
    low = min(0.13, 0.16 * height)
    front = half_d - 0.018
    body = [block((-half_d + 0.004, -half_w + 0.02, low), (front - 0.016, half_w, height - 0.02), 0.004)]
    mat = block((-half_d, -half_w, height - 0.024), (half_d, half_w, height), 0.006)
    grip = bent(
        points(
            [-0.6 * half_d, -0.6 * half_d, 0.6 * half_d, 0.6 * half_d],
            [-half_w + 0.02, -half_w + 0.002, -half_w + 0.002, -half_w + 0.02],
            0.86 * height,
        ),
        0.0018 + 0.006,
        0.015,
        8,
    )
    count = max(3, round((height - low) / 0.13))
    weight = 1.0 + 0.22 * np.arange(count)[::-1]
    edges = low + 0.008 + (height - low - 0.036) * np.concatenate([[0.0], np.cumsum(weight) / weight.sum()])
    areas = [Front(-half_w + 0.026, half_w - 0.006, float(a), float(b)) for a, b in itertools.pairwise(edges)]
    if style == "door":
        areas = [Front(-half_w + 0.026, half_w - 0.006, areas[0].low, areas[count // 2].high), *areas[count // 2 + 1 :]]
    grips = [block((front - 0.001, a.left + 0.01, a.high - 0.026), (front + 0.014, a.right - 0.01, a.high - 0.008), 0.003) for a in areas]
    wheels = []
    for x in (-half_d + 0.07, half_d - 0.09):
        for y in (-half_w + 0.08, half_w - 0.06):
            r = 0.42 * low
            wheels += [disc("y", (x, y, r), r, 0.03, 20, 0.005), block((x - 0.02, y - 0.024, r), (x + 0.02, y + 0.024, low + 0.002), 0.003)]
            wheels.append(block((x - 0.035, y - 0.03, low - 0.012), (x + 0.035, y + 0.03, low + 0.003), 0.002))
    lock = disc("x", (front, 0.0, height - 0.03), 0.009, 0.02, 12)
    return {"body": body, "drawers": fronts(front, areas, 0.016), "handles": [*grips, grip, lock], "top": mat, "castors": wheels}


def build_step_ladder(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return an opened step ladder of aluminium or wood, or one with a broad platform and a tray; one climbs it from +x."""
    depth, _, height, half_d, half_w = halved(size_m)
    count = max(2, round((0.72 if style == "platform" else 1.0) * height / 0.3))
    apex = -half_d + 0.3 * depth
    metal, broad = style != "wooden", style == "platform"
    platform = height * {"aluminium": 0.76, "wooden": 0.985, "platform": 0.66}[style]
    taper = 0.82
    thick = 0.022 if metal else 0.028
    rails, treads, pads = [], [], []

    def side(share: float) -> float:
        return (half_w - 0.5 * thick) * (1.0 - (1.0 - taper) * share)

    top_share = 0.97 if metal else platform / height
    for s in (-1.0, 1.0):
        high = (apex + 0.02, s * side(top_share), top_share * height if metal else platform - 0.01)
        knee = (apex + 0.1, s * side(platform / height), platform)
        foot = (half_d - 0.02, s * side(0.0), 0.012)
        rails.append(_plank(foot, knee if metal else high, 0.055, thick))
        if metal:
            rails.append(
                bent([knee, (apex + 0.06, s * side(0.97) * 0.9, height - 0.014), (apex + 0.06, 0.0, height - 0.012)], 0.012, 0.08, 8)
            )
        start, end = (-half_d + 0.02, s * 0.95 * side(0.0), 0.012), (apex, s * 0.95 * side(platform / height), platform - 0.03)
        rails.append(_plank(start, end, 0.04, 0.8 * thick))
        for x, y in ((half_d - 0.02, side(0.0)), (-half_d + 0.02, 0.95 * side(0.0))):
            behind, ahead = (0.02, 0.035) if x < 0 else (0.035, 0.02)
            pads.append(block((x - behind, s * y - 0.016, 0.0), (x + ahead, s * y + 0.016, 0.035), 0.004))
    for k in range(count):
        share = (k + 1.0) / (count + 0.0)
        z = share * platform
        x = half_d - 0.02 + share * (apex + 0.1 - half_d + 0.02)
        half = side(z / height)
        deep = (0.05 if k < count - 1 else 0.13) + (0.03 if broad else 0.0)
        back = 0.09 if k == count - 1 else 0.0
        treads.append(block((x - deep - back, -half, z - 0.022), (x + 0.04, half, z + (0.0 if k < count - 1 else 0.012)), 0.004))
    z = 0.4 * platform
    x = -half_d + 0.02 + 0.4 * (apex + half_d - 0.02)
    treads += [rod((x, -0.95 * side(0.4), z), (x, 0.95 * side(0.4), z), 0.012, segments=8)]
    if broad:
        edge = apex + 0.06
        treads.append(block((edge - 0.05, -0.62 * half_w, height - 0.07), (edge + 0.09, 0.62 * half_w, height - 0.045), 0.004))
        treads += [
            block((edge + a, -0.62 * half_w, height - 0.07), (edge + a + 0.008, 0.62 * half_w, height - 0.025), 0.002)
            for a in (-0.05, 0.082)
        ]
    stays = [
        rod((x, s * 0.9 * side(0.4), z), (half_d - 0.02 + 0.42 * (apex - half_d), s * side(0.4), z + 0.02), 0.005, segments=6)
        for s in (-1.0, 1.0)
    ]
    return {"rails": [*rails, *stays], "treads": treads, "feet": pads}


def _plank(a: tuple[float, float, float], b: tuple[float, float, float], wide: float, thick: float) -> Mesh:
    """A straight bar of rectangular section from a to b, its broad side along x."""
    start, end = np.asarray(a), np.asarray(b)
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]) * (wide, thick)
    section = points(corners, 0.0)
    return loft([start + section, end + section])


MODELS = {
    "workbench": Model(build_workbench, ("wooden", "steel", "pedestals")),
    "tool_cabinet": Model(build_tool_cabinet, ("drawers", "door")),
    "step_ladder": Model(build_step_ladder, ("aluminium", "wooden", "platform")),
}
