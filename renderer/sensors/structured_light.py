"""A projected pattern seen by one camera: shadow, correlation window, noise of the disparity, whole steps of it.

The pattern is found by correlation over a window, so all that goes wrong is nearly the same within one: noise, where edges are seen, and
whether enough light returns, which is judged by the mean over what the window sees of the surface.

The standard deviation of the device's formula holds for the depth that is read, so the share of the steps, step^2 / 12, is taken
off the noise that goes into them.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import entry, kernel
from renderer.sensors.beams import Beams
from renderer.sensors.devices import Device
from renderer.sensors.surfaces_seen import AXIAL, SIGNAL, axial_deviation, is_read, seen_pixel, signal, smooth_normal, within_range

_AGREEING_PX = 1.0
_ALIKE = 0.67
"""Share of the window within which pixels err alike: noise about local planes is that of real frames then."""


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
    alike = int(_ALIKE * device.window_px)
    at_x, at_y = seen_pixel(camera, device, beams, x, y, alike, key)
    depth = beams.distance[at_y, at_x] * beams.z[at_y, at_x]
    if not np.isfinite(depth):
        return float(depth)
    agreement, strength = _correlated(camera, device, beams, at_x, at_y)
    if not beams.lit[at_y, at_x] or agreement < device.window_agreement:
        return np.nan
    cosine = beams.cosine[at_y, at_x]
    if not is_read(device, strength, cosine, smooth_normal(key, x, y, camera.width, alike, SIGNAL)):
        return np.nan
    variance = axial_deviation(device, depth, np.arccos(min(cosine, 1.0)), beams.reflectance[at_y, at_x]) ** 2
    width = device.inverse_depth_step_per_m
    depth2 = depth * depth
    variance -= (width * depth2) ** 2 / 12.0
    inverse = 1.0 / depth + np.sqrt(max(variance, 0.0)) / depth2 * smooth_normal(key, x, y, camera.width, alike, AXIAL)
    if width > 0.0:
        inverse = np.floor(inverse / width + 0.5) * width
    return within_range(device, 1.0 / inverse) if inverse > 0.0 else np.inf


@kernel
def _correlated(camera: PosedCamera, device: Device, beams: Beams, x: int, y: int) -> tuple[float, float]:
    """Return the share of the window in which the pattern is seen with the disparity of its middle, and the mean signal there."""
    half = int(device.window_px) // 2
    scale = camera.focal_px * device.baseline_m
    middle = scale / (beams.distance[y, x] * beams.z[y, x])
    near = scale / (middle + _AGREEING_PX)
    far = scale / (middle - _AGREEING_PX) if middle > _AGREEING_PX else np.inf
    agreeing, count, total = 0, 0, 0.0
    for v in range(max(y - half, 0), min(y + half + 1, camera.height)):
        for u in range(max(x - half, 0), min(x + half + 1, camera.width)):
            count += 1
            depth = beams.distance[v, u] * beams.z[v, u]
            if beams.lit[v, u] and near < depth < far:
                agreeing += 1
                total += signal(beams, u, v)
    return agreeing / max(count, 1), total / max(agreeing, 1)
