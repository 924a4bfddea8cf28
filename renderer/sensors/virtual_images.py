"""What the two cameras of a stereo device see: matt surfaces under the light of the room, and the dots of a projector.

The image of a camera is, for every pixel, reflectance times (ambient light by direction + the projector's light).  Of the room's light
only that much is modelled: a bright half from above and from one side, the same for both cameras, so that edges of walls are seen; lamps
and panes are bright.  The projector, in the middle between the cameras, casts one dot somewhere in each cell of a square grid, a third to
full strength, over 86 x 57 degrees (Intel D400 data sheet); a dot is a Gaussian in angle, which includes the blur of lens and pixel, so
one ray a pixel is enough.  Light falls with the squared distance and the cosine.

Exposure: the white of both images is the 95th percentile of the left one over 0.8, but no less than ``signal_min``, as exposures end.
Then shot noise and noise of reading, and 10 bits.
"""

import math

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import entry, kernel
from renderer.core.random_numbers import mix_bits
from renderer.sensors.beams import Beams
from renderer.sensors.devices import Device
from renderer.sensors.surfaces_seen import normal

_HALF_WIDTH, _HALF_HEIGHT = math.tan(math.radians(43.0)), math.tan(math.radians(28.5))
_DOT_PX, _REACH = 0.9, 3.5
_SIDE, _DEEP, _UP = 0.35, 0.48, 0.80
_LEVELS, _WHITE_SHARE, _BRIGHT_PERCENT = 1023.0, 0.8, 95.0
_TO_UNIT = 2.0**-32
LUMINANCE, RED = 0, 1
"""Of ``Beams.color``: what grey cameras see, and what infrared ones do."""


@entry
def shade(
    camera: PosedCamera,
    device: Device,
    projector: PosedCamera,
    beams: Beams,
    channel: int,
    result: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill rows ``first``, ``first + step``, ... of the light (height, width) at a camera; 1: white under full light at 1 m."""
    for y in range(first, camera.height, step):
        for x in range(camera.width):
            reflectance = beams.color[y, x, channel]
            light = device.ambient * _ambient(beams, x, y)
            if device.dots > 0.0 and beams.lit[y, x]:
                light += _projected(device, projector, beams, x, y)
            result[y, x] = device.ambient * reflectance if reflectance > 1.5 else reflectance * light


@kernel
def _ambient(beams: Beams, x: int, y: int) -> float:
    nx, ny, nz = beams.world_normal[y, x, 0], beams.world_normal[y, x, 1], beams.world_normal[y, x, 2]
    light: float = 0.65 + 0.35 * (_SIDE * nx + _DEEP * ny + _UP * nz)
    return light


@kernel
def _projected(device: Device, projector: PosedCamera, beams: Beams, x: int, y: int) -> float:
    """Return the projector's light on a point, the cosine included."""
    r, origin = projector.rotation, projector.position
    dx, dy, dz = beams.point[y, x, 0] - origin[0], beams.point[y, x, 1] - origin[1], beams.point[y, x, 2] - origin[2]
    depth = r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz
    if depth <= 1e-3:
        return 0.0
    u = (r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz) / depth
    v = (r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz) / depth
    away2 = dx * dx + dy * dy + dz * dz
    nx, ny, nz = beams.world_normal[y, x, 0], beams.world_normal[y, x, 1], beams.world_normal[y, x, 2]
    cosine = max(-(nx * dx + ny * dy + nz * dz) / np.sqrt(away2), 0.0)
    return float(pattern(u, v, device.dots, _DOT_PX / float(projector.focal_px)) * cosine / away2)


@kernel
def pattern(u: float, v: float, dots: float, deviation: float) -> float:
    """Return the brightness of the pattern in the direction (u, v, 1), its mean about 1; 0 beside the field of projection.

    ``deviation``: of a dot, in units of u and v.
    """
    if abs(u) > _HALF_WIDTH or abs(v) > _HALF_HEIGHT:
        return 0.0
    cell = np.sqrt(4.0 * _HALF_WIDTH * _HALF_HEIGHT / dots)
    column, row = int(np.floor(u / cell)), int(np.floor(v / cell))
    total, reach2 = 0.0, (_REACH * deviation) ** 2
    for i in range(row - 1, row + 2):
        for j in range(column - 1, column + 2):
            seed = mix_bits(np.uint32(mix_bits(np.uint32(i + 32768)) + np.uint32(j + 32768)))
            other = mix_bits(np.uint32(seed ^ np.uint32(0x68E31DA4)))
            strength = 0.5 + float(mix_bits(np.uint32(other + np.uint32(1)))) * _TO_UNIT
            du = u - (j + float(seed) * _TO_UNIT) * cell
            dv = v - (i + float(other) * _TO_UNIT) * cell
            away2 = du * du + dv * dv
            if away2 < reach2:
                total += strength * np.exp(-0.5 * away2 / (deviation * deviation))
    return float(total * cell * cell / (2.0 * np.pi * deviation * deviation))


def white_of(light: NDArray[np.float32], device: Device) -> float:
    """Return the light that is white in both images."""
    return max(float(np.percentile(light.astype(np.float64), _BRIGHT_PERCENT)) / _WHITE_SHARE, device.signal_min, 1e-9)


@entry
def read_image(
    light: NDArray[np.float32],
    white: float,
    device: Device,
    key: np.uint32,
    purpose: int,
    result: NDArray[np.float32],
    first: int,
    step: int,
) -> None:
    """Fill rows of an image (height, width) of whole numbers up to 1023 from the light; ``purpose`` keys its noise."""
    height, width = light.shape
    for y in range(first, height, step):
        for x in range(width):
            electrons = min(light[y, x] / white, 1.5) * device.full_well_e
            spread = np.sqrt(electrons + device.read_noise_e * device.read_noise_e)
            electrons += spread * normal(key, y * width + x, purpose)
            level = np.floor(electrons / device.full_well_e * _LEVELS + 0.5)
            result[y, x] = min(max(level, 0.0), _LEVELS)


@kernel
def noise_of_level(device: Device, level: float) -> float:
    """Return the standard deviation of a level of :func:`read_image`."""
    electrons = level / _LEVELS * device.full_well_e
    variance = electrons + device.read_noise_e * device.read_noise_e
    return float(np.sqrt(variance) / device.full_well_e * _LEVELS + 0.29)
