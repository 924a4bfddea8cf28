"""Rooms as vectors of features, and how well a classifier tells two sets of rooms apart by them.

Features are those of what is recorded of both: categories that the real rooms have, at the precision of the source (1 mm, 1 mrad).  A box
that a source puts into a wall or a neighbour is as far off it, as when grammars are learned, and what hangs within 3 cm of a wall hangs on
it: sources leave such boxes in the air.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from shapely.geometry import Polygon
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import roc_auc_score

from grammar.geometry.arrays import Bools, Floats, Ints
from grammar.learning import ObservedObject, ObservedRoom
from grammar.learning.observed import filled_outline, fitting_gap, fitting_wall, half_extents, relative_pose, signed_gap, wall_poses

GROUPS = ("counts", "sizes", "walls", "pairs", "room")
_LEAST_ROOMS, _MOST_PAIRS = 3, 15
_STEP = 1e-3
_HANGS_FROM_M, _HANGS_WITHIN_M = 0.3, 0.03


class Schema(NamedTuple):
    """Which categories and pairs of categories have features, from the real rooms: those of at least three rooms."""

    categories: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]


class Told(NamedTuple):
    """How well rooms were told apart: area under the receiver operating characteristic, and the share of each feature in that."""

    auc: float
    importance: Mapping[str, float]


def schema_of(rooms: Sequence[ObservedRoom]) -> Schema:
    """Return the features that rooms like these have."""
    held = [sorted({item.category for item in room.objects}) for room in rooms]
    single = Counter(name for names in held for name in names)
    double = Counter((a, b) for names in held for i, a in enumerate(names) for b in names[i + 1 :])
    pairs = [pair for pair, count in double.most_common(_MOST_PAIRS) if count >= _LEAST_ROOMS]
    return Schema(tuple(sorted(name for name, count in single.items() if count >= _LEAST_ROOMS)), tuple(pairs))


def features(schema: Schema, room: ObservedRoom) -> dict[str, float]:
    """Return the features of a room by name, ``group: what``; NaN where the room has no such object."""
    things = {name: [_settled(room, item) for item in room.objects if item.category == name] for name in schema.categories}
    found = {"counts: all": float(sum(map(len, things.values())))}
    for name, items in things.items():
        found[f"counts: {name}"] = float(len(items))
        found |= _size(name, items) | _at_walls(name, room, items)
    for a, b in schema.pairs:
        found |= _pair(f"{a} and {b}", things.get(a, []), things.get(b, []))
    return found | _whole(room, [item for items in things.values() for item in items])


def _stepped(value: float) -> float:
    """Return a length or angle at the precision of the source."""
    return round(value / _STEP) * _STEP


def _size(name: str, items: Sequence[ObservedObject]) -> dict[str, float]:
    sides = np.round(np.array([item.size_m for item in items]), 3) if items else np.full((1, 3), math.nan)
    return {f"sizes: {axis} of {name}": float(value) for axis, value in zip(("depth", "width", "height"), sides.max(0), strict=True)}


def _at_walls(name: str, room: ObservedRoom, items: Sequence[ObservedObject]) -> dict[str, float]:
    near = [pose for item in items if (pose := fitting_wall(room.polygon_m, item)) is not None]
    gaps = [_stepped(fitting_gap(pose.gap_m)) for pose in near] or [math.nan]
    turns = [_stepped(abs(pose.turn_rad)) for pose in near] or [math.nan]
    sides = [_stepped(fitting_gap(pose.gap_m)) for item in items for pose in wall_poses(room.polygon_m, item)] or [math.nan]
    middle = [_stepped(item.position_m[2] + 0.5 * item.size_m[2]) for item in items if item.position_m[2] > 0.2] or [math.nan]
    return {
        f"walls: least gap of {name}": min(gaps),
        f"walls: greatest gap of {name}": max(gaps),
        f"walls: least side gap of {name}": min(sides),
        f"walls: greatest turn of {name}": max(turns),
        f"walls: mean turn of {name}": float(np.mean(turns)),
        f"walls: height of {name}": float(np.mean(middle)),
    }


def _settled(room: ObservedRoom, item: ObservedObject) -> ObservedObject:
    """Return an object at its wall, straight, if it hangs there, and else as far off the walls as it is in them."""
    pose = fitting_wall(room.polygon_m, item)
    if pose is not None and item.position_m[2] > _HANGS_FROM_M and pose.gap_m < _HANGS_WITHIN_M:
        yaw = item.yaw_rad - pose.turn_rad
        off = pose.gap_m + half_extents(item.size_m, pose.turn_rad)[0] - half_extents(item.size_m, 0.0)[0]
        return replace(item, position_m=_shifted(item, -off, yaw), yaw_rad=yaw)
    for pose in wall_poses(room.polygon_m, item):
        if (off := fitting_gap(pose.gap_m) - pose.gap_m) > 0.0 and pose.gap_m > -off:
            item = replace(item, position_m=_shifted(item, off, item.yaw_rad - pose.turn_rad))
    return item


def _shifted(item: ObservedObject, by_m: float, yaw_rad: float) -> tuple[float, float, float]:
    x, y, z = item.position_m
    return x + by_m * math.cos(yaw_rad), y + by_m * math.sin(yaw_rad), z


def _pair(names: str, first: Sequence[ObservedObject], second: Sequence[ObservedObject]) -> dict[str, float]:
    both = [(a, b) for a in first for b in second]
    near = min(both, key=lambda pair: math.dist(pair[0].position_m[:2], pair[1].position_m[:2]), default=None)
    if near is None:
        return dict.fromkeys((f"pairs: {what} of {names}" for what in ("distance", "gap", "turn", "ahead", "aside")), math.nan)
    place = relative_pose(near[0], near[1])
    return {
        f"pairs: distance of {names}": _stepped(math.hypot(place.x_m, place.y_m)),
        f"pairs: gap of {names}": _stepped(fitting_gap(signed_gap(near[0], near[1]))),
        f"pairs: turn of {names}": _stepped(abs(place.turn_rad)),
        f"pairs: ahead of {names}": _stepped(place.x_m),
        f"pairs: aside of {names}": _stepped(abs(place.y_m)),
    }


def _whole(room: ObservedRoom, items: Sequence[ObservedObject]) -> dict[str, float]:
    """Return what is said of the whole room; the niche of a door, a wall's thickness deep, is none of its outline."""
    outline = Polygon(filled_outline(room.polygon_m))
    x_low, y_low, x_high, y_high = outline.bounds
    sides = sorted((x_high - x_low, y_high - y_low))
    covered = sum(item.size_m[0] * item.size_m[1] for item in items if item.position_m[2] < 0.2)
    return {
        "room: area": outline.area,
        "room: proportion": sides[1] / sides[0],
        "room: short side": sides[0],
        "room: share of the floor covered": covered / outline.area,
        "room: windows": float(len(room.openings.get("window", ()))),
    }


