"""Sizes of objects and rooms: kernel density estimates and truncated normal distributions of what was observed."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from shapely import Polygon, box, get_parts

from grammar.geometry.arrays import Bools, Floats
from grammar.learning.observed import ObservedRoom, filled_outline, size_log_density, without_steps
from grammar.spec.object_rules import HeightMode, ObjectRule, SizeMode
from grammar.spec.room_rules import MOST_NOTCHES, SHAPES, RoomRule, RoomShapes, RoomSize
from grammar.spec.values import TruncatedNormal
from scene_description.polygons import signed_area_m2
from scene_description.types import Point2

_FURNISHED_SHARE = 0.2
_AREA_MARGIN_M2, _LEAST_AREA_M2 = 0.2, 1.0
_MAX_ROOMS, _ROOM_WIDTH = 64, 0.5
"""Kernels are half as wide as Scott's rule, which is for normal distributions, has them: rooms gather at several sizes."""

_LEAST_NOTCH_M = 0.3
"""A floor without arms has smaller notches."""
_LEAST_SIDE_SD_M, _LEAST_SHARE, _LEAST_SHARE_SD = 0.02, 0.01, 0.02
_BARE_ROOMS = 0.25
"""If so many rooms of a type have no furniture, that belongs to the type."""
_WHOLE = 0.97
"""Share of its bounding box that a rectangle fills at least."""
_L_CORNERS, _LEAST_NOTCHES, _LEAST_NOTCH, _MOST_NOTCH = (5, 6), 3, 0.05, 0.9

Size = tuple[float, float, float]
Kernel = tuple[float, Floats, Floats]
"""Weight, mean, and variance of the sizes that were merged into it."""

_MAX_KERNELS = 24
_LEAST_QUARTILES_M = 0.2
_ROUNDS = 30
_LEAST_SD_M = (0.01, 0.01, 0.01)
_LEAST_RELATIVE_SD = 0.03

_NORM_M = 0.006
"""What a grammar holds closer than this is a norm: the height of worktops."""

_MODEL_SHARE, _MODEL_COUNT = 0.1, 3
_MODEL_SD_M, _MODEL_ROUNDING_M = 0.0002, 0.0005
_HEIGHT, _EVEN_M = 2, 0.05
"""A side that recurs to the millimetre, in a tenth of the objects and three times at least, is that of a model that people have."""


def learn_size(rule: ObjectRule, seen: Sequence[Size], alpha: float, elsewhere: Sequence[Size] = (), pooled: float = 0.0) -> ObjectRule:
    """Return a rule whose sizes are a kernel density estimate over the observed ones.

    Kernels are products of normal distributions, their widths by Scott's rule, 1.06 sd n^(-1/5) of each side, at least 1 cm or 3 %; a side
    that recurs exactly is that of a common model and keeps its value.  Equal sizes share a kernel; where there are more than 24, the
    closest are merged.  The base's components stay with the weight of ``alpha`` observations, or of none where the sizes seen
    ``elsewhere``, in other room types, count as ``pooled`` observations.  The bounds are widened to hold all observed sizes.  A side that
    the base holds within 6 mm is a norm: it becomes the data's where that has common models, and stays as in the base where it has none.
    """
    norms = np.array([is_norm(low, high) for low, high in zip(rule.low_m, rule.high_m, strict=True)])
    if norms.any():
        return _with_norms(rule, learn_size(_widened(rule, norms), seen, alpha, elsewhere, pooled), norms, np.array(seen, np.float64))
    if elsewhere and pooled > 0.0:
        own, shared = learn_size(rule, seen, 0.0), learn_size(rule, elsewhere, 0.0)
        share = _own_share(rule, seen, shared, pooled)
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


