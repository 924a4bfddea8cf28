"""Pixels and directions by what CameraInfo says (sensor_msgs/CameraInfo; REP 104; the formulas as in OpenCV's documentation)."""

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.dataset.camera import Camera

Floats = NDArray[np.float64]

PLANE = ("plumb_bob", "rational_polynomial")
MODELS = (*PLANE, "equidistant")
_ROUNDS = 200


def directions(camera: Camera, pixels: Floats) -> Floats:
    """Return unit directions (n, 3) in the optical frame of pixels (n, 2), column and row with whole numbers at centres."""
    aim = (pixels - camera.K[:2, 2]) / np.diag(camera.K)[:2]
    if camera.model == "equidistant":
        off = np.linalg.norm(aim, axis=1)
        angle = off.copy()
        for _ in range(_ROUNDS):
            angle = angle - (_bent(camera, angle) - off) * 0.5
        side = aim / np.maximum(off, 1e-12)[:, None]
        return np.column_stack([np.sin(angle)[:, None] * side, np.cos(angle)])
    plain = aim.copy()
    for _ in range(_ROUNDS if np.any(camera.D) else 0):
        plain = plain - 0.5 * (_distorted(camera, plain) - aim)
    rays = np.column_stack([plain, np.ones(len(plain))])
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def pixels(camera: Camera, points: Floats) -> Floats:
    """Return pixels (n, 2) of points (n, 3) in the optical frame; NaN for what lies behind a plane camera."""
    if camera.model == "equidistant":
        aside = np.linalg.norm(points[:, :2], axis=1)
        bent = _bent(camera, np.arctan2(aside, points[:, 2]))
        plane = points[:, :2] * (bent / np.maximum(aside, 1e-12))[:, None]
    else:
        plane = _distorted(camera, points[:, :2] / np.where(points[:, 2] > 0.0, points[:, 2], np.nan)[:, None])
    return np.asarray(plane * np.diag(camera.K)[:2] + camera.K[:2, 2])


def _bent(camera: Camera, angle: Floats) -> Floats:
    k = np.zeros(4)
    k[: len(camera.D)] = camera.D[:4]
    square = angle * angle
    return np.asarray(angle * (1.0 + square * (k[0] + square * (k[1] + square * (k[2] + square * k[3])))))


def _distorted(camera: Camera, plane: Floats) -> Floats:
    k1, k2, p1, p2, k3, k4, k5, k6 = np.concatenate([camera.D, np.zeros(8)])[:8]
    x, y = plane.T
    r = x * x + y * y
    radial = (1.0 + r * (k1 + r * (k2 + r * k3))) / (1.0 + r * (k4 + r * (k5 + r * k6)))
    return np.column_stack([x * radial + 2.0 * p1 * x * y + p2 * (r + 2.0 * x * x), y * radial + p1 * (r + 2.0 * y * y) + 2.0 * p2 * x * y])
