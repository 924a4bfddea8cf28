"""Poses of small things: drawn near tidy places or, with growing disorder, anywhere, and taken where nothing is in the way.

A support is filled by a conditional sampler of its own, given the furniture and the things that came before.  No thing moves anything else,
so no chain is needed, and the cost grows with the number of things alone.

What stands on the floor of a tidy room stands along the walls: of a few free poses there the one nearest to a corner or to a neighbour is
taken, so boxes end up in rows and corners, and shoes beside the shoe rack.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.geometry.arrays import Boxes, Floats, Ints
from grammar.geometry.boxes import (
    BOX_WIDTH,
    HALF_DEPTH,
    HALF_WIDTH,
    Z_LOW,
    box_rows,
    deepest_penetrations,
    footprint_penetrations,
    place_boxes,
)
from grammar.geometry.solids import rest_top, surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, REFLEX, START_X, START_Y, WALL_YAW
from grammar.small_things.rules import Depth, Thing
from grammar.spec.categories import Categories, Category, Role
from scene_description import SceneObject
from scene_description import Support as Supported
from scene_description.types import Point2

_READ_M = 0.05
"""Surface that stays free at each side of a screen or keyboard, in front of it."""

_FLAT_M, _FREE_HEIGHT_M = 0.03, 0.6
"""What is lower than the first may lie there still: papers, a remote control."""

TRIALS = 14
"""Poses that are drawn for a thing before it is given up."""

GAP_M = 0.006
"""Air that a thing keeps from its neighbours."""

_MAIN_TURN = 0.75
_WOBBLE_RAD = 0.035
_ASKEW_TIDY, _ASKEW_MESSY = 0.06, 0.85
_ASKEW_RAD = 0.5
_TOUCH_M = 1e-6

_DEPTHS: Mapping[Depth, Callable[[np.random.Generator], float]] = {
    "back": lambda rng: -1.0 + float(rng.beta(1.0, 2.5)),
    "middle": lambda rng: float(np.clip(rng.normal(0.0, 0.35), -1.0, 1.0)),
    "front": lambda rng: 1.0 - float(rng.beta(1.0, 2.5)),
    "edge": lambda rng: (1.0 - 0.15 * float(rng.beta(1.0, 2.5))) * (1.0 if rng.random() < 0.5 else -1.0),
    "any": lambda rng: float(rng.uniform(-1.0, 1.0)),
}

WALL_TRIALS = 40
"""Poses along the walls that are drawn for a thing."""

DOOR_REACH_M = 1.2
"""How far from the sides of a door things lie that belong by the door."""

_GAP_M, _GAP_SD_M = 0.015, 0.01
_KNEE_HIGH_M = 0.3
_USE_M, _USE_HEIGHT_M = 0.55, 1.8
_FRONT_USED: tuple[Role, ...] = (
    "store", "shelf", "wardrobe", "fridge", "backed", "bedside", "seat", "table", "basin", "bathing", "toilet", "sink", "hob",
)  # fmt: skip


class Top(NamedTuple):
    """A rectangle that carries things, in its owner's frame, metres: height, middle, half depth, half width."""

    z: float
    x: float
    y: float
    half_depth: float
    half_width: float

    @property
    def area_m2(self) -> float:
        """Area of the rectangle."""
        return 4.0 * self.half_depth * self.half_width


def tops_of(category: Category, item: SceneObject, *, seat: bool) -> list[Top]:
    """Return the support surfaces of an object and its inner boards, of a seat only what one sits or lies on."""
    rests = [Top(*rest_top(rest, item.size_m)) for rest in category.rests]
    if seat:
        return rests
    reach = item.model.ajar * item.size_m[0]  # an open drawer carries nothing
    tops = [surface_top(surface, (item.size_m[0] - reach, *item.size_m[1:])) for surface in category.surfaces]
    return [*(Top(z, -0.5 * reach, 0.0, half_depth, half_width) for z, half_depth, half_width in tops), *rests]


