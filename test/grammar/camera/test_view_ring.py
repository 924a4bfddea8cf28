"""Views: rays with known lengths, the value of a view, the best sequence of turns against enumeration."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from grammar.camera.path_config import ViewWeights
from grammar.camera.view_ring import RING_COLUMNS, Ring, best_columns, cast_ring, column_azimuth_rad, view_values

ROOM = np.array([(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)])
EYE = np.array([2.0, 1.0, 1.5])
QUARTER = RING_COLUMNS // 4


def test_rays_in_an_empty_room_end_at_walls_floor_and_ceiling() -> None:
    distance, hit, plane = cast_ring(ROOM, 2.5, np.zeros((0, 8)), EYE, np.array([0.0, -math.pi / 4, math.pi / 4]))
    assert (hit == -1).all()
    assert plane[::QUARTER].tolist() == [[1, 4, 5], [2, 4, 5], [3, 4, 5], [0, 0, 0]], "four walls, floor, ceiling"
    np.testing.assert_allclose(distance[::QUARTER, 0], [4.0, 3.0, 2.0, 1.0])
    np.testing.assert_allclose(distance[::QUARTER, 1], math.sqrt(2.0) * np.array([1.5, 1.5, 1.5, 1.0]))
    np.testing.assert_allclose(distance[::QUARTER, 2], math.sqrt(2.0) * np.array([1.0, 1.0, 1.0, 1.0]))


def test_a_ray_into_a_corner_ends_there() -> None:
    square = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])
    turn = 2.0 * math.pi * 47 / RING_COLUMNS
    distance, _, _ = cast_ring(square, 2.5, np.zeros((0, 8)), np.array([-0.01 * math.cos(turn), -0.01 * math.sin(turn), 1.5]), np.zeros(1))
    assert distance[47, 0] == pytest.approx(0.01)


def test_rays_stop_at_the_nearest_box_and_name_it() -> None:
    turned = math.pi / 4
    boxes = np.array([[5.0, 1.0, 0.0, 2.0, 0.5, 0.5, 1.0, 0.0], [4.0, 1.0, 1.0, 2.0, 0.5, 0.5, math.cos(turned), math.sin(turned)]])
    distance, hit, plane = cast_ring(ROOM, 2.5, boxes, EYE, np.array([0.0, -0.2]))
    assert distance[0, 0] == pytest.approx(2.0 - 0.5 * math.sqrt(2.0))
    assert hit[0].tolist() == [1, 1]
    assert plane[0, 0] in (9, 10), "a side of the second box, three planes each after walls, floor and ceiling"
    below = cast_ring(ROOM, 2.5, boxes, EYE, np.array([-0.45]))
    assert below[1][0, 0] == 0, "passes below the hanging box"
    assert below[0][0, 0] == pytest.approx(2.5 / math.cos(0.45))
    assert hit[2 * QUARTER].tolist() == [-1, -1], "boxes behind the eye are not seen"


def ring_of(distance: NDArray[np.float64], hit: NDArray[np.int64]) -> Ring:
    """Return a ring whose rays all meet planes of their own, one a column."""
    return Ring(distance, hit, np.broadcast_to(np.arange(RING_COLUMNS)[:, None], hit.shape).copy())


PLAIN = ViewWeights(
    near_m=0.8,
    far_m=4.0,
    least_depth_m=0.0,
    most_share=0.35,
    depth=1.0,
    objects=2.0,
    shown=0.0,
    near=3.0,
    filled=0.0,
    missing=0.0,
    light=0.0,
    line=0.0,
    bare=0.0,
    main=0.0,
    slab=0.0,
)
DARK = np.zeros(2, np.bool_)
LEVEL, THREE = np.zeros(1), np.array([-0.2, 0.0, 0.2])


def test_value_of_a_view_is_its_formula() -> None:
    distance = np.full((RING_COLUMNS, 1), 2.0)
    hit = np.full((RING_COLUMNS, 1), -1)
    distance[9:12], hit[9], hit[10], hit[11] = 0.5, 0, 1, 0
    ring = ring_of(distance, hit)
    wall = view_values(ring._replace(hit=np.full_like(hit, -1)), DARK, LEVEL, 3, PLAIN)
    assert wall[10] == pytest.approx(0.125 - 3.0), "a wall is not as much in the way as a thing"
    values = view_values(ring, DARK, LEVEL, 3, PLAIN)
    assert values[30] == pytest.approx(0.5)
    assert values[10] == pytest.approx(0.125 + 2.0 * (1 - 0.8) - 2 * 3.0), "two things, both cut by the view's lower edge"
    assert values[12] == pytest.approx((0.125 + 1.0) / 3 + 2.0 * (1 - math.sqrt(0.8)) - 2 * 3.0 / 3)
    # what each of the other terms adds
    filled = view_values(ring, DARK, LEVEL, 3, PLAIN._replace(filled=1.5)) - values
    assert filled[10] == pytest.approx(-1.5 * (2 / 3 - 0.35)) and filled[30] == 0.0, "two of three rays meet the first box"
    wide = ring._replace(plane=np.zeros_like(hit))
    assert (view_values(wide, DARK, LEVEL, 3, PLAIN._replace(filled=1.5)) - values)[30] == pytest.approx(-1.5 * 0.65), "a plane"
    assert (view_values(ring, DARK, LEVEL, 3, PLAIN._replace(missing=0.5)) - values)[[10, 12, 30]] == pytest.approx([-1.0, -1.5, -2.0])
    assert (view_values(ring, DARK, LEVEL, 3, PLAIN._replace(shown=0.6)) - values)[[10, 12, 30]] == pytest.approx([0.6, 0.2, 0.0])
    main = view_values(ring, DARK, LEVEL, 3, PLAIN._replace(main=0.9), main=1) - values
    assert main[[10, 12, 30]] == pytest.approx([0.9, 0.0, 0.0]), "the second box"
    slab = PLAIN._replace(slab=1.2)
    tall = [view_values(ring, DARK, LEVEL, 3, slab, tall=np.array(which)) - values for which in ([True], [False, True], [True, True])]
    assert np.array(tall)[:, 10] == pytest.approx([-0.8, -0.4, -1.2]), "near, tall and cut by the view's lower edge"
    farther = PLAIN._replace(slab=1.2, near_m=0.2)
    plain = view_values(ring, DARK, LEVEL, 3, farther._replace(slab=0.0))
    assert (view_values(ring, DARK, LEVEL, 3, farther, tall=np.array([True])) == plain).all(), "farther than twice 0.2 m"
    bare = PLAIN._replace(bare=2.0)
    assert (view_values(ring, DARK, LEVEL, 3, bare) - values)[[10, 12, 30]] == pytest.approx([0.0, -2.0 * (2 / 3 - 0.3), -1.4]), "walls"
    assert (view_values(wide, DARK, LEVEL, 3, bare, floor_plane=0) == values - (view_values(wide, DARK, LEVEL, 3, PLAIN) - values)).all()
    assert (view_values(ring, np.array([False, True]), LEVEL, 3, PLAIN._replace(light=0.7)) - values)[[10, 12, 30]] == pytest.approx(
        [0.7, 0, 0]
    )
    assert (view_values(ring, DARK, LEVEL, 3, PLAIN._replace(least_depth_m=1.0)) - values)[[10, 12]] == pytest.approx([-5, 0]), "refused"


def test_what_is_cut_by_sides_or_lower_edge_counts_half() -> None:
    hit = np.full((RING_COLUMNS, 3), -1)
    hit[10, 1] = 0
    ring = ring_of(np.full((RING_COLUMNS, 3), 2.0), hit)
    only = PLAIN._replace(depth=0.0, near=0.0)
    assert view_values(ring, DARK, THREE, 3, only)[[10, 11, 12]] == pytest.approx([0.4, 2.0 * (1 - math.sqrt(0.8)), 0.0])
    hit[10, 0] = 0
    assert view_values(ring, DARK, THREE, 3, only)[10] == pytest.approx(2.0 * (1 - math.sqrt(0.8)))


def test_near_is_measured_along_the_optical_axis() -> None:
    distance = np.full((RING_COLUMNS, 1), 2.0)
    distance[16] = 0.9
    ring, only = ring_of(distance, np.full((RING_COLUMNS, 1), -1)), PLAIN._replace(depth=0.0, objects=0.0)
    values = view_values(ring, DARK, LEVEL, 15, only)
    assert values[[16, 13]].tolist() == [0.0, 0.0], "0.9 m ahead, and 15 degrees aside, 0.87 m"
    assert values[[10, 22]] == pytest.approx([-0.2, -0.2]), "30 degrees aside it is 0.78 m deep"
    assert view_values(ring, DARK, np.array([-0.6]), 15, only)[16] == pytest.approx(-0.2), "below"


def test_in_a_tiny_room_less_depth_is_enough() -> None:
    distance = np.full((RING_COLUMNS, 1), 0.9)
    distance[QUARTER], distance[2 * QUARTER] = 2.0, 0.7
    ring, none = ring_of(distance, np.full((RING_COLUMNS, 1), -1)), PLAIN._replace(near=0.0)
    less = view_values(ring, DARK, LEVEL, 1, none._replace(least_depth_m=1.2)) - view_values(ring, DARK, LEVEL, 1, none)
    assert less[[0, 2 * QUARTER]] == pytest.approx([0.0, -5.0]), "0.4 of the longest line is 0.8 m"


def test_where_it_is_narrow_the_longest_free_line_counts() -> None:
    distance = np.full((RING_COLUMNS, 1), 3.0)
    distance[QUARTER] = distance[3 * QUARTER] = 0.9
    distance[0] = 6.0
    ring = ring_of(distance, np.full((RING_COLUMNS, 1), -1))
    more = view_values(ring, DARK, LEVEL, 3, PLAIN._replace(line=0.8)) - view_values(ring, DARK, LEVEL, 3, PLAIN)
    assert more[[0, 5]] == pytest.approx([0.8, 0.4]), "1.8 m wide"
    elsewhere = view_values(ring, DARK, LEVEL, 3, PLAIN._replace(line=0.8), 8.0) - view_values(ring, DARK, LEVEL, 3, PLAIN, 8.0)
    assert elsewhere[[0, 5]] == pytest.approx([0.6, 0.3]), "8 m from another place"
    distance[QUARTER] = 2.5
    assert (view_values(ring, DARK, LEVEL, 3, PLAIN._replace(line=0.8)) == view_values(ring, DARK, LEVEL, 3, PLAIN)).all()


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
