"""Walks over the free floor: where a carried camera may be, shortest paths between viewpoints, smoothing that touches nothing.

A point is allowed where the disc of the carrier's body clears everything from the floor up to the lens, and the lens clears everything
around its own height.  Distances to walls and boxes are exact, and they change by at most a metre per metre.  So the whole line between two
points is allowed if both keep half their distance from each other in reserve.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from grammar.geometry.arrays import Boxes, Floats, Ints
from grammar.geometry.boxes import Z_HIGH, Z_LOW, point_distance
from grammar.geometry.free_space import FreeSpace, centres_of, distance_to_outline, rasterize, standable
from grammar.geometry.kernels import entry

RELAXATION = ((1.0, 1.0), (1.0, 0.7), (0.8, 0.5), (0.6, 0.3), (0.0, 1.0), (0.0, 0.6), (0.0, 0.3))
"""Shares of body radius and lens clearance that are tried in turn; without a body the lens may hover over furniture."""
LEAST_AREA_M2 = 0.2
RESERVE_CELLS = 0.75
_PASSAGE_M = 0.15


class Ground(NamedTuple):
    """Where a camera may be.

    cells_m: (n, 2) float64, centres of a connected set of cells, world, metres; costs: (n, n) sparse, cost of a step between neighbours;
    polygon: (v, 2) outline; boxes: (b, 8) solids that count; keep_m: (b,) distance to keep from each box; wall_keep_m: distance to keep
    from the walls; reserve_m: distance that the cells keep beyond these.
    """

    cells_m: Floats
    costs: sparse.csr_matrix
    polygon: Floats
    boxes: Boxes
    keep_m: Floats
    wall_keep_m: float
    reserve_m: float


class Routes(NamedTuple):
    """Shortest paths from ``viewpoints`` (k,), rows of ``Ground.cells_m``; ``before`` (k, n): the cell before each one on its path.

    costs: (k, k), of the paths between viewpoints.
    """

    viewpoints: Ints
    before: NDArray[np.int32]
    costs: Floats


class Walk(NamedTuple):
    """A polyline through ``points_m`` (n, 2), with the progress ``at_m`` (n,) at each point.

    A step between points is never longer than the progress between them.
    """

    at_m: Floats
    points_m: Floats


def choose_ground(
    polygon: Floats,
    boxes: Boxes,
    lens_m: float,
    spath_m: float,
    body_radius_m: float,
    clearance_m: float,
    resolution_m: float,
    relaxation: Sequence[tuple[float, float]] = RELAXATION,
) -> Ground:
    """Return the largest connected ground for a lens at height ``lens_m``, which sways by ``spath_m`` up and down.

    The distances to keep shrink step by step, by the shares of ``relaxation``, until some ground is left; at worst it is the one cell with
    the greatest clearance.
    """
    feet = boxes[boxes[:, Z_LOW] < lens_m + spath_m]
    band = around_lens(boxes, lens_m, spath_m + clearance_m)
    reserve_m = RESERVE_CELLS * resolution_m
    lens_raster = rasterize(polygon, band, resolution_m, math.inf)
    feet_raster = rasterize(polygon, feet, resolution_m, math.inf)
    for body_share, lens_share in relaxation:
        body_keep, lens_keep = body_share * body_radius_m, lens_share * clearance_m
        allowed = standable(lens_raster, lens_keep + reserve_m)
        solids, keep = band, np.full(len(band), lens_keep)
        if body_share > 0.0:
            allowed &= standable(feet_raster, body_keep + reserve_m)
            solids, keep = np.concatenate([band, feet]), np.concatenate([keep, np.full(len(feet), body_keep)])
        cells = largest_component(allowed)
        if np.count_nonzero(cells) * resolution_m**2 >= LEAST_AREA_M2:
            return _ground(lens_raster, cells, polygon, solids, keep, max(lens_keep, body_keep), reserve_m)
    roomiest = np.zeros_like(lens_raster.inside)
    roomiest.flat[np.argmax(lens_raster.clearance_m)] = True
    return _ground(lens_raster, roomiest, polygon, band, np.zeros(len(band)), 0.0, reserve_m)


def find_routes(ground: Ground, viewpoints: Ints) -> Routes:
    """Return the shortest paths between viewpoints (Dijkstra), at a cost that prefers the middle of passages."""
    costs, before = csgraph.dijkstra(ground.costs, indices=viewpoints, return_predecessors=True)
    return Routes(viewpoints, before, costs[:, viewpoints])


def sample_walk(rng: np.random.Generator, ground: Ground, routes: Routes, length_m: float, smoothing_m: float) -> Walk:
    """Return a smooth walk of at least ``length_m`` over randomly chosen viewpoints; with a single viewpoint it stands there.

    Smoothing is a Gaussian of about ``smoothing_m`` along the path; at a turning point the camera slows down and comes back.
    """
    # join shortest paths until the walk is long enough
    here = int(rng.integers(len(routes.viewpoints)))
    cells, path_m = [int(routes.viewpoints[here])], 0.0
    while path_m < length_m and len(routes.viewpoints) > 1:
        there = (here + 1 + int(rng.integers(len(routes.viewpoints) - 1))) % len(routes.viewpoints)
        leg = leg_between(routes, here, there)
        path_m += float(np.linalg.norm(np.diff(ground.cells_m[leg], axis=0), axis=1).sum())
        cells += leg[1:]
        here = there
    # smooth the points; their progress stays at least the distance between them
    points = ground.cells_m[cells]  # a copy
    nominal = np.linalg.norm(np.diff(points, axis=0), axis=1)
    spacing = float(nominal.mean()) if len(nominal) else 1.0
    rounds = round(2.0 * (smoothing_m / spacing) ** 2)
    _smooth(points, ground.polygon, ground.boxes, ground.keep_m, ground.wall_keep_m, ground.reserve_m, rounds)
    steps = np.maximum(np.linalg.norm(np.diff(points, axis=0), axis=1), nominal)
    return Walk(np.concatenate([[0.0], np.cumsum(steps)]), points)


def position_at(walk: Walk, along_m: Floats) -> Floats:
    """Return the (n, 2) positions at the progress ``along_m`` (n,)."""
    return np.column_stack([np.interp(along_m, walk.at_m, walk.points_m[:, axis]) for axis in (0, 1)])


def around_lens(boxes: Boxes, lens_m: float, half_height_m: float) -> Boxes:
    """Return the solids that reach into a band of heights around the lens."""
    return boxes[(boxes[:, Z_LOW] < lens_m + half_height_m) & (boxes[:, Z_HIGH] > lens_m - half_height_m)]


def largest_component(allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the largest connected set of cells (4-neighbourhood)."""
    components, count = ndimage.label(allowed)
    if count == 0:
        return allowed
    return np.asarray(components == 1 + np.argmax(np.bincount(components.ravel())[1:]))


