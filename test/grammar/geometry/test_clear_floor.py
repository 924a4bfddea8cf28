"""Clear floor: rectangles that walls and obstacles leave free."""

import math

import numpy as np
import pytest

from grammar.geometry.wall_spans import is_clear
from grammar.geometry.walls import wall_rows

L_SHAPE = wall_rows([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)])


def box(x, y, half_depth, half_width, yaw=0.0):
    return np.array([x, y, 0.0, 1.0, half_depth, half_width, math.cos(yaw), math.sin(yaw)])


@pytest.mark.parametrize(
    ("rectangle", "clear"),
    [
        (box(1, 1, 1, 1), True),  # touches two walls
        (box(1, 1, 1.01, 1), False),  # comes through one
        (box(2, 2, 0.5, 0.5), False),  # the corner that points inwards
        (box(3, 3, 0.5, 0.5), False),  # wholly outside
        (box(1, 1, 0.9, 0.9, math.pi / 4), False),  # turned, its corners come through
        (box(1, 2, 1.99, 0.9, math.pi / 2), True),
        (box(2, 1, 1.9, 0.9), True),
    ],
)
def test_a_rectangle_is_clear_where_no_wall_comes_into_it(rectangle, clear):
    assert is_clear(L_SHAPE, np.zeros((0, 8)), rectangle) is clear


def test_what_stands_there_is_in_the_way_and_what_touches_is_not():
    assert is_clear(L_SHAPE, np.array([box(2.5, 1, 0.5, 0.5)]), box(1, 1, 1, 1))
    assert not is_clear(L_SHAPE, np.array([box(2.4, 1, 0.5, 0.5)]), box(1, 1, 1, 1))
