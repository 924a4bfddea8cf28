"""A furnished room as the checks of use look at it, and what they measure: strips of floor, gaps behind backs, reach of doors."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from grammar.geometry.arrays import Bools, Boxes, Floats, Ints
from grammar.geometry.boxes import COS_YAW, HALF_DEPTH, HALF_WIDTH, SIN_YAW, Z_HIGH, Z_LOW, X, Y, footprint_penetration
from grammar.geometry.solids import object_solids, whole_box
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW, outside_distances, wall_rows
from grammar.geometry.zones import opening_frame, side_rectangle
from grammar.spec.categories import BACK_GAP_M, Categories, Role
from grammar.spec.grammar_file import room_needs
from grammar.spec.room_rules import RoomNeeds
from scene_description import Opening, Room, SceneObject

STRAIGHT_RAD = math.radians(15.0)
"""A back is to a wall if it is turned from it by less than this."""

_POINTS = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Furnished:
    """A room with its objects, their solids (m, 8) and whose these are (m,), and the rows of its walls."""

    room_type: str
    needs: RoomNeeds
    room: Room
    objects: tuple[SceneObject, ...]
    categories: Categories
    boxes: Boxes
    owner: Ints
    wall: Floats

    def having(self, *roles: Role) -> list[SceneObject]:
        """Return the objects whose category has one of these roles."""
        any_of = frozenset(roles)
        return [item for item in self.objects if not any_of.isdisjoint(self.categories[item.category].roles)]

    def lacking(self, *roles: Role) -> list[int]:
        """Return the room (0) if it needs objects of one of these roles and has none."""
        return [0] if any(role in self.needs.roles and not self.having(role) for role in roles) else []

    def only(self, kept: Bools) -> "Furnished":
        """Return the room with those of its solids only that ``kept`` (m,) says."""
        return replace(self, boxes=self.boxes[kept], owner=self.owner[kept])

    def standing(self, *roles: Role) -> list[SceneObject]:
        """Return those of :meth:`having` that stand on the floor."""
        return [item for item in self.having(*roles) if item.support.kind == "floor"]


class Against(NamedTuple):
    """An object with its back to a wall: the gap, and which stretch of that wall it takes, metres."""

    wall: int
    gap_m: float
    low_m: float
    high_m: float


def furnished(room_type: str, room: Room, objects: Sequence[SceneObject], categories: Categories) -> Furnished:
    """Return a room as the checks need it; the table of categories holds that of every object."""
    boxes, owner = object_solids(categories, objects)
    return Furnished(
        room_type=room_type,
        needs=room_needs(room_type),
        room=room,
        objects=tuple(objects),
        categories=categories,
        boxes=boxes,
        owner=owner,
        wall=wall_rows(room.polygon_m),
    )


def world_points(item: SceneObject, forward_m: Floats, left_m: Floats) -> Floats:
    """Return (n, 2) points given in an object's frame, in the world."""
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    u, v = np.ravel(forward_m), np.ravel(left_m)
    return np.column_stack([item.position_m[0] + u * c - v * s, item.position_m[1] + u * s + v * c])


def in_boxes(points: Floats, boxes: Boxes) -> Bools:
    """Return (n,) whether points (n, 2) lie in the footprint of any of the boxes (m, 8)."""
    return np.asarray(_hits(points, boxes).any(1))


def _hits(points: Floats, boxes: Boxes) -> Bools:
    dx, dy = points[:, :1] - boxes[:, X], points[:, 1:] - boxes[:, Y]
    c, s = boxes[:, COS_YAW], boxes[:, SIN_YAW]
    return np.asarray((np.abs(dx * c + dy * s) < boxes[:, HALF_DEPTH]) & (np.abs(dy * c - dx * s) < boxes[:, HALF_WIDTH]))


def strip_points(item: SceneObject, side: str, gap_m: float, depth_m: float) -> Floats:
    """Return a grid of points (n, 2) of a strip so far off a side of an object and so deep, in the world."""
    x, y, half_d, half_w = side_rectangle(side, depth_m, item.size_m)
    steps = (np.arange(_POINTS) + 0.5) / (0.5 * _POINTS) - 1.0
    return world_points(item, *np.meshgrid(x + np.sign(x) * gap_m + half_d * steps, y + np.sign(y) * gap_m + half_w * steps))


