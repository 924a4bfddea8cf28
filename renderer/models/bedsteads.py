"""Bedsteads: the parts ``frame``, ``headboard`` and ``legs`` of a bed in each style."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, moved, rod, rounded_box, sheet, sweep
from renderer.models.bedding import BedPlan
from renderer.models.carving import relief_board, turned_post
from renderer.models.model import Parts, Size
from renderer.models.soft import cushion
from renderer.models.upholstery import piping, tufted

Build = Callable[[np.random.Generator, Size, BedPlan], Parts]


class Bedstead(NamedTuple):
    """How a style is built, and how much room it needs around the mattress, m; how far a duvet falls, as share of its thickness."""

    build: Build
    head: float
    foot: float
    inset: float
    fall: float
    over_foot: bool


def _corners(half_d: float, half_w: float) -> list[tuple[float, float]]:
    return [(sx * half_d, sy * half_w) for sx in (-1.0, 1.0) for sy in (-1.0, 1.0)]


def _platform(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """A low slab on recessed legs, a wide headboard of planks."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    base = plan.z_low - 0.02
    slab = block((-half_d, -half_w, base - 0.09), (half_d, half_w, base + 0.05), 0.008)
    rim = blocks(
        [(plan.head, -half_w + 0.01, base), (plan.head, half_w - 0.04, base), (half_d - 0.04, -half_w + 0.03, base)],
        [
            (half_d - 0.01, -half_w + 0.04, base + 0.06),
            (half_d - 0.01, half_w - 0.01, base + 0.06),
            (half_d - 0.01, half_w - 0.03, base + 0.06),
        ],
        0.006,
    )
    seams = int(rng.integers(2, 5))
    if rng.random() < 0.5:
        edges = np.linspace(-half_w, half_w, seams + 1)
        low = [(-half_d, y + 0.0015, base) for y in edges[:-1]]
        high = [(-half_d + 0.04, y - 0.0015, height) for y in edges[1:]]
    else:
        edges = np.linspace(base, height, seams + 2)
        low = [(-half_d, -half_w, z + 0.002) for z in edges[:-1]]
        high = [(-half_d + 0.04, half_w, z - 0.002) for z in edges[1:]]
        high[-1] = (-half_d + 0.04, half_w, height)
    inset = 0.14
    legs = [
        block((x - 0.035, y - 0.035, 0.0), (x + 0.035, y + 0.035, base - 0.08), 0.005) for x, y in _corners(half_d - inset, half_w - inset)
    ]
    back = block((-half_d + 0.008, -half_w + 0.01, base + 0.01), (-half_d + 0.03, half_w - 0.01, height - 0.01), 0.002)
    return {"frame": merged(slab, rim), "headboard": merged(blocks(low, high, 0.007), back), "legs": merged(*legs)}