def _with_norms(rule: ObjectRule, learned: ObjectRule, norms: Bools, data: Floats) -> ObjectRule:
    """Return a learned rule whose sides that are norms of the base vary as little as there.

    A norm has its values of the data if one of them recurs, else that of the base.  Heights are those that recur, near the most common one,
    since worktops are even, and so are depths of what fills corners, since it is square.  What the base's own components say of a norm of
    the data is the most common value.
    """
    turns = rule.in_run is not None and rule.in_run.turns
    own, modes = rule.sizes[0], learned.sizes
    means, sds = np.array([mode.mean_m for mode in modes]), np.array([mode.sd_m for mode in modes])
    low, high = np.array(learned.low_m), np.array(learned.high_m)
    for axis in np.flatnonzero(norms).tolist():
        values = np.array(sorted(_recurring(data[:, axis])))
        if len(values):
            common = values[int(np.argmax([(np.abs(data[:, axis] - value) < _MODEL_ROUNDING_M).sum() for value in values]))]
            of_base = np.isin(means[:, axis], [mode.mean_m[axis] for mode in rule.sizes])
            if axis == _HEIGHT or turns:
                values = values[np.abs(values - common) < (_EVEN_M if axis == _HEIGHT else _NORM_M)]
                means[:, axis] = values[np.abs(means[:, [axis]] - values).argmin(1)]
            means[of_base, axis] = common
        else:
            means[:, axis] = own.mean_m[axis]
        half = min(0.5 * (rule.high_m[axis] - rule.low_m[axis]), _MODEL_ROUNDING_M if len(values) else _NORM_M)
        own_sd = own.sd_m[axis] if not len(values) else min(own.sd_m[axis], _MODEL_SD_M)
        sds[:, axis], low[axis], high[axis] = own_sd, means[:, axis].min() - half, means[:, axis].max() + half
    sizes = tuple(replace(mode, mean_m=_three(mean), sd_m=_three(sd)) for mode, mean, sd in zip(modes, means, sds, strict=True))
    return replace(rule, sizes=sizes, low_m=_three(low), high_m=_three(high))


def _own_share(rule: ObjectRule, seen: Sequence[Size], shared: ObjectRule, pooled: float) -> float:
    """Return the share of a room type's own sizes in the blend with those of other types: what predicts each of the own ones best.

    Of n sizes it is n / (n + pooled) at least.  Where the others predict an own size from the rest worse than other types do, it stays
    there; where a room type has models of its own it grows, to n / (n + 1) at most (expectation maximisation, each size left out once).
    """
    count = len(seen)
    least = count / (count + pooled)
    if count < 2 or count > _MAX_KERNELS or pooled <= 1.0:
        return least
    rest = [[*seen[:k], *seen[k + 1 :]] for k in range(count)]
    logs = np.array(
        [
            [size_log_density(size, learn_size(rule, others, 0.0).sizes), size_log_density(size, shared.sizes)]
            for others, size in zip(rest, seen, strict=True)
        ]
    )
    odds, share = np.exp(np.clip(logs[:, 1] - logs[:, 0], -50.0, 50.0)), least
    for _ in range(_ROUNDS):
        share = float((share / (share + (1.0 - share) * odds)).sum()) / (count + 1.0)
        share = max(share, least)
    return share


def is_norm(low_m: float, high_m: float) -> bool:
    """Return whether a grammar holds a length so close that it is a norm."""
    return high_m - low_m < _NORM_M


def _widened(rule: ObjectRule, norms: Bools) -> ObjectRule:
    """Return a rule without bounds that hold a side close."""
    high = np.where(norms, np.array(rule.low_m) + _NORM_M, rule.high_m)
    return replace(rule, high_m=_three(high))


def height_modes(middles: Floats) -> tuple[HeightMode, ...]:
    """Return a kernel estimate of the heights (n,) of what hangs, as narrow as that of rooms; heights that recur exactly are kept."""
    spread = max(_ROOM_WIDTH * 1.06 * float(middles.std()) * len(middles) ** -0.2, _LEAST_SD_M[0])
    recurring, counts = _recurring(middles), Counter(round(float(middle), 3) for middle in middles)
    found = [(middle, count / len(middles), _MODEL_SD_M if middle in recurring else spread) for middle, count in sorted(counts.items())]
    while len(found) > _MAX_KERNELS:
        k = int(np.argmin(np.diff([middle for middle, _, _ in found])))
        (a, p, _), (b, q, _) = found[k], found[k + 1]
        found[k : k + 2] = [((p * a + q * b) / (p + q), p + q, spread)]
    return tuple(HeightMode(probability=share, mean_m=middle, sd_m=sd) for middle, share, sd in found)


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
    """Return the distribution of the height of rooms, within what was observed.

    A height far from all others is taken for measured wrongly: beyond the outer fences of Tukey (*Exploratory Data Analysis*, 1977), three
    times the distance of the quartiles away from them, which counts as 0.2 m at least.
    """
    quarter, three_quarters = np.quantile(seen, (0.25, 0.75))
    away = 3.0 * max(float(three_quarters - quarter), _LEAST_QUARTILES_M)
    heights = [height for height in seen if quarter - away <= height <= three_quarters + away]
    low, high = min(heights), max(heights)
    return TruncatedNormal(mean=float(np.mean(heights)), sd=max(float(np.std(heights)), 0.005), low=low, high=max(high, low + 0.01))


