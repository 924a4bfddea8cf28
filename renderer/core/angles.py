"""Inverse trigonometric functions by polynomials, so that loops over lanes become vector code; the same on every processor.

The arctangent is 4.4.49 of Abramowitz and Stegun, Handbook of Mathematical Functions (1964), with an error of at most 2e-8 before rounding.
"""

from __future__ import annotations

import numpy as np

from renderer.core.kernel import inlined

_ZERO, _ONE, _TINY = np.float32(0.0), np.float32(1.0), np.float32(1e-30)
_PI, _HALF_PI = np.float32(np.pi), np.float32(0.5 * np.pi)
_A2, _A4, _A6, _A8 = np.float32(-0.3333314528), np.float32(0.1999355085), np.float32(-0.1420889944), np.float32(0.1065626393)
_A10, _A12, _A14, _A16 = np.float32(-0.0752896400), np.float32(0.0429096138), np.float32(-0.0161657367), np.float32(0.0028662257)


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
