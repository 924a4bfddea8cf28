"""Rows of walls: of a room that is known, and each caller's own."""

import math

import pytest

from grammar.geometry.walls import ALONG_X, LENGTH, NORMAL_X, NORMAL_Y, REFLEX, WALL_YAW, wall_rows

L_SHAPE = ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, 3.0), (0.0, 3.0))


def test_rows_of_a_room_with_a_corner_that_sticks_in() -> None:
    rows = wall_rows(L_SHAPE)
    assert rows[:, LENGTH] == pytest.approx([4.0, 2.0, 2.0, 1.0, 2.0, 3.0])
    assert rows[0, [ALONG_X, NORMAL_X, NORMAL_Y, WALL_YAW]] == pytest.approx([1.0, 0.0, 1.0, 0.5 * math.pi])
    assert rows[:, REFLEX].tolist() == [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]


def test_what_one_caller_does_to_its_rows_no_other_sees() -> None:
    mine = wall_rows(L_SHAPE)
    mine[:] = 0.0
    assert wall_rows(L_SHAPE)[0, LENGTH] == 4.0
    assert (wall_rows([list(point) for point in L_SHAPE]) == wall_rows(L_SHAPE)).all()
