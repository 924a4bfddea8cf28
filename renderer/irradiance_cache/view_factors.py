"""View factors of lights: how much of what a plane sees a light fills, by the cosine, where nothing hides it.

That of a polygon is a sum over its edges, as Lambert has found: half the angles that they fill, each times the cosine between the plane's
normal and that of the edge's own plane through the point, over pi.  What lies behind the plane is cut off first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined, kernel
from renderer.core.sampling import Vector
from renderer.path.lights import EMITTER_CORNER, EMITTER_EDGE_1, EMITTER_EDGE_2, EMITTER_NORMAL, EMITTER_SIZE

_ZERO, _TINY = np.float32(0.0), np.float32(1e-20)
_PER_VIEW = np.float32(0.5 / np.pi)


@kernel
def view_factor(emitters: NDArray[np.float32], first: int, last: int, point: Vector, normal: Vector) -> np.float32:
    """Return the share, 0 to 1, of the view from a plane that the fronts of triangles ``first`` to ``last - 1`` fill together.

    ``emitters``: as in ``Lights``; ``point``, ``normal``: of the plane, metres and unit, world.
    """
    total = _ZERO
    for e in range(first, last):
        row = EMITTER_SIZE * e
        a = _offset(emitters, row + EMITTER_CORNER, point)
        shining = emitters[row + EMITTER_NORMAL], emitters[row + EMITTER_NORMAL + 1], emitters[row + EMITTER_NORMAL + 2]
        if _dot(a, shining) < _ZERO:
            total += abs(_fill(a, _from(emitters, row + EMITTER_EDGE_1, a), _from(emitters, row + EMITTER_EDGE_2, a), normal))
    return total


@inlined
def _offset(table: NDArray[np.float32], at: int, point: Vector) -> Vector:
    return table[at] - point[0], table[at + 1] - point[1], table[at + 2] - point[2]


@inlined
def _from(table: NDArray[np.float32], at: int, corner: Vector) -> Vector:
    return corner[0] + table[at], corner[1] + table[at + 1], corner[2] + table[at + 2]


@inlined
def _fill(a: Vector, b: Vector, c: Vector, normal: Vector) -> np.float32:
    """Return the share of the view that a triangle with these offsets from the point fills, negative for one of its sides."""
    total, enters, leaves, is_cut = _ZERO, a, a, False
    for edge in range(3):
        begin, end = (a, b) if edge == 0 else (b, c) if edge == 1 else (c, a)
        low, high = _dot(begin, normal), _dot(end, normal)
        if low <= _ZERO and high <= _ZERO:
            continue
        if low <= _ZERO:
            begin = enters = _between(begin, end, low / (low - high))
            is_cut = True
        elif high <= _ZERO:
            end = leaves = _between(begin, end, low / (low - high))
            is_cut = True
        total += _angle_times_cosine(begin, end, normal)
    # The edge along the horizon closes what is cut off.
    return total + _angle_times_cosine(leaves, enters, normal) if is_cut else total


@inlined
def _between(begin: Vector, end: Vector, share: np.float32) -> Vector:
    return (
        begin[0] + share * (end[0] - begin[0]),
        begin[1] + share * (end[1] - begin[1]),
        begin[2] + share * (end[2] - begin[2]),
    )


@inlined
def _angle_times_cosine(begin: Vector, end: Vector, normal: Vector) -> np.float32:
    """Return what an edge adds to the share of the view."""
    x = begin[1] * end[2] - begin[2] * end[1]
    y = begin[2] * end[0] - begin[0] * end[2]
    z = begin[0] * end[1] - begin[1] * end[0]
    size = np.sqrt(x * x + y * y + z * z)
    angle = np.arctan2(size, _dot(begin, end))
    share: np.float32 = _PER_VIEW * np.float32(angle) * _dot((x, y, z), normal) / max(size, _TINY)
    return share


@inlined
def _dot(a: Vector, b: Vector) -> np.float32:
    value: np.float32 = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return value
