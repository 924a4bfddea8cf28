"""Beds: foot end at +x, headboard at -x."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from renderer.flat_scene import Mesh
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import Drape, cloth, cushion, drape, layer, pillow
from renderer.shapes import block, blocks, merged, moved, rod, rotated, rounded_box, sheet


class _Plan(NamedTuple):
    """Where things lie: mattress from ``head`` to ``foot`` along x, half width ``half``, between ``z_low`` and ``z_top``."""

    head: float
    foot: float
    half: float
    z_low: float
    z_top: float


def build_bed(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a bed made up with duvet, turned-down sheet, pillows, decorative cushion and throw."""
    depth, width, height = size_m
    top = min(0.53, 0.28 + 0.24 * height, 0.82 * height)
    thickness = min(0.22, 0.5 * top)
    head = {"platform": 0.05, "panel": 0.055, "upholstered": 0.10}[style]
    foot = {"platform": 0.05, "panel": 0.05, "upholstered": 0.06}[style]
    inset = {"platform": 0.07, "panel": 0.055, "upholstered": 0.06}[style]
    plan = _Plan(-0.5 * depth + head, 0.5 * depth - foot, 0.5 * width - inset, top - thickness, top)
    parts = {"platform": _platform, "panel": _panel, "upholstered": _upholstered}[style](rng, size_m, plan)
    parts["mattress"] = rounded_box((plan.head, -plan.half, plan.z_low), (plan.foot, plan.half, plan.z_top), 0.05, 2)
    parts.update(_bedding(rng, plan, height, hangs=style != "platform", over_foot=style != "panel"))
    return fitted(parts, size_m)


def _bedding(rng: np.random.Generator, plan: _Plan, height: float, hangs: bool, over_foot: bool) -> Parts:
    length = plan.foot - plan.head
    fall = (plan.z_top - plan.z_low) * (1.45 if hangs else 0.9)
    pillow_depth = min(0.44, 0.24 * length)
    start = plan.head + pillow_depth * rng.uniform(0.88, 1.0)
    center = 0.5 * (start + plan.foot)
    thickness = 0.022
    cover = drape(rng, Drape(plan.foot - center, plan.half, plan.z_top + thickness, fall, fall if over_foot else 0.02, 0.0, 0.055))
    throw_end = plan.foot - center - rng.uniform(0.12, 0.25)
    layers = {
        "duvet": cloth(cover, thickness),
        "sheet": layer(cover, (float(cover.s[0]), float(cover.s[0]) + rng.uniform(0.17, 0.26)), 0.95, 0.014, 0.013, 7),
        "throw": layer(cover, (throw_end - rng.uniform(0.42, 0.58), throw_end), 0.96, 0.008, 0.007, 10),
    }
    parts = {name: moved(mesh, x=center) for name, mesh in layers.items()}
    return parts | _pillows(rng, plan, height, pillow_depth)


def _pillows(rng: np.random.Generator, plan: _Plan, height: float, depth: float) -> Parts:
    """Sleeping pillows side by side, leaning a little, and a smaller cushion before them."""
    count = 2 if plan.half > 0.58 else 1
    room = max(height - plan.z_top, 0.12)
    width = min(2.0 * plan.half / count * 0.93, 0.72)
    thick = min(0.17, 0.8 * room)
    lean = min(math.radians(rng.uniform(20.0, 32.0)), math.asin(min(1.0, 0.55 * room / depth)))
    pillows = []
    for i in range(count):
        soft = rotated(pillow(rng, depth, width, thick), "y", lean)
        low = soft.vertices.min(axis=0)
        shift = (i - 0.5 * (count - 1)) * (2.0 * plan.half / count)
        pillows.append(moved(soft, x=plan.head + 0.01 - low[0], y=shift + rng.uniform(-0.01, 0.01), z=plan.z_top - low[2] - 0.012))
    small = 0.36 if plan.half > 0.5 else 0.32
    steep = min(math.radians(52.0), math.asin(min(1.0, 0.8 * room / small)))
    accent = rotated(rotated(pillow(rng, small, small * rng.uniform(1.0, 1.35), 0.13, 10), "y", steep), "z", rng.uniform(-0.12, 0.12))
    low = accent.vertices.min(axis=0)
    place = moved(accent, x=plan.head + 0.6 * depth - low[0], y=rng.uniform(-0.08, 0.08), z=plan.z_top - low[2] + 0.02)
    return {"pillows": merged(*pillows), "cushion": place}


