"""Carved and turned wood: boards with a relief, posts with finials."""

from __future__ import annotations

import math

import numpy as np

from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import block, lathe, merged, moved
from renderer.models.upholstery import lined


def relief_board(
    rng: np.random.Generator, half_w: float, z: tuple[float, float, float], x: tuple[float, float], columns: int, rows: int
) -> Mesh:
    """Return an upright board with a carved front that looks along +x and a crest that rises in the middle.

    Its front bears a moulded border, a fan in the middle and scrolls beside it.

    Args:
        rng: for the number of the fan's blades and the turns of the scrolls.
        half_w: half its width along y.
        z: lower edge, upper edge at the ends, and how far the middle rises above that.
        x: back and furthest front.
        columns: odd count of vertices across.
        rows: odd count of vertices upward.
    """
    low, shoulder, rise = z
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, columns), np.linspace(0.0, 1.0, rows), indexing="ij")
    crest = np.where(np.abs(u) < 0.72, 0.5 + 0.5 * np.cos(math.pi * u / 0.72), 0.0) + 0.16 * np.exp(-(((np.abs(u) - 0.86) / 0.09) ** 2))
    top = shoulder + rise * crest / crest.max()
    y, height = half_w * u, low + (top - low) * v
    blades = int(rng.integers(7, 11))
    turns = rng.uniform(2.2, 3.2)
    edge = np.minimum(half_w - np.abs(y), np.minimum(height - low, top - height))
    border = np.clip(1.0 - np.abs(edge - 0.024) / 0.022, 0.0, 1.0) ** 0.6
    span = shoulder + rise - low
    fan_r = np.hypot(y / (0.32 * half_w), (height - (low + 0.42 * span)) / (0.42 * span))
    fan_a = np.arctan2(y / (0.32 * half_w), (height - (low + 0.42 * span)) / (0.42 * span))
    fan = np.clip(6.0 * (1.0 - fan_r), 0.0, 1.0) * np.clip(8.0 * fan_r, 0.0, 1.0) * (0.35 + 0.65 * np.abs(np.cos(0.5 * blades * fan_a)))
    side_r = np.hypot((np.abs(y) - 0.64 * half_w) / (0.24 * half_w), (height - (low + 0.5 * (shoulder - low))) / (0.32 * (shoulder - low)))
    side_a = np.arctan2(height - (low + 0.5 * (shoulder - low)), np.abs(y) - 0.64 * half_w)
    scroll = np.clip(5.0 * (1.0 - side_r), 0.0, 1.0) * (0.5 + 0.5 * np.cos(2.0 * math.pi * turns * side_r**0.8 + side_a))
    relief = np.maximum.reduce([border, 0.85 * fan, 0.7 * scroll])
    front = x[0] + (x[1] - x[0]) * (0.55 + 0.45 * relief)
    board = lined(np.dstack([front, y, height]), np.dstack([np.full_like(front, x[0]), y, height]))
    foot = block((x[0] + 0.002, -half_w, low - 0.02), (x[1] - 0.002, half_w, low + 0.06), 0.006)
    return merged(board, foot)


def turned_post(side: float, height: float, square_to: float) -> Mesh:
    """Return a post on the floor at the origin: a square block up to ``square_to`` + 0.16 m, turned vase, rings and finial above."""
    half = 0.5 * side
    shaft = min(square_to + 0.16, 0.62 * height)
    foot = min(0.5 * square_to, 0.14)
    turned_foot = lathe(
        [
            (0.0, 0.0),
            (0.55 * half, 0.0),
            (0.8 * half, 0.25 * foot),
            (0.5 * half, 0.6 * foot),
            (0.8 * half, 0.8 * foot),
            (0.8 * half, foot),
            (0.0, foot),
        ],
        12,
    )
    body = block((-half, -half, foot), (half, half, shaft), 0.006)
    rest = height - shaft
    profile = [
        (0.78, 0.0),
        (0.55, 0.06),
        (0.9, 0.16),
        (1.0, 0.3),
        (0.75, 0.5),
        (0.45, 0.62),
        (0.85, 0.66),
        (0.4, 0.71),
        (0.62, 0.82),
        (0.5, 0.93),
    ]
    vase = [(0.0, 0.0), *((half * r, rest * share) for r, share in profile), (0.0, rest)]
    return merged(turned_foot, body, moved(lathe(vase, 12), z=shaft))
