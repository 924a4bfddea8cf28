"""Untidiness of furniture: chairs pushed back and turned, rugs shifted, drawers and doors ajar, pictures askew, curtains half drawn.

Every piece that may move has a level of clutter from which it has moved, and one pose that it moves to, which do not depend on the clutter
asked for.  Small things keep off both places of it, so those of smaller clutters stay where they are.
"""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.geometry.boxes import box_rows, deepest_penetrations
from grammar.geometry.solids import local_solids, whole_box
from grammar.small_things.place import Newcomer, Obstacles, clear_of
from grammar.small_things.rules import SmallThings, Thing
from grammar.small_things.sites import Surroundings
from scene_description import SceneObject

UNTIDY = 4
"""Names the streams of random numbers of what moves."""

_TRIALS = 6
_FIRST, _LAST = 0.7, 3.0
"""Levels between which things move, all alike likely."""

_GENTLE, _WILD = 0.35, 1.0
"""Shares of the most that things move by at clutter 1 and less, and at 3 and more."""

_THING = Thing(size_m=(1.0, 1.0, 1.0), sd_m=(0.0, 0.0, 0.0))


class Move(NamedTuple):
    """A piece of furniture as it is from a level of clutter on."""

    level: float
    item: SceneObject


def moves(
    rules: SmallThings, around: Surroundings, objects: Sequence[SceneObject], root: int, held: Collection[str], swings: Obstacles
) -> list[Move]:
    """Return what moves in a room, in the order of levels.

    Args:
        rules: of small things.
        around: the room before anything moves.
        objects: its furniture, which carries the grammar's things.
        root: seed; every object has a stream of its own.
        held: categories whose models are files: nothing of theirs opens.
        swings: floor that stays free: where doors swing.
    """
    carrying = {item.support.id for item in objects if item.support.kind == "object"}
    found: list[Move] = []
    for item in objects:
        rng = np.random.default_rng([root, UNTIDY, item.id])
        level = float(rng.uniform(_FIRST, _LAST))
        most = _GENTLE + (_WILD - _GENTLE) * min(max(0.5 * (level - 1.0), 0.0), 1.0)
        fixed = item.category in held
        taken = Obstacles(*around.taken).with_more(*swings).with_more(*_solids(around, [move.item for move in found]))
        for moved in _poses(rng, rules, item, most, free=item.id not in carrying, fixed=fixed):
            if _fits(around, moved, taken):
                found.append(Move(level, moved))
                break
    return sorted(found, key=lambda move: move.level)


def _poses(
    rng: np.random.Generator, rules: SmallThings, item: SceneObject, most: float, *, free: bool, fixed: bool
) -> Iterator[SceneObject]:
    """Yield poses that an object may move to."""
    untidy, name = rules.untidy, item.category
    if name in untidy.posed and not fixed:
        yield replace(item, model=replace(item.model, ajar=round(most * untidy.posed[name] * float(rng.uniform(0.3, 1.0)), 4)))
    elif name in untidy.reach_m and not fixed and item.support.kind == "floor":
        reach = most * untidy.reach_m[name] * float(rng.uniform(0.4, 1.0))
        yield _opened(item, reach)
    elif name in untidy.turned and free:
        back, turn = untidy.turned[name]
        for _ in range(_TRIALS):
            yield _pushed(item, -most * back * float(rng.uniform(0.1, 1.0)), 0.0, most * turn * float(rng.uniform(-1.0, 1.0)))
    elif name in untidy.shifted and free:
        shift, turn = untidy.shifted[name]
        for _ in range(_TRIALS):
            x, y, yaw = (most * float(rng.uniform(-1.0, 1.0)) * amount for amount in (shift, shift, turn))
            yield _pushed(item, x, y, yaw)


def _pushed(item: SceneObject, x: float, y: float, turn: float) -> SceneObject:
    """Return an object moved by (x, y) in its own frame, and turned."""
    c, s = math.cos(item.yaw_rad), math.sin(item.yaw_rad)
    position = (item.position_m[0] + x * c - y * s, item.position_m[1] + x * s + y * c, item.position_m[2])
    return replace(item, position_m=position, yaw_rad=math.remainder(item.yaw_rad + turn, 2.0 * math.pi))


def _opened(item: SceneObject, reach: float) -> SceneObject:
    """Return a store with a front that reaches out: its box is as much deeper."""
    depth, width, height = item.size_m
    deeper = replace(item, size_m=(depth + reach, width, height), model=replace(item.model, ajar=reach / (depth + reach)))
    return _pushed(deeper, 0.5 * reach, 0.0, 0.0)


def _solids(around: Surroundings, items: Sequence[SceneObject]) -> Obstacles:
    found = Surroundings(around.categories, around.room, items)
    return found.taken


def _fits(around: Surroundings, item: SceneObject, taken: Obstacles) -> bool:
    """Return whether a moved object is inside the room and meets nothing but itself."""
    if item.support.kind == "wall":
        return True
    category = around.categories[item.category]
    if category.underlay:
        sheet = box_rows([whole_box(item)])
        doors = taken.owners == 0
        free = Obstacles(taken.boxes[doors], taken.owners[doors])
        clear = not len(free.boxes) or bool(deepest_penetrations(sheet, np.array([item.id]), *free).max() <= 0.0)
        return clear and around.fits(item)
    new = Newcomer(_THING, item, local_solids(category, item.size_m))
    return around.fits(item) and clear_of(new, item, taken)
