"""Sofas and corner sofas; the sitters look along +x."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from renderer.flat_scene import Mesh
from renderer.models.model import Model, Parts, Size, fitted
from renderer.models.soft import cushion, pillow
from renderer.shapes import block, lathe, merged, moved, rod, rotated, rounded_box, sweep

SEAT_WIDTH_M = 0.7
GAP_M = 0.004


class _Build(NamedTuple):
    """Heights and widths of an upholstered frame, m: legs, armrests' width and height, seat, back frame, thickness of cushions."""

    leg: float
    arm: float
    arm_z: float
    seat_z: float
    back_z: float
    pad: float


def build_sofa(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a sofa: deep with broad round arms, slim on tall legs, or rolled arms as high as the back."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    plan = _plan(style, width, height)
    inner = half_w - plan.arm
    edges = np.linspace(-inner, inner, max(1, round(2.0 * inner / SEAT_WIDTH_M)) + 1)
    back = (-half_d, -half_w + 0.02, plan.leg), (-half_d + 0.13, half_w - 0.02, plan.back_z)
    base = (-half_d + 0.03, -inner - 0.02, plan.leg), (half_d - 0.03, inner + 0.02, plan.seat_z - plan.pad)
    body = [rounded_box(*back, 0.05, 3), rounded_box(*base, 0.02), *(_arm(style, plan, s, half_w, -half_d, half_d) for s in (-1.0, 1.0))]
    front = -half_d + 0.13
    backs = _back_cushions(rng, edges, front, plan.seat_z, height)
    spots = [(s * (inner - 0.24), s * rng.uniform(0.1, 0.4)) for s in (-1.0, 1.0)]
    return fitted(
        {
            "body": merged(*body),
            "seat": _seat_cushions(rng, edges, front - 0.03, half_d, plan),
            "back": backs,
            "legs": _feet(style, plan.leg, [(x, y) for x in (-half_d + 0.08, half_d - 0.08) for y in (-half_w + 0.09, half_w - 0.09)]),
            "pillows": _pillows(rng, spots, front + 0.2, plan.seat_z, height),
        },
        size_m,
    )


def build_corner_sofa(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return an L: a sofa along the back (0.55 of the depth) whose seat runs on to the front at the +y end (0.4 of the width)."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    plan = _plan(style, width, height)
    knee = -half_d + 0.55 * depth
    side = half_w - 0.4 * width
    inner = half_w - plan.arm
    low, top = plan.leg, plan.seat_z - plan.pad
    body = [
        rounded_box((-half_d, -half_w + 0.02, low), (-half_d + 0.13, half_w - 0.02, plan.back_z), 0.05, 3),
        rounded_box((-half_d + 0.03, -inner - 0.02, low), (knee - 0.03, inner + 0.02, top), 0.02),
        rounded_box((knee - 0.06, side + 0.01, low), (half_d - 0.02, inner + 0.02, top), 0.02),
        *(_arm(style, plan, s, half_w, -half_d, knee) for s in (-1.0, 1.0)),
    ]
    count = max(1, round((side + inner) / SEAT_WIDTH_M))
    edges = np.linspace(-inner, side, count + 1)
    front = -half_d + 0.13
    seats = [
        _seat_cushions(rng, edges, front - 0.03, knee, plan),
        _seat_cushions(rng, [side, inner], front - 0.03, half_d, plan),
    ]
    feet = [(-half_d + 0.08, y) for y in (-half_w + 0.09, side + 0.08, half_w - 0.09)]
    feet += [(knee - 0.1, -half_w + 0.09), (knee - 0.1, half_w - 0.09), (half_d - 0.1, side + 0.09), (half_d - 0.1, inner - 0.09)]
    spots = [(-inner + 0.26, -rng.uniform(0.1, 0.4)), (-inner + 0.62, rng.uniform(-0.2, 0.2)), (inner - 0.24, rng.uniform(0.1, 0.4))]
    return fitted(
        {
            "body": merged(*body),
            "seat": merged(*seats),
            "back": _back_cushions(rng, [*edges, inner], front, plan.seat_z, height),
            "legs": _feet(style, low, feet),
            "pillows": _pillows(rng, spots, front + 0.2, plan.seat_z, height),
        },
        size_m,
    )


def _plan(style: str, width: float, height: float) -> _Build:
    seat_z = min(0.45, 0.56 * height)
    leg = {"lounge": 0.05, "slim": 0.15, "rolled": 0.09}[style] * height / 0.85
    arm = min({"lounge": 0.22, "slim": 0.10, "rolled": 0.20}[style], 0.13 * width)
    rise = {"lounge": 0.15, "slim": 0.20, "rolled": 0.26}[style] * height / 0.85
    back_z = {"lounge": 0.86, "slim": 0.9, "rolled": 0.95}[style] * height
    return _Build(leg, arm, min(seat_z + rise, 0.9 * height), seat_z, back_z, 0.14 if style != "slim" else 0.12)


def _arm(style: str, plan: _Build, side: float, half_w: float, x0: float, x1: float) -> Mesh:
    """Return one armrest from x0 to x1: a soft block, a thin board, or a roll over a block."""
    low, high = sorted((side * half_w, side * (half_w - plan.arm)))
    if style != "rolled":
        radius = 0.075 if style == "lounge" else 0.03
        return rounded_box((x0 + 0.02, low, plan.leg), (x1 - 0.008, high, plan.arm_z), radius, 4)
    radius = 0.5 * plan.arm
    y, z = 0.5 * (low + high), plan.arm_z - radius
    roll = sweep(np.column_stack([np.linspace(x0 + 0.03, x1 - 0.006, 6), np.full(6, y), np.full(6, z)]), radius, 24)
    inset = 0.18 * plan.arm
    button = rotated(
        lathe([(0.0, 0.0), (0.62 * radius, 0.0), (0.6 * radius, 0.004), (0.3 * radius, 0.006), (0.0, 0.006)], 20), "y", math.pi / 2
    )
    return merged(
        roll, moved(button, x1 - 0.007, y, z), rounded_box((x0 + 0.03, low + inset, plan.leg), (x1 - 0.02, high - inset, z), 0.02)
    )


def _seat_cushions(rng: np.random.Generator, edges: Sequence[float] | np.ndarray, x0: float, x1: float, plan: _Build) -> Mesh:
    """Return seat cushions side by side between the edges (n,) along y."""
    return merged(
        *(
            cushion(rng, (x0, a + GAP_M, plan.seat_z - plan.pad - 0.002), (x1, b - GAP_M, plan.seat_z + 0.025), 0.05, 0.035)
            for a, b in itertools.pairwise(edges)
        )
    )


def _back_cushions(rng: np.random.Generator, edges: Sequence[float] | np.ndarray, front: float, seat_z: float, height: float) -> Mesh:
    """Return loose back cushions that lean on the frame, whose front lies at ``front``."""
    rows = []
    for a, b in itertools.pairwise(edges):
        top = height - rng.uniform(0.0, 0.015)
        pad = cushion(rng, (front - 0.03, a + GAP_M, seat_z - 0.01), (front + 0.17, b - GAP_M, top), 0.06, 0.065, axis=0)
        rows.append(rotated(pad, "y", -0.11, (front, 0.0, seat_z)))
    return merged(*rows)


def _pillows(rng: np.random.Generator, spots: Sequence[tuple[float, float]], x: float, seat_z: float, height: float) -> Mesh:
    """Return scatter cushions that stand on the seat at (y, turn about z) and lean on the back."""
    rows = []
    for y, turn in spots:
        side = min(0.42, 1.0 * (height - seat_z)) * rng.uniform(0.88, 1.0)
        angle = 0.5 * math.pi - rng.uniform(0.22, 0.36)
        standing = rotated(rotated(pillow(rng, side, side, 0.13, 12), "y", angle), "z", -turn)
        rows.append(moved(standing, x, y, seat_z + 0.02 - float(standing.vertices[:, 2].min())))
    return merged(*rows)


def _feet(style: str, height: float, spots: Sequence[tuple[float, float]]) -> Mesh:
    """Return low blocks, tapered pegs or turned feet at (x, y)."""
    if style == "lounge":
        return merged(*(block((x - 0.03, y - 0.03, 0.0), (x + 0.03, y + 0.03, height + 0.004)) for x, y in spots))
    if style == "slim":
        return merged(*(rod((1.03 * x, 1.03 * y, 0.0), (x, y, height + 0.02), 0.011, 0.02) for x, y in spots))
    profile = [(0.0, 0.0), (0.02, 0.0), (0.036, 0.3 * height), (0.03, 0.6 * height), (0.018, 0.75 * height), (0.03, height + 0.01)]
    return merged(*(moved(lathe([*profile, (0.0, height + 0.01)], 16), x, y) for x, y in spots))


MODELS = {
    "sofa": Model(build_sofa, ("lounge", "slim", "rolled")),
    "corner_sofa": Model(build_corner_sofa, ("lounge", "slim")),
}
