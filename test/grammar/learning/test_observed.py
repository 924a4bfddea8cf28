"""Outlines as sources give them: what doors take of them or add to them is none of the room."""

import math

import pytest
from shapely import Polygon

from grammar.learning.observed import ObservedObject, between_walls, filled_outline, wall_poses

_ROOM = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]

_DOORS = {
    "niche": [(1.0, 0.0), (1.0, -0.1), (1.8, -0.1), (1.8, 0.0)],
    "step": [(1.0, 0.0), (1.0, 0.1), (1.8, 0.1), (1.8, 0.0)],
}
"""Points of the wall along x between its ends."""

_KEPT = {
    "notch of an L": [(0.0, 0.0), (3.2, 0.0), (3.2, 0.6), (4.0, 0.6), (4.0, 3.0), (0.0, 3.0)],
    "chimney breast": [(0.0, 0.0), (1.0, 0.0), (1.0, 0.4), (1.8, 0.4), (1.8, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)],
    "half a wall that stands back": [(0.0, 0.0), (2.0, 0.0), (2.0, 0.1), (4.0, 0.1), (4.0, 3.0), (0.0, 3.0)],
}


def _sorted(polygon):
    return sorted((round(x, 6), round(y, 6)) for x, y in polygon)


@pytest.mark.parametrize("name", _DOORS)
def test_the_thickness_of_the_wall_in_a_door_is_none_of_the_room_and_taken_from_none(name):
    assert _sorted(filled_outline([_ROOM[0], *_DOORS[name], *_ROOM[1:]])) == _sorted(_ROOM)


def test_a_door_in_a_corner_takes_no_step_of_the_room():
    cornered = [(0.0, 0.0), (3.2, 0.0), (3.2, 0.1), (4.0, 0.1), (4.0, 3.0), (0.0, 3.0)]

    assert _sorted(filled_outline(cornered)) == _sorted(_ROOM)


@pytest.mark.parametrize("name", _KEPT)
def test_what_is_deeper_than_a_wall_or_wider_than_a_door_stays(name):
    found = Polygon(filled_outline(_KEPT[name]))

    assert found.symmetric_difference(Polygon(_KEPT[name])).area == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("yaw_rad", [0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi])
def test_what_is_longer_than_its_room_fits_between_the_walls(yaw_rad):
    # 3.03 m between walls that are 3 m apart, 1 cm in one and 2 cm in the other: as far off them it is 2.97 m long
    turned = abs(math.sin(yaw_rad)) > 0.5
    size = (3.03, 0.9, 2.0) if turned else (0.9, 3.03, 2.0)
    item = ObservedObject(category="shower_cabin", size_m=size, position_m=(0.6, 1.505, 0.0), yaw_rad=yaw_rad)

    found = between_walls(_ROOM, item)

    assert sorted(found.size_m) == pytest.approx([0.9, 2.0, 2.97])
    assert found.position_m == pytest.approx((0.6, 1.495, 0.0))
    assert sorted(pose.gap_m for pose in wall_poses(_ROOM, found))[:2] == pytest.approx([0.01, 0.02])


def test_what_only_one_wall_has_a_part_of_keeps_its_size():
    item = ObservedObject(category="bed", size_m=(2.0, 1.4, 0.5), position_m=(0.98, 1.5, 0.0), yaw_rad=0.0)

    assert between_walls(_ROOM, item) == item
