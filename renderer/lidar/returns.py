"""What a lidar makes of the echoes of a beam: one distance, or two, where their pulses can be told from each other.

A receiver sees the sum of the echoes of all rays within the beam; those within the length of its pulse merge, farther ones are returns of
their own (W. Wagner et al., "Gaussian decomposition and calibration of a novel small-footprint full-waveform digitising airborne laser
scanner", ISPRS J. 60, 2006).  Every number of noise depends on (scene, sweep, ray, return) only.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, kernel
from renderer.core.random_numbers import mix_bits
from renderer.lidar.echoes import Echoes
from renderer.lidar.reading import DARK, RangeErrors, erring_range

STRONGEST, LAST, DUAL = range(3)
MODES = {"strongest": STRONGEST, "last": LAST, "dual": DUAL}
_TO_UNIT = 2.0**-32
_LOST = np.uint32(0x2545F491)


class Returns(NamedTuple):
    """How echoes become returns; ``mode``: one of ``MODES``; separation_m, dropout_share: as ``LidarConfig`` has them."""

    mode: int
    separation_m: float
    dropout_share: float


@entry
def read_returns(
    echoes: Echoes,
    errors: RangeErrors,
    returns: Returns,
    key: np.uint32,
    ranges: NDArray[np.float32],
    intensities: NDArray[np.float32],
) -> None:
    """Fill ranges, in metres, infinite where nothing is seen, and intensities, the remission as it is seen: (n, returns) each.

    ``echoes``: arrays (n, rays of a beam); ``key``: of the sweep's random numbers.  Two returns are the strongest and the other.
    """
    apart = returns.separation_m
    for i in range(ranges.shape[0]):
        ranges[i], intensities[i] = np.inf, 0.0
        seed = mix_bits(np.uint32(mix_bits(np.uint32(i)) ^ key))
        if float(mix_bits(np.uint32(seed ^ _LOST))) * _TO_UNIT < returns.dropout_share:
            continue
        strongest, farthest = _extremes(echoes, i, -1.0, 0.0)
        if returns.mode == LAST:
            ranges[i, 0], intensities[i, 0] = _read(echoes, i, farthest, -1.0, apart, errors, seed)
        if not np.isfinite(ranges[i, 0]):
            ranges[i, 0], intensities[i, 0] = _read(echoes, i, strongest, -1.0, apart, errors, seed)
        if returns.mode == DUAL:
            second, last = _extremes(echoes, i, strongest, apart)
            other = last if last > strongest else second
            ranges[i, 1], intensities[i, 1] = _read(echoes, i, other, strongest, apart, errors, np.uint32(seed + _LOST))


@kernel
def _extremes(echoes: Echoes, i: int, taken: float, separation_m: float) -> tuple[float, float]:
    """Return the distances of the strongest and of the farthest echo that are not within ``separation_m`` of ``taken``; -1 for none."""
    strongest, farthest, most = -1.0, -1.0, 0.0
    for j in range(echoes.length.shape[1]):
        for k in range(2):
            way, back = _echo(echoes, i, j, k)
            if back == 0.0 or (taken >= 0.0 and abs(way - taken) <= separation_m):
                continue
            light = back / (way * way)
            if light > most:
                strongest, most = way, light
            farthest = max(farthest, way)
    return strongest, farthest


@kernel
def _echo(echoes: Echoes, i: int, j: int, k: int) -> tuple[float, float]:
    """Return way and remission of an echo of a ray: 0 the strongest, 1 the last, of remission 0 where that is the same."""
    if k == 0:
        return max(float(echoes.length[i, j]), 1e-6), float(echoes.remission[i, j])
    is_other = echoes.last[i, j] > echoes.length[i, j]
    return float(echoes.last[i, j]), float(echoes.last_remission[i, j]) if is_other else 0.0


@kernel
def _read(
    echoes: Echoes, i: int, at: float, taken: float, separation_m: float, errors: RangeErrors, seed: np.uint32
) -> tuple[float, float]:
    """Return range and intensity of all echoes of beam i about ``at``, weighted by their light; infinite and 0 where they are too weak.

    Those about ``taken``, where that is not negative, belong to another return.
    """
    light, way, back = 0.0, 0.0, 0.0
    for j in range(echoes.length.shape[1]):
        for k in range(2):
            distance, remission = _echo(echoes, i, j, k)
            near = abs(distance - at) <= separation_m or distance == at
            if remission == 0.0 or not near or (taken >= 0.0 and abs(distance - taken) <= separation_m):
                continue
            share = remission / (distance * distance)
            light, way, back = light + share, way + share * distance, back + remission
    rays = echoes.length.shape[1]
    if light == 0.0 or (errors.dark_range_m > 0.0 and light / rays * errors.dark_range_m * errors.dark_range_m < DARK):
        return np.inf, 0.0
    return erring_range(way / light, errors, seed), back / rays
