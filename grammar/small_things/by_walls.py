"""Poses of what stands on the floor of a tidy room: along the walls, packed against what stands there, where nobody walks or reaches.

A few poses along the walls are drawn, and of those that are free the one is taken that is nearest to a corner or to a neighbour.  So boxes
end up in rows and corners, and shoes beside the shoe rack.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from grammar.geometry.arrays import Boxes, Floats, Ints
from grammar.geometry.boxes import Z_LOW, footprint_penetration
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, REFLEX, START_X, START_Y, WALL_YAW
from grammar.small_things.place import clear_of, draw_turn
from grammar.small_things.rules import Thing
from grammar.small_things.surfaces import whole_box, world_box
from grammar.spec.categories import Categories, Category, Role
from scene_description import SceneObject
from scene_description import Support as Supported
from scene_description.types import Point2

TRIALS = 40
"""Poses along the walls that are drawn for a thing."""

DOOR_REACH_M = 1.2
"""How far from the sides of a door things lie that belong by the door."""

_GAP_M, _GAP_SD_M = 0.015, 0.01
_KNEE_HIGH_M = 0.3
_USE_M, _USE_HEIGHT_M = 0.55, 1.8
_FRONT_USED: tuple[Role, ...] = (
    "store", "shelf", "wardrobe", "fridge", "backed", "seat", "table", "basin", "bathing", "toilet", "sink", "hob",
)  # fmt: skip


def use_strips(categories: Categories, objects: Sequence[SceneObject]) -> Boxes:
    """Return the floor (n, 8) that people need to use what stands on it: before fronts, and all round vehicles and machines."""
    strips: list[Floats] = []
    for item in objects:
        roles, (depth, width, _) = set(categories[item.category].roles), item.size_m
        if item.support.kind == "floor" and roles & {"vehicle", "machine"}:
            strips.append(world_box(item, 0.0, 0.0, 0.0, (depth + 2.0 * _USE_M, width + 2.0 * _USE_M, _USE_HEIGHT_M), 0.0))
        elif item.support.kind == "floor" and roles & set(_FRONT_USED):
            strips.append(world_box(item, 0.5 * (depth + _USE_M), 0.0, 0.0, (_USE_M, width, _USE_HEIGHT_M), 0.0))
    return np.array(strips, np.float64).reshape(-1, 8)


def by_wall(
    rng: np.random.Generator,
    thing: Thing,
    category: Category,
    item: SceneObject,
    wall: Floats,
    doors: Sequence[Point2],
    inside: Callable[[SceneObject], bool],
    boxes: Boxes,
    owners: Ints,
) -> SceneObject | None:
    """Return a thing with its back to a wall, None where no drawn pose is free.

    Args:
        rng: source of randomness.
        thing: its rule.
        category: its solids.
        item: the thing, with its size and without a place.
        wall: rows of :func:`grammar.geometry.walls.wall_rows`.
        doors: the nearest places (x, y) of the doors that it belongs by; none: it may be anywhere.
        inside: whether the footprint of a placed thing is inside the room.
        boxes: (n, 8) what is in the way.
        owners: (n,) whose these are, 0 for space that is kept free.
    """
    standing = boxes[(owners > 0) & (boxes[:, Z_LOW] < _KNEE_HIGH_M)]
    boxes = boxes.copy()
    boxes[boxes[:, Z_LOW] < _KNEE_HIGH_M, Z_LOW] = 0.0  # nothing is pushed under a radiator
    free = [
        (_nearness(placed, wall, k, along, standing), n, placed)
        for n, (k, along, placed) in enumerate(_along_walls(rng, thing, item, wall))
        if (not doors or min(math.dist(placed.position_m[:2], door) for door in doors) < DOOR_REACH_M)
        and inside(placed)
        and clear_of(category, placed, boxes, owners)
    ]
    return min(free, key=lambda found: found[:2])[2] if free else None


def _along_walls(rng: np.random.Generator, thing: Thing, item: SceneObject, wall: Floats) -> Iterator[tuple[int, float, SceneObject]]:
    """Yield poses against walls that are long enough: wall, place of the middle along it, and the placed thing."""
    shares = wall[:, LENGTH] / wall[:, LENGTH].sum()
    for _ in range(TRIALS):
        row = wall[k := int(rng.choice(len(wall), p=shares))]
        turn, along = draw_turn(rng, thing, 0.0), float(rng.uniform()) * row[LENGTH]
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        off = 0.5 * (item.size_m[0] * c + item.size_m[1] * s) + _GAP_M + abs(float(rng.normal(0.0, _GAP_SD_M)))
        x, y = row[START_X] + along * row[ALONG_X] + off * row[NORMAL_X], row[START_Y] + along * row[ALONG_Y] + off * row[NORMAL_Y]
        yaw = math.remainder(row[WALL_YAW] + turn, 2.0 * math.pi)
        yield k, along, replace(item, position_m=(float(x), float(y), 0.0), yaw_rad=yaw, support=Supported(kind="floor"))


def _nearness(placed: SceneObject, wall: Floats, k: int, along: float, standing: Boxes) -> float:
    """Return the distance in metres to a corner of the room at an end of the wall, or to what stands there, whichever is nearer."""
    box, half = whole_box(placed), 0.5 * max(placed.size_m[:2])
    ends = [along - half] if wall[k, REFLEX] == 0.0 else []
    ends += [wall[k, LENGTH] - along - half] if wall[(k + 1) % len(wall), REFLEX] == 0.0 else []
    return min([math.inf, *map(float, ends), *(-footprint_penetration(box, other) for other in standing)])