def learn_room(base: RoomRule, rooms: Sequence[ObservedRoom], covered_m2: Sequence[float], alpha: float) -> RoomRule:
    """Return the rule of the room's size and shape, from the outlines without the niches of their doors.

    ``covered_m2`` is the floor that the furniture of each room covers.  Where that is a fifth of the floor and more, rooms and furniture
    are matched by that share, and so they are where a quarter of the rooms is bare, as halls are.  Both sides follow one distribution,
    since a room turned by a quarter is as likely; ``alpha`` pseudo-counts of the base smooth the shapes.
    """
    outlines = [filled_outline(room.polygon_m) for room in rooms]
    extents = np.array([np.ptp(np.array(outline), axis=0) for outline in outlines])
    areas = np.array([signed_area_m2(outline) for outline in outlines])
    side = learn_normal(base.width_m, (extents * np.sqrt(areas / extents.prod(1))[:, None]).ravel().tolist())
    shares = np.minimum(np.divide(covered_m2, areas), 1.0)
    fitted = float(np.median(shares)) >= _FURNISHED_SHARE
    bare = float(np.quantile(shares, _BARE_ROOMS)) <= _LEAST_SHARE
    high = float(np.quantile(areas, 0.95))
    return replace(
        base,
        width_m=side,
        depth_m=side,
        sizes=_learn_room_sizes(extents * np.sqrt(areas / extents.prod(1))[:, None], shares)
        if fitted
        else _learn_hall_sizes(extents, areas, outlines, shares if bare else None),
        height_m=_height([room.height_m for room in rooms]),
        area_low_m2=min(base.area_low_m2, max(float(areas.min()) - _AREA_MARGIN_M2, _LEAST_AREA_M2)),
        area_high_m2=max(min(base.area_high_m2, 1.5 * high), float(areas.max()) + _AREA_MARGIN_M2),
        floor_share_max=min(max(base.floor_share_max, float(np.max(shares)) if fitted else float(np.quantile(shares, 0.75))), 1.0),
        shapes=_learn_shapes(base.shapes, outlines, extents, areas, alpha),
        floor_share=None,
        proportion=None,
    )


def _learn_room_sizes(sides_m: Floats, shares: Floats | None, arms_m: Floats | None = None) -> tuple[RoomSize, ...]:
    """Return a kernel estimate of the rooms' sides and of the share of their floor that furniture covers.

    A side that recurs exactly keeps its value, as one of a common piece of furniture does (:func:`learn_size`): houses are built in steps.

    Args:
        sides_m: (rooms, 2) of rectangles of the rooms' areas.
        shares: (rooms,) or None, where furniture says nothing about the room.
        arms_m: (rooms,) width of the arms of rooms whose bounding rectangles the sides are.
    """
    long, short = sides_m.max(1), sides_m.min(1)
    given = [np.ones(len(sides_m)) if values is None else np.maximum(values, _LEAST_SHARE) for values in (shares, arms_m)]
    data = np.stack([long, short, *given], axis=1)
    spread = _ROOM_WIDTH * 1.06 * data.std(0) * len(data) ** -0.2
    kernels: list[Kernel] = [(1.0, row, np.zeros(4)) for row in data[np.lexsort(data.T)]]
    while len(kernels) > _MAX_ROOMS:
        kernels = _merge_closest(kernels)
    recurring = _recurring(sides_m.ravel())
    modes = []
    for count, mean, variance in kernels:
        sd = np.maximum(np.sqrt(spread**2 + variance), (_LEAST_SIDE_SD_M, _LEAST_SIDE_SD_M, _LEAST_SHARE_SD, _LEAST_SIDE_SD_M))
        kept = np.array([round(float(side), 3) in recurring for side in mean[:2]]) & (variance[:2] < _MODEL_SD_M**2)
        sides = np.where(kept, _MODEL_SD_M, sd[:2])
        modes.append(
            RoomSize(
                probability=count / len(data),
                mean_m=(float(mean[0]), float(mean[1])),
                sd_m=(float(sides[0]), float(sides[1])),
                floor_share=None if shares is None else min(float(mean[2]), 1.0),
                share_sd=float(sd[2]),
                arm_m=None if arms_m is None else float(mean[3]),
                arm_sd_m=_LEAST_SIDE_SD_M if arms_m is None else float(sd[3]),
            )
        )
    return tuple(modes)


