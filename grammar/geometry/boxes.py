"""Boxes that stand upright: exact tests between them, compiled.

A box is a row of eight float64 in world metres, in the columns named here: x and y of the middle of its footprint, the heights of its
underside and top, half its depth (along the box's own x) and half its width (along its y), cosine and sine of its yaw.  Many boxes are an
(n, 8) array.  The rectangle tests follow the separating axis theorem (Gottschalk et al., SIGGRAPH 1996) in two dimensions.
"""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from grammar.geometry.arrays import Boxes, Floats, Ints
from grammar.geometry.kernels import entry

X, Y, Z_LOW, Z_HIGH, HALF_DEPTH, HALF_WIDTH, COS_YAW, SIN_YAW = range(8)
"""Columns of boxes; boxes in an object's own frame have the first six."""

LOCAL_BOX_WIDTH, BOX_WIDTH = COS_YAW, SIN_YAW + 1
"""How many columns there are in an object's own frame, and in the world."""

_CORNER_DEPTH, _CORNER_WIDTH = np.array([1.0, -1.0, -1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])


def box_rows(rows: Iterable[ArrayLike]) -> Boxes:
    """Return boxes (8,) as the rows of an (n, 8) array, which may be empty."""
    return np.array(list(rows), np.float64).reshape(-1, BOX_WIDTH)


NO_BOXES = box_rows([])


def footprint_corners(box: Boxes) -> Boxes:
    """Return the (..., 4, 2) corners of the footprint of a box or boxes (..., 8), counter-clockwise, world metres."""
    x, y, _, _, depth, width, c, s = np.moveaxis(box, -1, 0)[..., None]
    u, v = depth * _CORNER_DEPTH, width * _CORNER_WIDTH
    return np.stack([x + u * c - v * s, y + u * s + v * c], axis=-1)


@entry
def row_penetration(first: Boxes, i: int, second: Boxes, j: int) -> float:
    """Return how far the footprints of boxes ``first[i]`` and ``second[j]`` overlap, in metres; 0 or less when they are apart.

    The depth is the least translation along any of the four edge normals that parts the rectangles.  A negative value is a lower bound of
    the distance between them with its sign turned.
    """
    dx, dy = second[j, X] - first[i, X], second[j, Y] - first[i, Y]
    ad, aw, ac, as_ = first[i, HALF_DEPTH], first[i, HALF_WIDTH], first[i, COS_YAW], first[i, SIN_YAW]
    bd, bw, bc, bs = second[j, HALF_DEPTH], second[j, HALF_WIDTH], second[j, COS_YAW], second[j, SIN_YAW]
    cos_ab, sin_ab = abs(ac * bc + as_ * bs), abs(ac * bs - as_ * bc)
    depth = ad + bd * cos_ab + bw * sin_ab - abs(dx * ac + dy * as_)
    depth = min(depth, aw + bd * sin_ab + bw * cos_ab - abs(dy * ac - dx * as_))
    depth = min(depth, bd + ad * cos_ab + aw * sin_ab - abs(dx * bc + dy * bs))
    return float(min(depth, bw + ad * sin_ab + aw * cos_ab - abs(dy * bc - dx * bs)))


def footprint_penetration(a: Boxes, b: Boxes) -> float:
    """Return :func:`row_penetration` of two boxes that are given as rows (8,)."""
    return float(row_penetration(a[None], 0, b[None], 0))


@entry
def _overlap(boxes, others, depth):  # type: ignore[no-untyped-def]
    for a in range(len(boxes)):
        for b in range(len(others)):
            depth[a] = max(depth[a], row_penetration(boxes, a, others, b))


def footprint_penetrations(boxes: Boxes, others: Boxes) -> Floats:
    """Return, for each of ``boxes`` (n, 8), the greatest :func:`row_penetration` with any of ``others``, -inf without these."""
    depth = np.full(len(boxes), -math.inf)
    _overlap(boxes, others, depth)
    return depth


