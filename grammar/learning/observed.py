"""Rooms as they were seen: what a grammar is learned from, in the program's own conventions.

Metres, radians, right-handed, z up, floor at z = 0.  An object's origin is the centre of its box's bottom face; at yaw 0 it looks along +x;
its size is (depth along its front, width, height).
"""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from shapely import Polygon, get_parts, union_all
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW, wall_rows
from grammar.spec.object_rules import SizeMode
from scene_description.types import Point2

_TOP_TOLERANCE_M = 0.1
_TURN_COST_M = 0.25
_FITTING_M = 0.05
"""Boxes that were fitted by hand reach into walls and neighbours by less."""

_PARALLEL_RAD = 0.02

_NICHE_M, _LEAST_KEPT, _STRAIGHT_M, _STEP_M = 0.45, 0.8, 0.02, 0.15
"""Half the width of the widest niche; a room of which less is left is all niches, and loses only steps that are smaller."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedObject:
    """One object.

    ``category`` is one of ours; ``on`` the index of the object of the same room that it stands on, where that is known; ``name`` what the
    source calls it, where no category of ours is like it and ``category`` only says that it is furniture or a thing.
    """

    category: str
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    yaw_rad: float
    on: int | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedOpening:
    """A door or window: number of the wall that it is in, distance of its first end from that wall's start, size, height of its sill."""

    wall: int
    offset_m: float
    width_m: float
    height_m: float
    sill_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedRoom:
    """One room with its counter-clockwise inner outline; ``house`` names what must not be split between learning and judging.

    ``openings``: by kind, "door" or "window"; a kind that is missing was not recorded.
    """

    id: str
    house: str
    room_type: str
    polygon_m: tuple[Point2, ...]
    height_m: float
    objects: tuple[ObservedObject, ...]
    openings: Mapping[str, tuple[ObservedOpening, ...]] = field(default_factory=dict)


def mixed(sources: Sequence[tuple[Sequence[ObservedRoom], float]]) -> list[ObservedRoom]:
    """Return the rooms of all sources such that a room of each counts in proportion to its weight.

    Of the source of greatest weight all rooms are taken, of the others the share that their weight is of that, in the order of the hashes
    of the rooms' names: which rooms these are depends on nothing else.
    """
    most = max((weight for _, weight in sources), default=1.0)
    kept: list[ObservedRoom] = []
    for rooms, weight in sources:
        count = round(len(rooms) * weight / most)
        digests = [hashlib.sha256(room.id.encode(errors="surrogatepass")).hexdigest() for room in rooms]
        order = sorted(zip(digests, range(len(rooms)), strict=True))
        chosen = [i for _, i in order[:count]]
        kept.extend(rooms[i] for i in sorted(chosen))
    return kept


class WallPose(NamedTuple):
    """The pose of an object relative to a wall: gap, yaw against the direction into the room (0: back to the wall), number of the wall."""

    gap_m: float
    turn_rad: float
    wall: int


class RelativePose(NamedTuple):
    """The pose of an object in the frame of another one: its origin and its relative yaw."""

    x_m: float
    y_m: float
    turn_rad: float


def filled_outline(polygon_m: Sequence[Point2]) -> tuple[Point2, ...]:
    """Return an outline without the niches and steps of its doors, counter-clockwise.

    Sources count the thickness of the wall in a door to the room, or to the next one: there it lies within this one's outline.
    """
    whole = Polygon(polygon_m)
    grown = _resized(_resized(whole, _NICHE_M), -_NICHE_M)
    whole = union_all([whole, *_steps(whole, grown)])
    filled = _resized(_resized(whole, -_NICHE_M), _NICHE_M)
    filled = union_all([filled, *_steps(filled, filled.envelope)])
    if filled.geom_type != "Polygon" or filled.area < _LEAST_KEPT * whole.area:
        return without_steps(polygon_m)  # narrower than a niche
    points = orient(filled.simplify(_STRAIGHT_M)).exterior.coords[:-1]
    return tuple((float(x), float(y)) for x, y in points)


def _resized(floor: BaseGeometry, by_m: float) -> BaseGeometry:
    return floor.buffer(by_m, join_style="mitre")


def _steps(floor: BaseGeometry, around: BaseGeometry) -> Iterator[BaseGeometry]:
    """Yield what a floor lacks to the one around it and is no deeper than a wall is thick and no longer than a niche."""
    for part in get_parts(around.difference(floor)):
        x_low, y_low, x_high, y_high = part.bounds
        if _resized(part, -0.5 * _STEP_M).is_empty and math.hypot(x_high - x_low, y_high - y_low) < 2.0 * _NICHE_M + _STEP_M:
            yield part


def without_steps(polygon_m: Sequence[Point2]) -> tuple[Point2, ...]:
    """Return an outline without steps of less than 15 cm, counter-clockwise."""
    far = int(np.argmax(np.square(np.array(polygon_m) - np.mean(polygon_m, 0)).sum(1)))
    points = orient(Polygon([*polygon_m[far:], *polygon_m[:far]]).simplify(_STEP_M)).exterior.coords[:-1]
    return tuple((float(x), float(y)) for x, y in points)


def size_log_density(size_m: Sequence[float], modes: Sequence[SizeMode], wider: float = 1.0) -> float:
    """Return the log-density of a size under components that are so many times wider and not truncated, but for a constant."""
    logs = [
        math.log(max(mode.probability, 1e-12))
        + sum(-0.5 * ((s - m) / (wider * d)) ** 2 - math.log(wider * d) for s, m, d in zip(size_m, mode.mean_m, mode.sd_m, strict=True))
        for mode in modes
    ]
    return float(np.logaddexp.reduce(logs))


