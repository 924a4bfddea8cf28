"""View factors of lights: how much of what a plane sees a light fills, by the cosine, where nothing hides it.

That of a polygon is a sum over its edges, as Lambert has found: half the angles that they fill, each times the cosine between the plane's
normal and that of the edge's own plane through the point, over pi.  What lies behind the plane is cut off first.

By these shares triangles are drawn where a light is near, and a point on one evenly by solid angle (Arvo, "Stratified Sampling of Spherical
Triangles", 1995): points spread evenly over the light itself would nearly all lie far from a place beside it, and the few that are close
would count many times as much as all others.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.core import lanes as ln
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES
from renderer.core.sampling import Vector, cos_sin_two_pi, cross, dot
from renderer.path.lights import EMITTER_CORNER, EMITTER_EDGE_1, EMITTER_EDGE_2, EMITTER_NORMAL, EMITTER_SIZE, clamp_unit, sample_triangle
from renderer.path.surfaces import lift_height

_ZERO, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_PER_VIEW = np.float32(0.5 / np.pi)
_EVEN_SR = np.float32(0.01)
"""Steradians below which points spread evenly over a triangle are as good as those by solid angle."""


@kernel
def view_factor(emitters: NDArray[np.float32], first: int, last: int, point: Vector, normal: Vector) -> np.float32:
    """Return the share, 0 to 1, of the view from a plane that the fronts of triangles ``first`` to ``last - 1`` fill together.

    ``emitters``: as in ``Lights``; ``point``, ``normal``: of the plane, metres and unit, world.
    """
    total = _ZERO
    for e in range(first, last):
        total += _share(emitters, e, point, normal)
    return total


@inlined
def _share(emitters: NDArray[np.float32], e: int, point: Vector, normal: Vector) -> np.float32:
    row, share = EMITTER_SIZE * e, _ZERO
    a = _offset(emitters, row + EMITTER_CORNER, point)
    if dot(a, _vector(emitters, row + EMITTER_NORMAL)) < _ZERO:
        share = abs(_fill(a, _from(emitters, row + EMITTER_EDGE_1, a), _from(emitters, row + EMITTER_EDGE_2, a), normal))
    return share


@kernel
def sample_view(
    emitters: NDArray[np.float32], first: int, last: int, whole: np.float32, lanes: NDArray[np.float32], sampled: NDArray[np.int32]
) -> None:
    """Draw triangles ``first`` to ``last - 1`` into ``sampled``, by their share of the view from P along NS, and points on them.

    All lanes stand on one point.  ``whole``: the sum of the shares, as :func:`view_factor` returns it.  Fills TO_LIGHT and LIGHT_PDF, 0
    where nothing arrives; U_REMAPPED and U_LIGHT_1 are the random numbers.
    """
    point, normal = (lanes[ln.P_X], lanes[ln.P_Y], lanes[ln.P_Z]), (lanes[ln.NS_X], lanes[ln.NS_Y], lanes[ln.NS_Z])
    for k in range(LANES):
        lanes[ln.U_REMAPPED + k] *= whole
        lanes[ln.GROUP_FOUND + k] = _ZERO
    for e in range(first, last):
        share = _share(emitters, e, point, normal)
        if share <= _ZERO:
            continue
        for k in range(LANES):
            if lanes[ln.GROUP_FOUND + k] == _ZERO:
                falls = lanes[ln.U_REMAPPED + k] < share
                sampled[k], lanes[ln.LIGHT_PDF + k] = e, share
                lanes[ln.GROUP_FOUND + k] = _ONE if falls else _ZERO
                lanes[ln.U_REMAPPED + k] -= _ZERO if falls else share
    for k in range(LANES):
        row, share = EMITTER_SIZE * sampled[k], lanes[ln.LIGHT_PDF + k]
        a = _offset(emitters, row + EMITTER_CORNER, point)
        b, c = _from(emitters, row + EMITTER_EDGE_1, a), _from(emitters, row + EMITTER_EDGE_2, a)
        way, steradians = _sample_solid_angle(a, b, c, clamp_unit(lanes[ln.U_REMAPPED + k] / share), lanes[ln.U_LIGHT_1 + k])
        shining = _vector(emitters, row + EMITTER_NORMAL)
        facing = dot(way, shining)
        reach = dot(a, shining) / facing if facing < _ZERO else _ZERO
        # The ray ends off the surface that shines.
        lift = lift_height(point[0] + reach * way[0], point[1] + reach * way[1], point[2] + reach * way[2])
        lanes[ln.TO_LIGHT_X + k] = reach * way[0] + lift * shining[0]
        lanes[ln.TO_LIGHT_Y + k] = reach * way[1] + lift * shining[1]
        lanes[ln.TO_LIGHT_Z + k] = reach * way[2] + lift * shining[2]
        arrives = (reach > _ZERO) & (dot(way, normal) > _ZERO) & (steradians > _ZERO)
        lanes[ln.LIGHT_PDF + k] = share / (whole * steradians) if arrives else _ZERO


@inlined
def _sample_solid_angle(a: Vector, b: Vector, c: Vector, u: np.float32, v: np.float32) -> tuple[Vector, np.float32]:
    """Return a unit direction into the triangle with these offsets from the point, and one over its density, steradians."""
    s, t = sample_triangle(u, v)
    even = (
        a[0] + s * (b[0] - a[0]) + t * (c[0] - a[0]),
        a[1] + s * (b[1] - a[1]) + t * (c[1] - a[1]),
        a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]),
    )
    volume = abs(dot(a, cross(b, c)))
    a, b, c = _unit(a), _unit(b), _unit(c)
    along = dot(a, b)
    triple = abs(dot(a, cross(b, c)))
    steradians = _TWO * np.float32(np.arctan2(triple, _ONE + along + dot(b, c) + dot(c, a)))
    if steradians < _EVEN_SR:
        # Area times cosine over squared distance, as half the volume over the cubed distance.
        squared = max(dot(even, even), _TINY)
        return _unit(even), np.float32(0.5) * volume / (squared * np.sqrt(squared))
    # The angle at a, and the sub-triangle of the wanted area, of which the third corner lies between a and c.
    n, m = cross(a, b), cross(a, c)
    scale = _ONE / max(np.sqrt(dot(n, n) * dot(m, m)), _TINY)
    cosine, sine = dot(n, m) * scale, triple * scale
    turn_x, turn_y = cos_sin_two_pi(clamp_unit(u * steradians * _PER_VIEW))
    p, q = turn_y * cosine - turn_x * sine, turn_x * cosine + turn_y * sine
    x, y = q - cosine, p + sine * along
    below = (y * p + x * q) * sine
    corner = _toward(a, c, min(max(((y * q - x * p) * cosine - y) / below, -_ONE), _ONE) if below != _ZERO else _ONE)
    return _toward(b, corner, _ONE - v * (_ONE - dot(corner, b))), steradians


@inlined
def _toward(begin: Vector, end: Vector, cosine: np.float32) -> Vector:
    """Return the unit vector at an angle of this cosine from ``begin``, turned towards ``end``."""
    along = dot(end, begin)
    aside = _unit((end[0] - along * begin[0], end[1] - along * begin[1], end[2] - along * begin[2]))
    sine = np.sqrt(max(_ONE - cosine * cosine, _ZERO))
    return cosine * begin[0] + sine * aside[0], cosine * begin[1] + sine * aside[1], cosine * begin[2] + sine * aside[2]


@inlined
def _unit(a: Vector) -> Vector:
    scale = _ONE / np.sqrt(max(dot(a, a), _TINY))
    return a[0] * scale, a[1] * scale, a[2] * scale


@inlined
def _vector(table: NDArray[np.float32], at: int) -> Vector:
    return table[at], table[at + 1], table[at + 2]


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
        low, high = dot(begin, normal), dot(end, normal)
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
    across = cross(begin, end)
    size = np.sqrt(dot(across, across))
    angle = np.arctan2(size, dot(begin, end))
    share: np.float32 = _PER_VIEW * np.float32(angle) * dot(across, normal) / max(size, _TINY)
    return share
