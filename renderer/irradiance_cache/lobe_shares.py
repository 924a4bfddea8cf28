"""What a lobe of GGX mirrors of a disc or a rectangle, as a share of the slopes of its microfacets.

The slopes have the density alpha^2 / (pi (alpha^2 + m^2)^2) (Walter et al., "Microfacet Models for Refraction through Rough Surfaces",
2007).  What a lobe mirrors of something even is the share of the slopes that mirror a part of it, which has a closed form for discs and for
polygons of slopes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import ggx_g1_root
from renderer.core import lanes as ln
from renderer.core.kernel import inlined
from renderer.core.sampling import Vector

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_LEAST_COSINE = np.float32(0.05)
_TAN_EIGHTH, _PER_TURN = np.float32(np.sqrt(2.0) - 1.0), np.float32(0.5 / np.pi)
_TURN_8, _TURN_4, _TURN_2 = np.float32(np.pi / 4.0), np.float32(np.pi / 2.0), np.float32(np.pi)


@inlined
def slopes_in_disc(facet: np.float32, half: np.float32, alpha: np.float32, spread: np.float32) -> np.float32:
    """Return the share of GGX's slopes that mirror some of a ball.

    ``facet``: cosine of the microfacets that mirror the ball's centre; ``half``: that of the view to them; ``spread``: the ball's solid
    angle over pi.  By stereographic projection the density of slopes is the uniform one of a sphere, so a disc of slopes has the share of a
    spherical cap.
    """
    square, inverse = alpha * alpha, _ONE / facet
    radius = spread * inverse * inverse * inverse * np.float32(0.25) / half
    away = (inverse * inverse - _ONE) + square - radius
    root = np.sqrt(away * away + np.float32(4.0) * square * radius)
    share: np.float32 = _TWO * square * radius / (root * (root + away)) if away > _ZERO else _HALF * (root - away) / root
    return share


@inlined
def slopes_along(x0: np.float32, y0: np.float32, x1: np.float32, y1: np.float32, alpha: np.float32) -> np.float32:
    """Return the share of GGX's slopes in the triangle of 0 and the edge from one slope to another, negative if it turns clockwise.

    With d the edge's distance from 0, s its places on its line and r^2 = alpha^2 + d^2, the integral of the density is
    d / r (atan(s1 / r) - atan(s0 / r)) / 2 pi; over all edges of a polygon these add up to its share.
    """
    x, y = x1 - x0, y1 - y0
    squared = x * x + y * y
    length = np.sqrt(squared if squared > _TINY else _TINY)
    scale = _ONE / length
    d, s0, s1 = (x0 * y1 - y0 * x1) * scale, (x0 * x + y0 * y) * scale, (x1 * x + y1 * y) * scale
    r = np.sqrt(alpha * alpha + d * d)
    share: np.float32 = d / r * _PER_TURN * _angle(r * length, r * r + s0 * s1)
    return share


@inlined
def _angle(y: np.float32, x: np.float32) -> np.float32:
    """Return the angle from the x axis to (x, y), y > 0, radians, to 1e-7 (Moshier, Cephes, atanf), without branches."""
    across = x if x > _ZERO else -x
    least, most = (y, across) if y < across else (across, y)
    aslant = least > _TAN_EIGHTH * most
    top, bottom = (least - most, least + most) if aslant else (least, most)
    z = top / bottom
    q = z * z
    near = (
        ((np.float32(8.05374449538e-2) * q - np.float32(1.38776856032e-1)) * q + np.float32(1.99777106478e-1)) * q
        - np.float32(3.33329491539e-1)
    ) * q * z + z
    near = near + _TURN_8 if aslant else near
    near = _TURN_4 - near if y >= across else near
    return near if x > _ZERO else _TURN_2 - near


@inlined
def mirrored_share(
    share: np.float32, facet: np.float32, half: np.float32, cosine: np.float32, height: np.float32, alpha: np.float32
) -> np.float32:
    """Return what GGX reflects of even light that a share of its slopes mirrors, over its luminance and the Fresnel term.

    ``facet``: cosine of these microfacets; ``half``: that of the view to them; ``cosine``, ``height``: of the directions to the light and
    of the view.
    """
    value: np.float32 = _TWO * share * half * cosine / facet
    return value / (cosine * ggx_g1_root(height, alpha) + height * ggx_g1_root(cosine, alpha))


@inlined
def mirroring_slopes(to: Vector, wo: Vector) -> tuple[np.float32, np.float32]:
    """Return the slopes of the microfacets that mirror a point; one below the surface is lifted into its plane."""
    z = to[2] if to[2] > _ZERO else _ZERO
    squared = to[0] * to[0] + to[1] * to[1] + z * z
    scale = _ONE / np.sqrt(squared if squared > _TINY else _TINY)
    up = wo[2] + z * scale
    steep = _ONE / (up if up > _LEAST_COSINE else _LEAST_COSINE)
    return (wo[0] + to[0] * scale) * steep, (wo[1] + to[1] * scale) * steep


@inlined
def on_rim(corner: int, parts: int) -> tuple[np.float32, np.float32]:
    """Return where on the rim of a square, -1 to 1 each way, a corner of it lies whose sides have so many parts."""
    side, along = (corner // parts) % 4, _TWO * np.float32(corner % parts) / np.float32(parts) - _ONE
    if side == 0:
        return along, -_ONE
    if side == 1:
        return _ONE, along
    return (-along, _ONE) if side == 2 else (-_ONE, -along)


@inlined
def to_local(v: Vector, k: int, lanes: NDArray[np.float32]) -> Vector:
    """Return a vector of the world in the frame of lane k's hit."""
    return (
        v[0] * lanes[ln.TANGENT_X + k] + v[1] * lanes[ln.TANGENT_Y + k] + v[2] * lanes[ln.TANGENT_Z + k],
        v[0] * lanes[ln.BITANGENT_X + k] + v[1] * lanes[ln.BITANGENT_Y + k] + v[2] * lanes[ln.BITANGENT_Z + k],
        v[0] * lanes[ln.NS_X + k] + v[1] * lanes[ln.NS_Y + k] + v[2] * lanes[ln.NS_Z + k],
    )


