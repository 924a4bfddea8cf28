"""Rugs: bordered with a medallion, striped, round."""

from __future__ import annotations

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, blocks, lathe, merged, slab, stretched
from renderer.models.model import Model, Parts, Size, fitted


def build_rug(rng: np.random.Generator, size_m: Size, style: str) -> Parts:
    """Return a rug with border, inner line, pattern and fringe; a striped one; a round one with rings; or one piece for a woven pattern."""
    depth, width, height = size_m
    half_d, half_w = 0.5 * depth, 0.5 * width
    if style == "round":
        edge = 1.0 - rng.uniform(0.1, 0.2)
        pile = lathe([(0.0, 0.0), (edge, 0.0), (edge, 0.96 * height), (0.0, 0.97 * height)], 56)
        border = lathe([(edge, 0.0), (1.0, 0.0), (1.0, 0.6 * height), (0.99, 0.9 * height), (edge, 0.97 * height)], 56, closed=True)
        rings = [
            lathe([(r, 0.5 * height), (r + 0.05, 0.5 * height), (r + 0.05, height), (r, height)], 48, closed=True)
            for r in np.linspace(0.2, edge - 0.12, 3)
        ]
        scale = (half_d, half_w, 1.0)
        return fitted(
            {name: stretched(mesh, scale, (0, 0, 0)) for name, mesh in (("pile", pile), ("border", border), ("pattern", merged(*rings)))},
            size_m,
        )
    fringe = min(0.06, 0.05 * max(depth, width))
    long_x = depth >= width
    half_d -= fringe * long_x
    half_w -= fringe * (not long_x)
    bevel = 0.35 * height
    count = 44
    spots = np.linspace(-0.985, 0.985, count)
    if long_x:
        threads = [
            ((s * half_d, half_w * t - 0.006, 0.0), (s * (half_d + fringe), half_w * t + 0.006, 0.4 * height))
            for s in (-1.0, 1.0)
            for t in spots
        ]
    else:
        threads = [
            ((half_d * t - 0.006, s * half_w, 0.0), (half_d * t + 0.006, s * (half_w + fringe), 0.4 * height))
            for s in (-1.0, 1.0)
            for t in spots
        ]
    tassels = blocks([np.minimum(a, b) for a, b in threads], [np.maximum(a, b) for a, b in threads], 0.002)
    if style == "woven":
        return fitted({"pile": block((-half_d, -half_w, 0.0), (half_d, half_w, height), bevel), "fringe": tassels}, size_m)
    edge = rng.uniform(0.07, 0.12) * min(depth, width)
    if style == "striped":
        pile = block((-half_d, -half_w, 0.0), (half_d, half_w, 0.95 * height), bevel)
        stripes = max(5, round(2 * max(half_d, half_w) / 0.16)) | 1
        edges = np.linspace(-1.0, 1.0, 2 * stripes + 1)
        low, high = [], []
        for k in range(1, 2 * stripes, 2):
            a, b = (edges[k], edges[k + 1]) if rng.random() < 0.5 else (edges[k], 0.5 * (edges[k] + edges[k + 1]))
            low.append((a * half_d, -half_w + 0.004, 0.3 * height) if long_x else (-half_d + 0.004, a * half_w, 0.3 * height))
            high.append((b * half_d, half_w - 0.004, height) if long_x else (half_d - 0.004, b * half_w, height))
        return fitted({"pile": pile, "pattern": blocks(low, high, 0.001), "fringe": tassels}, size_m)
    pile = block((-half_d + edge, -half_w + edge, 0.0), (half_d - edge, half_w - edge, 0.97 * height), 0.001)
    border = _flat_frame(half_d, half_w, edge, 0.0, 0.97 * height, bevel)
    lines = [_flat_frame(half_d - k, half_w - k, 0.018, 0.5 * height, height, 0.001) for k in (0.35 * edge, 1.25 * edge)]
    return fitted(
        {
            "pile": pile,
            "border": border,
            "pattern": merged(*lines, *_medallions(half_d - 1.6 * edge, half_w - 1.6 * edge, height)),
            "fringe": tassels,
        },
        size_m,
    )


def _flat_frame(half_d: float, half_w: float, rim: float, low: float, high: float, bevel: float) -> Mesh:
    """Return a flat rectangular ring of four bars."""
    return blocks(
        [(-half_d, -half_w, low), (-half_d, half_w - rim, low), (-half_d, -half_w + rim, low), (half_d - rim, -half_w + rim, low)],
        [(half_d, -half_w + rim, high), (half_d, half_w, high), (-half_d + rim, half_w - rim, high), (half_d, half_w - rim, high)],
        bevel,
    )


def _medallions(half_d: float, half_w: float, height: float) -> list[Mesh]:
    """Return diamonds: a large one in the middle, small ones round it."""

    def diamond(x: float, y: float, a: float, b: float) -> Mesh:
        return slab([(x + a, y), (x, y + b), (x - a, y), (x, y - b)], 0.5 * height, height)

    pieces = []
    for size in (0.62, 0.5, 0.3):
        outer = np.array([(half_d * size, 0), (0, half_w * size), (-half_d * size, 0), (0, -half_w * size)])
        inner = 0.93 * outer if size != 0.3 else 0.0 * outer
        if size == 0.3:
            pieces.append(slab(outer, 0.5 * height, height))
        else:
            pieces += [slab([outer[k], outer[(k + 1) % 4], inner[(k + 1) % 4], inner[k]], 0.5 * height, height) for k in range(4)]
    small = 0.09 * min(half_d, half_w)
    pieces += [diamond(sx * 0.82 * half_d, sy * 0.82 * half_w, small, small) for sx in (-1, 1) for sy in (-1, 1)]
    pieces += [diamond(sx * 0.84 * half_d, 0.0, small, small) for sx in (-1, 1)] + [
        diamond(0.0, sy * 0.84 * half_w, small, small) for sy in (-1, 1)
    ]
    return pieces


MODELS = {"rug": Model(build_rug, ("bordered", "striped", "round", "woven"))}
