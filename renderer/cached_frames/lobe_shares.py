"""What a lobe of GGX mirrors of a disc, as a share of the slopes of its microfacets, or of a polygon, as a share of the lobe.

The slopes have the density alpha^2 / (pi (alpha^2 + m^2)^2) (Walter et al., "Microfacet Models for Refraction through Rough Surfaces",
2007).  What a lobe mirrors of something even is the share of the slopes that mirror a part of it, which has a closed form for discs.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.bsdf.microfacet import ggx_g1_root
from renderer.cached_frames import records as rec
from renderer.cached_frames.records import SHARP
from renderer.core import lanes as ln
from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES
from renderer.core.sampling import Vector, cross, dot

_ZERO, _HALF, _ONE, _TWO, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0), np.float32(1e-20)
_LEAN, _NARROWER, _WIDEST, _LEAST_HEIGHT = np.float32(0.4), np.float32(0.38), np.float32(1.33), np.float32(1e-3)
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
def quadrilateral_share(a: Vector, b: Vector, c: Vector, d: Vector) -> np.float32:
    """Return the share of the cosine lobe about z that a quadrilateral covers, seen from 0 (Lambert's formula), clipped at z = 0.

    A flat convex one that goes around z as x goes to y; without branches, as all lanes do the same.
    """
    first, second, third, fourth = _edge_above(a, b), _edge_above(b, c), _edge_above(c, d), _edge_above(d, a)
    # Where the horizon cuts it, an edge along that closes what is left.
    leaves, enters = _horizon_place(a, b, c, d), _horizon_place(d, c, b, a)
    share: np.float32 = first + second + third + fourth + _cosines_along(leaves, enters)
    return share if share > _ZERO else _ZERO


@inlined
def _edge_above(a: Vector, b: Vector) -> np.float32:
    """Return what the part of an edge above the horizon adds."""
    low, high = _above(a, b), _above(b, a)
    added = _cosines_along(low, high)
    return added if (a[2] > _ZERO) | (b[2] > _ZERO) else _ZERO


@inlined
def _above(a: Vector, b: Vector) -> Vector:
    """Return a, or where the edge from b to a meets the horizon, if a lies below that and b above."""
    return _crossing(a, b) if (a[2] < _ZERO) & (b[2] > _ZERO) else a


@inlined
def _crossing(a: Vector, b: Vector) -> Vector:
    """Return where the line through a and b, which lie on both sides of the horizon, meets it."""
    apart = a[2] - b[2]
    t = a[2] / (apart if abs(apart) > _TINY else _TINY)
    return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), _ZERO


@inlined
def _horizon_place(a: Vector, b: Vector, c: Vector, d: Vector) -> Vector:
    """Return where the outline a, b, c, d goes below the horizon; 0 if it does not."""
    place = _sinking(a, b, (_ZERO, _ZERO, _ZERO))
    return _sinking(d, a, _sinking(c, d, _sinking(b, c, place)))


@inlined
def _sinking(a: Vector, b: Vector, other: Vector) -> Vector:
    """Return where the edge from a to b goes below the horizon, or else the ``other`` place."""
    return _crossing(b, a) if (a[2] > _ZERO) & (b[2] <= _ZERO) else other


@inlined
def _cosines_along(a: Vector, b: Vector) -> np.float32:
    """Return what the edge from a to b of a polygon adds to the share of the cosine lobe about z that it covers.

    It is positive where the edge goes around z as x goes to y.
    """
    x, y, z = cross(a, b)
    squared = x * x + y * y + z * z
    length = np.sqrt(squared if squared > _TINY else _TINY)
    share: np.float32 = z / length * _PER_TURN * _angle(length, dot(a, b))
    return share


@inlined
def lobe_frame(wo: Vector, alpha: np.float32) -> tuple[Vector, Vector, Vector]:
    """Return the rows of the matrix that makes a cosine lobe about z of what GGX reflects to wo, in the frame of the hit.

    GGX's lobe is a linearly transformed cosine (Heitz, Dupuy, Hill and Neubelt, "Real-Time Polygonal-Light Shading with Linearly
    Transformed Cosines", 2016).  A slope m turns the mirrored direction by 2 m in the plane of incidence and by 2 m cos theta across it, so
    where alpha is small the lobe is as wide, about that direction.  Where it is not, the lobe leans to the normal and stays wide at
    grazing angles: the numbers are fitted to what GGX mirrors of windows, alpha up to
    0.36.
    """
    aside = wo[0] * wo[0] + wo[1] * wo[1]
    sine = np.sqrt(aside if aside > _TINY else _TINY)
    ux, uy, cosine = wo[0] / sine, wo[1] / sine, wo[2] if wo[2] > _LEAST_HEIGHT else _LEAST_HEIGHT
    ux, uy = ux if aside > _TINY else _ONE, uy if aside > _TINY else _ZERO
    lean = _LEAN * alpha * np.sqrt(alpha) * sine / cosine
    lean = lean / (_ONE + lean)
    scale = _ONE / np.sqrt(_ONE + lean * lean)
    along = _HALF * scale / (alpha * (_ONE - _NARROWER * alpha))
    least, square = (_WIDEST * alpha) * (_WIDEST * alpha), cosine * cosine
    across = _HALF / (alpha * np.sqrt(np.sqrt(square * square + least * least)))
    first = along * (ux * cosine + lean * wo[0]), along * (uy * cosine + lean * wo[1]), along * (sine - lean * wo[2])
    axis = scale * (lean * ux * cosine - wo[0]), scale * (lean * uy * cosine - wo[1]), scale * (lean * sine + wo[2])
    return first, (-across * uy, across * ux, _ZERO), axis


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
def ggx_reflected(facet: np.float32, cosine: np.float32, height: np.float32, alpha: np.float32) -> np.float32:
    """Return pi times what GGX reflects into a direction, times its cosine, a steradian, over the Fresnel term.

    ``facet``: cosine of the microfacets that mirror it; ``cosine``, ``height``: of the direction and of the view.
    """
    square = alpha * alpha
    wide = _ONE + (square - _ONE) * facet * facet
    masked = cosine * ggx_g1_root(height, alpha) + height * ggx_g1_root(cosine, alpha)
    value: np.float32 = _HALF * square * cosine / (wide * wide * masked)
    return value if cosine > _ZERO else _ZERO


@inlined
def to_local(v: Vector, k: int, lanes: NDArray[np.float32]) -> Vector:
    """Return a vector of the world in the frame of lane k's hit."""
    return (
        v[0] * lanes[ln.TANGENT_X + k] + v[1] * lanes[ln.TANGENT_Y + k] + v[2] * lanes[ln.TANGENT_Z + k],
        v[0] * lanes[ln.BITANGENT_X + k] + v[1] * lanes[ln.BITANGENT_Y + k] + v[2] * lanes[ln.BITANGENT_Z + k],
        v[0] * lanes[ln.NS_X + k] + v[1] * lanes[ln.NS_Y + k] + v[2] * lanes[ln.NS_Z + k],
    )


@inlined
def to_world(v: Vector, k: int, lanes: NDArray[np.float32]) -> Vector:
    """Return a vector of the frame of lane k's hit in the world."""
    return (
        v[0] * lanes[ln.TANGENT_X + k] + v[1] * lanes[ln.BITANGENT_X + k] + v[2] * lanes[ln.NS_X + k],
        v[0] * lanes[ln.TANGENT_Y + k] + v[1] * lanes[ln.BITANGENT_Y + k] + v[2] * lanes[ln.NS_Y + k],
        v[0] * lanes[ln.TANGENT_Z + k] + v[1] * lanes[ln.BITANGENT_Z + k] + v[2] * lanes[ln.NS_Z + k],
    )


@inlined
def in_frame(v: Vector, frame: int, k: int, gloss: NDArray[np.float32]) -> Vector:
    """Return a vector of the world where lane k's lobe is a cosine lobe about z."""
    return (
        gloss[frame + k] * v[0] + gloss[frame + LANES + k] * v[1] + gloss[frame + 2 * LANES + k] * v[2],
        gloss[frame + 3 * LANES + k] * v[0] + gloss[frame + 4 * LANES + k] * v[1] + gloss[frame + 5 * LANES + k] * v[2],
        gloss[frame + 6 * LANES + k] * v[0] + gloss[frame + 7 * LANES + k] * v[1] + gloss[frame + 8 * LANES + k] * v[2],
    )


@inlined
def row_length(row: int, k: int, gloss: NDArray[np.float32]) -> np.float32:
    """Return the length of a row of lane k's matrix that begins in field ``row``."""
    x, y, z = gloss[row + k], gloss[row + LANES + k], gloss[row + 2 * LANES + k]
    length: np.float32 = np.sqrt(x * x + y * y + z * z)
    return length


@inlined
def build_frames(lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> bool:
    """Fill OVER_FRAME, and UNDER_FRAME if a lane that asks has a lobe under its coat; return whether any has."""
    coated = False
    for k in range(LANES):
        coated |= (gloss[rec.ASKS + k] > _ZERO) & (gloss[rec.LOBE_UNDER_ALPHA + k] < _ONE)
    _build_frame(rec.LOBE_ALPHA, rec.OVER_FRAME, lanes, gloss)
    if coated:
        _build_frame(rec.LOBE_UNDER_ALPHA, rec.UNDER_FRAME, lanes, gloss)
    return coated


@inlined
def _build_frame(width: int, frame: int, lanes: NDArray[np.float32], gloss: NDArray[np.float32]) -> None:
    """Fill a frame for lobes whose widths are in field ``width``."""
    for k in range(LANES):
        alpha, wo = gloss[width + k], (lanes[ln.WO_X + k], lanes[ln.WO_Y + k], lanes[ln.WO_Z + k])
        rows = lobe_frame(wo, alpha if alpha > SHARP else SHARP)
        for row in range(3):
            x, y, z = to_world(rows[row], k, lanes)
            at = frame + 3 * row * LANES + k
            gloss[at], gloss[at + LANES], gloss[at + 2 * LANES] = x, y, z
