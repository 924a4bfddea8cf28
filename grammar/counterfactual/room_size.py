"""The size of the room: the floor scaled, and the furniture carried to where its relations hold it.

What stands or hangs at walls keeps its gap to them and its share along them, groups move with their core and keep their shape, what stands
on other things goes with these, and all else keeps its share of the floor.  Sizes, heights and the camera stay as they are.  Where that
leaves the room invalid, single pieces are slid about until it is not.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.counterfactual.change import Outcome, Work, random_numbers
from grammar.counterfactual.gate import AT_LEAST, all_checks, checked, new_faults
from grammar.counterfactual.rearrangement import carried, shifted
from grammar.counterfactual.values import number
from grammar.geometry.arrays import Floats
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_lengths, wall_rows
from grammar.synthesize import SceneSynthesizer
from scene_description import Opening, Room, SceneDescription, SceneObject, ValidityCheck
from scene_description.products import matmul

NEAR_WALL_M = 0.25
"""Greatest gap to a wall at which an object counts as standing there."""

_PARALLEL = 0.9
_ONE_WAY = 1e-9
"""Squared sine, about, below which the normals of walls count as one direction."""

TRIALS, PATIENCE = 400, 100
"""Slides that are tried altogether, and without any success."""

_IN_WALL_M = 0.01
"""An object that is deeper in a wall is not at it, but must leave it."""

_SLIDE_SD_M = 0.2
_AT_FAULT = 0.6
"""How often a slide is of an object at fault, where there is one."""

Step = tuple[float, float]


def repaired(
    rng: np.random.Generator, rules: SceneSynthesizer, before: SceneDescription, after: SceneDescription
) -> tuple[SceneDescription, frozenset[int]]:
    """Return a scene with pieces slid along the walls that they stand at, or over the floor, until no check fails that held before.

    The faults of ``before`` do not count.

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
        step = step - normal * float(matmul(normal, step))
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
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    depth = 0.5 * item.size_m[0] * np.abs(wall[:, NORMAL_X] * c + wall[:, NORMAL_Y] * s)
    width = 0.5 * item.size_m[1] * np.abs(wall[:, NORMAL_Y] * c - wall[:, NORMAL_X] * s)
    gap = across - depth - width
    beside = (along > 0.0) & (along < wall[:, LENGTH]) & (gap > -_IN_WALL_M) & (gap < NEAR_WALL_M)
    chosen: list[int] = [] if item.support.wall is None else [item.support.wall]
    for w in np.argsort(gap, kind="stable").tolist():
        turned = [abs(float(matmul(wall[w, [NORMAL_X, NORMAL_Y]], wall[k, [NORMAL_X, NORMAL_Y]]))) < _PARALLEL for k in chosen]
        if beside[w] and len(chosen) < 2 and all(turned):
            chosen.append(w)
    return chosen


def scale_room(work: Work) -> Outcome:
    """Scale both sides of the floor."""
    factor, scene = number(work.change, 0.3, 3.0), work.scene
    if factor == 1.0:
        return Outcome(scene)
    old = np.array(scene.room.polygon_m)
    centre = 0.5 * (old.min(0) + old.max(0))
    polygon = centre + factor * (old - centre)
    room = replace(scene.room, polygon_m=tuple((x, y) for x, y in polygon.tolist()))
    room = replace(room, openings=tuple(_moved_opening(opening, scene.room, room) for opening in scene.room.openings))
    steps = _steps(scene, room, centre, factor)
    objects = tuple(shifted(item, item.position_m, *steps[item.id], 0.0, 0.0) for item in scene.objects)
    luminaires = []
    for lamp in scene.luminaires:
        x, y = (centre + factor * (np.array(lamp.position_m[:2]) - centre)).tolist()
        luminaires.append(replace(lamp, position_m=(x, y, lamp.position_m[2])))
    after = replace(scene, room=room, objects=objects, luminaires=tuple(luminaires))
    touched = tuple(sorted({opening.id for opening in room.openings} | {item.id for item in objects}))
    after, slid = repaired(random_numbers(scene, work.change), work.rules(), scene, after)
    note = f"slid to where they are valid: {', '.join(f'{item.id} {item.category}' for item in objects if item.id in slid)}" if slid else ""
    return Outcome(checked(work.rules(), scene, after, work.change), objects=touched, note=note)


def _moved_opening(opening: Opening, old: Room, new: Room) -> Opening:
    """Return an opening at the same share of what its wall has left beside it."""
    before, after = (wall_lengths(room.polygon_m)[opening.wall] - opening.width_m for room in (old, new))
    share = opening.offset_m / before if before > 1e-9 else 0.5
    return replace(opening, offset_m=max(share * after, 0.0))


def _steps(scene: SceneDescription, room: Room, centre: Floats, factor: float) -> dict[int, Step]:
    """Return how far each object goes, by id: after what carries it, else with its core, else as the walls near it do."""
    old, new = wall_rows(scene.room.polygon_m), wall_rows(room.polygon_m)
    by_id = {item.id: item for item in scene.objects}
    steps: dict[int, Step] = {}
    for before, after in zip(scene.room.openings, room.openings, strict=True):
        dx, dy = (_point(new, after) - _point(old, before)).tolist()
        steps[before.id] = (dx, dy)
    for item in scene.objects:
        _resolve(item, by_id, steps, old, new, centre, factor)
    return steps


def _point(wall: Floats, opening: Opening) -> Floats:
    """Return x and y of the middle of an opening in its wall."""
    row, along = wall[opening.wall], opening.offset_m + 0.5 * opening.width_m
    return np.asarray(row[[START_X, START_Y]] + along * row[[ALONG_X, ALONG_Y]])


def _resolve(
    item: SceneObject,
    by_id: Mapping[int, SceneObject],
    steps: dict[int, Step],
    old: Floats,
    new: Floats,
    centre: Floats,
    factor: float,
) -> Step:
    if item.id in steps:
        return steps[item.id]
    steps[item.id] = (0.0, 0.0)  # ends circles of groups
    leader = item.support.id if item.support.id is not None else item.group
    step: Floats = (factor - 1.0) * (np.array(item.position_m[:2]) - centre)
    if leader is not None and leader in by_id:
        step = np.array([*_resolve(by_id[leader], by_id, steps, old, new, centre, factor)])
    elif leader is not None:
        step = np.array([*steps[leader]])
    elif item.support.kind != "ceiling":
        step = _with_walls(step, near_walls(item, old), old, new)
    if leader is not None and item.support.kind == "wall" and item.support.wall is not None:
        step = _with_walls(step, [item.support.wall], old, new)
    steps[item.id] = (float(step[0]), float(step[1]))
    return steps[item.id]


def _with_walls(step: Floats, near: list[int], old: Floats, new: Floats) -> Floats:
    """Return a step whose share across the given walls is theirs: the nearest solution (least squares) for one wall or two."""
    if not near:
        return step
    normal = old[near][:, [NORMAL_X, NORMAL_Y]]
    wanted = ((new[near][:, [START_X, START_Y]] - old[near][:, [START_X, START_Y]]) * normal).sum(1)
    pull = matmul(wanted - matmul(normal, step), normal)
    (xx, xy), (_, yy) = matmul(normal.T, normal).tolist()
    area, spread = xx * yy - xy * xy, xx + yy
    if area < _ONE_WAY * spread * spread:
        return np.asarray(step + matmul(((xx, xy), (xy, yy)), pull) / (spread * spread))
    return np.asarray(step + matmul(((yy, -xy), (-xy, xx)), pull) / area)
