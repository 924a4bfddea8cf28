"""What hangs and stands in bathrooms: cabinet, towel rail, laundry basket, dispensers; wall things have the wall behind them (-x)."""

import itertools
import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.geometry.cloth import heap, wrinkles
from renderer.geometry.lofts import bent, disc, loft, lying, oval
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, rod, sheet
from renderer.models.cabinets import Front, carcass, fronts, knob
from renderer.models.model import Model, Pieces, Size, halved


def build_bathroom_cabinet(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a wall cabinet with mirrored doors, or one with framed doors over an open shelf with towels."""
    depth, width, height, half_d, half_w = halved(size_m)
    reach = 0.02 if style == "towels" else 0.006
    front = half_d - reach
    count = max(1, round(width / 0.34))
    edges = np.linspace(-half_w + 0.002, half_w - 0.002, count + 1)
    shelf = 0.36 * height if style == "towels" else 0.0
    areas = [Front(float(a), float(b), shelf + 0.004, height - 0.002) for a, b in itertools.pairwise(edges)]
    body = [carcass(front + half_d - 0.019, width, 0.0, height, 0.0, -half_d)]
    pulls = [knob(front, a.right - 0.035 if k % 2 == 0 and count > 1 else a.left + 0.035, a.low + 0.06, reach) for k, a in enumerate(areas)]
    parts = {"body": merged(*body)}
    if style == "mirrored":
        panes = [(a.left + 0.004, a.right - 0.004) for a in areas]
        parts["doors"] = fronts(front - 0.002, areas, 0.016)
        parts["mirror"] = blocks(
            [(front - 0.003, a, 0.008) for a, _ in panes], [(front + 0.002, b, height - 0.008) for _, b in panes], 0.001
        )
        parts["handles"] = merged(*pulls)
        return parts
    board = block((-half_d + 0.004, -half_w + 0.01, shelf - 0.018), (front - 0.02, half_w - 0.01, shelf), 0.002)
    rolls = []
    r = min(0.24 * shelf, 0.3 * depth, 0.05)
    columns = max(2, int((width - 0.06) / (2.2 * r)))
    for k, y in enumerate(np.linspace(-half_w + 0.03 + r, half_w - 0.03 - r, columns)):
        if rng.random() < 0.75 or k == 0:
            rolls.append(_rolled_towel(r, 0.7 * depth, (-half_d + 0.4 * depth + 0.01, float(y), 0.018 + r)))
    parts["body"] = merged(*body, board)
    return parts | {"doors": fronts(front, areas, 0.018, True), "handles": pulls, "towels": rolls}


def _rolled_towel(radius: float, length: float, at: tuple[float, float, float]) -> Mesh:
    h = 0.5 * length
    profile = [(0.0, -h), (0.8 * radius, -h), (radius, -h + 0.01), (radius, h - 0.01), (0.86 * radius, h), (0.8 * radius, h - 0.006)]
    profile += [(0.55 * radius, h), (0.48 * radius, h - 0.006), (0.25 * radius, h), (0.0, h - 0.004)]
    return lying(lathe(profile, 16), "x", at)


def build_towel_rail(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a towel on a bar, or on the rungs of a ladder-shaped heated rail."""
    depth, width, height, half_d, half_w = halved(size_m)
    tube = min(0.011, 0.14 * depth)
    if style == "bar":
        z, x = height - max(1.6 * tube, 0.016), half_d - 0.035
        path = [(-half_d, -half_w + tube, z), (x, -half_w + tube, z), (x, half_w - tube, z), (-half_d, half_w - tube, z)]
        rail = [
            bent(path, tube, 0.03),
            *(disc("x", (-half_d + 0.005, s * (half_w - 1.6 * tube), z), 1.6 * tube, 0.01, 16) for s in (-1.0, 1.0)),
        ]
        wide, y = rng.uniform(0.6, 0.85) * (width - 0.08), 0.0
        cloth = [_hung_towel(rng, x, y, z, tube, wide, z - 0.001, rng.uniform(0.6, 0.9) * z)]
        return {"rail": rail, "towel": cloth}
    x = half_d - 0.03
    rail = [rod((x, s * (half_w - 0.016), 0.0), (x, s * (half_w - 0.016), height), 0.016) for s in (-1.0, 1.0)]
    pitch = 0.055
    rungs = [k * pitch + 0.05 for k in range(int((height - 0.06) / pitch)) if k % 6 != 5]
    rail += [rod((x, -half_w + 0.016, z), (x, half_w - 0.016, z), tube, segments=8) for z in rungs]
    rail += [
        rod((-half_d, s * (half_w - 0.016), z), (x, s * (half_w - 0.016), z), 0.01, segments=8)
        for s in (-1.0, 1.0)
        for z in (0.12 * height, 0.88 * height)
    ]
    top = rungs[-1] if rng.random() < 0.5 else rungs[2 * len(rungs) // 3]
    fall = rng.uniform(0.45, 0.65) * height
    wide = rng.uniform(0.6, 0.9) * (width - 0.08)
    return {"rail": rail, "towel": _hung_towel(rng, x, 0.0, top, tube, wide, min(fall, top), 0.7 * min(fall, top))}


def _hung_towel(
    rng: np.random.Generator, x: float, y: float, z: float, tube: float, width: float, front_fall: float, back_fall: float
) -> Mesh:
    """A folded towel over a bar at (x, z): its front and back falls, thick and soft."""
    r, thick = tube + 0.008, 0.009
    turn = np.linspace(0.0, math.pi, 7)
    fall = np.linspace(1.0, 0.0, 9)[:-1]
    px = np.concatenate([np.full(8, r), r * el.cos(turn), np.full(8, -r)])
    pz = np.concatenate([-front_fall * fall, r * el.sin(turn), -back_fall * fall[::-1]])
    t = np.linspace(-0.5, 0.5, 13)
    ss, tt = np.meshgrid(np.arange(len(px), dtype=np.float64), t, indexing="ij")
    hang = np.clip(-pz, 0.0, None)[:, None] / max(front_fall, 1e-6)
    wave = 0.35 * thick * wrinkles(rng, 0.04 * ss, tt, 5, 1.0, 3.0) * np.sqrt(hang)
    points = np.dstack([x + px[:, None] + wave, y + width * tt * (1.0 - 0.02 * hang), z + pz[:, None] + 0.0 * tt])
    normal = np.dstack([np.sign(px)[:, None] * (np.abs(px) > 0.4 * r)[:, None] + 0.0 * tt, 0.0 * tt, (pz > 0.0)[:, None] + 0.0 * tt])
    return sheet((points + 0.5 * thick * normal)[::-1], (points - 0.5 * thick * normal)[::-1])


def build_laundry_basket(rng: np.random.Generator, size_m: Size, style: str) -> Pieces:
    """Return a woven hamper with clothes under its rim, or a canvas bag in a wooden frame."""
    _, _, height, half_d, half_w = halved(size_m)
    low, top = 0.74 * height, 0.95 * height  # of the clothes
    if style == "woven":
        rim = [
            oval(half_d - i, half_w - i, height - z, power=4.0, points=48)
            for i, z in ((0.0, 0.03), (0.0, 0.006), (0.006, 0.0), (0.03, 0.004))
        ]
        inside = oval(0.8 * half_d, 0.8 * half_w, 0.5 * height, power=4.0, points=48)
        body = loft([*_weave(half_d, half_w, 0.955 * height), *rim, inside])
        return {"body": body, "clothes": heap(rng, (-0.95 * half_d, -0.95 * half_w, low), (0.95 * half_d, 0.95 * half_w, top))}
    frame = []
    for y in (-half_w + 0.012, half_w - 0.012):
        frame += [rod((s * (half_d - 0.014), y, 0.0), (-s * (half_d - 0.014), y, height - 0.012), 0.011, segments=8) for s in (-1.0, 1.0)]
    frame += [
        rod((s * (half_d - 0.014), -half_w, height - 0.012), (s * (half_d - 0.014), half_w, height - 0.012), 0.012) for s in (-1.0, 1.0)
    ]
    frame.append(rod((0.0, -half_w + 0.012, 0.5 * height), (0.0, half_w - 0.012, 0.5 * height), 0.008))
    bag = [oval(0.55 * half_d, half_w - 0.05, 0.12 * height, power=6.0), oval(0.62 * half_d, half_w - 0.035, 0.16 * height, power=6.0)]
    bag += [oval(0.8 * half_d, half_w - 0.028, 0.55 * height, power=6.0), oval(half_d - 0.02, half_w - 0.028, height - 0.02, power=8.0)]
    bag += [oval(half_d - 0.026, half_w - 0.034, height - 0.02, power=8.0), oval(0.7 * half_d, half_w - 0.06, 0.4 * height, power=6.0)]
    clothes = heap(rng, (-0.86 * half_d, 0.03 - half_w, low), (0.86 * half_d, half_w - 0.03, top))
    return {"frame": frame, "body": loft(bag), "clothes": clothes}


def _weave(half_d: float, half_w: float, top: float) -> list[NDArray[np.float64]]:
    """Outlines of a tapered wall woven round 16 stakes: every other row of strands lies outside each stake."""
    rings = [oval(0.82 * half_d, 0.82 * half_w, 0.0, power=4.0, points=48)]
    over = el.cos(np.arange(48) * (math.pi / 1.5))
    count = 18
    for k in range(count):
        share = 0.82 + 0.15 * (k + 0.5) / count
        for bulge, part in ((-0.003, 0.08), (0.004, 0.5), (-0.003, 0.92)):
            row = oval(share * half_d, share * half_w, top * (k + part) / count, power=4.0, points=48)
            swell = bulge + 0.004 * over * (1.0 if k % 2 else -1.0) * (part == 0.5)
            row[:, :2] *= 1.0 + (swell / np.linalg.norm(row[:, :2], axis=1))[:, None]
            rings.append(row)
    return rings


MODELS = {
    "bathroom_cabinet": Model(build_bathroom_cabinet, ("mirrored", "towels")),
    "towel_rail": Model(build_towel_rail, ("bar", "ladder")),
    "laundry_basket": Model(build_laundry_basket, ("woven", "canvas")),
}
