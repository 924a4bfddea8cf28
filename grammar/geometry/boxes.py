"""Boxes that stand upright: exact tests between them, compiled.

A box is a row of eight float64 in world metres: ``x, y`` (centre of its footprint), ``z_low, z_high``, ``half_depth`` (along the box's own
x), ``half_width`` (along its y), ``cos_yaw, sin_yaw``.  Many boxes are an (n, 8) array.  The rectangle tests follow the separating axis
theorem (Gottschalk et al., SIGGRAPH 1996) in two dimensions.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grammar.geometry.kernels import LEAN

Boxes = NDArray[np.float64]

_CORNER_DEPTH, _CORNER_WIDTH = np.array([1.0, -1.0, -1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])


def footprint_corners(box: Boxes) -> Boxes:
    """Return the (4, 2) corners of a box's footprint, counter-clockwise, world metres."""
    u, v = box[4] * _CORNER_DEPTH, box[5] * _CORNER_WIDTH
    return np.column_stack([box[0] + u * box[6] - v * box[7], box[1] + u * box[7] + v * box[6]])


@njit(**LEAN)
def row_penetration(first: Boxes, i: int, second: Boxes, j: int) -> float:
    """Return how far the footprints of boxes ``first[i]`` and ``second[j]`` overlap, in metres; 0 or less when they are apart.

    The depth is the least translation along any of the four edge normals that parts the rectangles.  A negative value is a lower bound of
    the distance between them with its sign turned.
    """
    dx, dy = second[j, 0] - first[i, 0], second[j, 1] - first[i, 1]
    ad, aw, ac, as_ = first[i, 4], first[i, 5], first[i, 6], first[i, 7]
    bd, bw, bc, bs = second[j, 4], second[j, 5], second[j, 6], second[j, 7]
    cos_ab, sin_ab = abs(ac * bc + as_ * bs), abs(ac * bs - as_ * bc)
    depth = ad + bd * cos_ab + bw * sin_ab - abs(dx * ac + dy * as_)
    depth = min(depth, aw + bd * sin_ab + bw * cos_ab - abs(dy * ac - dx * as_))
    depth = min(depth, bd + ad * cos_ab + aw * sin_ab - abs(dx * bc + dy * bs))
    return float(min(depth, bw + ad * sin_ab + aw * cos_ab - abs(dy * bc - dx * bs)))


def footprint_penetration(a: Boxes, b: Boxes) -> float:
    """Return :func:`row_penetration` of two boxes that are given as rows (8,)."""
    return float(row_penetration(a.reshape(1, 8), 0, b.reshape(1, 8), 0))


@njit(**LEAN)
def penetration(first: Boxes, i: int, second: Boxes, j: int) -> float:
    """Return the penetration depth of boxes ``first[i]`` and ``second[j]`` in metres; 0 or less when they are apart or touch."""
    vertical = min(first[i, 3], second[j, 3]) - max(first[i, 2], second[j, 2])
    if vertical <= 0.0:
        return float(vertical)
    return float(min(vertical, row_penetration(first, i, second, j)))


@njit(**LEAN)
def point_distance(box: Boxes, x_m: float, y_m: float) -> float:
    """Return the distance in metres from a point to a box's footprint, 0 inside."""
    dx, dy = x_m - box[0], y_m - box[1]
    u = max(abs(dx * box[6] + dy * box[7]) - box[4], 0.0)
    v = max(abs(dy * box[6] - dx * box[7]) - box[5], 0.0)
    return math.sqrt(u * u + v * v)


@njit(**LEAN)
def segment_inside_length(box: Boxes, ax_m: float, ay_m: float, bx_m: float, by_m: float) -> float:
    """Return how many metres of the segment from a to b lie in the open footprint of a box (Liang-Barsky clipping)."""
    au = (ax_m - box[0]) * box[6] + (ay_m - box[1]) * box[7]
    av = (ay_m - box[1]) * box[6] - (ax_m - box[0]) * box[7]
    du = (bx_m - ax_m) * box[6] + (by_m - ay_m) * box[7]
    dv = (by_m - ay_m) * box[6] - (bx_m - ax_m) * box[7]
    low, high = 0.0, 1.0
    for start, step, half in ((au, du, box[4]), (av, dv, box[5])):
        if abs(step) < 1e-12:
            if abs(start) >= half:
                return 0.0
        else:
            first, second = (-half - start) / step, (half - start) / step
            low = max(low, min(first, second))
            high = min(high, max(first, second))
    return max(high - low, 0.0) * math.sqrt(du * du + dv * dv)


@njit(**LEAN)
def place_boxes(local: Boxes, first: int, last: int, x_m: float, y_m: float, z_m: float, yaw_rad: float, out: Boxes) -> None:
    """Write to rows ``first`` to ``last - 1`` of ``out`` (n, 8) the boxes that those rows of ``local`` (n, 6) become at a pose.

    A local row is ``x, y, z_low, z_high, half_depth, half_width`` in the object's frame (front +x, origin at the centre of the bottom).
    """
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    for k in range(first, last):
        out[k, 0] = x_m + local[k, 0] * c - local[k, 1] * s
        out[k, 1] = y_m + local[k, 0] * s + local[k, 1] * c
        out[k, 2] = z_m + local[k, 2]
        out[k, 3] = z_m + local[k, 3]
        out[k, 4] = local[k, 4]
        out[k, 5] = local[k, 5]
        out[k, 6] = c
        out[k, 7] = s


def deepest_penetrations(boxes: Boxes, owner: NDArray[np.int64], others: Boxes, other_owner: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return, for each of ``boxes`` (n, 8), its deepest penetration in metres with those of ``others`` that have another owner; 0: none."""
    depth = np.zeros(len(boxes))
    _deepen(boxes, owner, others, other_owner, depth)
    return depth


@njit(**LEAN)
def _deepen(boxes, owner, others, other_owner, depth):  # type: ignore[no-untyped-def]
    for a in range(len(boxes)):
        for b in range(len(others)):
            if owner[a] != other_owner[b]:
                depth[a] = max(depth[a], penetration(boxes, a, others, b))