def _learn_hall_sizes(extents: Floats, areas: Floats, outlines: Sequence[Sequence[Point2]], shares: Floats | None) -> tuple[RoomSize, ...]:
    """Return a kernel estimate of the sides of halls, with the width of the arms of those that have some.

    An L or a T of arms ``a`` wide in a rectangle of ``w`` by ``d`` has the area ``a (w + d - a)``.
    """
    total = extents.sum(1)
    arms = 0.5 * (total - np.sqrt(np.maximum(total**2 - 4.0 * areas, 0.0)))
    corners = np.array([len(without_steps(outline)) for outline in outlines])
    armed = (areas <= _WHOLE * extents.prod(1)) & (corners > 4) & (extents.min(1) - arms > _LEAST_NOTCH_M)
    straight = extents * np.sqrt(areas / extents.prod(1))[:, None]
    plain, bent = (
        _learn_room_sizes(sides[chosen], None if shares is None else shares[chosen], widths) if chosen.any() else ()
        for sides, chosen, widths in ((straight, ~armed, None), (extents, armed, arms[armed]))
    )
    share, known = float(armed.mean()), np.zeros(1) if shares is None else shares
    # furniture says little about a hall, but a bare one stays bare
    loose = max(1.06 * float(known.std()) * len(known) ** -0.2, _LEAST_SHARE_SD)
    return tuple(
        replace(mode, probability=mode.probability * part, share_sd=_LEAST_SHARE if (mode.floor_share or 0.0) <= _LEAST_SHARE else loose)
        for modes, part in ((plain, 1.0 - share), (bent, share))
        for mode in modes
    )


def _learn_shapes(base: RoomShapes, outlines: Sequence[Sequence[Point2]], extents: Floats, areas: Floats, alpha: float) -> RoomShapes:
    """Return the probabilities of shapes by the corners of outlines; those of eight and more corners are shared out as the base does.

    Three notches or more of those with five or six corners are the kernels of the notches of an L, as wide as those of the rooms' sides; of
    many every so many-th is one.
    """
    filled = areas / extents.prod(1) > _WHOLE
    corners = [4 if whole else _corners(outline) for whole, outline in zip(filled, outlines, strict=True)]
    counts = {"rectangle": corners.count(4), "l_shape": sum(count in _L_CORNERS for count in corners)}
    eight = [name for name in SHAPES if name not in counts]
    rest, others = len(corners) - sum(counts.values()), sum(getattr(base, name) for name in eight)
    if others <= 0.0:
        counts["l_shape"] += rest
    else:
        counts |= {name: rest * getattr(base, name) / others for name in eight}
    total = len(corners) + alpha
    shares = {name: round((counts.get(name, 0.0) + alpha * getattr(base, name)) / total, 4) for name in SHAPES if name != "rectangle"}
    bent = (_notch_shares(outline) for outline, count in zip(outlines, corners, strict=True) if count in _L_CORNERS)
    notches = [shares for shares in bent if max(shares) <= _MOST_NOTCH]  # what takes a whole side is a wall that is not straight
    if len(notches) >= _LEAST_NOTCHES:
        most = min(len(notches), MOST_NOTCHES)
        spread = _ROOM_WIDTH * 1.06 * float(np.std(notches, axis=0).mean()) * len(notches) ** -0.2
        low, high = np.clip([np.min(notches), np.max(notches)], _LEAST_NOTCH, _MOST_NOTCH).tolist()
        base = replace(
            base,
            notches=tuple(notches[k * len(notches) // most] for k in range(most)),
            notch_sd=max(spread, _LEAST_SHARE_SD),
            notch_low=min(base.notch_low, low),
            notch_high=max(base.notch_high, high),
        )
    return replace(base, rectangle=round(1.0 - sum(shares.values()), 4), **shares)


def _corners(outline: Sequence[Point2]) -> int:
    """Return the number of corners of an outline, of one with a long shallow step those with that step."""
    plain = len(without_steps(outline))
    return len(outline) if plain == 4 and len(outline) in _L_CORNERS else plain


def _notch_shares(outline: Sequence[Point2]) -> tuple[float, float]:
    """Return the shares of the long and of the short side of its bounding rectangle that the largest notch of an outline takes."""
    whole = box(*Polygon(outline).bounds)
    notch = max(get_parts(whole.difference(Polygon(outline))), key=lambda part: part.area)
    sides, cut = ((right - left, top - bottom) for left, bottom, right, top in (whole.bounds, notch.bounds))
    shares = [float(part / side) for part, side in sorted(zip(cut, sides, strict=True), key=lambda pair: -pair[1])]
    return shares[0], shares[1]
