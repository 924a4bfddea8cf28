"""Poses of small things: drawn near tidy places or, with growing disorder, anywhere, and taken where nothing is in the way.

A support is filled by a conditional sampler of its own, given the furniture and the things that came before.  No thing moves anything else,
so no chain is needed, and the cost grows with the number of things alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.geometry.arrays import Boxes, Ints
from grammar.geometry.boxes import HALF_DEPTH, HALF_WIDTH, deepest_penetrations, place_boxes
from grammar.geometry.solids import local_solids
from grammar.small_things.rules import Depth, Thing
from grammar.small_things.surfaces import Top
from grammar.spec.categories import Category
from scene_description import SceneObject
from scene_description import Support as Supported

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
    "any": lambda rng: float(rng.uniform(-1.0, 1.0)),
}


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
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    free_depth = top.half_depth - 0.5 * (size_m[0] * c + size_m[1] * s)
    free_width = top.half_width - 0.5 * (size_m[0] * s + size_m[1] * c)
    if free_depth < 0.0 or free_width < 0.0:
        return None
    return top.x + u * free_depth, top.y + v * free_width, turn


def clear_of(category: Category, item: SceneObject, boxes: Boxes, owner: Ints) -> bool:
    """Return whether a thing keeps its air from the boxes (n, 8) of others."""
    local = local_solids(category, item.size_m)
    placed = np.empty((len(local), 8))
    place_boxes(local, 0, len(local), *item.position_m, item.yaw_rad, placed)
    placed[:, [HALF_DEPTH, HALF_WIDTH]] += GAP_M
    mine = np.full(len(placed), item.id, np.int64)
    return not len(boxes) or bool(deepest_penetrations(placed, mine, boxes, owner).max() <= _TOUCH_M)


def on_top(
    rng: np.random.Generator,
    thing: Thing,
    category: Category,
    item: SceneObject,
    owner: SceneObject,
    tops: Sequence[Top],
    disorder: float,
    boxes: Boxes,
    owners: Ints,
) -> SceneObject | None:
    """Return a thing on one of the surfaces of its owner, None where no drawn pose is free.

    Args:
        rng: source of randomness.
        thing: its rule.
        category: its solids.
        item: the thing, with its size and without a place.
        owner: what it stands on.
        tops: surfaces of the owner.
        disorder: 0 tidy to 1 messy.
        boxes: (n, 8) solids that are in the way.
        owners: (n,) whose these are.
    """
    c, s = math.cos(owner.yaw_rad), math.sin(owner.yaw_rad)
    for _ in range(TRIALS):
        top = tops[int(rng.integers(len(tops)))]
        pose = draw_on_top(rng, thing, item.size_m, top, disorder)
        if pose is None:
            continue
        x, y, turn = pose
        placed = replace(
            item,
            position_m=(owner.position_m[0] + x * c - y * s, owner.position_m[1] + x * s + y * c, owner.position_m[2] + top.z),
            yaw_rad=math.remainder(owner.yaw_rad + turn, 2.0 * math.pi),
            support=Supported(kind="object", id=owner.id),
        )
        if clear_of(category, placed, boxes, owners):
            return placed
    return None


def on_floor(
    rng: np.random.Generator,
    thing: Thing,
    category: Category,
    item: SceneObject,
    anchors: Sequence[SceneObject],
    disorder: float,
    inside: Callable[[SceneObject], bool],
    boxes: Boxes,
    owners: Ints,
) -> SceneObject | None:
    """Return a thing on the floor beside a piece of furniture, where what is dropped or pushed aside ends up; None where none is free.

    ``inside`` says whether the footprint of a placed thing is inside the room.  The other arguments are those of :func:`on_top`.
    """
    for _ in range(TRIALS if anchors else 0):
        beside = anchors[int(rng.integers(len(anchors)))]
        turn = draw_turn(rng, thing, disorder)
        c, s = abs(math.cos(turn)), abs(math.sin(turn))
        half = 0.5 * (item.size_m[0] * c + item.size_m[1] * s), 0.5 * (item.size_m[0] * s + item.size_m[1] * c)
        gap, along = GAP_M + abs(float(rng.normal(0.0, 0.12))), float(rng.uniform(-1.0, 1.0))
        side = int(rng.integers(3))
        if side == 0:
            x, y = 0.5 * beside.size_m[0] + half[0] + gap, 0.5 * along * beside.size_m[1]
        else:
            x, y = 0.5 * along * beside.size_m[0], (0.5 * beside.size_m[1] + half[1] + gap) * (1.0 if side == 1 else -1.0)
        cos, sin = math.cos(beside.yaw_rad), math.sin(beside.yaw_rad)
        placed = replace(
            item,
            position_m=(beside.position_m[0] + x * cos - y * sin, beside.position_m[1] + x * sin + y * cos, 0.0),
            yaw_rad=math.remainder(beside.yaw_rad + turn, 2.0 * math.pi),
            support=Supported(kind="floor"),
        )
        if inside(placed) and clear_of(category, placed, boxes, owners):
            return placed
    return None