def table(schema: Schema, rooms: Sequence[ObservedRoom]) -> tuple[tuple[str, ...], Floats]:
    """Return the features' names and (rooms, features) float64."""
    rows = [features(schema, room) for room in rooms]
    names = tuple(rows[0])
    return names, np.array([[row[name] for name in names] for row in rows])


def folds_of(rooms: Sequence[ObservedRoom], folds: int) -> Ints:
    """Return (rooms,) the fold of each room; rooms of a house share theirs, and folds are about equally large."""
    sizes, place = [0] * folds, {}
    for house, count in sorted(Counter(room.house for room in rooms).items(), key=lambda pair: (-pair[1], pair[0])):
        place[house] = int(np.argmin(sizes))
        sizes[place[house]] += count
    return np.array([place[room.house] for room in rooms])


def told_apart(names: Sequence[str], real: Floats, drawn: Floats, folds: tuple[Ints, Ints], trees: int = 300) -> Told:
    """Return how well a random forest tells rooms apart that it has not seen: all folds but one teach it, that one is judged.

    Args:
        names: of the features.
        real: (rooms, features).
        drawn: (rooms, features).
        folds: (rooms,) of both.
        trees: of the forest; leaves hold two rooms at least, and both kinds weigh the same.
    """
    data, label = np.concatenate([real, drawn]), np.repeat([1, 0], [len(real), len(drawn)])
    fold, score = np.concatenate(folds), np.zeros(len(data))
    importance = np.zeros(len(names))
    for k in range(int(fold.max()) + 1):
        held: Bools = fold == k
        forest = RandomForestClassifier(trees, min_samples_leaf=2, class_weight="balanced", random_state=k, max_features="sqrt")
        forest.fit(data[~held], label[~held])
        score[held] = forest.predict_proba(data[held])[:, 1]
        importance += forest.feature_importances_
    judged = [fold == k for k in range(int(fold.max()) + 1)]
    auc = float(np.mean([roc_auc_score(label[held], score[held]) for held in judged if len(np.unique(label[held])) == 2]))
    return Told(auc, dict(zip(names, (importance / importance.sum()).tolist(), strict=True)))


def told_of_unseen(real: Floats, unseen: Floats, drawn: Floats, folds: int, trees: int = 300) -> float:
    """Return the area under the curve for real rooms that neither the grammar nor the forest has seen, against sampled rooms.

    Args:
        real: (rooms, features) of rooms that taught the grammar; they teach the forest.
        unseen: (rooms, features) of rooms of other houses.
        drawn: (rooms, features) of sampled rooms; one fold after the other is judged, the rest teaches.
        folds: their number.
        trees: of the forest.
    """
    found = []
    for k in range(folds):
        held = np.arange(len(drawn)) % folds == k
        forest = RandomForestClassifier(trees, min_samples_leaf=2, class_weight="balanced", random_state=k, max_features="sqrt")
        forest.fit(np.concatenate([real, drawn[~held]]), np.repeat([1, 0], [len(real), int((~held).sum())]))
        scores = forest.predict_proba(np.concatenate([unseen, drawn[held]]))[:, 1]
        found.append(roc_auc_score(np.repeat([1, 0], [len(unseen), int(held.sum())]), scores))
    return float(np.mean(found))


def real_against_real(rooms: Sequence[ObservedRoom], folds: int, rng: np.random.Generator, repeats: int = 8) -> tuple[float, float]:
    """Return the mean area under the curve where the rooms of half of the houses are told from those of the rest, and its deviation.

    That is what a perfect learner could be expected to reach, with as few real rooms as there are.
    """
    schema, found = schema_of(rooms), []
    names, data = table(schema, rooms)
    houses = sorted({room.house for room in rooms})
    for _ in range(repeats):
        chosen = {houses[k] for k in rng.permutation(len(houses))[: len(houses) // 2]}
        half = np.array([room.house in chosen for room in rooms])
        parts = [[room for room in rooms if (room.house in chosen) == first] for first in (True, False)]
        found.append(told_apart(names, data[half], data[~half], (folds_of(parts[0], folds), folds_of(parts[1], folds)), 100).auc)
    return float(np.mean(found)), float(np.std(found))
