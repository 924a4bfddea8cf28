"""Sizes of objects and rooms: kernel density estimates and truncated normal distributions of what was observed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtr, ndtri

from grammar.derivation.densities import truncated_normal_log_density
from grammar.geometry.arrays import Floats
from grammar.learning.geometry import filled_outline, without_steps
from grammar.learning.observed import ObservedRoom
from grammar.spec.object_rules import ObjectRule, SizeMode
from grammar.spec.room_rules import SHAPES, RoomRule, RoomShapes
from grammar.spec.values import TruncatedNormal
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_FURNISHED_SHARE = 0.2
_LEAST_FITTED, _LEAST_RANGE_M, _NARROW_M = 8, 0.005, 0.02
_QUARTILES = (0.25, 0.5, 0.75)
_WHOLE = 0.97
"""Share of its bounding box that a rectangle fills at least."""

Size = tuple[float, float, float]
Kernel = tuple[float, Floats, Floats]
"""Weight, mean, and variance of the sizes that were merged into it."""

_MAX_KERNELS = 24
_LEAST_SD_M = (0.01, 0.01, 0.01)
_LEAST_RELATIVE_SD = 0.03

_MODEL_SHARE, _MODEL_COUNT = 0.1, 3
_MODEL_SD_M = 0.0002
"""A side that recurs to the millimetre, in a tenth of the objects and three times at least, is that of a model that people have."""


def learn_size(rule: ObjectRule, seen: Sequence[Size], alpha: float, elsewhere: Sequence[Size] = (), pooled: float = 0.0) -> ObjectRule:
    """Return a rule whose sizes are a kernel density estimate over the observed ones.

    Kernels are products of normal distributions, their widths by Scott's rule, 1.06 sd n^(-1/5) of each side, at least 1 cm or 3 %; a side
    that recurs exactly is that of a common model and keeps its value.  Equal sizes share a kernel; where there are more than 24, the
    closest are merged.  The base's components stay with the weight of ``alpha`` observations, or of none where the sizes seen
    ``elsewhere``, in other room types, count as ``pooled`` observations.  The bounds are widened to hold all observed sizes.
    """
    if elsewhere and pooled > 0.0:
        own, shared = learn_size(rule, seen, 0.0), learn_size(rule, elsewhere, 0.0)
        share = len(seen) / (len(seen) + pooled)
        parts = ((share, own), (1.0 - share, shared))
        blend = [replace(mode, probability=part * mode.probability) for part, learned in parts for mode in learned.sizes]
        low, high = np.minimum(own.low_m, shared.low_m), np.maximum(own.high_m, shared.high_m)
        return replace(rule, sizes=tuple(blend), low_m=_three(low), high_m=_three(high))
    data = np.array(seen, np.float64)
    spread = 1.06 * data.std(0) * len(data) ** -0.2
    weights = Counter(tuple(round(side, 3) for side in size) for size in seen)
    kernels: list[Kernel] = [(float(count), np.array(size), np.zeros(3)) for size, count in sorted(weights.items())]
    while len(kernels) > _MAX_KERNELS:
        kernels = _merge_closest(kernels)
    recurring = [_recurring(data[:, axis]) for axis in range(3)]
    total = len(seen) + alpha
    modes = [replace(mode, probability=mode.probability * alpha / total) for mode in rule.sizes if alpha > 0.0]
    for count, mean, variance in kernels:
        floor = np.maximum(_LEAST_SD_M, _LEAST_RELATIVE_SD * mean)
        floor = np.minimum(floor, 0.2 * mean)
        sd = np.maximum(np.sqrt(spread**2 + variance), floor)
        same = [round(float(side), 3) in values for side, values in zip(mean, recurring, strict=True)]
        sd = np.where(np.array(same) & (variance < _MODEL_SD_M**2), _MODEL_SD_M, sd)
        modes.append(SizeMode(probability=count / total, mean_m=_three(mean), sd_m=_three(sd)))
    low, high = np.minimum(rule.low_m, data.min(0)), np.maximum(rule.high_m, data.max(0))
    return replace(rule, sizes=tuple(modes), low_m=_three(low), high_m=_three(high))


def _recurring(sides: Floats) -> set[float]:
    """Return the lengths, to the millimetre, that are so common that they are those of models."""
    counts = Counter(round(float(side), 3) for side in sides)
    return {side for side, count in counts.items() if count >= max(_MODEL_COUNT, _MODEL_SHARE * len(sides))}


def _merge_closest(kernels: Sequence[Kernel]) -> list[Kernel]:
    """Replace the two closest kernels by one with the same moments."""
    means = np.array([kernel[1] for kernel in kernels])
    distance = np.linalg.norm(np.log(means[:, None] / means[None]), axis=2)
    distance[np.tril_indices(len(kernels))] = math.inf
    i, j = divmod(int(np.argmin(distance)), len(kernels))
    (a, m, u), (b, n, v) = kernels[i], kernels[j]
    mean = (a * m + b * n) / (a + b)
    variance = (a * (u + (m - mean) ** 2) + b * (v + (n - mean) ** 2)) / (a + b)
    return [*(kernel for k, kernel in enumerate(kernels) if k not in (i, j)), (a + b, mean, variance)]


def _three(values: Floats) -> Size:
    return float(values[0]), float(values[1]), float(values[2])


def learn_normal(base: TruncatedNormal, seen: Sequence[float]) -> TruncatedNormal:
    """Return a truncated normal with the mean and standard deviation of what was observed; its bounds are widened to hold all of it."""
    return TruncatedNormal(
        mean=float(np.mean(seen)),
        sd=max(float(np.std(seen)), 0.005),
        low=max(min(base.low, float(np.min(seen))), 0.0),
        high=max(base.high, float(np.max(seen))),
    )


def _height(seen: Sequence[float]) -> TruncatedNormal:
    """Return the distribution of the height of rooms, within what was observed."""
    low, high = float(np.min(seen)), float(np.max(seen))
    return TruncatedNormal(mean=float(np.mean(seen)), sd=max(float(np.std(seen)), 0.005), low=low, high=max(high, low + 0.01))


def learn_room(base: RoomRule, rooms: Sequence[ObservedRoom], covered_m2: Sequence[float], alpha: float) -> RoomRule:
    """Return the rule of the room's size and shape, from the outlines without the niches of their doors.

    ``covered_m2`` is the floor that the furniture of each room covers.  Where that is a fifth of the floor and more, the area of a room
    follows from it and the share; else it is learned itself.  Both sides follow one distribution, since a room turned by a quarter is as
    likely; ``alpha`` pseudo-counts of the base smooth the shapes.
    """
    outlines = [filled_outline(room.polygon_m) for room in rooms]
    extents = np.array([np.ptp(np.array(outline), axis=0) for outline in outlines])
    areas = np.array([signed_area_m2(outline) for outline in outlines])
    side = learn_normal(base.width_m, (extents * np.sqrt(areas / extents.prod(1))[:, None]).ravel().tolist())
    shares = np.divide(covered_m2, areas)
    fitted = float(np.median(shares)) >= _FURNISHED_SHARE
    low, high = (float(area) for area in (np.quantile(areas, (0.05, 0.95)) if fitted else (areas.min(), areas.max())))
    return replace(
        base,
        width_m=side,
        depth_m=side,
        height_m=_height([room.height_m for room in rooms]),
        area_low_m2=min(base.area_low_m2, low),
        area_high_m2=max(min(base.area_high_m2, 1.5 * high), high),
        floor_share_max=min(max(base.floor_share_max, float(np.max(shares)) if fitted else float(np.quantile(shares, 0.75))), 1.0),
        shapes=_learn_shapes(base.shapes, outlines, extents, areas, alpha),
        floor_share=fitted_normal(shares) if fitted else None,
        area_m2=None if fitted else quartile_normal(areas),
        proportion=(fitted_normal if fitted else quartile_normal)(extents.max(1) / extents.min(1)),
    )


def fitted_normal(values: Floats) -> TruncatedNormal:
    """Return the normal, truncated to what was seen, of greatest likelihood; its mean may lie at a bound, where the values gather."""
    low, high = float(values.min()), float(values.max())
    high = max(high, low + _LEAST_RANGE_M)
    mean, sd = float(values.mean()), max(float(values.std()), _LEAST_RANGE_M)
    if len(values) < _LEAST_FITTED or high - low < _NARROW_M:
        return TruncatedNormal(mean=mean, sd=sd, low=low, high=high)

    def loss(parameters: Floats) -> float:
        m, s = float(parameters[0]), math.exp(float(parameters[1]))
        return -sum(truncated_normal_log_density(float(value), m, s, low, high) for value in values)

    span = high - low
    bounds = ((max(low - 0.5 * span, 0.0), high + 0.5 * span), (math.log(0.2 * span), math.log(1.5 * span)))
    found = minimize(loss, np.array([mean, math.log(max(sd, 0.2 * span))]), bounds=bounds, method="L-BFGS-B")
    return TruncatedNormal(mean=float(found.x[0]), sd=math.exp(float(found.x[1])), low=low, high=high)


def quartile_normal(values: Floats) -> TruncatedNormal:
    """Return the normal, truncated to what was seen, whose quartiles are nearest to those of the values, by their ratios.

    Sizes of rooms that are not made for furniture have long tails, by which the likelihood would put their median too high.
    """
    low, high = float(values.min()), max(float(values.max()), float(values.min()) + _LEAST_RANGE_M)
    wanted, span = np.log(np.quantile(values, _QUARTILES)), high - low

    def loss(parameters: Floats) -> float:
        m, s = float(parameters[0]), math.exp(float(parameters[1]))
        below, above = ndtr((low - m) / s), ndtr((high - m) / s)
        found = m + s * ndtri(np.clip(below + (above - below) * np.array(_QUARTILES), 1e-12, 1.0 - 1e-12))
        return float(np.square(np.log(np.maximum(found, 0.5 * low)) - wanted).sum())

    bounds = ((max(low - 0.5 * span, 0.0), high), (math.log(0.02 * span), math.log(1.5 * span)))
    start = np.array([float(np.median(values)), math.log(0.3 * span)])
    found = minimize(loss, start, bounds=bounds, method="L-BFGS-B")
    return TruncatedNormal(mean=float(found.x[0]), sd=math.exp(float(found.x[1])), low=low, high=high)


def _learn_shapes(base: RoomShapes, outlines: Sequence[Sequence[Point2]], extents: Floats, areas: Floats, alpha: float) -> RoomShapes:
    """Return the probabilities of shapes by the corners of outlines; those of eight and more corners are shared out as the base does."""
    filled = areas / extents.prod(1) > _WHOLE
    corners = [4 if whole else len(without_steps(outline)) for whole, outline in zip(filled, outlines, strict=True)]
    counts = {"rectangle": corners.count(4), "l_shape": sum(count in (5, 6) for count in corners)}
    eight = [name for name in SHAPES if name not in counts]
    rest, others = len(corners) - sum(counts.values()), sum(getattr(base, name) for name in eight)
    if others <= 0.0:
        counts["l_shape"] += rest
    else:
        counts |= {name: rest * getattr(base, name) / others for name in eight}
    total = len(corners) + alpha
    shares = {name: round((counts.get(name, 0.0) + alpha * getattr(base, name)) / total, 4) for name in SHAPES if name != "rectangle"}
    return replace(base, rectangle=round(1.0 - sum(shares.values()), 4), **shares)
