"""Desks; the sitter's side is +x, where the space for the knees is free."""

from __future__ import annotations

import itertools

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, merged, rod
from renderer.models.cabinets import Front, bar_handle, fronts, pulls
from renderer.models.model import Model, Parts, Size, fitted


def build_desk(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a desk on side panels with flat drawers, on four legs with a flat drawer, or a plain top on a metal frame."""
    return fitted({"panels": _paneled, "legs": _legged, "frame": _framed}[style](rng, size_m), size_m)


def _paneled(rng: np.random.Generator, size_m: Size) -> Parts:
    """Side panels, a modesty panel at the back and flat drawers below the top."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    thick, side = 0.03, 0.032
    under = height - thick
    inner = half_w - 0.006 - side
    panels = blocks(
        [(-half_d + 0.008, s * (half_w - 0.006) - (side if s > 0 else 0.0), 0.0) for s in (-1.0, 1.0)],
        [(half_d - 0.016, s * (half_w - 0.006) + (side if s < 0 else 0.0), under + 0.001) for s in (-1.0, 1.0)],
        0.004,
    )
    modesty = block((-half_d + 0.03, -inner - 0.002, under - 0.095), (-half_d + 0.048, inner + 0.002, under))
    divide = block((-half_d + 0.05, -0.009, under - 0.085), (half_d - 0.03, 0.009, under + 0.001))
    front = half_d - 0.02
    areas = [Front(a, b, under - 0.09, under - 0.002) for a, b in ((-inner, -0.001), (0.001, inner))]
    boxes = blocks(
        [(-half_d + 0.05, a.left + 0.012, a.low + 0.006) for a in areas], [(front - 0.01, a.right - 0.012, a.high - 0.01) for a in areas]
    )
    return {
        "top": block((-half_d, -half_w, under), (half_d, half_w, height), 0.004),
        "legs": merged(panels, modesty, divide),
        "drawers": merged(fronts(front, areas, 0.016), boxes),
        "handles": pulls(front, areas, str(rng.choice(("bar", "knob"))), 0.018),
    }


def _legged(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    thick, apron = 0.026, 0.10
    under = height - thick
    legs: list[Mesh] = []
    splay = 0.012 if rng.random() < 0.5 else 0.0
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            x, y = sx * (half_d - 0.032 - splay), sy * (half_w - 0.032 - splay)
            legs.append(rod((x + sx * splay, y + sy * splay, 0.0), (x, y, under - 0.01), 0.015, 0.025, 14))
    inner = half_w - 0.067 - splay
    back_edge, front_edge = -half_d + 0.032 + splay, half_d - 0.027 - splay
    rails = blocks(
        [(back_edge, -inner, under - apron), (back_edge, -inner - 0.015, under - apron), (back_edge, inner - 0.01, under - apron)],
        [
            (back_edge + 0.018, inner, under + 0.001),
            (front_edge - 0.02, -inner + 0.01, under + 0.001),
            (front_edge - 0.02, inner + 0.015, under + 0.001),
        ],
    )
    count = 1 if width < 1.1 else 2
    edges = np.linspace(-inner + 0.012, inner - 0.012, count + 1)
    areas = [Front(float(a), float(b), under - apron + 0.006, under - 0.004) for a, b in itertools.pairwise(edges)]
    boxes = blocks(
        [(back_edge + 0.02, a.left + 0.01, a.low + 0.008) for a in areas],
        [(front_edge - 0.016, a.right - 0.01, a.high - 0.01) for a in areas],
    )
    return {
        "top": block((-half_d, -half_w, under), (half_d, half_w, height), 0.006),
        "legs": merged(*legs, rails),
        "drawers": merged(fronts(front_edge, areas, 0.018), boxes),
        "handles": pulls(front_edge, areas, "knob", 0.02),
    }


def _framed(rng: np.random.Generator, size_m: Size) -> Parts:
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    thick = rng.uniform(0.024, 0.036)
    under = height - thick
    bar = 0.02
    inset = 0.026
    low, high = [], []
    for s in (-1.0, 1.0):
        y0, y1 = sorted((s * (half_w - inset), s * (half_w - inset - 2 * bar)))
        for x in (-half_d + inset, half_d - inset - 2 * bar):
            low.append((x, y0, 0.0))
            high.append((x + 2 * bar, y1, under + 0.001))
        for z in (0.0, under - bar):
            low.append((-half_d + inset + bar, y0 + 0.002, z + 0.001))
            high.append((half_d - inset - bar, y1 - 0.002, z + bar))
    low += [(-half_d + inset + 0.002, -half_w + inset, under - 0.045), (-half_d + inset + 0.004, -half_w + inset, under - 0.088)]
    high += [(-half_d + inset + bar, half_w - inset, under), (-half_d + inset + bar, half_w - inset, under - 0.088 + bar)]
    tray_x, tray_half = half_d - 0.05, min(0.26, 0.22 * width)
    area = Front(-tray_half, tray_half, under - 0.075, under - 0.003)
    box = block((-half_d + 0.12, -tray_half + 0.006, under - 0.07), (tray_x - 0.014, tray_half - 0.006, under - 0.005))
    return {
        "top": block((-half_d, -half_w, under), (half_d, half_w, height), 0.004),
        "legs": blocks(low, high, 0.003),
        "drawers": merged(fronts(tray_x, [area], 0.016), box),
        "handles": bar_handle(tray_x, 0.0, under - 0.04, 0.16, 0.02),
    }


MODELS = {"desk": Model(build_desk, ("legs", "panels", "frame"))}
