"""Tidy things on the floor: with their backs to walls, packed, by doors, and off the floor that people use."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar.geometry.boxes import HALF_DEPTH, HALF_WIDTH, X, Y
from grammar.geometry.solids import local_solids
from grammar.geometry.walls import wall_rows
from grammar.small_things.place import DOOR_REACH_M, Newcomer, Obstacles, by_wall, use_strips
from grammar.small_things.rules import Thing
from grammar.small_things.sites import FloorSite, Surroundings
from scene_description import ModelReference, Room, SceneObject, Support

WALL = wall_rows(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)))
BOX = Thing(size_m=(0.3, 0.4, 0.3), sd_m=(0.01, 0.01, 0.01), turns=(0.0,))
NOTHING, NOBODY = np.empty((0, 8)), np.empty(0, np.int64)


def thing(category: str, x: float, y: float, yaw: float, size_m: tuple[float, float, float]) -> SceneObject:
    return SceneObject(
        id=1, category=category, label=0, size_m=size_m, position_m=(x, y, 0.0), yaw_rad=yaw, support=Support(kind="floor"),
        model=ModelReference(generator=category), parts=(),
    )  # fmt: skip


def placed(
    seed: int, boxes: np.ndarray = NOTHING, owners: np.ndarray = NOBODY, doors: tuple[tuple[float, float], ...] = ()
) -> SceneObject | None:
    box = thing("cardboard_box", 0.0, 0.0, 0.0, BOX.size_m)
    inside = lambda item: 0.14 < item.position_m[0] < 3.86 and 0.14 < item.position_m[1] < 2.86  # noqa: E731
    return by_wall(
        np.random.default_rng(seed),
        Newcomer(BOX, box, local_solids(CATEGORIES["cardboard_box"], box.size_m)),
        WALL,
        doors,
        inside,
        Obstacles(boxes, owners),
    )


def wall_gap(item: SceneObject) -> float:
    x, y = item.position_m[:2]
    return min(x, y, 4.0 - x, 3.0 - y) - 0.15


@pytest.mark.parametrize("seed", range(5))
def test_a_box_stands_with_its_back_to_a_wall_near_a_corner_or_a_neighbour(seed: int) -> None:
    alone = placed(seed)
    assert alone is not None and -0.01 < wall_gap(alone) < 0.1
    # of 40 places along 14 m of wall, one is near one of the four corners
    assert min(math.dist(alone.position_m[:2], corner) for corner in ((0, 0), (4, 0), (4, 3), (0, 3))) < 0.6
    # two walls of 4 m are taken up to 3 cm, but for a box in the middle of one of them that it comes to stand beside
    neighbour = np.array([[2.0, 0.2, 0.0, 0.5, 0.2, 0.2, 1.0, 0.0]])
    kept = np.array(
        [[0.5, 1.5, 0.0, 2.0, 0.6, 1.6, 1.0, 0.0], [3.5, 1.5, 0.0, 2.0, 0.6, 1.6, 1.0, 0.0], [2.0, 2.5, 0.0, 2.0, 2.0, 1.0, 1.0, 0.0]]
    )
    beside = placed(seed, np.concatenate([neighbour, kept]), np.array([7, 0, 0, 0]))
    assert beside is not None and beside.position_m[1] < 0.3 and abs(beside.position_m[0] - 2.0) < 0.7


def test_shoes_stand_by_a_door_or_nowhere() -> None:
    near = placed(3, doors=((4.0, 1.5),))
    assert near is not None and math.dist(near.position_m[:2], (4.0, 1.5)) < DOOR_REACH_M
    assert placed(3, doors=((20.0, 1.5),)) is None


def test_the_floor_before_fronts_and_around_cars_is_used() -> None:
    shelf, car, plant = (
        thing("storage_shelf", 1.0, 2.0, math.pi / 2, (0.4, 1.0, 1.8)),
        thing("car", 0.0, 0.0, 0.0, (4.0, 1.8, 1.5)),
        thing("potted_plant", 0.0, 0.0, 0.0, (0.3, 0.3, 0.8)),
    )
    before, around = use_strips(CATEGORIES, [shelf, car, plant])
    assert before[[X, Y, HALF_DEPTH, HALF_WIDTH]] == pytest.approx([1.0, 2.0 + 0.2 + 0.275, 0.275, 0.5])
    assert around[[X, Y, HALF_DEPTH, HALF_WIDTH]] == pytest.approx([0.0, 0.0, 2.55, 1.45])


@pytest.mark.parametrize(("height_m", "stands"), [(0.3, True), (1.3, False)])
def test_what_is_as_high_as_a_broom_leans_at_a_wall_or_is_not_there(height_m: float, stands: bool) -> None:
    room = Room(polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), height_m=2.5, wall_thickness_m=0.1, openings=(), surfaces=())
    bench = thing("workbench", 2.0, 1.5, 0.0, (0.6, 0.6, 0.9))
    walls = np.array(
        [[2.0, y, 0.0, 2.0, 2.0, 0.3, 1.0, 0.0] for y in (0.3, 2.7)] + [[x, 1.5, 0.0, 2.0, 0.3, 1.5, 1.0, 0.0] for x in (0.3, 3.7)]
    )
    site = FloorSite(tidy={}, late={}, beside="wall", anchors=[bench], doors=(), free=walls, used=NOTHING)
    item = replace(thing("broom", 0.0, 0.0, 0.0, (0.14, 0.32, height_m)), id=2)
    newcomer = Newcomer(BOX, item, local_solids(CATEGORIES["broom"], item.size_m))
    found = site.place(np.random.default_rng(1), newcomer, 0.0, Surroundings(CATEGORIES, room, [bench]))
    assert (found is not None) == stands
