"""What a sensor makes of light: vignetting, shot noise, read noise, black level and whole numbers.

A pixel that saturates, ``headroom_ev`` above the white of the frame's exposure, holds ``full_well_e`` electrons; light brings them by
Poisson's law, reading adds Gaussian noise, and the converter has ``bits``, of which a share lies below zero light so that dark noise is not
cut off.  So variance is mean + read noise^2 + quantisation step^2 / 12, in electrons: the photon transfer curve (J. Janesick, "Photon
Transfer", SPIE 2007).

Every number of noise depends on (scene, frame, pixel, channel) only.

Before that, the lens magnifies colours differently (lateral chromatic aberration), so that edges away from the axis have coloured fringes:
red and blue images are the green one, larger or smaller about the image centre, the linear part of the usual model by channel (J. Mallon
and P. F. Whelan, "Calibration and removal of lateral chromatic aberration in images", Pattern Recognition Letters 28, 2007).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.camera.cameras import PosedCamera
from renderer.camera.config import SensorConfig
from renderer.core.kernel import entry, kernel
from renderer.core.random_numbers import mix_bits, standard_normal


def magnify_channels(light: NDArray[np.float32], red_shift_px: float, blue_shift_px: float) -> NDArray[np.float32]:
    """Return light (height, width, 3) with its red and its blue image magnified; the same array where nothing is to do.

    What lies outside the image is taken to be as its edge.  Between pixels light is interpolated linearly.

    ``red_shift_px``, ``blue_shift_px``: how far these images of a corner lie outside the green one; negative: inside.
    """
    height, width = light.shape[:2]
    corner = 0.5 * math.hypot(width, height)
    result = light
    for channel, shift in ((0, red_shift_px), (2, blue_shift_px)):
        if shift:
            result = result.copy() if result is light else result
            result[..., channel] = _magnified(light[..., channel], 1.0 + shift / corner)
    return result


def veil(light: NDArray[np.float32], share: float) -> NDArray[np.float32]:
    """Return light (height, width, 3) of which a share is scattered evenly over the image, as the glare of a lens is (ISO 9358)."""
    mean = light.mean(axis=(0, 1), dtype=np.float64)
    return np.asarray((1.0 - share) * light + share * mean, np.float32)


def _magnified(image: NDArray[np.float32], factor: float) -> NDArray[np.float32]:
    """Return an image (height, width) magnified about its centre."""
    for axis in (0, 1):
        size = image.shape[axis]
        middle = 0.5 * (size - 1)
        place = np.clip(middle + (np.arange(size) - middle) / factor, 0.0, size - 1.0)
        before = np.minimum(place.astype(np.int64), max(size - 2, 0))
        share = (place - before).astype(np.float32)
        share = share[:, None] if axis == 0 else share
        here, there = np.take(image, before, axis), np.take(image, np.minimum(before + 1, size - 1), axis)
        image = here + share * (there - here)
    return image


_TO_UNIT = 2.0**-32
_SHOT, _SECOND, _READ = np.uint32(0x51ED270B), np.uint32(0xB5297A4D), np.uint32(0x68E31DA4)
_GAUSSIAN_FROM = 60.0


def expose(radiance: NDArray[np.float32], white: float, sensor: SensorConfig, frame_key: np.uint32) -> NDArray[np.float32]:
    """Return what a sensor reads of luminance (height, width, 3) in cd/m2, in the same unit; the same radiance if it is ideal.

    ``white``: luminance that saturates, cd/m2.
    """
    if sensor.full_well_e == 0.0:
        return radiance
    levels = 2.0**sensor.bits - 1.0 if sensor.bits else 0.0
    black = round(sensor.black_level * levels)
    step_e = sensor.full_well_e / (levels - black) if levels else 0.0
    electrons = np.empty_like(radiance)
    readout = _Readout(sensor.full_well_e / white, sensor.full_well_e, sensor.read_noise_e, step_e, float(black), levels)
    _read_out(np.ascontiguousarray(radiance), readout, np.uint32(frame_key), electrons)
    return electrons * np.float32(white / sensor.full_well_e)


def vignetting(camera: PosedCamera, falloff: float, amount: float) -> NDArray[np.float32] | None:
    """Return the share of light (height, width) that reaches each pixel, 1 on the axis; None if that is all of it everywhere.

    Args:
        camera: whose rays tell the angle to the axis.
        falloff: 0 none, 1 the cosine's fourth power of a simple lens, between them a power.
        amount: further loss in the corners, growing with the squared distance from the middle.
    """
    if falloff == 0.0 and amount == 0.0:
        return None
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    x, y = u - 0.5 * camera.width, v - 0.5 * camera.height
    if len(camera.bearings):
        ways = camera.bearings[1:-1, 1:-1].astype(np.float64)
        cosine = np.nan_to_num(ways[..., 2] / np.linalg.norm(ways, axis=-1))
    else:
        cosine = 1.0 / np.sqrt(1.0 + (x**2 + y**2) / float(camera.focal_px) ** 2)
    corner = 0.25 * (camera.width**2 + camera.height**2)
    share = el.power(np.maximum(cosine, 0.0), 4.0 * falloff) * (1.0 - amount * (x**2 + y**2) / corner)
    return np.asarray(share, np.float32)


class _Readout(NamedTuple):
    """How light becomes numbers: electrons of a unit of luminance, of a full pixel, of noise and of one step; black and white in steps."""

    electrons_per_unit: float
    full_well_e: float
    read_noise_e: float
    step_e: float
    black: float
    levels: float


@entry
def _read_out(radiance: NDArray[np.float32], readout: _Readout, key: np.uint32, result: NDArray[np.float32]) -> None:
    """Fill ``result`` with the electrons that are read, less the black level."""
    step_e, black = readout.step_e, readout.black
    height, width = radiance.shape[0], radiance.shape[1]
    for i in range(height):
        for j in range(width):
            for channel in range(3):
                seed = mix_bits(np.uint32(mix_bits(np.uint32((i * width + j) * 3 + channel)) ^ key))
                mean = max(float(radiance[i, j, channel]) * readout.electrons_per_unit, 0.0)
                value = float(_poisson(mean, seed)) + readout.read_noise_e * standard_normal(
                    mix_bits(np.uint32(seed ^ _READ)), mix_bits(np.uint32(seed + _READ))
                )
                if step_e > 0.0:
                    code = np.floor(value / step_e + black + 0.5)
                    value = (min(max(code, 0.0), readout.levels) - black) * step_e
                result[i, j, channel] = min(value, readout.full_well_e)


@kernel
def _poisson(mean: float, seed: np.uint32) -> float:
    """Return a Poisson number: by inversion, and for large means from a normal one corrected for its skew (Cornish and Fisher 1938)."""
    if mean > _GAUSSIAN_FROM:
        z = standard_normal(mix_bits(np.uint32(seed ^ _SHOT)), mix_bits(np.uint32(seed + _SECOND)))
        large: float = np.floor(mean + z * np.sqrt(mean) + (z * z - 1.0) / 6.0 + 0.5)
        return max(large, 0.0)
    u = (float(mix_bits(np.uint32(seed ^ _SHOT))) + 0.5) * _TO_UNIT
    count, term = 0.0, np.exp(-mean)
    total = term
    while u > total and count < 1000.0:
        count += 1.0
        term *= mean / count
        total += term
    return count