def _ground(
    raster: FreeSpace,
    cells: NDArray[np.bool_],
    polygon: Floats,
    boxes: Boxes,
    keep_m: Floats,
    wall_keep_m: float,
    reserve_m: float,
) -> Ground:
    # number the cells; passages cost more the narrower they are
    row, column = np.nonzero(cells)
    number = np.full(cells.shape, -1)
    number[row, column] = np.arange(len(row))
    cell_cost = 1.0 + _PASSAGE_M / np.maximum(raster.clearance_m[row, column], 0.01)
    # join each cell with its neighbours to the right and above
    starts, ends, costs = [], [], []
    padded = np.pad(number, 1, constant_values=-1)
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        neighbour = padded[row + 1 + down, column + 1 + right]
        a = np.flatnonzero(neighbour >= 0)
        b = neighbour[a]
        starts.append(a)
        ends.append(b)
        costs.append(0.5 * (cell_cost[a] + cell_cost[b]) * math.hypot(down, right) * raster.resolution_m)
    entries = (np.concatenate(costs), (np.concatenate(starts), np.concatenate(ends)))
    graph = sparse.coo_matrix(entries, shape=(len(row), len(row)))
    return Ground(centres_of(raster, cells), (graph + graph.T).tocsr(), polygon, boxes, keep_m, wall_keep_m, reserve_m)


def leg_between(routes: Routes, here: int, there: int) -> list[int]:
    """Return the cells from one viewpoint to another, both included."""
    leg = [int(routes.viewpoints[there])]
    while leg[-1] != routes.viewpoints[here]:
        leg.append(int(routes.before[here, leg[-1]]))
    return leg[::-1]


@entry
def slack_at(polygon, boxes, keep_m, wall_keep_m, x_m, y_m):  # type: ignore[no-untyped-def]
    """Return by how many metres a point keeps more than the required distance from walls and boxes; negative if it does not."""
    is_inside, distance = distance_to_outline(polygon, x_m, y_m)
    slack = (distance if is_inside else -distance) - wall_keep_m
    for b in range(len(boxes)):
        slack = min(slack, point_distance(boxes[b], x_m, y_m) - keep_m[b])
    return slack


@entry
def is_free_line(polygon, boxes, keep_m, wall_keep_m, ax, ay, bx, by, step_m):  # type: ignore[no-untyped-def]
    """Return whether every point of a line between two keeps the required distances; it is looked at in steps."""
    count = math.ceil(math.hypot(bx - ax, by - ay) / step_m) + 1
    for i in range(count + 1):
        share = i / count
        if slack_at(polygon, boxes, keep_m, wall_keep_m, ax + share * (bx - ax), ay + share * (by - ay)) < 0.5 * step_m:
            return False
    return True


@entry
def _smooth(points, polygon, boxes, keep_m, wall_keep_m, reserve_m, rounds):  # type: ignore[no-untyped-def]
    """Move each point half-way to the middle of its neighbours, ``rounds`` times, unless that costs the reserve or stretches a step."""
    widest = (2.0 * reserve_m) ** 2
    for _ in range(rounds):
        for i in range(1, len(points) - 1):
            x = 0.5 * points[i, 0] + 0.25 * (points[i - 1, 0] + points[i + 1, 0])
            y = 0.5 * points[i, 1] + 0.25 * (points[i - 1, 1] + points[i + 1, 1])
            before = (x - points[i - 1, 0]) ** 2 + (y - points[i - 1, 1]) ** 2
            after = (x - points[i + 1, 0]) ** 2 + (y - points[i + 1, 1]) ** 2
            if before <= widest and after <= widest and slack_at(polygon, boxes, keep_m, wall_keep_m, x, y) >= reserve_m:
                points[i, 0], points[i, 1] = x, y
