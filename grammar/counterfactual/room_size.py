"""The size of the room: the floor scaled, and the furniture carried to where its relations hold it.

What stands or hangs at walls keeps its gap to them and its share along them, groups move with their core and keep their shape, what stands
on other things goes with these, and all else keeps its share of the floor.  Sizes, heights and the camera stay as they are.  Where that
leaves the room invalid, single pieces are slid about until it is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from grammar.counterfactual.change import random_numbers
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.gate import checked
from grammar.counterfactual.rearrangement import shifted
from grammar.counterfactual.repair import near_walls, repaired
from grammar.counterfactual.values import number
from grammar.geometry.arrays import Floats
from grammar.geometry.walls import ALONG_X, ALONG_Y, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_lengths, wall_rows
from scene_description import Opening, Room, SceneDescription, SceneObject

Step = tuple[float, float]


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
    correction, *_ = np.linalg.lstsq(normal, wanted - normal @ step, rcond=None)
    return np.asarray(step + correction)


FACTORS = (
    Factor(
        name="room_size",
        label="size of the room",
        unit=None,
        value="factor on both sides of the floor, 0.3 to 3; 1: as it is",
        attribute="objects",
        touches="geometry",
        make=scale_room,
        current=lambda work: 1.0,
    ),
)
