"""From observed poses to the modes of a grammar's relations, each with its probability and its spreads.

Poses are grouped by the nearest quarter turn, by how straight they are in it (exactly, nearly, not), and around a core by side.  (The
authors' statistics have von Mises components about the quarter turns.) Within each group the gaps or places are a small mixture.  A spread
is the mean deviation of the data divided by that which the weight of the energy term gives: a mode is as tight or as loose as what was
seen.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from grammar.learning.mixtures import gap_mixture, place_mixture
from grammar.learning.observed import RelativePose, half_extents, wrapped
from grammar.spec.object_rules import AroundMode, Mode, PlaceMode, WallMode

_LEAST_SHARE = 0.025
_SEEN_TWICE = 1.5
_EXPLAINED = 0.5
_MOST_MODES = {WallMode: 6, AroundMode: 10, PlaceMode: 6}
"""Greatest number of modes by kind: more cost time and add little."""

ALIGNED_RAD = 0.002
_STRAIGHT_RAD = 0.1
_EXACT_RAD = math.radians(3.0)
_LEAST_SPREAD, _MOST_SPREAD = 0.01, 500.0
LEAST_PLACE_M = 0.004
_RAYLEIGH = 4.6
"""n R^2 that uniform angles exceed with probability 0.01."""

LEAST_ANGLE_RAD = 0.0002
"""What is closer than the records tell is not distinguished."""

AnyMode = TypeVar("AnyMode", WallMode, AroundMode, PlaceMode)


class Scale(NamedTuple):
    """Mean deviations in metres and radians that a relation's weights give: 1 / (tidiness times weight)."""

    distance_m: float
    angle_rad: float

    @classmethod
    def of(cls, distance_weight: float, angle_weight: float, beta: float) -> "Scale":
        """Return that of a relation's weights; a weight of zero sets none, so its modes get no spread."""
        return cls(*(1.0 / (beta * weight) if weight > 0.0 else 1e6 for weight in (distance_weight, angle_weight)))

    def spread(self, distance_m: float) -> float:
        """Return the spread of a mode with this mean deviation in distance."""
        return min(max(distance_m / self.distance_m, _LEAST_SPREAD), _MOST_SPREAD)

    def orientation_spread(self, angle_rad: float) -> float:
        """Return the orientation spread of a mode with this mean deviation in angle."""
        return min(max(angle_rad / self.angle_rad, _LEAST_SPREAD), _MOST_SPREAD)


class GroupPose(NamedTuple):
    """One object around its core: pose in the core's frame and both sizes."""

    frame: RelativePose
    size_m: tuple[float, float, float]
    core_m: tuple[float, float, float]


class SupportPose(NamedTuple):
    """One object on a support surface: pose in the supporter's frame, its size and the surface's half extents."""

    frame: RelativePose
    size_m: tuple[float, float, float]
    half_surface_m: tuple[float, float]


def quarter_of(angle: float) -> int:
    """Return which of the four quarter turns is nearest: 0, 1, 2 or 3."""
    return round(wrapped(angle) / (0.5 * math.pi)) % 4


def turn_group(angle: float, turned: bool) -> tuple[int, int]:
    """Return the nearest quarter turn of an angle and how straight it is, 0 aligned to 2 not; without ``turned`` all are alike."""
    if not turned:
        return 0, 0
    quarter = quarter_of(angle)
    off = abs(wrapped(angle - 0.5 * math.pi * quarter))
    return quarter, (off > ALIGNED_RAD) + (off > _STRAIGHT_RAD)


def has_direction(angles: Sequence[float]) -> bool:
    """Return whether angles gather about one direction: their mean resultant length is beyond what chance makes it (Rayleigh)."""
    if not angles:
        return False
    length = abs(np.mean(np.exp(1j * np.asarray(angles))))
    return bool(len(angles) * length**2 > _RAYLEIGH)


def typical_angle(angles: Sequence[float], quarter: int) -> tuple[float, float]:
    """Return the median of angles about a quarter turn and the mean deviation from it.

    Where the median is off by less than three degrees, or by less than the angles scatter, that turn itself is meant.
    """
    base = wrapped(0.5 * math.pi * quarter)
    off = np.array([wrapped(angle - base) for angle in angles])
    middle = float(np.median(off))
    middle = middle if abs(middle) > max(_EXACT_RAD, float(np.abs(off - middle).mean())) else 0.0
    return wrapped(base + middle), max(float(np.abs(off - middle).mean()), LEAST_ANGLE_RAD)


def wall_modes(seen: Sequence[tuple[float, float]], turned: bool, scale: Scale) -> tuple[WallMode, ...]:
    """Return modes for (gap, turn) pairs; without ``turned`` all directions are alike."""
    modes: list[WallMode] = []
    for (quarter, _), group in _grouped((turn_group(turn, turned), (gap, turn)) for gap, turn in seen).items():
        angle, off = typical_angle([turn for _, turn in group], quarter)
        for part in gap_mixture([gap for gap, _ in group], LEAST_PLACE_M):
            modes.append(
                WallMode(
                    probability=part.share * len(group) / len(seen),
                    spread=scale.spread(part.scale),
                    orientation_spread=scale.orientation_spread(off) if turned else 1.0,
                    distance_m=part.middle[0],
                    orientation_rad=angle if turned else None,
                )
            )
    return _kept(modes)


