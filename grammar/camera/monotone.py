"""Monotone cubic interpolation (PCHIP), without what importing scipy.interpolate loads: as long as the rest of scipy that rooms need."""

from __future__ import annotations

import numpy as np

from grammar.geometry.arrays import Floats


def interpolate_monotonically(keys: Floats, values: Floats, at: Floats) -> Floats:
    """Return a smooth curve through points that rises and falls only where they do.

    Args:
        keys: (k,) where the points are, rising, two and more.
        values: (k,) what they are.
        at: (n,) where the curve is asked for, within the keys.

    Returns:
        (n,) the cubic Hermite curve with the slopes of F. N. Fritsch and J. Butland, "A Method for Constructing Local Monotone Piecewise
        Cubic Interpolants", SIAM J. Sci. Stat. Comput. 5 (1984); the same bits as scipy's ``PchipInterpolator``.
    """
    steps = np.diff(keys)
    slopes = np.diff(values) / steps
    tangents = _tangents(steps, slopes)
    third = (tangents[:-1] + tangents[1:] - 2.0 * slopes) / steps
    coefficients = (values[:-1], tangents[:-1], (slopes - tangents[:-1]) / steps - third, third / steps)
    piece = np.clip(np.searchsorted(keys, at, side="right") - 1, 0, len(steps) - 1)
    along = at - keys[piece]
    result, power = np.zeros(len(at)), np.ones(len(at))
    for coefficient in coefficients:
        result = result + coefficient[piece] * power
        power = power * along
    return result


def _tangents(steps: Floats, slopes: Floats) -> Floats:
    """Return the curve's slope at each key: 0 where it turns, else the weighted harmonic mean of the slopes on both sides."""
    if len(slopes) == 1:
        return np.repeat(slopes, 2)
    tangents = np.zeros(len(slopes) + 1)
    goes_on = np.sign(slopes[1:]) * np.sign(slopes[:-1]) > 0.0
    before, after, left, right = (each[goes_on] for each in (steps[:-1], steps[1:], slopes[:-1], slopes[1:]))
    weight_left, weight_right = 2.0 * after + before, after + 2.0 * before
    tangents[1:-1][goes_on] = 1.0 / ((weight_left / left + weight_right / right) / (weight_left + weight_right))
    tangents[0] = _end_tangent(steps[0], steps[1], slopes[0], slopes[1])
    tangents[-1] = _end_tangent(steps[-1], steps[-2], slopes[-1], slopes[-2])
    return tangents


def _end_tangent(step: float, next_step: float, slope: float, next_slope: float) -> float:
    """Return the slope at an end: of the parabola through three points, as far as the curve stays monotone."""
    tangent = ((2.0 * step + next_step) * slope - step * next_slope) / (step + next_step)
    if np.sign(tangent) != np.sign(slope):
        return 0.0
    if np.sign(slope) != np.sign(next_slope) and abs(tangent) > 3.0 * abs(slope):
        return 3.0 * slope
    return tangent