def world_box(owner: SceneObject, x: float, y: float, z: float, size_m: tuple[float, float, float], turn: float) -> Boxes:
    """Return the (8,) box of a thing whose middle is at (x, y) in the owner's frame, and whose underside is z above the owner's."""
    c, s = math.cos(owner.yaw_rad), math.sin(owner.yaw_rad)
    yaw = owner.yaw_rad + turn
    bottom = owner.position_m[2] + z
    return np.array(
        [
            owner.position_m[0] + x * c - y * s,
            owner.position_m[1] + x * s + y * c,
            bottom,
            bottom + size_m[2],
            0.5 * size_m[0],
            0.5 * size_m[1],
            math.cos(yaw),
            math.sin(yaw),
        ]
    )


def kept_free(owner: SceneObject, top: Top, item: SceneObject) -> Boxes:
    """Return the (8,) box of what stays free of things before an object that people look at or type on, up to the surface's front edge."""
    dx, dy = item.position_m[0] - owner.position_m[0], item.position_m[1] - owner.position_m[1]
    c, s = math.cos(owner.yaw_rad), math.sin(owner.yaw_rad)
    x, y = dx * c + dy * s, dy * c - dx * s
    depth = max(top.x + top.half_depth - x, 0.01)
    return world_box(owner, x + 0.5 * depth, y, top.z + _FLAT_M, (depth, item.size_m[1] + 2.0 * _READ_M, _FREE_HEIGHT_M), 0.0)


def draw_thing_size(rng: np.random.Generator, thing: Thing) -> tuple[float, float, float]:
    """Draw the size of a thing: normal, cut at two standard deviations."""
    drawn = np.clip(rng.standard_normal(3), -2.0, 2.0)
    size = [max(mean + sd * float(z), 0.3 * mean) for mean, sd, z in zip(thing.size_m, thing.sd_m, drawn, strict=True)]
    return size[0], size[1], size[2]


def draw_turn(rng: np.random.Generator, thing: Thing, disorder: float) -> float:
    """Draw a yaw against the supporter: mostly along its edges, the likelier askew the more disorder there is."""
    if not thing.turns:
        return float(rng.uniform(-math.pi, math.pi))
    others = thing.turns[1:]
    main = not others or rng.random() < _MAIN_TURN
    turn = thing.turns[0] if main else others[int(rng.integers(len(others)))]
    if thing.straight:
        return turn
    askew = rng.random() < _ASKEW_TIDY + (_ASKEW_MESSY - _ASKEW_TIDY) * disorder
    spread = _ASKEW_RAD + (math.pi - _ASKEW_RAD) * disorder
    return turn + (float(rng.uniform(-spread, spread)) if askew else _WOBBLE_RAD * float(rng.standard_normal()))


def draw_on_top(
    rng: np.random.Generator, thing: Thing, size_m: tuple[float, float, float], top: Top, disorder: float
) -> tuple[float, float, float] | None:
    """Draw x, y and yaw in the owner's frame, the footprint within the rectangle; None if it does not fit there at the drawn yaw."""
    turn = draw_turn(rng, thing, disorder)
    u = _DEPTHS["any" if rng.random() < disorder else thing.at](rng)
    v = float(rng.uniform(-1.0, 1.0))
    if thing.at == "edge" and u < 0.0:
        turn += math.pi
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    free_depth = top.half_depth - 0.5 * (size_m[0] * c + size_m[1] * s)
    free_width = top.half_width - 0.5 * (size_m[0] * s + size_m[1] * c)
    if free_depth < 0.0 or free_width < 0.0:
        return None
    return top.x + u * free_depth, top.y + v * free_width, turn


class Newcomer(NamedTuple):
    """A thing that looks for a place: its rule, itself, with its size and without a place, and its (n, 6) solids in its own frame."""

    thing: Thing
    item: SceneObject
    solids: Boxes


