"""Equirectangular maps of the whole sphere: zenith in the first row, +x in the middle column, columns clockwise as seen from above.

Angles go by polynomials, so that loops over lanes become vector code, the same on every processor: the arctangent is 4.4.49 of Abramowitz
and Stegun, Handbook of Mathematical Functions (1964), with an error of at most 2e-8 before rounding.
"""

import math

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.core.arrays import Array
from renderer.core.color import Rgb
from renderer.core.kernel import inlined

_ZERO, _HALF, _ONE, _TINY = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(1e-30)
_PI, _HALF_PI, _TURN = np.float32(np.pi), np.float32(0.5 * np.pi), np.float32(2.0 * np.pi)
_BELOW_ONE = np.float32(0.9999999)
_A2, _A4, _A6, _A8 = np.float32(-0.3333314528), np.float32(0.1999355085), np.float32(-0.1420889944), np.float32(0.1065626393)
_A10, _A12, _A14, _A16 = np.float32(-0.0752896400), np.float32(0.0429096138), np.float32(-0.0161657367), np.float32(0.0028662257)


def pixel_solid_angles(height: int, width: int) -> NDArray[np.float64]:
    """Return the solid angle in steradian of the pixels of each row (height,) of an equirectangular map."""
    edges = el.sin(np.linspace(0.5 * np.pi, -0.5 * np.pi, height + 1))
    return np.asarray((edges[:-1] - edges[1:]) * (2.0 * np.pi / width))


def map_directions(height: int, width: int) -> Array:
    """Return the unit directions (height, width, 3) of the pixels of an equirectangular map: zenith above, +x in the middle, clockwise."""
    elevation = math.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    yaw = math.pi - 2.0 * math.pi * (np.arange(width) + 0.5) / width
    level = el.cos(elevation)
    return np.stack(np.broadcast_arrays(level * el.cos(yaw), level * el.sin(yaw), el.sin(elevation)), axis=-1)


@inlined
def arctan2(y: np.float32, x: np.float32) -> np.float32:
    """Return the angle of (x, y) from the x axis, in [-pi, pi]; 0 for (0, 0)."""
    across, along = abs(x), abs(y)
    steep = along > across
    least, most = across if steep else along, along if steep else across
    ratio = least / (most if most > _TINY else _TINY)
    q = ratio * ratio
    series = _A8 + q * (_A10 + q * (_A12 + q * (_A14 + q * _A16)))
    angle = ratio * (_ONE + q * (_A2 + q * (_A4 + q * (_A6 + q * series))))
    angle = _HALF_PI - angle if steep else angle
    angle = _PI - angle if x < _ZERO else angle
    return -angle if y < _ZERO else angle


@inlined
def arcsin(sine: np.float32) -> np.float32:
    """Return the angle in [-pi/2, pi/2] of a sine in [-1, 1]."""
    square = _ONE - sine * sine
    return arctan2(sine, np.sqrt(square if square > _ZERO else _ZERO))


@inlined
def bilinear_map(table: NDArray[np.float32], x: np.float32, y: np.float32, z: np.float32) -> Rgb:
    """Return what an equirectangular map (h, w, 3) has towards a unit direction, between its pixels."""
    height, width = np.int32(table.shape[0]), np.int32(table.shape[1])
    across, down = map_position(x, y, z, height, width)
    across, down = across - _HALF, down - _HALF
    down = down if down > _ZERO else _ZERO
    column = np.floor(across)
    j, i = np.int32(column), np.int32(down)
    i = i if i < height else height - np.int32(1)
    s, t = across - column, down - np.float32(i)
    below = i + np.int32(1) if i + 1 < height else i
    left = j + width if j < 0 else j
    right = np.int32(0) if left + 1 >= width else left + np.int32(1)
    r = _blend(table[i, left, 0], table[i, right, 0], table[below, left, 0], table[below, right, 0], s, t)
    g = _blend(table[i, left, 1], table[i, right, 1], table[below, left, 1], table[below, right, 1], s, t)
    b = _blend(table[i, left, 2], table[i, right, 2], table[below, left, 2], table[below, right, 2], s, t)
    return r, g, b


@inlined
def _blend(a: np.float32, b: np.float32, c: np.float32, d: np.float32, s: np.float32, t: np.float32) -> np.float32:
    upper: np.float32 = a + s * (b - a)
    lower: np.float32 = c + s * (d - c)
    return upper + t * (lower - upper)


@inlined
def map_position(x: np.float32, y: np.float32, z: np.float32, height: np.int32, width: np.int32) -> tuple[np.float32, np.float32]:
    """Return column and row, in [0, width) and [0, height), of a direction in an equirectangular map; its middle column looks along +x."""
    wide, high = np.float32(width), np.float32(height)
    across = (_PI - arctan2(y, x)) / _TURN * wide
    down = (_HALF - arcsin(z) / _PI) * high
    across = across if across > _ZERO else _ZERO
    down = down if down > _ZERO else _ZERO
    return across if across < wide else wide * _BELOW_ONE, down if down < high else high
