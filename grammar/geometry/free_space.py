"""The floor that is left to walk on: a raster of the room, what a disc-shaped robot reaches, and the occupancy grid.

Distances are exact: each cell holds the distance of its centre to the nearest wall or solid, not a count of cells, so the answer about a
passage does not depend on how furniture falls on the raster.  The share of walkable floor is R_walkable of PhyScene (Yang et al., CVPR
2024), taken for the part that is connected to the door.

Solid boxes are rows of an (n, 8) array as :mod:`grammar.geometry.boxes` defines them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from grammar.geometry.arrays import Bools, Boxes, Floats
from grammar.geometry.boxes import BOX_WIDTH, COS_YAW, HALF_DEPTH, HALF_WIDTH, Z_LOW, X, Y, point_distance, row_penetration
from grammar.geometry.kernels import entry
from grammar.spec.rules import GrammarError

MAX_CELLS = 16_000_000
_TOUCH_M = 1e-9

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Cell values of nav_msgs/OccupancyGrid."""


class FreeSpace(NamedTuple):
    """A raster of the floor; row = y, column = x, both growing, so row 0 has the lowest y.

    origin_m: world x, y of the outer corner of cell [0, 0], a multiple of ``resolution_m``; resolution_m: side of a cell;
    inside: (h, w) bool, the cell's centre lies inside the floor polygon; occupied: (h, w) bool, a solid touches or covers some point of the
    cell's square (exact test of square against rectangle, so nothing solid is ever missed); clearance_m: (h, w) float64, distance from the
    cell's centre to the nearest wall or solid, 0 within solids and outside the polygon.
    """

    origin_m: tuple[float, float]
    resolution_m: float
    inside: Bools
    occupied: Bools
    clearance_m: Floats


def rasterize(polygon_m: ArrayLike, boxes: Boxes, resolution_m: float, clearance_height_m: float) -> FreeSpace:
    """Return the raster of a floor with the solids whose underside is lower than ``clearance_height_m``.

    Args:
        polygon_m: (n, 2) floor outline, world, metres.
        boxes: (m, 8) solid boxes; leave out what one walks over, such as rugs.
        resolution_m: side of a cell.
        clearance_height_m: height of what must pass; solids that begin above it do not count.

    Raises:
        GrammarError: the raster would have more than ``MAX_CELLS`` cells.
    """
    polygon = np.ascontiguousarray(polygon_m, np.float64)
    low = np.floor(polygon.min(0) / resolution_m + _TOUCH_M)
    width, height = (int(n) for n in np.ceil(polygon.max(0) / resolution_m - _TOUCH_M) - low)
    if width * height > MAX_CELLS:
        raise GrammarError(
            f"free space: expected at most {MAX_CELLS} cells, got {width} x {height}; raise resolution_m from {resolution_m}"
        )
    origin = (float(low[0] * resolution_m), float(low[1] * resolution_m))
    solid = np.ascontiguousarray(boxes[boxes[:, Z_LOW] < clearance_height_m], np.float64)
    inside, occupied, clearance = np.zeros((height, width), bool), np.zeros((height, width), bool), np.zeros((height, width))
    free = FreeSpace(origin, resolution_m, inside, occupied, clearance)
    _rasterize(polygon, solid, np.zeros((1, BOX_WIDTH)), free)
    return free


def centre_of(free: FreeSpace, row: int, column: int) -> tuple[float, float]:
    """Return the world x, y of a cell's centre."""
    return (free.origin_m[0] + (column + 0.5) * free.resolution_m, free.origin_m[1] + (row + 0.5) * free.resolution_m)


def centres_of(free: FreeSpace, cells: Bools) -> Floats:
    """Return (n, 2) world x, y of the centres of the cells that are True (h, w), row by row."""
    row, column = np.nonzero(cells)
    return np.asarray(np.column_stack([column, row]) * free.resolution_m + 0.5 * free.resolution_m + np.array(free.origin_m))


def standable(free: FreeSpace, radius_m: float) -> Bools:
    """Return (h, w) bool: the free floor eroded by a disc, that is, the cells where a disc fits with its centre on the cell's centre."""
    return free.inside & (free.clearance_m >= radius_m - _TOUCH_M)