class Obstacles(NamedTuple):
    """What is in the way: (n, 8) boxes and whose they are, (n,); 0: space that is kept free."""

    boxes: Boxes
    owners: Ints

    def with_more(self, boxes: Boxes, owners: Ints | None = None) -> "Obstacles":
        """Return these and more, by default space that is kept free."""
        of = np.zeros(len(boxes), np.int64) if owners is None else owners
        return Obstacles(np.concatenate([self.boxes, boxes]), np.concatenate([self.owners, of]))


def clear_of(new: Newcomer, placed: SceneObject, obstacles: Obstacles) -> bool:
    """Return whether a newcomer keeps its air from what is in the way where it is ``placed``."""
    boxes = np.empty((len(new.solids), BOX_WIDTH))
    place_boxes(new.solids, 0, len(boxes), *placed.position_m, placed.yaw_rad, boxes)
    boxes[:, [HALF_DEPTH, HALF_WIDTH]] += GAP_M
    mine = np.full(len(boxes), placed.id, np.int64)
    return not len(obstacles.boxes) or bool(deepest_penetrations(boxes, mine, *obstacles).max() <= _TOUCH_M)


Fits = Callable[[SceneObject], bool]
"""Whether a placed thing is inside the room, below its ceiling."""


def on_top(
    rng: np.random.Generator, new: Newcomer, owner: SceneObject, tops: Sequence[Top], disorder: float, fits: Fits, obstacles: Obstacles
) -> SceneObject | None:
    """Return a thing on one of the surfaces of its owner, None where no drawn pose is free; ``disorder``: 0 tidy to 1 messy."""
    for _ in range(TRIALS if tops else 0):
        top = tops[int(rng.integers(len(tops)))]
        pose = draw_on_top(rng, new.thing, new.item.size_m, top, disorder)
        if pose is None:
            continue
        placed = in_frame(new.item, owner, pose[0], pose[1], top.z, pose[2], Supported(kind="object", id=owner.id))
        if fits(placed) and clear_of(new, placed, obstacles):
            return placed
    return None


def in_frame(item: SceneObject, owner: SceneObject, x: float, y: float, z: float, turn: float, support: Supported) -> SceneObject:
    """Return an object at a place in the frame of another one."""
    box = world_box(owner, x, y, z, item.size_m, turn)
    yaw = math.remainder(owner.yaw_rad + turn, 2.0 * math.pi)
    return replace(item, position_m=(float(box[0]), float(box[1]), float(box[Z_LOW])), yaw_rad=yaw, support=support)


def on_floor(
    rng: np.random.Generator, new: Newcomer, anchors: Sequence[SceneObject], disorder: float, fits: Fits, obstacles: Obstacles
) -> SceneObject | None:
    """Return a thing on the floor beside a piece of furniture, where what is dropped or pushed aside ends up; None where none is free.

    Before its front lies only what is dropped: what is tidy stands at its sides, towards its back, and is not in the way.
    """
    size = new.item.size_m
    for _ in range(TRIALS if anchors else 0):
        beside = anchors[int(rng.integers(len(anchors)))]
        turn = draw_turn(rng, new.thing, disorder)
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        half = 0.5 * (size[0] * c + size[1] * s), 0.5 * (size[0] * s + size[1] * c)
        gap, along = GAP_M + abs(float(rng.normal(0.0, 0.12))), float(rng.uniform(-1.0, 1.0))
        side = int(rng.integers(0 if disorder > 0.0 else 1, 3))
        if side == 0:
            x, y = 0.5 * beside.size_m[0] + half[0] + gap, 0.5 * along * beside.size_m[1]
        else:
            back = along if disorder > 0.0 else -abs(along)
            x, y = 0.5 * back * beside.size_m[0], (0.5 * beside.size_m[1] + half[1] + gap) * (1.0 if side == 1 else -1.0)
        placed = in_frame(new.item, beside, x, y, -beside.position_m[2], turn, Supported(kind="floor"))
        if fits(placed) and clear_of(new, placed, obstacles):
            return placed
    return None


