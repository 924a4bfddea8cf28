"""A projected pattern seen by one camera: shadow, correlation window, noise of the disparity, whole steps of it.

The standard deviation of the device's formula holds for the depth that is read, so the share of the steps, step^2 / 12, is taken
off the noise that goes into them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import entry, kernel
from renderer.sensors.beams import Beams
from renderer.sensors.devices import Device
from renderer.sensors.surfaces_seen import AXIAL, axial_deviation, is_read, normal, seen_pixel, signal, within_range

_AGREEING_PX = 1.0


@entry
def read_structured_light(
    camera: PosedCamera, device: Device, beams: Beams, key: np.uint32, result: NDArray[np.float32], first: int, step: int
) -> None:
    """Fill rows ``first``, ``first + step``, ... of the sensed depth (height, width), metres along the optical axis."""
    for y in range(first, camera.height, step):
        for x in range(camera.width):
            result[y, x] = _read_pixel(camera, device, beams, x, y, key)


@kernel
def _read_pixel(camera: PosedCamera, device: Device, beams: Beams, x: int, y: int, key: np.uint32) -> float:
    at_x, at_y = seen_pixel(camera, device, beams, x, y, key)
    pixel = y * camera.width + x
    depth = beams.distance[at_y, at_x] * beams.z[at_y, at_x]
    if not np.isfinite(depth):
        return float(depth)
    cosine = beams.cosine[at_y, at_x]
    if not is_read(device, signal(beams, at_x, at_y), cosine, pixel, key):
        return np.nan
    if _agreement(camera, device, beams, at_x, at_y) < device.window_agreement:
        return np.nan
    variance = axial_deviation(device, depth, np.arccos(min(cosine, 1.0)), beams.reflectance[at_y, at_x]) ** 2
    width = device.inverse_depth_step_per_m
    depth2 = depth * depth
    variance -= (width * depth2) ** 2 / 12.0
    inverse = 1.0 / depth + np.sqrt(max(variance, 0.0)) / depth2 * normal(key, pixel, AXIAL)
    if width > 0.0:
        inverse = np.floor(inverse / width + 0.5) * width
    return within_range(device, 1.0 / inverse) if inverse > 0.0 else np.inf


@kernel
def _agreement(camera: PosedCamera, device: Device, beams: Beams, x: int, y: int) -> float:
    """Return the share of the correlation window in which the pattern is seen, with the disparity of its middle."""
    half = int(device.window_px) // 2
    scale = camera.focal_px * device.baseline_m
    middle = scale / (beams.distance[y, x] * beams.z[y, x])
    near = scale / (middle + _AGREEING_PX)
    far = scale / (middle - _AGREEING_PX) if middle > _AGREEING_PX else np.inf
    agreeing, count = 0, 0
    for v in range(max(y - half, 0), min(y + half + 1, camera.height)):
        for u in range(max(x - half, 0), min(x + half + 1, camera.width)):
            count += 1
            depth = beams.distance[v, u] * beams.z[v, u]
            agreeing += 1 if beams.lit[v, u] and near < depth < far else 0
    return agreeing / max(count, 1)