def _platform(rng: np.random.Generator, size_m: Size, plan: _Plan) -> Parts:
    """A low slab on recessed legs, a plain wide headboard."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    base = plan.z_low - 0.02
    slab = block((-half_d, -half_w, base - 0.09), (half_d, half_w, base + 0.05), 0.008)
    lip = block((plan.head, -plan.half + 0.03, base), (plan.foot, plan.half - 0.03, plan.z_low + 0.01))
    seams = int(rng.integers(2, 5))
    edges = np.linspace(-half_w, half_w, seams + 1)
    low = [(-half_d, y + 0.0015, base) for y in edges[:-1]]
    high = [(-half_d + 0.04, y - 0.0015, height) for y in edges[1:]]
    inset = 0.14
    legs = [
        block(
            (sx * (half_d - inset) - 0.035, sy * (half_w - inset) - 0.035, 0.0),
            (sx * (half_d - inset) + 0.035, sy * (half_w - inset) + 0.035, base - 0.08),
            0.005,
        )
        for sx in (-1.0, 1.0)
        for sy in (-1.0, 1.0)
    ]
    return {"frame": merged(slab, lip), "headboard": blocks(low, high, 0.008), "legs": merged(*legs)}


def _panel(rng: np.random.Generator, size_m: Size, plan: _Plan) -> Parts:
    """Posts and rails with a curved, slatted or panelled headboard and a low footboard."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    post = 0.055
    foot_height = min(plan.z_top + 0.06, 0.75 * height)
    rail_low, rail_high = plan.z_low - 0.10, plan.z_low + 0.07
    rails = [
        block((-half_d + 0.02, s * plan.half, rail_low), (half_d - 0.02, s * (plan.half - 0.03), rail_high), 0.004) for s in (-1.0, 1.0)
    ]
    lip = block((plan.head, -plan.half + 0.02, plan.z_low - 0.03), (plan.foot, plan.half - 0.02, plan.z_low + 0.005))
    foot = _paneled_board(half_d - 0.01, half_w, post, rail_low, foot_height, 0.05)
    rise = rng.uniform(0.03, 0.09) * min(1.0, height)
    head = _paneled_board(-half_d + post - 0.01, half_w, post, rail_low, height - rise, rise)
    legs = []
    for x, top in ((-half_d + 0.5 * post, height - rise + 0.012), (half_d - 0.5 * post, foot_height + 0.015)):
        legs += [block((x - 0.5 * post, s * half_w, 0.0), (x + 0.5 * post, s * (half_w - post), top), 0.006) for s in (-1.0, 1.0)]
    return {"frame": merged(*rails, lip, foot), "headboard": head, "legs": merged(*legs)}


def _paneled_board(front: float, half_w: float, post: float, low: float, high: float, rise: float) -> Mesh:
    """Top rail that rises in the middle, bottom rail, stiles and fields between them; its front lies at x = ``front``."""
    inner = half_w - post
    thick = 0.032
    y = np.linspace(-inner, inner, 25)
    arch = rise * np.maximum(np.cos(0.5 * math.pi * y / inner), 0.0) ** 0.8
    rail = 0.075
    front_face = np.stack(
        [np.column_stack([np.full(25, front), y, np.full(25, high - rail)]), np.column_stack([np.full(25, front), y, high + arch])], axis=1
    )
    back_face = front_face - np.array([thick, 0.0, 0.0])
    top_rail = sheet(front_face, back_face)
    fields = max(3, round(2.0 * inner / 0.42))
    edges = np.linspace(-inner, inner, fields + 1)
    stile = 0.032
    low_corners = [(front - thick, edge - stile, low) for edge in edges[1:-1]] + [(front - thick, -inner, low)]
    high_corners = [(front, edge + stile, high - rail + 0.01) for edge in edges[1:-1]] + [(front, inner, low + 0.09)]
    frame = blocks(low_corners, high_corners, 0.005)
    back = block((front - thick + 0.006, -inner, low + 0.02), (front - 0.018, inner, high - 0.02), 0.002)
    raised = blocks(
        [(front - 0.02, a + stile + 0.03, low + 0.12) for a in edges[:-1]],
        [(front - 0.008, b - stile - 0.03, high - rail - 0.03) for b in edges[1:]],
        0.008,
    )
    return merged(top_rail, frame, back, raised)


def _upholstered(rng: np.random.Generator, size_m: Size, plan: _Plan) -> Parts:
    """Padded side rails and a headboard of tufted channels or squares."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    low, high = 0.09, plan.z_low + 0.06
    side = plan.half + 0.004
    sides = [rounded_box((-half_d + 0.02, s * side, low), (plan.foot + 0.004, s * (side - 0.05), high), 0.02) for s in (-1.0, 1.0)]
    end = rounded_box((plan.foot - 0.05, -side, low), (plan.foot + 0.004, side, high), 0.02)
    lip = block((plan.head, -plan.half + 0.03, low + 0.02), (plan.foot - 0.03, plan.half - 0.03, plan.z_low + 0.01))
    back = rounded_box((-half_d, -half_w, low), (-half_d + 0.07, half_w, height), 0.03)
    columns = min(max(3, round(width / rng.uniform(0.2, 0.34))), 11)
    rows = 1 if columns > 5 or rng.random() < 0.4 else 2
    ys = np.linspace(-half_w + 0.012, half_w - 0.012, columns + 1)
    zs = np.linspace(plan.z_low + 0.05, height - 0.012, rows + 1)
    pads = [
        cushion(rng, (-half_d + 0.05, a, c), (-half_d + 0.115, b, d), 0.02, 0.022, axis=0, divisions=3)
        for a, b in itertools.pairwise(ys)
        for c, d in itertools.pairwise(zs)
    ]
    legs = [
        rod((sx * (half_d - 0.12), sy * (half_w - 0.12), 0.0), (sx * (half_d - 0.12), sy * (half_w - 0.12), low + 0.03), 0.018, 0.028)
        for sx in (-1.0, 1.0)
        for sy in (-1.0, 1.0)
    ]
    return {"frame": merged(*sides, end, lip), "headboard": merged(back, *pads), "legs": merged(*legs)}


MODELS = {"bed": Model(build_bed, ("platform", "panel", "upholstered"))}
