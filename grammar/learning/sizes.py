"""Sizes of objects and rooms: kernel estimates and cut normal distributions from what was seen."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from grammar.learning.observed import ObservedRoom
from grammar.spec.rules import Normal, ObjectRule, RoomRule, SizeMode
from scene_description.polygons import signed_area_m2

Size = tuple[float, float, float]
Kernel = tuple[float, NDArray[np.float64], NDArray[np.float64]]
"""Weight, mean and inner variance."""

_MAX_KERNELS = 24
_LEAST_SD_M = (0.01, 0.01, 0.01)
_LEAST_RELATIVE_SD = 0.03


def learn_size(rule: ObjectRule, seen: Sequence[Size], alpha: float) -> ObjectRule:
    """Return a rule whose sizes are a kernel estimate over the seen ones.

    Kernels are products of normal distributions, their widths by Scott's rule, 1.06 sd n^(-1/5) of each side, at least 1 cm or 3 %.  Equal
    sizes share a kernel; of more than 24 the closest are merged.  The base's components stay with the weight of ``alpha`` observations.
    The bounds are widened to hold all that was seen.
    """
    data = np.array(seen, np.float64)
    spread = 1.06 * data.std(0) * len(data) ** -0.2
    weights = Counter(tuple(round(side, 3) for side in size) for size in seen)
    kernels: list[Kernel] = [(float(count), np.array(size), np.zeros(3)) for size, count in sorted(weights.items())]
    while len(kernels) > _MAX_KERNELS:
        kernels = _merge_closest(kernels)
    total = len(seen) + alpha
    modes = [replace(mode, probability=mode.probability * alpha / total) for mode in rule.sizes if alpha > 0.0]
    for count, mean, variance in kernels:
        floor = np.maximum(_LEAST_SD_M, _LEAST_RELATIVE_SD * mean)
        floor = np.minimum(floor, 0.2 * mean)
        sd = np.maximum(np.sqrt(spread**2 + variance), floor)
        modes.append(SizeMode(probability=count / total, mean_m=_three(mean), sd_m=_three(sd)))
    low, high = np.minimum(rule.low_m, data.min(0)), np.maximum(rule.high_m, data.max(0))
    return replace(rule, sizes=tuple(modes), low_m=_three(low), high_m=_three(high))


def _merge_closest(kernels: Sequence[Kernel]) -> list[Kernel]:
    """Replace the two closest kernels by one of the same moments."""
    means = np.array([kernel[1] for kernel in kernels])
    distance = np.linalg.norm(np.log(means[:, None] / means[None]), axis=2)
    distance[np.tril_indices(len(kernels))] = math.inf
    i, j = divmod(int(np.argmin(distance)), len(kernels))
    (a, m, u), (b, n, v) = kernels[i], kernels[j]
    mean = (a * m + b * n) / (a + b)
    variance = (a * (u + (m - mean) ** 2) + b * (v + (n - mean) ** 2)) / (a + b)
    return [*(kernel for k, kernel in enumerate(kernels) if k not in (i, j)), (a + b, mean, variance)]


def _three(values: NDArray[np.float64]) -> Size:
    return float(values[0]), float(values[1]), float(values[2])


def learn_normal(base: Normal, seen: Sequence[float]) -> Normal:
    """Return a cut normal distribution with the mean and spread of what was seen; its bounds are widened to hold that."""
    return Normal(
        mean=float(np.mean(seen)),
        sd=max(float(np.std(seen)), 0.005),
        low=max(min(base.low, float(np.min(seen))), 0.0),
        high=max(base.high, float(np.max(seen))),
    )


def _height(seen: Sequence[float]) -> Normal:
    low, high = float(np.min(seen)), float(np.max(seen))
    return Normal(mean=float(np.mean(seen)), sd=max(float(np.std(seen)), 0.005), low=low, high=max(high, low + 0.01))


def learn_room(base: RoomRule, rooms: Sequence[ObservedRoom], covered_m2: Sequence[float]) -> RoomRule:
    """Return the room's size: the rectangles with the proportions of the outlines' bounding boxes and the outlines' areas.

    Both sides follow one distribution, since a room turned by a quarter is as good.  ``covered_m2`` is the floor that the furniture of each
    room stands on; the bound on its share rises to that of three quarters of the rooms.
    """
    sides, areas = [], []
    for room in rooms:
        extent = np.ptp(np.array(room.polygon_m), axis=0)
        area = signed_area_m2(room.polygon_m)
        scale = math.sqrt(area / float(extent[0] * extent[1]))
        sides.extend((scale * extent).tolist())
        areas.append(area)
    side = learn_normal(base.width_m, sides)
    low, high = float(np.quantile(areas, 0.05)), float(np.quantile(areas, 0.95))
    share = float(np.quantile(np.divide(covered_m2, areas), 0.75))
    return replace(
        base,
        width_m=side,
        depth_m=side,
        height_m=_height([room.height_m for room in rooms]),
        area_low_m2=min(base.area_low_m2, low),
        area_high_m2=max(min(base.area_high_m2, 1.5 * high), high),
        floor_share_max=min(max(base.floor_share_max, share), 1.0),
    )
