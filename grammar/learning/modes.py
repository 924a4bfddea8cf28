"""From observed numbers to the few modes that a grammar's relations hold: medians, since the losses are absolute differences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grammar.learning.geometry import InFrame, half_extents, wrapped
from grammar.rules import AroundMode, PlaceMode, WallMode

_LEAST_SHARE = 0.25
"""Modes are equally likely, so a rare one would be sampled far too often; half its share among two is the least that improves the fit."""

_LEAST_COUNT = 3
_SPLIT_M = 0.25
_STRAIGHT_RAD = math.radians(3.0)


class GroupPose(NamedTuple):
    """One object around its core: pose in the core's frame and both sizes."""

    frame: InFrame
    size_m: tuple[float, float, float]
    core_m: tuple[float, float, float]


class TopPose(NamedTuple):
    """One object on a top: pose in the owner's frame, its size and the top's half extents."""

    frame: InFrame
    size_m: tuple[float, float, float]
    half_top_m: tuple[float, float]


def quarter_of(angle: float) -> int:
    """Return which of the four quarter turns is nearest: 0, 1, 2 or 3."""
    return round(wrapped(angle) / (0.5 * math.pi)) % 4


def typical_angle(angles: Sequence[float], quarter: int) -> float:
    """Return the median of angles about a quarter turn, that turn itself when nearly equal."""
    base = wrapped(0.5 * math.pi * quarter)
    off = float(np.median([wrapped(angle - base) for angle in angles]))
    return wrapped(base + off) if abs(off) > _STRAIGHT_RAD else base


def split_median(values: Sequence[float]) -> list[float]:
    """Return the median, or the medians of the lower and the upper half where these lie far apart."""
    low, high = np.quantile(values, (0.25, 0.75))
    if high - low <= _SPLIT_M or len(values) < 2 * _LEAST_COUNT:
        return [float(np.median(values))]
    return [float(low), float(high)]


def wall_modes(seen: Sequence[tuple[float, float]], turned: bool) -> tuple[WallMode, ...]:
    """Return modes for (gap, turn) pairs; without ``turned`` the direction is of no matter."""
    if not turned:
        return tuple(WallMode(distance_m=max(gap, 0.0), orientation_rad=None) for gap in split_median([gap for gap, _ in seen]))
    modes: list[WallMode] = []
    for quarter in range(4):
        group = [item for item in seen if quarter_of(item[1]) == quarter]
        if len(group) >= max(_LEAST_COUNT, _LEAST_SHARE * len(seen)):
            angle = typical_angle([turn for _, turn in group], quarter)
            modes.extend(WallMode(distance_m=max(gap, 0.0), orientation_rad=angle) for gap in split_median([gap for gap, _ in group]))
    return tuple(modes)


def around_modes(seen: Sequence[GroupPose], turned: bool) -> tuple[AroundMode, ...]:
    """Return modes for poses around a core: one or two for each side and quarter turn that is taken often enough."""
    groups: dict[tuple[str, int], list[GroupPose]] = {}
    for pose in seen:
        quarter = quarter_of(pose.frame.turn_rad) if turned else 0
        groups.setdefault((_side(pose)[0], quarter), []).append(pose)
    modes: list[AroundMode] = []
    for (side, quarter), group in sorted(groups.items()):
        if len(group) < max(_LEAST_COUNT, _LEAST_SHARE * len(seen)):
            continue
        angle = typical_angle([pose.frame.turn_rad for pose in group], quarter) if turned else None
        gaps = [_side(pose)[1] for pose in group]
        align, along = _alignment(side, group)
        modes.extend(
            AroundMode(side=side, gap_m=gap, align=align, along_m=along, orientation_rad=angle)  # type: ignore[arg-type]
            for gap in split_median(gaps)
        )
    return tuple(modes)


def _side(pose: GroupPose) -> tuple[str, float]:
    """Return the side of the core that an object is at, and the gap there (negative: it reaches under or into the core)."""
    half_d, half_w = half_extents(pose.size_m, pose.frame.turn_rad)
    core_d, core_w = 0.5 * pose.core_m[0], 0.5 * pose.core_m[1]
    gaps = {
        "front": pose.frame.x_m - core_d - half_d,
        "back": -pose.frame.x_m - core_d - half_d,
        "left": pose.frame.y_m - core_w - half_w,
        "right": -pose.frame.y_m - core_w - half_w,
    }
    side = max(gaps, key=lambda name: gaps[name])
    return side, gaps[side]


def _alignment(side: str, group: Sequence[GroupPose]) -> tuple[float, float]:
    """Return which ends are flush (-1, 0 or 1) and the median offset from that, for the choice that leaves the least scatter."""
    best = (math.inf, 0.0, 0.0)
    for align in (0.0, -1.0, 1.0):
        offsets = []
        for pose in group:
            half = half_extents(pose.size_m, pose.frame.turn_rad)
            axis = 0 if side in ("left", "right") else 1
            value = pose.frame.x_m if axis == 0 else pose.frame.y_m
            offsets.append(value - align * (0.5 * pose.core_m[axis] - half[axis]))
        middle = float(np.median(offsets))
        scatter = float(np.mean(np.abs(np.array(offsets) - middle)))
        if scatter < best[0] - 1e-6:
            best = (scatter, align, middle)
    return best[1], best[2]


def place_modes(seen: Sequence[TopPose], turned: bool) -> tuple[PlaceMode, ...]:
    """Return one mode for poses on tops, two where they keep to both ends of the width."""
    fractions = [_fractions(pose) for pose in seen]
    depth = float(np.median([item[0] for item in fractions]))
    widths = [item[1] for item in fractions]
    low, high = (float(value) for value in np.quantile(widths, (0.25, 0.75)))
    both = high - low > 1.0
    angle = typical_angle([pose.frame.turn_rad for pose in seen], 0) if turned else None
    return tuple(
        PlaceMode(depth_fraction=depth, width_fraction=width, orientation_rad=angle)
        for width in ([low, high] if both else [float(np.median(widths))])
    )


def _fractions(pose: TopPose) -> tuple[float, float]:
    half = half_extents(pose.size_m, pose.frame.turn_rad)
    free = [max(top - own, 1e-3) for top, own in zip(pose.half_top_m, half, strict=True)]
    return min(max(pose.frame.x_m / free[0], -1.0), 1.0), min(max(pose.frame.y_m / free[1], -1.0), 1.0)
