"""Polygons: floor outlines as sequences of vertices."""

from __future__ import annotations

from collections.abc import Sequence

from scene_description.types import Point2


def polygon_area_m2(polygon_m: Sequence[Point2]) -> float:
    """Return the area of an outline (shoelace formula), positive where it runs counter-clockwise."""
    following = (*polygon_m[1:], polygon_m[0])
    return 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(polygon_m, following, strict=True))
