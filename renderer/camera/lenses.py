"""Lens models: where a direction falls on the image plane, and back.

All functions work on normalised image coordinates (pixels less the principal point, over the focal length) and on directions of the optical
frame (x right, y down, z forward), float64, (n, 2) and (n, 3).  Coefficients are those of ROS's CameraInfo D, in its order.

- ``pinhole``: x / z, y / z
- ``brown_conrady`` ("plumb_bob"): k1, k2, p1, p2, k3 (D. C. Brown, "Decentering Distortion of Lenses", 1966; formula as in OpenCV)
- ``rational`` ("rational_polynomial"): k1, k2, p1, p2, k3, k4, k5, k6
- ``kannala_brandt`` ("equidistant"): k1 to k4 on odd powers of the angle (Kannala and Brandt, "A Generic Camera Model and Calibration
  Method for Conventional, Wide-Angle, and Fish-Eye Lenses", 2006); all zero: the ideal equidistant fisheye
- ``equirectangular``: azimuth and elevation, in radians; the panorama
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from renderer.core.arrays import Array

_STEPS = 60
_CLOSE = 1e-10


class Lens(NamedTuple):
    """A lens model.

    project: (directions (n, 3), coefficients) -> normalised coordinates (n, 2), NaN where the lens sees nothing.  bearing: (coordinates
    (n, 2), coefficients) -> directions (n, 3), NaN where no direction maps there.  coefficients: how many there are.  ros_name: the
    distortion_model of CameraInfo.  planar: directions come with z = 1 (a field of view below 180 degrees), else with unit length.
    """

    project: Callable[[Array, Sequence[float]], Array]
    bearing: Callable[[Array, Sequence[float]], Array]
    coefficients: int
    ros_name: str
    planar: bool


def _on_plane(directions: Array) -> Array:
    ahead = np.where(directions[:, 2] > 0.0, directions[:, 2], np.nan)
    return directions[:, :2] / ahead[:, None]


def _project_pinhole(directions: Array, coefficients: Sequence[float]) -> Array:
    del coefficients
    return _on_plane(directions)


def _bear_pinhole(points: Array, coefficients: Sequence[float]) -> Array:
    del coefficients
    return np.column_stack([points, np.ones(len(points))])


def _polynomial(coefficients: Sequence[float], squared: Array) -> tuple[Array, Array]:
    """Return sum of c_i s^i (c_0 = 1) over the squared radius s, and its derivative."""
    value, slope, power = np.ones_like(squared), np.zeros_like(squared), np.ones_like(squared)
    for i, coefficient in enumerate(coefficients, start=1):
        slope = slope + i * coefficient * power
        power = power * squared
        value = value + coefficient * power
    return value, slope


def _distort(points: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
    """Return the distorted points (n, 2) and the derivative (n, 2, 2) of the radial and tangential model."""
    k1, k2, p1, p2, k3, k4, k5, k6 = (*coefficients, *(0.0,) * (8 - len(coefficients)))
    x, y = points[:, 0], points[:, 1]
    squared = x * x + y * y
    above, above_slope = _polynomial((k1, k2, k3), squared)
    below, below_slope = _polynomial((k4, k5, k6), squared)
    radial = above / below
    slope = 2.0 * (above_slope * below - above * below_slope) / (below * below)
    moved = np.column_stack(
        [x * radial + 2.0 * p1 * x * y + p2 * (squared + 2.0 * x * x), y * radial + p1 * (squared + 2.0 * y * y) + 2.0 * p2 * x * y]
    )
    cross = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    derivative = np.empty((len(points), 2, 2))
    derivative[:, 0, 0] = radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    derivative[:, 0, 1] = derivative[:, 1, 0] = cross
    derivative[:, 1, 1] = radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    return moved, derivative


def _project_distorted(directions: Array, coefficients: Sequence[float]) -> Array:
    return _distort(_on_plane(directions), coefficients)[0]


def _bear_distorted(points: Array, coefficients: Sequence[float]) -> Array:
    """Undo the distortion by Newton's method along a path from the centre, so that the branch that holds the centre is found."""
    plain = np.zeros_like(points)
    for share in np.linspace(0.1, 1.0, 10):
        for _ in range(_STEPS // 10):
            moved, derivative = _distort(plain, coefficients)
            determinant = derivative[:, 0, 0] * derivative[:, 1, 1] - derivative[:, 0, 1] ** 2
            off = share * points - moved
            safe = np.where(determinant > 0.0, determinant, np.nan)
            step_x = (derivative[:, 1, 1] * off[:, 0] - derivative[:, 0, 1] * off[:, 1]) / safe
            step_y = (derivative[:, 0, 0] * off[:, 1] - derivative[:, 0, 1] * off[:, 0]) / safe
            plain = plain + np.column_stack([step_x, step_y])
    moved, derivative = _distort(plain, coefficients)
    determinant = derivative[:, 0, 0] * derivative[:, 1, 1] - derivative[:, 0, 1] ** 2
    good = (np.abs(moved - points).max(axis=1) < _CLOSE * (1.0 + np.abs(points).max(axis=1))) & (determinant > 0.0)
    return np.where(good[:, None], _bear_pinhole(plain, ()), np.nan)


def _bent(angle: Array, coefficients: Sequence[float]) -> tuple[Array, Array]:
    """Return the image radius of an angle to the axis, and its derivative."""
    value, slope = _polynomial(coefficients, angle * angle)
    return angle * value, value + 2.0 * angle * angle * slope


def _project_fisheye(directions: Array, coefficients: Sequence[float]) -> Array:
    aside = np.hypot(directions[:, 0], directions[:, 1])
    radius, _ = _bent(el.arctan2(aside, directions[:, 2]), coefficients)
    scale = np.where(aside > 0.0, radius / np.maximum(aside, 1e-300), 1.0 / np.maximum(directions[:, 2], 1e-300))
    return directions[:, :2] * scale[:, None]


def _bear_fisheye(points: Array, coefficients: Sequence[float]) -> Array:
    radius = np.hypot(points[:, 0], points[:, 1])
    angle = np.zeros_like(radius)
    for share in np.linspace(0.1, 1.0, 10):
        for _ in range(_STEPS // 10):
            bent, slope = _bent(angle, coefficients)
            angle = angle + (share * radius - bent) / np.where(slope > 0.0, slope, np.nan)
    bent, slope = _bent(angle, coefficients)
    good = (np.abs(bent - radius) < _CLOSE * (1.0 + radius)) & (slope > 0.0) & (angle >= 0.0) & (angle <= math.pi)
    aside = el.sin(angle) / np.maximum(radius, 1e-300)
    directions = np.column_stack([points * np.where(radius > 0.0, aside, 0.0)[:, None], el.cos(angle)])
    return np.where(good[:, None], directions, np.nan)


def _project_panorama(directions: Array, coefficients: Sequence[float]) -> Array:
    del coefficients
    x, y, z = directions.T
    return np.column_stack([el.arctan2(x, z), el.arctan2(y, np.hypot(x, z))])


def _bear_panorama(points: Array, coefficients: Sequence[float]) -> Array:
    del coefficients
    azimuth, down = points.T
    level = el.cos(down)
    return np.column_stack([level * el.sin(azimuth), el.sin(down), level * el.cos(azimuth)])


LENSES: dict[str, Lens] = {
    "pinhole": Lens(_project_pinhole, _bear_pinhole, 0, "plumb_bob", True),
    "brown_conrady": Lens(_project_distorted, _bear_distorted, 5, "plumb_bob", True),
    "rational": Lens(_project_distorted, _bear_distorted, 8, "rational_polynomial", True),
    "kannala_brandt": Lens(_project_fisheye, _bear_fisheye, 4, "equidistant", False),
    "equirectangular": Lens(_project_panorama, _bear_panorama, 0, "equirectangular", False),
}
"""Name -> lens model."""
