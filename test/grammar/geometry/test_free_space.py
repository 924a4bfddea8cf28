"""Free space: rasters against shapely, passages of known width, shares that can be counted by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.affinity import rotate
from shapely.geometry import Point, Polygon, box

from grammar.geometry.free_space import FreeSpace, centre_of, centres_of, occupancy_grid, rasterize, reachable, standable, walkable_share
from scene_description import SceneSynthError

ROOM = ((0.0, 0.0), (5.0, 0.0), (5.0, 4.0), (0.0, 4.0))
L_ROOM = ((-1.0, -2.0), (3.0, -2.0), (3.0, 0.0), (1.0, 0.0), (1.0, 2.0), (-1.0, 2.0))
NO_BOXES = np.zeros((0, 8))


def solid(x: float, y: float, depth: float, width: float, yaw: float = 0.0, low: float = 0.0, high: float = 1.0) -> list[float]:
    return [x, y, low, high, depth / 2, width / 2, math.cos(yaw), math.sin(yaw)]


def boxes(*rows: list[float]) -> NDArray[np.float64]:
    return np.array(rows)


def footprint(row: list[float]) -> Polygon:
    x, y, _, _, u, v, c, s = row
    return rotate(box(x - u, y - v, x + u, y + v), math.degrees(math.atan2(s, c)), origin=(x, y))


def divided_room(gap_m: float) -> FreeSpace:
    """The room with a wall along x = 3 that leaves a gap from y = 0.5 on."""
    top = 4.0 - 0.5 - gap_m
    return rasterize(ROOM, boxes(solid(3.0, 0.25, 0.1, 0.5), solid(3.0, 4.0 - top / 2, 0.1, top)), 0.05, 1.5)


def test_empty_room_is_all_inside_and_its_clearance_is_the_distance_to_the_nearest_wall() -> None:
    free = rasterize(ROOM, NO_BOXES, 0.1, 1.5)
    assert free.inside.shape == (40, 50)
    assert free.inside.all()
    assert not free.occupied.any()
    x, y = np.meshgrid(np.arange(50) * 0.1 + 0.05, np.arange(40) * 0.1 + 0.05)
    np.testing.assert_allclose(free.clearance_m, np.minimum.reduce([x, y, 5.0 - x, 4.0 - y]), atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_raster_agrees_with_shapely(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = [solid(*rng.uniform(-1, 3, 2), *rng.uniform(0.05, 1.2, 2), rng.uniform(-4, 4)) for _ in range(6)]
    free = rasterize(L_ROOM, boxes(*rows), 0.17, 1.5)
    room, prints = Polygon(L_ROOM), [footprint(row) for row in rows]
    side = free.resolution_m
    for row, column in np.ndindex(free.inside.shape):
        x, y = centre_of(free, row, column)
        square = box(x - side / 2, y - side / 2, x + side / 2, y + side / 2)
        assert free.inside[row, column] == room.contains(Point(x, y))
        gap = min(square.distance(shape) for shape in prints)
        if gap > 1e-9:
            assert not free.occupied[row, column]
        elif max(square.intersection(shape).area for shape in prints) > 1e-9:
            assert free.occupied[row, column]
        nearest = min(room.exterior.distance(Point(x, y)), *(shape.distance(Point(x, y)) for shape in prints))
        assert free.clearance_m[row, column] == pytest.approx(nearest if room.contains(Point(x, y)) else 0.0, abs=1e-9)


def test_origin_is_a_multiple_of_the_resolution_and_the_raster_covers_the_room() -> None:
    free = rasterize(((-0.33, 0.12), (1.01, 0.12), (1.01, 0.99), (-0.33, 0.99)), NO_BOXES, 0.25, 1.5)
    assert free.origin_m == (-0.5, 0.0)
    assert free.inside.shape == (4, 7)
    assert centre_of(free, 0, 0) == (-0.375, 0.125)
    assert centre_of(free, 3, 0) == (-0.375, 0.875)


def test_centres_of_cells_are_those_of_each() -> None:
    free = rasterize(np.array(ROOM) - (1.3, 0.7), NO_BOXES, 0.5, 1.5)
    cells = np.zeros_like(free.inside)
    cells[[0, 3, 3], [2, 0, 5]] = True
    np.testing.assert_allclose(centres_of(free, cells), [centre_of(free, *cell) for cell in ((0, 2), (3, 0), (3, 5))])


def test_what_hangs_above_the_clearance_height_does_not_count() -> None:
    lamp = boxes(solid(2.5, 2.0, 0.5, 0.5, low=1.6, high=2.0))
    assert not rasterize(ROOM, lamp, 0.05, 1.5).occupied.any()
    assert rasterize(ROOM, lamp, 0.05, 1.7).occupied.sum() == pytest.approx(100, abs=44), "10 x 10 cells and those it touches"


@pytest.mark.parametrize(("gap_m", "radius_m", "passes"), [(0.7, 0.3, True), (0.5, 0.3, False), (0.9, 0.4, True), (0.75, 0.4, False)])
def test_a_disc_passes_a_gap_that_is_wider_than_itself(gap_m: float, radius_m: float, passes: bool) -> None:
    free = divided_room(gap_m)
    reached = reachable(free, radius_m, (1.0, 2.0))
    here, beyond = (reached[round(y / 0.05), round(x / 0.05)] for x, y in ((1.0, 2.0), (4.2, 2.0)))
    assert here
    assert beyond == passes


def test_reached_cells_are_free_and_connected_by_sides() -> None:
    free = divided_room(0.7)
    reached = reachable(free, 0.3, (1.0, 2.0))
    assert not (reached & ~standable(free, 0.3)).any()
    assert free.clearance_m[reached].min() >= 0.3 - 1e-9
    diagonal = rasterize(((0, 0), (2, 0), (2, 2), (0, 2)), boxes(solid(0.5, 1.5, 1, 1), solid(1.5, 0.5, 1, 1)), 1.0, 1.5)
    open_cells = diagonal._replace(clearance_m=np.array([[1.0, 0.0], [0.0, 1.0]]))
    np.testing.assert_array_equal(reachable(open_cells, 0.1, (0.5, 0.5)), [[True, False], [False, False]])


def test_walk_begins_near_the_threshold_or_not_at_all() -> None:
    free = rasterize(ROOM, NO_BOXES, 0.05, 1.5)
    assert reachable(free, 0.3, (2.5, 0.0)).sum() == standable(free, 0.3).sum() == (100 - 12) * (80 - 12)
    blocked = rasterize(ROOM, boxes(solid(2.5, 0.5, 1.4, 1.0)), 0.05, 1.5)
    assert not reachable(blocked, 0.3, (2.5, 0.0)).any()
    assert walkable_share(blocked, 0.3, (2.5, 0.0)) == 0.0


def test_walkable_share_is_the_ratio_of_eroded_areas() -> None:
    free = rasterize(ROOM, boxes(solid(3.0, 2.0, 0.2, 4.0)), 0.05, 1.5)
    left, right = (2.9 - 0.4) * (4.0 - 0.4), (5.0 - 3.1 - 0.4) * (4.0 - 0.4)
    assert walkable_share(free, 0.2, (0.0, 2.0)) == pytest.approx(left / (left + right), rel=1e-9)
    assert walkable_share(free, 0.2, (5.0, 2.0)) == pytest.approx(right / (left + right), rel=1e-9)
    assert walkable_share(rasterize(ROOM, NO_BOXES, 0.05, 1.5), 0.2, (0.0, 2.0)) == 1.0


def test_a_full_room_has_no_walkable_share() -> None:
    assert walkable_share(rasterize(ROOM, boxes(solid(2.5, 2.0, 5.0, 4.0)), 0.05, 1.5), 0.2, (0.0, 2.0)) == 0.0


def test_occupancy_grid_has_the_values_and_rows_of_nav_msgs() -> None:
    free = rasterize(L_ROOM, boxes(solid(0.0, -1.5, 0.9, 0.9)), 0.5, 1.5)
    grid = occupancy_grid(free)
    assert grid.dtype == np.int8
    expected = np.zeros((8, 8), int)
    expected[4:, 4:] = -1
    expected[:2, 1:3] = 100
    np.testing.assert_array_equal(grid, expected)


def test_refuses_rasters_that_would_not_fit_into_memory() -> None:
    with pytest.raises(SceneSynthError, match=r"at most 16000000 cells, got 20000 x 20000; raise resolution_m from 0\.1$"):
        rasterize(((-1000, -1000), (1000, -1000), (1000, 1000), (-1000, 1000)), NO_BOXES, 0.1, 1.5)