def reachable(free: FreeSpace, radius_m: float, start_m: tuple[float, float]) -> Bools:
    """Return (h, w) bool: the cells that the centre of a disc can reach from ``start_m`` over cells where it fits (4-neighbourhood).

    The walk begins at the nearest such cell within ``radius_m`` and one cell's diagonal of ``start_m``, so that a point on a door's
    threshold is a good start; without one nothing is reachable.
    """
    stands = standable(free, radius_m)
    row, column = _nearest_cell(free, stands, start_m)
    distance = math.dist(centre_of(free, row, column), start_m)
    if not stands[row, column] or distance > radius_m + math.sqrt(2.0) * free.resolution_m:
        return np.zeros_like(stands)
    components, _ = ndimage.label(stands)
    return np.asarray(components == components[row, column])


def walkable_share(free: FreeSpace, radius_m: float, start_m: tuple[float, float]) -> float:
    """Return the area of the eroded free floor that is connected to ``start_m``, over the area of all eroded free floor.

    Eroded means: where the robot's centre can be.  1: the robot gets from the door wherever it could stand; 0: it cannot enter.
    """
    total = np.count_nonzero(standable(free, radius_m))
    return np.count_nonzero(reachable(free, radius_m, start_m)) / total if total else 0.0


def occupancy_grid(free: FreeSpace) -> NDArray[np.int8]:
    """Return (h, w) int8 as nav_msgs/OccupancyGrid wants it: 0 free, 100 occupied, -1 outside the room; row 0 has the lowest y."""
    return np.where(free.inside, np.where(free.occupied, OCCUPIED, FREE), UNKNOWN).astype(np.int8)


def _nearest_cell(free: FreeSpace, wanted: Bools, point_m: tuple[float, float]) -> tuple[int, int]:
    x = free.origin_m[0] + (np.arange(wanted.shape[1]) + 0.5) * free.resolution_m - point_m[0]
    y = free.origin_m[1] + (np.arange(wanted.shape[0]) + 0.5) * free.resolution_m - point_m[1]
    squared = np.where(wanted, (y * y)[:, None] + x * x, np.inf)
    row, column = divmod(int(np.argmin(squared)), wanted.shape[1])
    return row, column


@entry
def _rasterize(polygon, boxes, cell, free):  # type: ignore[no-untyped-def]
    """Fill the arrays of a raster; ``cell`` (1, 8) is work space for a cell as a box."""
    side, inside, occupied = free.resolution_m, free.inside, free.occupied
    cell[0, HALF_DEPTH], cell[0, HALF_WIDTH], cell[0, COS_YAW] = 0.5 * side, 0.5 * side, 1.0
    for row in range(inside.shape[0]):
        cell[0, Y] = free.origin_m[1] + (row + 0.5) * side
        for column in range(inside.shape[1]):
            cell[0, X] = free.origin_m[0] + (column + 0.5) * side
            is_inside, nearest = distance_to_outline(polygon, cell[0, X], cell[0, Y])
            for b in range(len(boxes)):
                distance = point_distance(boxes[b], cell[0, X], cell[0, Y])
                nearest = min(nearest, distance)
                if distance <= 0.75 * side and not occupied[row, column]:
                    occupied[row, column] = row_penetration(cell, np.int64(0), boxes, b) >= 0.0
            inside[row, column] = is_inside
            free.clearance_m[row, column] = nearest if is_inside else 0.0


@entry
def distance_to_outline(polygon: Floats, x_m: float, y_m: float) -> tuple[bool, float]:
    """Return whether a point lies inside an (n, 2) outline (even-odd rule), and its distance to the outline in metres."""
    is_inside = False
    nearest = np.inf
    n = len(polygon)
    for i in range(n):
        ax, ay = polygon[i, 0], polygon[i, 1]
        bx, by = polygon[(i + 1) % n, 0], polygon[(i + 1) % n, 1]
        ex, ey = bx - ax, by - ay
        if (ay > y_m) != (by > y_m) and x_m < ax + (y_m - ay) * ex / ey:
            is_inside = not is_inside
        t = min(max(((x_m - ax) * ex + (y_m - ay) * ey) / max(ex * ex + ey * ey, 1e-300), 0.0), 1.0)
        dx, dy = x_m - ax - t * ex, y_m - ay - t * ey
        nearest = min(nearest, dx * dx + dy * dy)
    return is_inside, math.sqrt(nearest)