@inlined
def _nearest_place(middle: Vector, wo: Vector, axis: Vector) -> np.float32:
    """Return which place along half a side, at a middle, is nearest to the mirrored ray, in half sides; all in the frame of the hit."""
    # The mirrored direction is (-x, -y, z).
    along = middle[2] * wo[2] - middle[0] * wo[0] - middle[1] * wo[1]
    aside = -along * wo[0] - middle[0], -along * wo[1] - middle[1], along * wo[2] - middle[2]
    squared = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]
    place: np.float32 = (aside[0] * axis[0] + aside[1] * axis[1] + aside[2] * axis[2]) / (squared if squared > _TINY else _TINY)
    return place


@inlined
def mirroring_span(middle: Vector, wo: Vector, axis: Vector, width_m: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """Return which place in [-1, 1] along half a side is nearest to the mirrored ray, and from where to where it is within a width of that.

    Far from the ray a lobe changes slowly: half the way to it counts as width.  All in the frame of the hit.
    """
    place = _nearest_place(middle, wo, axis)
    nearest = min(max(place, -_ONE), _ONE)
    squared = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]
    width = width_m / np.sqrt(max(squared, _TINY)) + _HALF * abs(place - nearest)
    return nearest, max(nearest - width, -_ONE), min(nearest + width, _ONE)


@inlined
def view_direction(k: int, lanes: NDArray[np.float32]) -> Vector:
    """Return the unit direction from the hit of lane k to the eye, world."""
    a, b, c = lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k]
    return (
        a * lanes[ln.TANGENT_X + k] + b * lanes[ln.BITANGENT_X + k] + c * lanes[ln.NS_X + k],
        a * lanes[ln.TANGENT_Y + k] + b * lanes[ln.BITANGENT_Y + k] + c * lanes[ln.NS_Y + k],
        a * lanes[ln.TANGENT_Z + k] + b * lanes[ln.BITANGENT_Z + k] + c * lanes[ln.NS_Z + k],
    )
