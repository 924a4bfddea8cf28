"""Furniture slid about until a room is valid again: seeded descent on the faults of the exact checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grammar.counterfactual.gate import AT_LEAST, all_checks, new_faults
from grammar.counterfactual.rearrangement import shifted
from grammar.counterfactual.removal import carried
from grammar.geometry.arrays import Floats
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_rows
from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, SceneObject, ValidityCheck

NEAR_WALL_M = 0.25
"""Greatest gap to a wall at which an object counts as standing there."""

_PARALLEL = 0.9

TRIALS, PATIENCE = 400, 100
"""Slides that are tried altogether, and without any success."""

_IN_WALL_M = 0.01
"""An object that is deeper in a wall is not at it, but must leave it."""

_SLIDE_SD_M = 0.2
_AT_FAULT = 0.6
"""How often a slide is of an object at fault, where there is one."""


def repaired(
    rng: np.random.Generator, rules: SceneSynthesizer, before: SceneDescription, after: SceneDescription
) -> tuple[SceneDescription, frozenset[int]]:
    """Return a scene with pieces slid along the walls that they stand at, or over the floor, until no check fails that held before.

    Args:
        rng: source of randomness.
        rules: where the checks come from.
        before: the scene whose faults do not count.
        after: the scene to repair.

    Returns:
        the best scene found, valid or not; the ids of what was slid.
    """
    held = all_checks(rules, before)
    faults = new_faults(held, all_checks(rules, after))
    slid: frozenset[int] = frozenset()
    patience = PATIENCE
    for _ in range(TRIALS):
        if not faults or not patience:
            break
        candidate, ids = _slide(rng, after, faults)
        left = new_faults(held, all_checks(rules, candidate))
        patience -= 1
        if _badness(left) < _badness(faults):
            after, faults, slid, patience = candidate, left, slid | ids, PATIENCE
    return after, slid


def _badness(faults: Sequence[ValidityCheck]) -> float:
    """Return how far checks are from being passed; each failed one counts 1 and 1 for each object, and its excess in units of 0.1."""
    excess = ((check.limit - check.value) if check.name in AT_LEAST else (check.value - check.limit) for check in faults)
    return sum(1.0 + len(check.objects) + min(10.0 * over, 50.0) for check, over in zip(faults, excess, strict=True))


def _slide(rng: np.random.Generator, scene: SceneDescription, faults: Sequence[ValidityCheck]) -> tuple[SceneDescription, frozenset[int]]:
    """Return the scene with one piece, or one whole group, slid a little, and what moved."""
    by_id = {item.id: item for item in scene.objects}
    movable = [item for item in scene.objects if item.support.kind in ("floor", "wall")]
    guilty = sorted({key for check in faults for key in check.objects if key in by_id and by_id[key] in movable})
    if guilty and rng.random() < _AT_FAULT:
        item = by_id[guilty[int(rng.integers(len(guilty)))]]
    else:
        item = movable[int(rng.integers(len(movable)))]
    step = rng.normal(0.0, _SLIDE_SD_M, 2)
    wall = wall_rows(scene.room.polygon_m)
    for w in near_walls(item, wall)[: 1 if item.support.kind == "wall" or rng.random() < 0.5 else 2]:
        normal = wall[w, [NORMAL_X, NORMAL_Y]]
        step = step - normal * float(normal @ step)
    together = {item.id}
    if rng.random() < 0.5:
        together |= {other.id for other in movable if other.group == item.id}
    ids = carried(scene, together)
    dx, dy = step.tolist()
    objects = tuple(shifted(other, other.position_m, dx, dy, 0.0, 0.0) if other.id in ids else other for other in scene.objects)
    return replace(scene, objects=objects), frozenset(ids)


def near_walls(item: SceneObject, wall: Floats) -> list[int]:
    """Return the walls that an object stands or hangs at, the nearest first, no two of them parallel."""
    x, y = item.position_m[:2]
    along = (x - wall[:, START_X]) * wall[:, ALONG_X] + (y - wall[:, START_Y]) * wall[:, ALONG_Y]
    across = (x - wall[:, START_X]) * wall[:, NORMAL_X] + (y - wall[:, START_Y]) * wall[:, NORMAL_Y]
    c, s = np.cos(item.yaw_rad), np.sin(item.yaw_rad)
    depth = 0.5 * item.size_m[0] * np.abs(wall[:, NORMAL_X] * c + wall[:, NORMAL_Y] * s)
    width = 0.5 * item.size_m[1] * np.abs(wall[:, NORMAL_Y] * c - wall[:, NORMAL_X] * s)
    gap = across - depth - width
    beside = (along > 0.0) & (along < wall[:, LENGTH]) & (gap > -_IN_WALL_M) & (gap < NEAR_WALL_M)
    chosen: list[int] = [] if item.support.wall is None else [item.support.wall]
    for w in np.argsort(gap, kind="stable").tolist():
        turned = [abs(float(wall[w, [NORMAL_X, NORMAL_Y]] @ wall[k, [NORMAL_X, NORMAL_Y]])) < _PARALLEL for k in chosen]
        if beside[w] and len(chosen) < 2 and all(turned):
            chosen.append(w)
    return chosen
