"""What a scanner makes of echoes: mixed pixels, what is too weak to be seen, noise, steps, limits of range.

Echoes of the rays within one beam come out as one distance, their mean weighted by the light of each: mixed pixels at edges (M. Hebert and
E. Krotkov, "3D measurements from imaging laser radars: how good are they?", Image and Vision Computing 10(3), 1992).  Every number of
noise depends on (scene, scan, beam) only.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry, kernel
from renderer.core.random_numbers import mix_bits, standard_normal

DARK = 0.1
"""Remission of the surface that ``dark_range_m`` is about, as data sheets have it."""

_OTHER = np.uint32(0x68E31DA4)


class RangeErrors(NamedTuple):
    """What a scanner gets wrong.

    dark_range_m: how far a remission of ``DARK`` is seen, 0 for no limit; noise_m, noise_share: standard deviation of the range, its
    constant part and the one that grows with the range; resolution_m: step, 0 for none.
    """

    dark_range_m: float
    noise_m: float
    noise_share: float
    resolution_m: float


@entry
def read_beams(
    length: NDArray[np.float32],
    remission: NDArray[np.float32],
    errors: RangeErrors,
    key: np.uint32,
    ranges: NDArray[np.float32],
    intensities: NDArray[np.float32],
) -> None:
    """Fill ranges, in metres, infinite where nothing is seen, and intensities: the remission as it is seen, of nothing 0; (n,) each.

    ``length``, ``remission``: (n, rays of a beam), of the echoes; ``key``: of the scan's random numbers.
    """
    for i in range(length.shape[0]):
        light, way, back = 0.0, 0.0, 0.0
        for j in range(length.shape[1]):
            if remission[i, j] > 0.0:
                distance = max(float(length[i, j]), 1e-6)
                share = float(remission[i, j]) / (distance * distance)
                light += share
                way += share * distance
                back += float(remission[i, j])
        light, back = light / length.shape[1], back / length.shape[1]
        ranges[i], intensities[i] = np.inf, 0.0
        if light == 0.0 or (errors.dark_range_m > 0.0 and light * errors.dark_range_m * errors.dark_range_m < DARK):
            continue
        seed = mix_bits(np.uint32(mix_bits(np.uint32(i)) ^ key))
        ranges[i], intensities[i] = erring_range(way / (light * length.shape[1]), errors, seed), back


@kernel
def erring_range(distance: float, errors: RangeErrors, seed: np.uint32) -> float:
    """Return a distance as it is read: with noise, in steps."""
    normal = standard_normal(seed, mix_bits(np.uint32(seed + _OTHER)))
    distance += np.sqrt(errors.noise_m * errors.noise_m + errors.noise_share * errors.noise_share * distance * distance) * normal
    if errors.resolution_m > 0.0:
        distance = np.floor(distance / errors.resolution_m + 0.5) * errors.resolution_m
    return max(distance, 0.0)


def limit_ranges(ranges: NDArray[np.float32], range_min_m: float, range_max_m: float) -> NDArray[np.float32]:
    """Return ranges as REP 117 has them: -inf for what is too near, +inf for what is too far or not seen at all."""
    far = np.where(ranges > range_max_m, np.float32(np.inf), ranges)
    return np.where(far < range_min_m, np.float32(-np.inf), far).astype(np.float32)
