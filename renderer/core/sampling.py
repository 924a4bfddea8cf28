"""Local frames, and warping of uniform random numbers to directions."""

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import inlined
from renderer.core.ray_packet import LANES

_ZERO, _HALF, _ONE, _TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_THREE, _FOUR, _QUARTER_PI = np.float32(3.0), np.float32(4.0), np.float32(0.25 * np.pi)
_SIN_3, _SIN_5, _SIN_7 = np.float32(-1.0 / 6.0), np.float32(1.0 / 120.0), np.float32(-1.0 / 5040.0)
_COS_4, _COS_6, _COS_8 = np.float32(1.0 / 24.0), np.float32(-1.0 / 720.0), np.float32(1.0 / 40320.0)

_BELOW_ONE = np.float32(0.99999994)
_ATAN_1, _ATAN_3, _ATAN_5, _ATAN_7, _ATAN_9, _ATAN_11 = (
    np.float32(c) for c in (1.27321054, -0.423508533, 0.24642323, -0.14823873, 0.0670326175, -0.0149212404)
)

Vector = tuple[np.float32, np.float32, np.float32]


@inlined
def dot(a: Vector, b: Vector) -> np.float32:
    """Return the dot product."""
    product: np.float32 = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def cos_sin_two_pi(u: np.float32) -> tuple[np.float32, np.float32]:
    """Return cosine and sine of the angle 2 pi u, by polynomials over an eighth of a turn; u in [0, 1)."""
    # Reduce to an eighth of a turn on either side of the nearest quarter.
    eighths = _FOUR * u
    quarter = np.floor(eighths + _HALF)
    angle = (eighths - quarter) * (_TWO * _QUARTER_PI)
    q = angle * angle
    cosine = _ONE + q * (-_HALF + q * (_COS_4 + q * (_COS_6 + q * _COS_8)))
    sine = angle * (_ONE + q * (_SIN_3 + q * (_SIN_5 + q * _SIN_7)))
    # Turn back by that quarter.
    first, second, third = quarter == _ONE, quarter == _TWO, quarter == _THREE
    a = sine if first | third else cosine
    b = cosine if first | third else sine
    return -a if first | second else a, -b if second | third else b


@inlined
def sample_cosine_hemisphere(u: np.float32, v: np.float32) -> Vector:
    """Return a direction of the upper hemisphere with density cosine / pi (concentric map of Shirley and Chiu, 1997)."""
    a, b = _TWO * u - _ONE, _TWO * v - _ONE
    steep = abs(b) > abs(a)
    radius, other = b if steep else a, a if steep else b
    angle = _QUARTER_PI * other / (radius if radius != _ZERO else _ONE)
    q = angle * angle
    cosine = _ONE + q * (-_HALF + q * (_COS_4 + q * (_COS_6 + q * _COS_8)))
    sine = angle * (_ONE + q * (_SIN_3 + q * (_SIN_5 + q * _SIN_7)))
    x, y = radius * (sine if steep else cosine), radius * (cosine if steep else sine)
    z = _ONE - x * x - y * y
    return x, y, np.sqrt(z if z > _ZERO else _ZERO)


@inlined
def invert_cosine_hemisphere(x: np.float32, y: np.float32) -> tuple[np.float32, np.float32]:
    """Return (u, v) in [0, 1) from which :func:`sample_cosine_hemisphere` makes (x, y, .), to some 1e-6."""
    radius = np.sqrt(x * x + y * y)
    steep = abs(y) > abs(x)
    long, short = y if steep else x, x if steep else y
    ratio = short / (long if long != _ZERO else _ONE)
    q = ratio * ratio
    # The arc tangent within [-1, 1], over a quarter of pi (minimax polynomial).
    angle = ratio * (_ATAN_1 + q * (_ATAN_3 + q * (_ATAN_5 + q * (_ATAN_7 + q * (_ATAN_9 + q * _ATAN_11)))))
    a = radius if long >= _ZERO else -radius
    b = a * angle
    u, v = _HALF + _HALF * (b if steep else a), _HALF + _HALF * (a if steep else b)
    u, v = u if u > _ZERO else _ZERO, v if v > _ZERO else _ZERO
    return u if u < _BELOW_ONE else _BELOW_ONE, v if v < _BELOW_ONE else _BELOW_ONE


@inlined
def coordinate_system(
    nx: np.float32, ny: np.float32, nz: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]:
    """Return two unit vectors that make a right-handed basis with a unit vector.

    After Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    """
    sign = _ONE if nz >= _ZERO else -_ONE
    p = -_ONE / (sign + nz)
    r = nx * ny * p
    return _ONE + sign * nx * nx * p, sign * r, -sign * nx, r, sign + ny * ny * p, -ny


def even_points(count: int) -> NDArray[np.float32]:
    """Return ``count`` points of the unit square, (count, 2) float32, spread evenly: blocks of 16 lie close together.

    Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences" (2018).
    """
    steps = np.arange(1, count + 1)[:, None] * np.array([0.7548776662466927, 0.5698402909980532])
    points = steps % 1.0
    blocks = max(count // LANES, 1)
    rows = max(1, int(np.sqrt(blocks)))
    order = np.lexsort((points[:, 1], (points[:, 0] * rows).astype(int)))
    return np.ascontiguousarray(points[order], np.float32)