def wrapped(angle: float) -> float:
    """Return an angle in [-pi, pi]."""
    return math.remainder(angle, 2.0 * math.pi)


def half_extents(size_m: Sequence[float], turn_rad: float) -> tuple[float, float]:
    """Return half the extents along x and y of a footprint turned by ``turn_rad``."""
    c, s = abs(math.cos(turn_rad)), abs(math.sin(turn_rad))
    return 0.5 * (size_m[0] * c + size_m[1] * s), 0.5 * (size_m[0] * s + size_m[1] * c)


def wall_poses(polygon_m: Sequence[Point2], item: ObservedObject) -> list[WallPose]:
    """Return the pose of an object relative to every wall that its origin lies before."""
    found = []
    for index, wall in enumerate(wall_rows(polygon_m).tolist()):
        dx, dy = item.position_m[0] - wall[START_X], item.position_m[1] - wall[START_Y]
        along, across = dx * wall[ALONG_X] + dy * wall[ALONG_Y], dx * wall[NORMAL_X] + dy * wall[NORMAL_Y]
        if 0.0 <= along <= wall[LENGTH] and across >= 0.0:
            turn = wrapped(item.yaw_rad - wall[WALL_YAW])
            found.append(WallPose(across - half_extents(item.size_m, turn)[0], turn, index))
    return found


def nearest_wall(polygon_m: Sequence[Point2], item: ObservedObject) -> WallPose | None:
    """Return the wall with the least gap."""
    return min(wall_poses(polygon_m, item), key=lambda pose: pose.gap_m, default=None)


def fitting_gap(gap_m: float) -> float:
    """Return a gap as one of at least zero: what a source puts a little into a wall or a neighbour is off by as much, either way."""
    return -gap_m if -_FITTING_M < gap_m < 0.0 else max(gap_m, 0.0)


def between_walls(polygon_m: Sequence[Point2], item: ObservedObject) -> ObservedObject:
    """Return what a source puts a little into two opposite walls as it fits between them, as far off each as it is in it or off it."""
    poses = [pose for pose in wall_poses(polygon_m, item) if pose.gap_m > -_FITTING_M]
    size, place = list(item.size_m), list(item.position_m)
    for axis, angle in ((0, item.yaw_rad), (1, item.yaw_rad + 0.5 * math.pi)):
        # a turn of 0 has the wall behind the object; the yaw of a wall is the direction into the room
        facing = [wrapped(item.yaw_rad - pose.turn_rad - angle) for pose in poses]
        ends = [
            [pose.gap_m for pose, off in zip(poses, facing, strict=True) if abs(wrapped(off - way)) < _PARALLEL_RAD]
            for way in (0.0, math.pi)
        ]
        if all(ends) and (low := min(ends[0])) + (high := min(ends[1])) < 0.0 and max(low, high) < _FITTING_M:
            low_end, high_end = fitting_gap(low) - low, fitting_gap(high) - high
            size[axis] -= low_end + high_end
            place[0] += 0.5 * (low_end - high_end) * math.cos(angle)
            place[1] += 0.5 * (low_end - high_end) * math.sin(angle)
    return replace(item, size_m=(size[0], size[1], size[2]), position_m=(place[0], place[1], place[2]))


def fitting_wall(polygon_m: Sequence[Point2], item: ObservedObject) -> WallPose | None:
    """Return the wall that an object most plausibly stands at: one that is near, and at its back rather than its side or front."""
    return min(wall_poses(polygon_m, item), key=lambda pose: max(pose.gap_m, 0.0) + _TURN_COST_M * abs(pose.turn_rad), default=None)


def relative_pose(item: ObservedObject, other: ObservedObject) -> RelativePose:
    """Return ``item`` in the frame of ``other``."""
    dx, dy = item.position_m[0] - other.position_m[0], item.position_m[1] - other.position_m[1]
    c, s = math.cos(other.yaw_rad), math.sin(other.yaw_rad)
    return RelativePose(dx * c + dy * s, dy * c - dx * s, wrapped(item.yaw_rad - other.yaw_rad))


def box_gap(item: ObservedObject, other: ObservedObject) -> float:
    """Return the distance of two footprints as boxes along the axes of ``other``; 0 where they meet."""
    return max(signed_gap(item, other), 0.0)


def signed_gap(item: ObservedObject, other: ObservedObject) -> float:
    """Return the distance of two footprints as boxes along the axes of ``other``, where they meet how deep, below zero."""
    place = relative_pose(item, other)
    half_d, half_w = half_extents(item.size_m, place.turn_rad)
    gaps = abs(place.x_m) - half_d - 0.5 * other.size_m[0], abs(place.y_m) - half_w - 0.5 * other.size_m[1]
    return max(gaps) if max(gaps) < 0.0 else math.hypot(*(max(gap, 0.0) for gap in gaps))


def is_supported_by(item: ObservedObject, other: ObservedObject) -> bool:
    """Return whether an object stands on another one: its underside is at the other's top, its origin within the other's footprint."""
    if item.position_m[2] < 0.1 or abs(item.position_m[2] - other.position_m[2] - other.size_m[2]) > _TOP_TOLERANCE_M:
        return False
    place = relative_pose(item, other)
    return abs(place.x_m) <= 0.5 * other.size_m[0] and abs(place.y_m) <= 0.5 * other.size_m[1]