def taken_share(found: Furnished, item: SceneObject, side: str, gap_m: float, depth_m: float) -> float:
    """Return the share of a strip along a side of an object that others' solids or walls take, up to the object's own height."""
    points = strip_points(item, side, gap_m, depth_m)
    low, high = item.position_m[2], item.position_m[2] + item.size_m[2]
    beside = (found.owner != item.id) & (found.boxes[:, Z_LOW] < high) & (found.boxes[:, Z_HIGH] > low)
    taken = in_boxes(points, found.boxes[beside])
    return float((taken.sum() + outside(found, points[~taken]).sum()) / len(points))


def outside(found: Furnished, points: Floats) -> Bools:
    """Return (n,) whether points (n, 2) lie outside the room."""
    return np.asarray(outside_distances(found.wall, points) > 0.0)


def face_covered(boxes: Boxes, frame: tuple[float, float, float], width_m: float, heights_m: tuple[float, float], depth_m: float) -> Bools:
    """Return (m, n) which of a grid of points of an upright face each box stands before, within a depth.

    Args:
        boxes: (m, 8) in the world.
        frame: x, y of the face's middle and the yaw of the direction that it looks in.
        width_m: of the face.
        heights_m: of its lower and upper edge.
        depth_m: how far before it boxes count.
    """
    c, s = math.cos(frame[2]), math.sin(frame[2])
    dx, dy = boxes[:, X] - frame[0], boxes[:, Y] - frame[1]
    turn_c = np.abs(boxes[:, COS_YAW] * c + boxes[:, SIN_YAW] * s)
    turn_s = np.abs(boxes[:, SIN_YAW] * c - boxes[:, COS_YAW] * s)
    half_into = boxes[:, HALF_DEPTH] * turn_c + boxes[:, HALF_WIDTH] * turn_s
    half_along = boxes[:, HALF_DEPTH] * turn_s + boxes[:, HALF_WIDTH] * turn_c
    into, left = dx * c + dy * s, dy * c - dx * s
    before = (into + half_into > 0.0) & (into - half_into < depth_m)
    along = ((np.arange(_POINTS) + 0.5) / _POINTS - 0.5) * width_m
    up = heights_m[0] + (np.arange(_POINTS) + 0.5) / _POINTS * (heights_m[1] - heights_m[0])
    a, z = (grid.ravel() for grid in np.meshgrid(along, up))
    inside = (np.abs(a - left[:, None]) < half_along[:, None]) & (z > boxes[:, Z_LOW, None]) & (z < boxes[:, Z_HIGH, None])
    return np.asarray(inside & before[:, None])


def against_wall(found: Furnished, item: SceneObject) -> Against | None:
    """Return the wall nearest to an object's back that the back is turned to, None if there is none."""
    back = world_points(item, np.array([-0.5 * item.size_m[0]]), np.array([0.0]))[0]
    best: Against | None = None
    for index, row in enumerate(found.wall):
        if abs(math.remainder(item.yaw_rad - row[WALL_YAW], 2.0 * math.pi)) > STRAIGHT_RAD:
            continue
        dx, dy = back[0] - row[START_X], back[1] - row[START_Y]
        along, across = dx * row[ALONG_X] + dy * row[ALONG_Y], dx * row[NORMAL_X] + dy * row[NORMAL_Y]
        inside = 0.0 <= along <= row[LENGTH] and across > -0.5 * item.size_m[0]
        if inside and (best is None or across < best.gap_m):
            best = Against(index, float(across), float(along) - 0.5 * item.size_m[1], float(along) + 0.5 * item.size_m[1])
    return best


def back_gap(found: Furnished, item: SceneObject) -> float:
    """Return the gap in metres behind an object's back to the wall that it is turned to; infinite where there is none."""
    wall = against_wall(found, item)
    return math.inf if wall is None else wall.gap_m


def wall_distance(found: Furnished, points: Floats) -> float:
    """Return the least distance in metres from points (n, 2) to the walls."""
    dx, dy = points[:, :1] - found.wall[:, START_X], points[:, 1:] - found.wall[:, START_Y]
    along, across = dx * found.wall[:, ALONG_X] + dy * found.wall[:, ALONG_Y], dx * found.wall[:, NORMAL_X] + dy * found.wall[:, NORMAL_Y]
    return float(np.hypot(across, along - np.clip(along, 0.0, found.wall[:, LENGTH])).min())