def around_modes(seen: Sequence[GroupPose], turned: bool, scale: Scale) -> tuple[AroundMode, ...]:
    """Return modes for poses around a core; a pose seen once makes no mode, and where most poses make none there are none."""
    groups = _grouped(((_side(pose)[0], *turn_group(pose.frame.turn_rad, turned)), pose) for pose in seen)
    modes: list[AroundMode] = []
    for (side, quarter, _), group in groups.items():
        angle, off = typical_angle([pose.frame.turn_rad for pose in group], quarter)
        align = _alignment(side, group)
        for part in place_mixture([(_side(pose)[1], _along(side, pose, align)) for pose in group], LEAST_PLACE_M):
            modes.append(
                AroundMode(
                    probability=part.share * len(group) / len(seen),
                    spread=scale.spread(part.scale),
                    orientation_spread=scale.orientation_spread(off) if turned else 1.0,
                    side=side,  # type: ignore[arg-type]
                    gap_m=part.middle[0],
                    align=align,
                    along_m=part.middle[1],
                    orientation_rad=angle if turned else None,
                )
            )
    found = [mode for mode in modes if _share(mode) * len(seen) >= _SEEN_TWICE]
    return _kept(found) if sum(map(_share, found)) >= _EXPLAINED else ()


def place_modes(seen: Sequence[SupportPose], turned: bool, scale: Scale) -> tuple[PlaceMode, ...]:
    """Return modes for poses on support surfaces."""
    modes: list[PlaceMode] = []
    for (quarter, _), group in _grouped((turn_group(pose.frame.turn_rad, turned), pose) for pose in seen).items():
        angle, off = typical_angle([pose.frame.turn_rad for pose in group], quarter)
        free = np.array([_free_half_extents(pose) for pose in group])
        fractions = np.clip(np.array([(pose.frame.x_m, pose.frame.y_m) for pose in group]) / free, -1.0, 1.0)
        for part in place_mixture([(float(a), float(b)) for a, b in fractions], 0.02):
            length = 2.0 * part.scale * float(free.mean())  # the energy counts both edges of each axis
            modes.append(
                PlaceMode(
                    probability=part.share * len(group) / len(seen),
                    spread=scale.spread(length),
                    orientation_spread=scale.orientation_spread(off) if turned else 1.0,
                    depth_fraction=part.middle[0],
                    width_fraction=part.middle[1],
                    orientation_rad=angle if turned else None,
                )
            )
    return _kept(modes)


def blended(first: Sequence[AnyMode], second: Sequence[AnyMode], share: float) -> tuple[AnyMode, ...]:
    """Return the modes of two sets, the first with ``share`` of the probability."""
    return _kept(
        [replace(mode, probability=part * _share(mode)) for part, modes in ((share, first), (1.0 - share, second)) for mode in modes]
    )


_Key = TypeVar("_Key", bound=tuple[object, ...])
_Item = TypeVar("_Item")


def _grouped(pairs: Iterable[tuple[_Key, _Item]]) -> Mapping[_Key, list[_Item]]:
    """Return the items by key, in the order of the keys' text, so that nothing depends on the order of the data."""
    groups: dict[_Key, list[_Item]] = {}
    for key, item in pairs:
        groups.setdefault(key, []).append(item)
    return {key: groups[key] for key in sorted(groups, key=repr)}


def _kept(modes: Sequence[AnyMode]) -> tuple[AnyMode, ...]:
    """Return the modes that are not too rare, at most as many as their kind allows, with probabilities that sum to 1."""
    if not modes:
        return ()
    most = _MOST_MODES[type(modes[0])]
    order = sorted(range(len(modes)), key=lambda k: (-_share(modes[k]), k))[:most]
    kept = [modes[k] for k in sorted(order) if _share(modes[k]) >= _LEAST_SHARE or k == order[0]]
    total = sum(_share(mode) for mode in kept)
    return tuple(replace(mode, probability=_share(mode) / total) for mode in kept)


def _share(mode: Mode) -> float:
    return mode.probability or 0.0


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


def _along(side: str, pose: GroupPose, align: float) -> float:
    """Return the offset of an object along its side of the core from where ``align`` puts it."""
    axis = 0 if side in ("left", "right") else 1
    half = half_extents(pose.size_m, pose.frame.turn_rad)
    value = pose.frame.x_m if axis == 0 else pose.frame.y_m
    return value - align * (0.5 * pose.core_m[axis] - half[axis])


def _alignment(side: str, group: Sequence[GroupPose]) -> float:
    """Return which ends are flush (-1, 0 or 1): the choice that leaves the least scatter."""
    best = (math.inf, 0.0)
    for align in (0.0, -1.0, 1.0):
        offsets = np.array([_along(side, pose, align) for pose in group])
        scatter = float(np.mean(np.abs(offsets - np.median(offsets))))
        if scatter < best[0] - 1e-6:
            best = (scatter, align)
    return best[1]


def _free_half_extents(pose: SupportPose) -> tuple[float, float]:
    """Return how far an object's middle can be from the middle of its support surface, along depth and width."""
    half = half_extents(pose.size_m, pose.frame.turn_rad)
    return max(pose.half_surface_m[0] - half[0], 1e-3), max(pose.half_surface_m[1] - half[1], 1e-3)
