"""The phase of modulated light: what a pixel receives from several places is one sum, so edges fly and corners are bent.

Where surfaces end within a pixel or beside it, four beams of the pixel are summed as complex numbers, each with the strength and the
phase of its way; the pixel reads the phase of the sum.  Where the phases disagree the sum is weaker than its parts, and the pixel is
invalid below ``min_coherence``.  Several modulation frequencies are represented by one, unwrapped about the strongest return.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.cameras import PosedCamera
from renderer.core.kernel import entry, kernel
from renderer.sensors.beams import Beams
from renderer.sensors.devices import Device
from renderer.sensors.multipath import multipath_at, radians_per_metre
from renderer.sensors.surfaces_seen import AXIAL, SIGNAL, axial_deviation, goes_on, is_read, normal, seen_pixel, signal, within_range

SUM_REAL, SUM_IMAGINARY, SUM_STRENGTH, STRONGEST, STRONGEST_M, SUM_FIELDS = range(6)
"""Fields of a pixel's sum: phasor, strength of all, strength and distance of the strongest."""

SUB_PIXELS = ((-0.375, -0.125), (0.125, -0.375), (0.375, 0.125), (-0.125, 0.375))
"""Where the four beams of a pixel go, in pixels from its centre."""


class Returns(NamedTuple):
    """What pixels are read from: beams; tiles (rows, columns) where a surface ends; their sums (height, width, SUM_FIELDS); multipath."""

    beams: Beams
    tiles: NDArray[np.uint8]
    sums: NDArray[np.float32]
    grid: NDArray[np.float32]


@entry
def mark_edges(camera: PosedCamera, beams: Beams, tiles: NDArray[np.uint8], first: int, step: int) -> None:
    """Set ``tiles`` (rows, columns) of 4 x 4 pixels to 1 where a surface ends, for rows ``first``, ``first + step``, ... of pixels."""
    for y in range(first, camera.height, step):
        for x in range(camera.width):
            for over, down in ((1, 0), (0, 1)):
                other_x, other_y = x + over, y + down
                if other_x < camera.width and other_y < camera.height and not goes_on(camera, beams, x, y, other_x, other_y):
                    tiles[y // 4, x // 4] = tiles[other_y // 4, other_x // 4] = 1


@entry
def add_returns(
    camera: PosedCamera, device: Device, beams: Beams, tiles: NDArray[np.int32], sums: NDArray[np.float32], first: int, step: int
) -> None:
    """Add the returns of beams in some tiles to the sums (height, width, SUM_FIELDS)."""
    across, per_metre = (camera.width + 3) // 4, radians_per_metre(device)
    for index in range(first, len(tiles), step):
        row, column = (tiles[index] // across) * 4, (tiles[index] % across) * 4
        for y in range(row, min(row + 4, camera.height)):
            for x in range(column, min(column + 4, camera.width)):
                if np.isfinite(beams.distance[y, x]):
                    strength, phase = signal(beams, x, y), per_metre * beams.distance[y, x]
                    sums[y, x, SUM_REAL] += strength * np.cos(phase)
                    sums[y, x, SUM_IMAGINARY] += strength * np.sin(phase)
                    sums[y, x, SUM_STRENGTH] += strength
                    if strength > sums[y, x, STRONGEST]:
                        sums[y, x, STRONGEST], sums[y, x, STRONGEST_M] = strength, beams.distance[y, x]


@entry
def read_time_of_flight(
    camera: PosedCamera, device: Device, returns: Returns, key: np.uint32, result: NDArray[np.float32], first: int, step: int
) -> None:
    """Fill rows ``first``, ``first + step``, ... of the sensed depth (height, width), metres along the optical axis."""
    for y in range(first, camera.height, step):
        for x in range(camera.width):
            result[y, x] = _read_pixel(camera, device, returns, x, y, key)


@kernel
def _read_pixel(camera: PosedCamera, device: Device, returns: Returns, x: int, y: int, key: np.uint32) -> float:
    beams, sums = returns.beams, returns.sums
    at_x, at_y = seen_pixel(camera, device, beams, x, y, 1, key)
    pixel, per_metre = y * camera.width + x, radians_per_metre(device)
    distance, cosine, strength = beams.distance[at_y, at_x], beams.cosine[at_y, at_x], 0.0
    shift = 0.0
    if returns.tiles[at_y // 4, at_x // 4] and sums[at_y, at_x, SUM_STRENGTH] > 0.0:
        # Several places in one pixel.
        total, real, imaginary = sums[at_y, at_x, SUM_STRENGTH], sums[at_y, at_x, SUM_REAL], sums[at_y, at_x, SUM_IMAGINARY]
        strength = total / len(SUB_PIXELS)
        if np.sqrt(real * real + imaginary * imaginary) < device.min_coherence * total:
            return np.nan
        distance = sums[at_y, at_x, STRONGEST_M]
        phase = np.arctan2(imaginary, real) - per_metre * distance
        shift = (phase - 2.0 * np.pi * np.floor(phase / (2.0 * np.pi) + 0.5)) / per_metre
    elif np.isfinite(distance):
        strength = signal(beams, at_x, at_y)
    if not np.isfinite(distance):
        return float(distance)
    cosine = cosine if cosine > 0.0 else np.float32(1.0)
    if not is_read(device, strength, float(cosine), normal(key, pixel, SIGNAL)):
        return np.nan
    # Light that comes by way of other surfaces, then noise.
    if device.multipath > 0.0:
        real, imaginary = multipath_at(camera, beams, returns.grid, at_x, at_y)
        shift += np.arctan2(device.multipath * imaginary, 1.0 + device.multipath * real) / per_metre
    depth = (distance + shift) * beams.z[y, x]
    sigma = axial_deviation(device, depth, np.arccos(min(cosine, 1.0)), beams.reflectance[at_y, at_x])
    return within_range(device, depth + sigma * normal(key, pixel, AXIAL))