def leaf_frames(room: Room) -> Iterator[tuple[Opening, float, float, float, float]]:
    """Yield for every door that opens into the room: the door, x and y of its hinge, yaw into the room, and on which side the latch is.

    The last number is 1 where the latch is to the left of the hinge, as one looks into the room, else -1.
    """
    for opening in room.openings:
        if opening.category == "door" and opening.swing == "in":
            x, y, yaw = opening_frame(room, opening)
            side = -1.0 if opening.hinge == "start" else 1.0
            half = 0.5 * opening.width_m * side
            yield opening, x + half * math.sin(yaw), y - half * math.cos(yaw), yaw, side


def behind_doors(room: Room, points: Floats) -> Bools:
    """Return (n,) whether points (n, 2) lie behind a door that opens into the room: where its leaf gets to beyond a right angle."""
    hidden = np.zeros(len(points), bool)
    for opening, x, y, yaw, side in leaf_frames(room):
        dx, dy = points[:, 0] - x, points[:, 1] - y
        into, to_latch = dx * math.cos(yaw) + dy * math.sin(yaw), side * (dy * math.cos(yaw) - dx * math.sin(yaw))
        hidden |= (to_latch < 0.0) & (into > -0.01) & (np.hypot(dx, dy) < opening.width_m)
    return hidden


def swept_points(room: Room) -> Iterator[Floats]:
    """Yield (n, 2) points of the floor that each door into the room sweeps until it stands at a right angle."""
    radius, angle = np.meshgrid(np.linspace(0.1, 0.97, 12), np.linspace(0.05, 0.5 * math.pi - 0.05, 12))
    for opening, x, y, yaw, side in leaf_frames(room):
        into, left = opening.width_m * radius * el.sin(angle), side * opening.width_m * radius * el.cos(angle)
        c, s = math.cos(yaw), math.sin(yaw)
        yield np.column_stack([(x + into * c - left * s).ravel(), (y + into * s + left * c).ravel()])


AtFault = Callable[[Furnished, SceneObject], bool]
"""Whether an object of a room is at fault."""


def clusters(boxes: Sequence[Boxes], within_m: float) -> list[int]:
    """Return for each box the number of its cluster: boxes nearer than a distance are in one, and so are their neighbours."""
    group = list(range(len(boxes)))
    for i, box in enumerate(boxes):
        for j in range(i):
            if group[i] != group[j] and footprint_penetration(box, boxes[j]) > -within_m:
                old, new = group[i], group[j]
                group = [new if one == old else one for one in group]
    return group


def each(at_fault: AtFault, *roles: Role, on_floor: bool = True) -> Callable[[Furnished], list[int]]:
    """Return the function that finds the objects at fault among those with these roles, by default of those on the floor."""

    def find(found: Furnished) -> list[int]:
        return [item.id for item in (found.standing if on_floor else found.having)(*roles) if at_fault(found, item)]

    return find


def blocked(side: str, gap_m: float, depth_m: float, share: float) -> AtFault:
    """Return whether more than a share of a strip along a side, so far off and so deep, is taken."""
    return lambda found, item: taken_share(found, item, side, gap_m, depth_m) > share


def near(within_m: float, *roles: Role, on_floor: bool = True) -> AtFault:
    """Return whether something with these roles is nearer than a distance; a negative one: overlaps by more than that."""

    def is_near(found: Furnished, item: SceneObject) -> bool:
        others = (found.standing if on_floor else found.having)(*roles)
        return any(footprint_penetration(whole_box(item), whole_box(other)) > -within_m for other in others)

    return is_near


def far(beyond_m: float, *roles: Role) -> AtFault:
    """Return whether something with these roles stands on the floor, and all of it is further off than a distance."""

    def is_far(found: Furnished, item: SceneObject) -> bool:
        others = found.standing(*roles)
        return bool(others) and max(footprint_penetration(whole_box(item), whole_box(other)) for other in others) < -beyond_m

    return is_far


def covered(depth_m: float, share: float) -> AtFault:
    """Return whether things within a depth of a front cover more than a share of it."""

    def is_covered(found: Furnished, item: SceneObject) -> bool:
        x, y = world_points(item, np.array([0.5 * item.size_m[0]]), np.zeros(1))[0]
        boxes, heights = found.boxes[found.owner != item.id], (item.position_m[2], item.position_m[2] + item.size_m[2])
        return bool(face_covered(boxes, (x, y, item.yaw_rad), item.size_m[1], heights, depth_m).any(0).mean() > share)

    return is_covered


def off_wall(role: Role) -> AtFault:
    """Return whether there is no wall behind a back.

    The chain's term ``off_wall`` holds to the same gap; it measures the further end of the back, here it is the middle.
    """
    return lambda found, item: back_gap(found, item) > BACK_GAP_M[role]
