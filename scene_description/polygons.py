"""Measures of polygons in the plane, as floor outlines are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scene_description.types import Point2


def signed_area_m2(points_m: Sequence[Point2]) -> float:
    """Return the area of an outline in square metres, positive where it runs counter-clockwise (shoelace formula)."""
    following = (*points_m[1:], points_m[0])
    return 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points_m, following, strict=True))


def centroid_m(points_m: Sequence[Point2]) -> NDArray[np.float64]:
    """Return x and y of the centre of area of an outline that has an area, (2,) float64, metres."""
    polygon = np.array(points_m)
    following = np.roll(polygon, -1, 0)
    cross = polygon[:, 0] * following[:, 1] - following[:, 0] * polygon[:, 1]
    return np.asarray(((polygon + following) * cross[:, None]).sum(0) / (3.0 * cross.sum()))


def distance_outside_m(points_m: Sequence[Point2], x: float, y: float) -> float:
    """Return how far a point lies outside of an outline, metres; 0 within it.

    Within means that a ray from the point crosses the outline an odd number of times.
    """
    start = np.array(points_m)
    end = np.roll(start, -1, 0)
    point, along = np.array((x, y)), end - start
    crossed = (start[:, 1] > y) != (end[:, 1] > y)
    steep = np.where(crossed, along[:, 1], 1.0)
    if np.count_nonzero(crossed & (start[:, 0] + (y - start[:, 1]) / steep * along[:, 0] > x)) % 2:
        return 0.0
    share = np.clip(((point - start) * along).sum(1) / (along**2).sum(1), 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * along - point, axis=1).min())