def _panel(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Posts and rails with a curved, panelled headboard and a low footboard."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    post = 0.055
    foot_height = min(plan.z_top + 0.06, 0.58 * height)
    rail_low = plan.z_low - 0.10
    foot = _paneled_board(half_d - 0.01, half_w, post, rail_low, foot_height, min(0.05, 0.595 * height - foot_height))
    rise = rng.uniform(0.03, 0.09) * min(1.0, height)
    head = _paneled_board(-half_d + post - 0.01, half_w, post, rail_low, height - rise, rise)
    legs = []
    for x, top in ((-half_d + 0.5 * post, height - rise + 0.012), (half_d - 0.5 * post, foot_height + 0.008)):
        legs += [block((x - 0.5 * post, s * half_w, 0.0), (x + 0.5 * post, s * (half_w - post), top), 0.006) for s in (-1.0, 1.0)]
    return {"frame": merged(_side_rails(half_d, plan), foot), "headboard": head, "legs": merged(*legs)}


def _side_rails(half_d: float, plan: BedPlan) -> Mesh:
    """Boards along the sides, with a ledge that carries the slats."""
    low, high = plan.z_low - 0.10, plan.z_low + 0.07
    rails = [
        block((-half_d + 0.02, s * (plan.half + 0.014), low), (half_d - 0.02, s * (plan.half - 0.012), high), 0.004) for s in (-1.0, 1.0)
    ]
    ledges = [
        block((plan.head, s * plan.half, low + 0.03), (plan.foot, s * (plan.half - 0.05), plan.z_low - 0.012), 0.002) for s in (-1.0, 1.0)
    ]
    return merged(*rails, *ledges)


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


def _carved(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Turned posts with finials between which carved boards rise in the middle."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    post = 0.065
    low = plan.z_low - 0.06
    foot_top = 0.585 * height
    rise = rng.uniform(0.1, 0.2) * height
    inner = half_w - 0.5 * post
    head_post = height - 0.5 * rise
    head = relief_board(rng, inner, (low, height - rise, rise), (-half_d + 0.012, -half_d + 0.05), 47, 17)
    foot = relief_board(rng, inner, (low, foot_top - 0.07, 0.06), (half_d - 0.058, half_d - 0.022), 35, 9)
    x_head, x_foot = -half_d + 0.5 * post, half_d - 0.5 * post
    posts = [moved(turned_post(post, head_post, low), x_head, s * (half_w - 0.5 * post)) for s in (-1.0, 1.0)]
    posts += [moved(turned_post(post, foot_top, low), x_foot, s * (half_w - 0.5 * post)) for s in (-1.0, 1.0)]
    return {"frame": merged(_side_rails(half_d - 0.02, plan), foot), "headboard": head, "legs": merged(*posts)}


def _metal(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Tubes: an arched head and a lower foot end with bars and rings, brass knobs on the posts."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    tube = 0.017
    inner = half_w - tube - 0.004
    low = plan.z_low - 0.04

    def end(x: float, shoulder: float, top: float, bars: int) -> tuple[Mesh, Mesh]:
        angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 17)
        arch = np.column_stack([np.full(17, x), inner * np.sin(angle), shoulder + (top - tube - shoulder) * np.cos(angle) ** 1.4])
        rails = [sweep(arch, tube, 10), *(rod((x, -inner, z), (x, inner, z), 0.011) for z in (low + 0.06, shoulder - 0.02))]
        ys = np.linspace(-inner, inner, bars + 2)[1:-1]
        rise = np.interp(ys, arch[:, 1], arch[:, 2])
        rails += [rod((x, y, low + 0.06), (x, y, z), 0.006, segments=6) for y, z in zip(ys, rise, strict=True)]
        mid = 0.5 * (low + 0.06 + shoulder)
        turn = np.arange(12) * (2.0 * math.pi / 12)
        ring = 0.36 * float(ys[1] - ys[0])
        for y in 0.5 * (ys[1:] + ys[:-1]):
            rails.append(piping(np.column_stack([np.full(12, x), y + ring * np.cos(turn), mid + ring * np.sin(turn)]), 0.0055, 4))
        posts, knobs = [], []
        for s in (-1.0, 1.0):
            posts.append(rod((x, s * inner, 0.0), (x, s * inner, shoulder), tube, segments=14))
            ball = [
                (0.0, -0.01),
                (0.019, -0.01),
                (0.021, 0.0),
                (0.012, 0.006),
                (0.024, 0.022),
                (0.021, 0.036),
                (0.012, 0.045),
                (0.0, 0.047),
            ]
            knobs.append(moved(lathe(ball, 14), x, s * inner, shoulder))
        return merged(*rails), merged(*posts, *knobs)

    shoulder = height - rng.uniform(0.14, 0.22) * height
    bars = min(max(4, round(width / 0.2)), 9)
    head, head_posts = end(-half_d + 0.024, shoulder, height, bars)
    foot, foot_posts = end(half_d - 0.024, 0.48 * height, 0.585 * height, bars)
    sides = blocks(
        [(-half_d + 0.03, s * plan.half - 0.014, low) for s in (-1.0, 1.0)],
        [(half_d - 0.03, s * plan.half + 0.014, plan.z_low + 0.02) for s in (-1.0, 1.0)],
        0.004,
    )
    return {"frame": merged(sides, foot), "headboard": head, "legs": merged(head_posts, foot_posts)}


def _padded_sides(half_d: float, plan: BedPlan, low: float) -> Mesh:
    """Upholstered rails on both sides and at the foot."""
    high, side = plan.z_low + 0.06, plan.half + 0.004
    sides = [rounded_box((-half_d + 0.02, s * side, low), (plan.foot + 0.004, s * (side - 0.05), high), 0.02) for s in (-1.0, 1.0)]
    end = rounded_box((plan.foot - 0.05, -side, low), (plan.foot + 0.004, side, high), 0.02)
    return merged(*sides, end)


def _peg_legs(half_d: float, half_w: float, low: float) -> Mesh:
    return merged(*(rod((x, y, 0.0), (x, y, low + 0.03), 0.018, 0.028) for x, y in _corners(half_d - 0.12, half_w - 0.12)))


def _upholstered(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """Padded side rails and a headboard of channels or squares."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    low = 0.09
    back = rounded_box((-half_d, -half_w, low), (-half_d + 0.05, half_w, height), 0.022)
    columns = min(max(3, round(width / rng.uniform(0.2, 0.34))), 11)
    rows = 1 if columns > 5 or rng.random() < 0.4 else 2
    ys = np.linspace(-half_w + 0.012, half_w - 0.012, columns + 1)
    zs = np.linspace(plan.z_low + 0.05, height - 0.012, rows + 1)
    pads = [
        cushion(rng, (-half_d + 0.035, a, c), (-half_d + 0.083, b, d), 0.016, 0.02, axis=0, divisions=3)
        for a, b in itertools.pairwise(ys)
        for c, d in itertools.pairwise(zs)
    ]
    return {"frame": _padded_sides(half_d, plan, low), "headboard": merged(back, *pads), "legs": _peg_legs(half_d, half_w, low)}


def _tufted(rng: np.random.Generator, size_m: Size, plan: BedPlan) -> Parts:
    """A high headboard with deep buttons between piped borders, padded rails."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    low, border = 0.08, 0.07
    back = rounded_box((-half_d, -half_w, low), (-half_d + 0.06, half_w, height), 0.022, 3)
    y, bottom, top = half_w - border, plan.z_low, height - border
    pitch = (max(rng.uniform(0.17, 0.22), 2.0 * y / 8.0), max(rng.uniform(0.15, 0.19), (top - bottom) / 3.4))
    panel = tufted((-y, y), (bottom, top), (-half_d + 0.036, -half_d + 0.085), pitch, 0.035)
    welt = [(-half_d + 0.061, -y, bottom), (-half_d + 0.061, y, bottom), (-half_d + 0.061, y, top), (-half_d + 0.061, -y, top)]
    loop = np.concatenate([np.linspace(a, b, 8, endpoint=False) for a, b in zip(welt, [*welt[1:], welt[0]], strict=True)])
    return {
        "frame": _padded_sides(half_d, plan, low),
        "headboard": merged(back, panel, piping(loop, 0.007)),
        "legs": _peg_legs(half_d, half_w, low),
    }


BEDSTEADS = {
    "platform": Bedstead(_platform, 0.05, 0.05, 0.07, 0.8, True),
    "panel": Bedstead(_panel, 0.055, 0.05, 0.055, 1.4, False),
    "upholstered": Bedstead(_upholstered, 0.075, 0.06, 0.06, 1.4, True),
    "carved": Bedstead(_carved, 0.06, 0.075, 0.065, 1.2, False),
    "tufted": Bedstead(_tufted, 0.075, 0.06, 0.06, 1.3, True),
    "metal": Bedstead(_metal, 0.05, 0.05, 0.055, 1.1, False),
}
"""Style -> bedstead."""
