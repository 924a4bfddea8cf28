"""What stands in the way of a body on the floor: all triangles between two heights, as convex polygons in the plan."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.kernel import entry
from renderer.geometry.mesh import Mesh
from scene_description.kinematics import Floats

_CORNERS = 5
"""A triangle that is cut by two planes has so many corners at most."""


class Obstacles(NamedTuple):
    """n convex polygons in the plan, of the floor's outline or of a cut triangle.

    Attributes:
        corners_m: (n, 5, 2) float64; the last corner is repeated where there are fewer.
        low_m, high_m: (n, 2) float64, the least and greatest coordinates of each.
    """

    corners_m: Floats
    low_m: Floats
    high_m: Floats

    @classmethod
    def between(cls, mesh: Mesh, outline_m: Floats, low_m: float, high_m: float) -> "Obstacles":
        """Return what a mesh has between two heights, and the walls along the floor's outline (v, 2), whatever stands open."""
        heights = mesh.vertices[:, 2][mesh.faces]
        crossing = (heights.min(axis=1) < high_m) & (heights.max(axis=1) > low_m)
        triangles = mesh.vertices[mesh.faces[crossing]].astype(np.float64)
        corners = np.empty((len(triangles), _CORNERS, 2))
        _cut_triangles(triangles, low_m, high_m, corners)
        walls = np.stack([outline_m, *[np.roll(outline_m, -1, axis=0)] * (_CORNERS - 1)], axis=1)
        return cls.of(np.concatenate([corners, walls]))

    @classmethod
    def of(cls, corners_m: Floats) -> "Obstacles":
        """Return polygons (n, 5, 2)."""
        return cls(corners_m, corners_m.min(axis=1), corners_m.max(axis=1))

    def near(self, place_m: tuple[float, float], reach_m: float) -> "Obstacles":
        """Return those that may come within a distance of a place."""
        place = np.array(place_m)
        close = ((self.low_m <= place + reach_m) & (self.high_m >= place - reach_m)).all(axis=1)
        return Obstacles(*(values[close] for values in self))

    def clearance_m(self, places_m: Floats) -> Floats:
        """Return how far each of some places (n, 2) is from the nearest of them; infinite where there are none, 0 within one."""
        found = np.empty(len(places_m))
        _distances(self.corners_m, places_m, found)
        return found


@entry
def _cut_triangles(triangles: Floats, low: float, high: float, corners: Floats) -> None:
    """Fill the plan (n, 5, 2) of what triangles (n, 3, 3) have between two heights (J. Sutherland and G. Hodgman, CACM 17(1), 1974)."""
    for i in range(triangles.shape[0]):
        count = 0
        for k in range(3):
            a, b = triangles[i, k], triangles[i, (k + 1) % 3]
            begin, end = 0.0, 1.0
            rise = b[2] - a[2]
            if rise != 0.0:
                first, second = (low - a[2]) / rise, (high - a[2]) / rise
                begin, end = max(begin, min(first, second)), min(end, max(first, second))
            elif a[2] < low or a[2] > high:
                continue
            if begin > end:
                continue
            for share in (begin, end):  # an edge's end is the next one's beginning, unless either was cut
                x, y = (b[0], b[1]) if share == 1.0 else (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
                if count < _CORNERS and (count == 0 or x != corners[i, count - 1, 0] or y != corners[i, count - 1, 1]):
                    corners[i, count, 0], corners[i, count, 1] = x, y
                    count += 1
        for k in range(max(count, 1), _CORNERS):
            corners[i, k, 0], corners[i, k, 1] = corners[i, max(count, 1) - 1, 0], corners[i, max(count, 1) - 1, 1]


@entry
def _distances(corners: Floats, places: Floats, found: NDArray[np.float64]) -> None:
    """Fill the distance (n,) of each place (n, 2) from the nearest polygon."""
    for p in range(places.shape[0]):
        x, y = places[p, 0], places[p, 1]
        least = np.inf
        for i in range(corners.shape[0]):
            lefts, rights = 0, 0
            for k in range(_CORNERS):
                ax, ay = corners[i, k, 0], corners[i, k, 1]
                bx, by = corners[i, (k + 1) % _CORNERS, 0] - ax, corners[i, (k + 1) % _CORNERS, 1] - ay
                length = bx * bx + by * by
                share = min(max(((x - ax) * bx + (y - ay) * by) / length, 0.0), 1.0) if length > 0.0 else 0.0
                dx, dy = x - ax - share * bx, y - ay - share * by
                least = min(least, dx * dx + dy * dy)
                side = bx * (y - ay) - by * (x - ax)
                lefts += side > 0.0
                rights += side < 0.0
            if max(lefts, rights) > 2 and min(lefts, rights) == 0:
                least = 0.0
        found[p] = math.sqrt(least)
