"""Views: rays with known lengths, the value of a view, the best sequence of turns against enumeration."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from grammar.camera.path_config import ViewWeights
from grammar.camera.view_ring import RING_COLUMNS, best_columns, cast_ring, column_azimuth_rad, view_values

ROOM = np.array([(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)])
EYE = np.array([2.0, 1.0, 1.5])
QUARTER = RING_COLUMNS // 4


def test_rays_in_an_empty_room_end_at_walls_floor_and_ceiling() -> None:
    distance, hit = cast_ring(ROOM, 2.5, np.zeros((0, 8)), EYE, np.array([0.0, -math.pi / 4, math.pi / 4]))
    assert (hit == -1).all()
    np.testing.assert_allclose(distance[::QUARTER, 0], [4.0, 3.0, 2.0, 1.0])
    np.testing.assert_allclose(distance[::QUARTER, 1], math.sqrt(2.0) * np.array([1.5, 1.5, 1.5, 1.0]))
    np.testing.assert_allclose(distance[::QUARTER, 2], math.sqrt(2.0) * np.array([1.0, 1.0, 1.0, 1.0]))


def test_rays_stop_at_the_nearest_box_and_name_it() -> None:
    turned = math.pi / 4
    boxes = np.array([[5.0, 1.0, 0.0, 2.0, 0.5, 0.5, 1.0, 0.0], [4.0, 1.0, 1.0, 2.0, 0.5, 0.5, math.cos(turned), math.sin(turned)]])
    distance, hit = cast_ring(ROOM, 2.5, boxes, EYE, np.array([0.0, -0.2]))
    assert distance[0, 0] == pytest.approx(2.0 - 0.5 * math.sqrt(2.0))
    assert hit[0].tolist() == [1, 1]
    below = cast_ring(ROOM, 2.5, boxes, EYE, np.array([-0.45]))
    assert below[1][0, 0] == 0, "passes below the hanging box"
    assert below[0][0, 0] == pytest.approx(2.5 / math.cos(0.45))
    assert hit[2 * QUARTER].tolist() == [-1, -1], "boxes behind the eye are not seen"


def test_value_of_a_view_is_its_formula() -> None:
    distance = np.full((RING_COLUMNS, 1), 2.0)
    hit = np.full((RING_COLUMNS, 1), -1)
    distance[9:12], hit[9], hit[10], hit[11] = 0.5, 0, 1, 0
    values = view_values(distance, hit, 2, 3, ViewWeights(near_m=0.8, far_m=4.0, depth=1.0, objects=2.0, near=3.0))
    assert values[30] == pytest.approx(0.5)
    assert values[10] == pytest.approx(0.125 + 2.0 * (1 - 0.8**2) - 3.0)
    assert values[12] == pytest.approx((0.125 + 1.0) / 3 + 2.0 * (1 - 0.8) - 3.0 / 3)


def test_best_turns_agree_with_enumeration() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(size=(4, 6))
    for most, cost in ((1, 0.0), (1, 0.3), (2, 0.1)):
        path = best_columns(values, most, cost)

        def score(columns: tuple[int, ...], most: int = most, cost: float = cost) -> float:
            turns = [(b - a + 3) % 6 - 3 for a, b in itertools.pairwise(columns)]
            allowed = all(abs(turn) <= most for turn in turns)
            return sum(values[k, c] for k, c in enumerate(columns)) - cost * sum(t * t for t in turns) if allowed else -math.inf

        best = max(itertools.product(range(6), repeat=4), key=score)
        assert tuple(path) == best


def test_columns_lie_counter_clockwise_from_x() -> None:
    azimuth = column_azimuth_rad()
    assert len(azimuth) == RING_COLUMNS
    assert azimuth[0] == 0.0
    assert azimuth[QUARTER] == pytest.approx(math.pi / 2)