@entry
def penetration(first: Boxes, i: int, second: Boxes, j: int) -> float:
    """Return the penetration depth of boxes ``first[i]`` and ``second[j]`` in metres; 0 or less when they are apart or touch."""
    vertical = min(first[i, Z_HIGH], second[j, Z_HIGH]) - max(first[i, Z_LOW], second[j, Z_LOW])
    if vertical <= 0.0:
        return float(vertical)
    return float(min(vertical, row_penetration(first, i, second, j)))


@entry
def point_distance(box: Boxes, x_m: float, y_m: float) -> float:
    """Return the distance in metres from a point to a box's footprint, 0 inside."""
    dx, dy = x_m - box[X], y_m - box[Y]
    u = max(abs(dx * box[COS_YAW] + dy * box[SIN_YAW]) - box[HALF_DEPTH], 0.0)
    v = max(abs(dy * box[COS_YAW] - dx * box[SIN_YAW]) - box[HALF_WIDTH], 0.0)
    return math.sqrt(u * u + v * v)


@entry
def segment_inside_length(box: Boxes, ax_m: float, ay_m: float, bx_m: float, by_m: float) -> float:
    """Return how many metres of the segment from a to b lie in the open footprint of a box (Liang-Barsky clipping)."""
    au = (ax_m - box[X]) * box[COS_YAW] + (ay_m - box[Y]) * box[SIN_YAW]
    av = (ay_m - box[Y]) * box[COS_YAW] - (ax_m - box[X]) * box[SIN_YAW]
    du = (bx_m - ax_m) * box[COS_YAW] + (by_m - ay_m) * box[SIN_YAW]
    dv = (by_m - ay_m) * box[COS_YAW] - (bx_m - ax_m) * box[SIN_YAW]
    low, high = 0.0, 1.0
    for start, step, half in ((au, du, box[HALF_DEPTH]), (av, dv, box[HALF_WIDTH])):
        if abs(step) < 1e-12:
            if abs(start) >= half:
                return 0.0
        else:
            first, second = (-half - start) / step, (half - start) / step
            low = max(low, min(first, second))
            high = min(high, max(first, second))
    return max(high - low, 0.0) * math.sqrt(du * du + dv * dv)


@entry
def place_boxes(local: Boxes, first: int, last: int, x_m: float, y_m: float, z_m: float, yaw_rad: float, out: Boxes) -> None:
    """Write to rows ``first`` to ``last - 1`` of ``out`` (n, 8) the boxes that those rows of ``local`` (n, 6) become at a pose.

    A local row is ``x, y, z_low, z_high, half_depth, half_width`` in the object's frame (front +x, origin at the centre of the bottom).
    """
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    for k in range(first, last):
        out[k, X] = x_m + local[k, X] * c - local[k, Y] * s
        out[k, Y] = y_m + local[k, X] * s + local[k, Y] * c
        out[k, Z_LOW] = z_m + local[k, Z_LOW]
        out[k, Z_HIGH] = z_m + local[k, Z_HIGH]
        out[k, HALF_DEPTH] = local[k, HALF_DEPTH]
        out[k, HALF_WIDTH] = local[k, HALF_WIDTH]
        out[k, COS_YAW] = c
        out[k, SIN_YAW] = s


def deepest_penetrations(boxes: Boxes, owner: Ints, others: Boxes, other_owner: Ints) -> Floats:
    """Return, for each of ``boxes`` (n, 8), its deepest penetration in metres with those of ``others`` that have another owner; 0: none."""
    depth = np.zeros(len(boxes))
    _deepen(boxes, owner, others, other_owner, depth)
    return depth


@entry
def _deepen(boxes, owner, others, other_owner, depth):  # type: ignore[no-untyped-def]
    for a in range(len(boxes)):
        for b in range(len(others)):
            if owner[a] != other_owner[b]:
                depth[a] = max(depth[a], penetration(boxes, a, others, b))
