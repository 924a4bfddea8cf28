"""Where the ceiling of a room is: the lower envelope of a flat ceiling and the planes that rise from its walls.

Over a point at distance d from the line of the wall of a slope, measured into the room, that plane is ``eaves_height_m + d tan(pitch_rad)``
high.  World frame, metres.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scene_description.products import matmul
from scene_description.strict import FieldError
from scene_description.types import Opening, Point2, Room, Slope

OUTSIDE_M = 1e-6
"""So far a corner of the floor may lie behind the wall that a slope rises from."""


def ceiling_planes(room: Room) -> NDArray[np.float64]:
    """Return the sloped planes of a ceiling, (s, 3): a, b, c of ``height = a x + b y + c``; no row for a flat ceiling."""
    return np.array([_plane(room.polygon_m, slope) for slope in room.slopes or ()], np.float64).reshape(-1, 3)


def ceiling_height_m(room: Room, x: float, y: float) -> float:
    """Return the height of the ceiling over a point of the floor."""
    slopes: list[float] = matmul(ceiling_planes(room), (x, y, 1.0)).tolist()
    return min([room.height_m, *slopes])


def height_lines_m(room: Room, height_m: float) -> list[tuple[Point2, Point2]]:
    """Return the lines over the floor along which a sloped ceiling is as high as that, as ends of their pieces, world metres."""
    planes, lines = ceiling_planes(room).tolist(), list[tuple[Point2, Point2]]()
    for k, (a, b, c) in enumerate(planes):
        # the line a x + b y + c = height as points at + t along, cut by the outline and where another plane is lower
        steep = math.hypot(a, b)
        x, y, u, v = (height_m - c) * a / steep**2, (height_m - c) * b / steep**2, -b / steep, a / steep
        first, last = -math.inf, math.inf if height_m < room.height_m else -math.inf
        for d, e, f in planes[:k] + planes[k + 1 :]:
            at, rise = d * x + e * y + f - height_m, d * u + e * v
            if rise > 0.0:
                first = max(first, -at / rise)
            elif rise < 0.0:
                last = min(last, -at / rise)
            elif at < 0.0:
                last = -math.inf
        cuts = _crossings(room.polygon_m, (x, y), (u, v))
        pieces = [(max(low, first), min(high, last)) for low, high in zip(cuts[::2], cuts[1::2], strict=True)]
        lines.extend(((x + p * u, y + p * v), (x + q * u, y + q * v)) for p, q in pieces if q - p > OUTSIDE_M)
    return lines


def ceiling_over_opening_m(room: Room, opening: Opening) -> float:
    """Return the height of the ceiling at an opening's wall where it is lowest over the opening, which is at one of its ends."""
    if room.slopes is None:
        return room.height_m
    (ax, ay), (bx, by) = room.polygon_m[opening.wall], room.polygon_m[(opening.wall + 1) % len(room.polygon_m)]
    length = math.hypot(bx - ax, by - ay)
    shares = (opening.offset_m / length, (opening.offset_m + opening.width_m) / length)
    return min(ceiling_height_m(room, ax + share * (bx - ax), ay + share * (by - ay)) for share in shares)


def stretches_below_m(room: Room, height_m: float) -> list[tuple[float, float]]:
    """Return for each wall from where to where along it, metres from its start, the ceiling is at least so high; (0, 0): nowhere."""
    planes = np.vstack([(0.0, 0.0, room.height_m), ceiling_planes(room)])
    found = []
    for (ax, ay), (bx, by) in zip(room.polygon_m, (*room.polygon_m[1:], room.polygon_m[0]), strict=True):
        low, high = 0.0, 1.0
        for start, end in (matmul(planes, np.array([(ax, bx), (ay, by), (1.0, 1.0)])) - height_m).tolist():
            if start < 0.0 and end < 0.0:
                high = 0.0
            elif start < 0.0:
                low = max(low, start / (start - end))
            elif end < 0.0:
                high = min(high, start / (start - end))
        length = math.hypot(bx - ax, by - ay)
        found.append((low * length, high * length) if low < high else (0.0, 0.0))
    return found


def check_slopes(room: Room) -> None:
    """Check that the slopes of a ceiling fit its room.

    Raises:
        FieldError: a slope names no wall or the wall of another one, begins above the flat ceiling, or part of the floor lies behind it.
    """
    walls: set[int] = set()
    for i, slope in enumerate(room.slopes or ()):
        path = f"room.slopes[{i}]"
        if slope.wall >= len(room.polygon_m):
            raise FieldError(f"{path}.wall", f"an edge below {len(room.polygon_m)}", f"{slope.wall}")
        if slope.wall in walls:
            raise FieldError(f"{path}.wall", "one slope for a wall", f"wall {slope.wall} twice")
        walls.add(slope.wall)
        if slope.eaves_height_m >= room.height_m:
            raise FieldError(
                f"{path}.eaves_height_m", f"a height below the ceiling at {room.height_m:.3f} m", f"{slope.eaves_height_m:.3f} m"
            )
        behind = -min(distance_into_room_m(room.polygon_m, slope.wall, x, y) for x, y in room.polygon_m)
        if behind > OUTSIDE_M:
            raise FieldError(f"{path}.wall", "a wall with the whole floor before it", f"floor {behind:.3f} m behind wall {slope.wall}")


def distance_into_room_m(polygon_m: Sequence[Point2], wall: int, x: float, y: float) -> float:
    """Return how far a point lies from the line of a wall, metres; below 0 behind it."""
    (ax, ay), (nx, ny) = polygon_m[wall], _inward(polygon_m, wall)
    return (x - ax) * nx + (y - ay) * ny


def _inward(polygon_m: Sequence[Point2], wall: int) -> Point2:
    """Return the unit normal of a wall, into the room."""
    (ax, ay), (bx, by) = polygon_m[wall], polygon_m[(wall + 1) % len(polygon_m)]
    length = math.hypot(bx - ax, by - ay)
    return (ay - by) / length, (bx - ax) / length


def _crossings(polygon_m: Sequence[Point2], at: Point2, along: Point2) -> list[float]:
    """Return where a line enters and leaves an outline, as distances from its point ``at`` in rising order; an even number."""
    found = []
    for (ax, ay), (bx, by) in zip(polygon_m, (*polygon_m[1:], polygon_m[0]), strict=True):
        side_a, side_b = ((px - at[0]) * along[1] - (py - at[1]) * along[0] for px, py in ((ax, ay), (bx, by)))
        if (side_a > 0.0) != (side_b > 0.0):
            share = side_a / (side_a - side_b)
            px, py = ax + share * (bx - ax), ay + share * (by - ay)
            found.append((px - at[0]) * along[0] + (py - at[1]) * along[1])
    return sorted(found)


def _plane(polygon_m: Sequence[Point2], slope: Slope) -> tuple[float, float, float]:
    """Return a, b, c of the plane of a slope."""
    (ax, ay), (nx, ny), rise = polygon_m[slope.wall], _inward(polygon_m, slope.wall), math.tan(slope.pitch_rad)
    return rise * nx, rise * ny, slope.eaves_height_m - rise * (ax * nx + ay * ny)
