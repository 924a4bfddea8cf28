"""Places on rectangles that a lobe of GGX mirrors: which is nearest to the mirrored ray, and points that are chosen about it.

A place is how far along half a side it lies from the middle, in [-1, 1].
"""

import numpy as np

from renderer.core.kernel import inlined
from renderer.core.sampling import Vector, cross, dot

_TURN = np.float32(1.2)
"""By how much a slope turns what is mirrored, over its angle: twice in the plane of incidence, 2 cos theta across; in the mean of both."""
_ZERO, _HALF, _ONE, _TINY, _INFINITE = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-20), np.float32(np.inf)
_LEAST_SINE_SQUARED = np.float32(0.01)


@inlined
def mirrored_reach(middle: Vector, wo: Vector, first: Vector, second: Vector) -> np.float32:
    """Return how far along the mirrored ray a rectangle is: where the ray meets its plane, or before that passes beyond its rim.

    ``first``, ``second``: half its sides; all in the frame of the hit, where the mirrored direction is (-x, -y, z) of ``wo``.  A ray that
    goes away from a pane close beside it has most of that about its lobe where it passes the rim.
    """
    nx, ny, nz = cross(first, second)
    away, rate = dot(middle, (nx, ny, nz)), wo[2] * nz - wo[0] * nx - wo[1] * ny
    reach = away / (rate if abs(rate) > _TINY else _TINY)
    reach = min(min(reach if reach > _ZERO else _INFINITE, _rim_reach(middle, wo, first)), _rim_reach(middle, wo, second))
    return reach if reach < _INFINITE else _ZERO


@inlined
def _rim_reach(middle: Vector, wo: Vector, axis: Vector) -> np.float32:
    """Return where along the mirrored ray it passes beyond the end of a side; infinity if it never does, or has at its start."""
    start, rate = -dot(middle, axis), wo[2] * axis[2] - wo[0] * axis[0] - wo[1] * axis[1]
    squared = dot(axis, axis)
    left = (squared if rate > _ZERO else -squared) - start
    reach = left / (rate if abs(rate) > _TINY else _TINY)
    return reach if reach > _ZERO else _INFINITE


@inlined
def _place_at(middle: Vector, wo: Vector, reach: np.float32, axis: Vector) -> np.float32:
    """Return where the mirrored ray is at ``reach``, along half a side from the middle, in half sides."""
    aside = -reach * wo[0] - middle[0], -reach * wo[1] - middle[1], reach * wo[2] - middle[2]
    place: np.float32 = dot(aside, axis) / max(dot(axis, axis), _TINY)
    return place


@inlined
def nearest_place(middle: Vector, wo: Vector, reach: np.float32, axis: Vector) -> np.float32:
    """Return which place in [-1, 1] along half a side is nearest to the mirrored ray at ``reach``, of :func:`mirrored_reach`."""
    return min(max(_place_at(middle, wo, reach, axis), -_ONE), _ONE)


@inlined
def mirroring_span(
    middle: Vector, wo: Vector, reach: np.float32, axis: Vector, width_m: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """Return which place in [-1, 1] along half a side is nearest to the mirrored ray, and from where to where it is within a width of that.

    ``reach``: of :func:`mirrored_reach`.  Far from the ray a lobe changes slowly: half the way to it counts as width.
    """
    place, nearest = _place_at(middle, wo, reach, axis), nearest_place(middle, wo, reach, axis)
    width = width_m / np.sqrt(max(dot(axis, axis), _TINY)) + _HALF * abs(place - nearest)
    return nearest, max(nearest - width, -_ONE), min(nearest + width, _ONE)


@inlined
def choose_places(
    nearest: Vector, near_s: np.float32, near_t: np.float32, along: Vector, aside: Vector, width: np.float32, u: np.float32, v: np.float32
) -> tuple[np.float32, np.float32]:
    """Return places along both half sides, chosen by (u, v) as a lobe of a ``width``, radians, is spread about the point ``nearest``.

    ``near_s``, ``near_t``: the places of that point; all in the frame of the hit.
    """
    width_s_m, width_t_m = lobe_width_m(nearest, along, width), lobe_width_m(nearest, aside, width)
    s = place_near(near_s, along, width_s_m, u)
    return s, place_near(near_t, aside, width_t_m * _spread_aside(s - near_s, along, width_s_m), v)


@inlined
def places_density(
    nearest: Vector,
    near_s: np.float32,
    near_t: np.float32,
    along: Vector,
    aside: Vector,
    width: np.float32,
    s: np.float32,
    t: np.float32,
) -> np.float32:
    """Return the density of places (s, t) that are chosen by :func:`choose_places`."""
    width_s_m, width_t_m = lobe_width_m(nearest, along, width), lobe_width_m(nearest, aside, width)
    # Far out along one side slopes are as far apart along the other, so that none has a density that is much too small.
    width_t_m *= _spread_aside(s - near_s, along, width_s_m)
    return place_density(near_s, along, width_s_m, s) * place_density(near_t, aside, width_t_m, t)


@inlined
def lobe_width_m(point: Vector, axis: Vector, width: np.float32) -> np.float32:
    """Return over how many metres along an axis a lobe of a ``width``, radians, spreads about a point that is seen from 0."""
    squared, along = dot(point, point), dot(point, axis)
    sine_squared = _ONE - along * along / max(squared * dot(axis, axis), _TINY)
    width_m: np.float32 = width * np.sqrt(squared / max(sine_squared, _LEAST_SINE_SQUARED))
    return width_m


@inlined
def _spread_aside(away: np.float32, axis: Vector, width_m: np.float32) -> np.float32:
    """Return how many times as wide GGX's slopes are distributed across an axis so far along it, in half sides, as they are at its 0."""
    deviation = _TURN * width_m
    spread: np.float32 = np.sqrt(_ONE + away * away * dot(axis, axis) / max(deviation * deviation, _TINY))
    return spread


@inlined
def place_near(nearest: np.float32, axis: Vector, width_m: np.float32, u: np.float32) -> np.float32:
    """Return a place in [-1, 1] along half a side, chosen by u as GGX's slopes are distributed along one axis about the ``nearest``.

    ``width_m``: the width of GGX at the distance of the place.
    """
    deviation, a, b = _bounds(nearest, axis, width_m)
    g = a + u * (b - a)
    place: np.float32 = min(max(nearest + deviation * g / np.sqrt(max(_ONE - g * g, _TINY)), -_ONE), _ONE)
    return place


@inlined
def place_density(nearest: np.float32, axis: Vector, width_m: np.float32, place: np.float32) -> np.float32:
    """Return the density of a place that is chosen by :func:`place_near`."""
    deviation, a, b = _bounds(nearest, axis, width_m)
    away = place - nearest
    root = np.sqrt(deviation * deviation + away * away)
    density: np.float32 = deviation * deviation / ((b - a) * root * root * root)
    return density


@inlined
def _bounds(nearest: np.float32, axis: Vector, width_m: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """Return how far slopes spread along half a side, in half sides, and the sines of the angles to its ends, seen from so far away."""
    low, high, deviation = -_ONE - nearest, _ONE - nearest, _TURN * width_m / np.sqrt(max(dot(axis, axis), _TINY))
    return deviation, low / np.sqrt(deviation * deviation + low * low), high / np.sqrt(deviation * deviation + high * high)