def use_strips(categories: Categories, objects: Sequence[SceneObject]) -> Boxes:
    """Return the floor (n, 8) that people need to use what stands on it: before fronts, and all round vehicles and machines."""
    strips: list[Floats] = []
    for item in objects:
        roles, (depth, width, _) = set(categories[item.category].roles), item.size_m
        if item.support.kind == "floor" and roles & {"vehicle", "machine"}:
            strips.append(world_box(item, 0.0, 0.0, 0.0, (depth + 2.0 * _USE_M, width + 2.0 * _USE_M, _USE_HEIGHT_M), 0.0))
        elif item.support.kind == "floor" and roles & set(_FRONT_USED):
            strips.append(world_box(item, 0.5 * (depth + _USE_M), 0.0, 0.0, (_USE_M, width, _USE_HEIGHT_M), 0.0))
    return box_rows(strips)


def by_wall(
    rng: np.random.Generator,
    new: Newcomer,
    wall: Floats,
    doors: Sequence[Point2],
    fits: Fits,
    obstacles: Obstacles,
) -> SceneObject | None:
    """Return a thing with its back to a wall, (w, 9) rows of ``wall_rows``, None where no drawn pose is free.

    ``doors``: the nearest places (x, y) of the doors that it belongs by; none: it may be anywhere.
    """
    boxes, owners = obstacles
    standing = boxes[(owners > 0) & (boxes[:, Z_LOW] < _KNEE_HIGH_M)]
    boxes = boxes.copy()
    boxes[boxes[:, Z_LOW] < _KNEE_HIGH_M, Z_LOW] = 0.0  # nothing is pushed under a radiator
    obstacles = Obstacles(boxes, owners)
    drawn = [
        found
        for found in _along_walls(rng, new.thing, new.item.size_m, wall)
        if not doors or min(math.dist(found[2:4], door) for door in doors) < DOOR_REACH_M
    ]
    for k in np.argsort(_nearness(new.item.size_m, drawn, wall, standing), kind="stable").tolist():
        x, y, yaw = drawn[k][2:]
        placed = replace(new.item, position_m=(x, y, 0.0), yaw_rad=yaw, support=Supported(kind="floor"))
        if fits(placed) and clear_of(new, placed, obstacles):
            return placed
    return None


_AtWall = tuple[int, float, float, float, float]
"""A pose against a wall: its number, how far along it the middle is, and x, y, yaw in the world."""


def _along_walls(rng: np.random.Generator, thing: Thing, size_m: tuple[float, float, float], wall: Floats) -> Iterator[_AtWall]:
    """Yield poses against walls that are long enough."""
    shares = wall[:, LENGTH] / wall[:, LENGTH].sum()
    for _ in range(WALL_TRIALS):
        row = wall[k := int(rng.choice(len(wall), p=shares))]
        turn, along = draw_turn(rng, thing, 0.0), float(rng.uniform()) * row[LENGTH]
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        off = 0.5 * (size_m[0] * c + size_m[1] * s) + _GAP_M + abs(float(rng.normal(0.0, _GAP_SD_M)))
        x, y = row[START_X] + along * row[ALONG_X] + off * row[NORMAL_X], row[START_Y] + along * row[ALONG_Y] + off * row[NORMAL_Y]
        yield k, along, float(x), float(y), math.remainder(row[WALL_YAW] + turn, 2.0 * math.pi)


def _nearness(size_m: tuple[float, float, float], drawn: Sequence[_AtWall], wall: Floats, standing: Boxes) -> Floats:
    """Return (n,) the distances in metres to a corner of the room at an end of the wall, or to what stands there, whichever is nearer."""
    (depth, width, height), half = size_m, 0.5 * max(size_m[:2])
    boxes = box_rows((x, y, 0.0, height, 0.5 * depth, 0.5 * width, math.cos(yaw), math.sin(yaw)) for _, _, x, y, yaw in drawn)
    near = -footprint_penetrations(boxes, standing)
    for n, (k, along, *_) in enumerate(drawn):
        low = along - half if wall[k, REFLEX] == 0.0 else math.inf
        high = wall[k, LENGTH] - along - half if wall[(k + 1) % len(wall), REFLEX] == 0.0 else math.inf
        near[n] = min(near[n], low, high)
    return near
