"""What lies on a bed: mattress with taped edges, duvet in folds, turned-down sheet, throw, pillows, cushions; and the slats below."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import blocks, merged, moved, rotated, rounded_box
from renderer.models.model import Parts
from renderer.models.soft import Drape, cloth, drape, layer, pillow
from renderer.models.upholstery import piping, rounded_loop

DUVET_M = 0.03


class BedPlan(NamedTuple):
    """Where things lie: mattress from ``head`` to ``foot`` along x, half width ``half``, between ``z_low`` and ``z_top``."""

    head: float
    foot: float
    half: float
    z_low: float
    z_top: float


def mattress(plan: BedPlan) -> Mesh:
    """Return a mattress with a tape round its upper and lower edge."""
    body = rounded_box((plan.head, -plan.half, plan.z_low), (plan.foot, plan.half, plan.z_top), 0.05, 2)
    half_x, center = 0.5 * (plan.foot - plan.head), 0.5 * (plan.foot + plan.head)
    loop = rounded_loop(half_x - 0.010, plan.half - 0.010, 0.05)
    tapes = [
        piping(np.column_stack([center + loop[:, 0], loop[:, 1], np.full(len(loop), z)]), 0.006, 4)
        for z in (plan.z_low + 0.012, plan.z_top - 0.012)
    ]
    return merged(body, *tapes)


def slats(plan: BedPlan) -> Mesh:
    """Return the boards across the bed that the mattress lies on."""
    count = max(4, round((plan.foot - plan.head) / 0.22))
    xs = np.linspace(plan.head + 0.06, plan.foot - 0.06, count)
    return blocks(
        [(x - 0.035, -plan.half + 0.012, plan.z_low - 0.014) for x in xs],
        [(x + 0.035, plan.half - 0.012, plan.z_low + 0.004) for x in xs],
        0.003,
    )


def bedding(rng: np.random.Generator, plan: BedPlan, height: float, fall_m: float, over_foot: bool) -> Parts:
    """Return duvet, sheet, throw, pillows and cushion.

    Args:
        rng: for folds and places.
        plan: the mattress.
        height: of the bed, up to which pillows may reach.
        fall_m: how far the duvet hangs down at the sides.
        over_foot: it hangs down at the foot as well.
    """
    length = plan.foot - plan.head
    deep = min(0.44, 0.24 * length)
    start = plan.head + deep * rng.uniform(0.95, 1.1)
    center = 0.5 * (start + plan.foot)
    quilt = float(rng.choice((0.0, 0.0, 0.26, 0.34)))
    lies = Drape(plan.foot - center, plan.half, plan.z_top + DUVET_M, fall_m, fall_m if over_foot else 0.02, 0.0, 0.065)
    cover = drape(rng, lies, 41, 41, 0.034, quilt)
    throw_end = plan.foot - center - rng.uniform(0.12, 0.25)
    layers = {
        "duvet": cloth(cover, DUVET_M),
        "sheet": layer(cover, (float(cover.s[0]), float(cover.s[0]) + rng.uniform(0.17, 0.26)), 0.95, 0.016, 0.014, 7),
        "throw": layer(cover, (throw_end - rng.uniform(0.42, 0.58), throw_end), 0.97, 0.011, 0.009, 11),
    }
    parts = {name: moved(mesh, x=center) for name, mesh in layers.items()}
    return parts | _pillows(rng, plan, height, deep)


def _pillows(rng: np.random.Generator, plan: BedPlan, height: float, depth: float) -> Parts:
    """Sleeping pillows in one or two rows, leaning on the headboard, and a smaller cushion before them."""
    count = 2 if plan.half > 0.58 else 1
    room = max(height - plan.z_top, 0.12)
    width = min(2.0 * plan.half / count * 0.94, 0.74)
    thick = min(0.19, 0.8 * room)
    rows = 2 if room > 0.32 and rng.random() < 0.6 else 1
    pillows = []
    front = plan.head + 0.01
    for row in range(rows):
        steep = rng.uniform(48.0, 60.0) if row + 1 < rows else rng.uniform(20.0, 32.0)
        lean = min(math.radians(steep), math.asin(min(1.0, 0.62 * room / depth)))
        share = 1.0 if row == 0 else 0.94
        for i in range(count):
            soft = rotated(rotated(pillow(rng, share * depth, share * width, thick, 10), "y", lean), "z", rng.uniform(-0.04, 0.04))
            low = soft.vertices.min(axis=0)
            shift = (i - 0.5 * (count - 1)) * (2.0 * plan.half / count)
            pillows.append(moved(soft, front - low[0], shift + rng.uniform(-0.015, 0.015), plan.z_top - low[2] - 0.014))
        front += 0.10 + 0.45 * thick if rows > 1 else 0.0
    small = 0.36 if plan.half > 0.5 else 0.32
    upright = min(math.radians(54.0), math.asin(min(1.0, 0.75 * room / small)))
    accent = rotated(pillow(rng, small, small * rng.uniform(1.0, 1.4), 0.14, 10, piped=True), "y", upright)
    accent = rotated(accent, "z", rng.uniform(-0.12, 0.12))
    low = accent.vertices.min(axis=0)
    place = moved(accent, x=front + 0.5 * depth - low[0], y=rng.uniform(-0.08, 0.08), z=plan.z_top - low[2] + 0.02)
    return {"pillows": merged(*pillows), "cushion": place}
