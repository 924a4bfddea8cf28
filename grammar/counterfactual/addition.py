"""Objects put into a room: of a category, at a place where the room stays valid."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from grammar.counterfactual.change import ChangeError, InvalidChangeError, Outcome, Work, random_numbers
from grammar.counterfactual.gate import categories_of, checked, grammar_of
from grammar.counterfactual.surfaces import dressed, lit
from grammar.counterfactual.targets import all_things
from grammar.counterfactual.values import whole
from grammar.derivation.densities import draw_height, draw_size
from grammar.geometry.arrays import Floats
from grammar.geometry.boxes import deepest_penetrations
from grammar.geometry.slopes import above_slopes, slope_rows
from grammar.geometry.solids import object_solids, surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW, rectangle_outside, wall_rows
from grammar.layout.assemble import around_target
from grammar.spec.categories import Categories
from grammar.spec.object_rules import ObjectRule
from grammar.spec.rules import Grammar
from grammar.synthesize import SceneSynthesizer
from scene_description import ModelReference, SceneDescription, SceneObject, Support

TRIALS = 400
"""Places that are drawn for one object."""

MOST = 50
"""Objects that one change can add."""

_CHECKED = 40
"""Places of one object that are checked exactly before it is given up."""


class NewObject(NamedTuple):
    """An object that has no place yet, its rule, and the objects that it can belong to or stand on."""

    item: SceneObject
    rule: ObjectRule
    cores: Sequence[SceneObject]
    supporters: Sequence[SceneObject]


def free_places(
    rng: np.random.Generator, scene: SceneDescription, categories: Categories, new: NewObject, tolerance_m: float
) -> Iterator[SceneObject]:
    """Yield the new object at places where it overlaps nothing; the exact checks of the whole room are left to the caller.

    ``tolerance_m``: depth of overlap that counts as touching.
    """
    boxes, owner = object_solids(categories, scene.objects)
    wall, slope = wall_rows(scene.room.polygon_m), slope_rows(scene.room)
    for _ in range(TRIALS):
        placed = _draw(rng, scene, categories, new, wall)
        if placed is None:
            continue
        x, y, z = placed.position_m
        c, s = math.cos(placed.yaw_rad), math.sin(placed.yaw_rad)
        if rectangle_outside(wall, x, y, c, s, 0.5 * placed.size_m[0], 0.5 * placed.size_m[1]) > tolerance_m or z < 0.0:
            continue
        if z + placed.size_m[2] > scene.room.height_m + 1e-9:
            continue
        mine, me = object_solids(categories, [placed])
        if any(above_slopes(slope, mine, k) > tolerance_m for k in range(len(mine))):
            continue
        if len(mine) and len(boxes) and deepest_penetrations(mine, me, boxes, owner).max() > tolerance_m:
            continue
        yield placed


def _draw(rng: np.random.Generator, scene: SceneDescription, categories: Categories, new: NewObject, wall: Floats) -> SceneObject | None:
    """Return the object at a drawn place, or None where there is none."""
    item, rule, cores, supporters = new
    if rule.mount == "object":
        return _on_supporter(rng, categories, rule, supporters, item)
    if rule.mount == "wall":
        height = 0.5 * scene.room.height_m if rule.centre_height_m is None else draw_height(rng, rule)[0]
        return _at_wall(rng, wall, item, 0.0, 0.0, height - 0.5 * item.size_m[2], hangs=True)
    if rule.mount == "ceiling":
        x, y, yaw = _anywhere(rng, wall)
        return replace(item, position_m=(x, y, scene.room.height_m - item.size_m[2]), yaw_rad=yaw)
    if rule.around and cores and rng.random() >= _alone(rule):
        return _around(rng, rule, cores[int(rng.integers(len(cores)))], item)
    if rule.wall:
        mode = rule.wall[int(rng.integers(len(rule.wall)))]
        turn = float(rng.uniform(-math.pi, math.pi)) if mode.orientation_rad is None else mode.orientation_rad
        return _at_wall(rng, wall, item, mode.distance_m, turn, 0.0, hangs=False)
    x, y, yaw = _anywhere(rng, wall)
    return replace(item, position_m=(x, y, 0.0), yaw_rad=yaw)


def _alone(rule: ObjectRule) -> float:
    """Return the probability that an object belongs to no core though there are some."""
    weights = rule.cores or {}
    return weights.get("none", 0.0) / max(sum(weights.values()), 1e-12)


def _anywhere(rng: np.random.Generator, wall: Floats) -> tuple[float, float, float]:
    """Return a point of the bounding rectangle of the floor, and a yaw square to a wall."""
    low, high = wall[:, [START_X, START_Y]].min(0), wall[:, [START_X, START_Y]].max(0)
    x, y = (low + (high - low) * rng.random(2)).tolist()
    return x, y, float(wall[int(rng.integers(len(wall))), WALL_YAW])


def _at_wall(
    rng: np.random.Generator, wall: Floats, item: SceneObject, gap_m: float, turn_rad: float, z_m: float, *, hangs: bool
) -> SceneObject:
    """Return the object beside a wall, which is drawn by its length."""
    w = int(rng.choice(len(wall), p=wall[:, LENGTH] / wall[:, LENGTH].sum()))
    along = float(rng.random() * wall[w, LENGTH])
    c, s = abs(math.cos(turn_rad)), abs(math.sin(turn_rad))
    across = gap_m + 0.5 * (item.size_m[0] * c + item.size_m[1] * s)
    x = float(wall[w, START_X] + along * wall[w, ALONG_X] + across * wall[w, NORMAL_X])
    y = float(wall[w, START_Y] + along * wall[w, ALONG_Y] + across * wall[w, NORMAL_Y])
    support = Support(kind="wall", wall=w) if hangs else item.support
    return replace(item, position_m=(x, y, z_m), yaw_rad=float(wall[w, WALL_YAW]) + turn_rad, support=support)


def _around(rng: np.random.Generator, rule: ObjectRule, core: SceneObject, item: SceneObject) -> SceneObject:
    """Return the object at one of the places that its rule has around a core."""
    mode = rule.around[int(rng.integers(len(rule.around)))]
    x, y, turn = around_target(mode, item.size_m, core.size_m)
    x, y = (value + float(rng.normal(0.0, 0.05)) for value in (x, y))
    if math.isnan(turn):
        turn = float(rng.uniform(-math.pi, math.pi))
    c, s = math.cos(core.yaw_rad), math.sin(core.yaw_rad)
    position = (core.position_m[0] + x * c - y * s, core.position_m[1] + x * s + y * c, 0.0)
    return replace(item, position_m=position, yaw_rad=math.remainder(core.yaw_rad + turn, 2.0 * math.pi), group=core.id)


def _on_supporter(
    rng: np.random.Generator, categories: Categories, rule: ObjectRule, supporters: Sequence[SceneObject], item: SceneObject
) -> SceneObject | None:
    """Return the object somewhere on a support surface, or None where it does not fit on the one that was drawn."""
    tops = [
        (below, surface_top(surface, below.size_m))
        for below in supporters
        for surface in (categories[below.category].surfaces if below.category in categories else ())
    ]
    if not tops:
        return None
    below, (height, half_d, half_w) = tops[int(rng.integers(len(tops)))]
    turns = [mode.orientation_rad or 0.0 for mode in rule.placements] or [0.0]
    turn = turns[int(rng.integers(len(turns)))]
    c, s = abs(math.cos(turn)), abs(math.sin(turn))
    free_d = half_d - 0.5 * (item.size_m[0] * c + item.size_m[1] * s)
    free_w = half_w - 0.5 * (item.size_m[0] * s + item.size_m[1] * c)
    u, v = rng.uniform(-1.0, 1.0, 2).tolist()
    if free_d < 0.0 or free_w < 0.0:
        return None
    x, y = u * free_d, v * free_w
    c, s = math.cos(below.yaw_rad), math.sin(below.yaw_rad)
    position = (below.position_m[0] + x * c - y * s, below.position_m[1] + x * s + y * c, below.position_m[2] + height)
    yaw = math.remainder(below.yaw_rad + turn, 2.0 * math.pi)
    return replace(item, position_m=position, yaw_rad=yaw, support=Support(kind="object", id=below.id))


def rules_of_category(rules: SceneSynthesizer, scene: SceneDescription, category: str) -> tuple[ObjectRule, ...]:
    """Return the rules of a category in the scene's grammar, else in the first other one that has it."""
    for grammar in (grammar_of(rules, scene), *rules.grammars.values(), *rules.learned.values()):
        found = tuple(rule for rule in grammar.objects.values() if rule.category == category)
        if found:
            return found
    return ()


def addable(rules: SceneSynthesizer) -> list[str]:
    """Return the categories that an object can be added of."""
    grammars: Iterable[Grammar] = (*rules.grammars.values(), *rules.learned.values())
    return sorted({rule.category for grammar in grammars for rule in grammar.objects.values()} & set(rules.appearance.categories))


def next_id(scene: SceneDescription) -> int:
    """Return an id that no object of the scene has or had."""
    gone = (key for record in scene.counterfactuals or () for key in record.removed)
    return max((*(thing.id for thing in all_things(scene)), *gone), default=0) + 1


def added(rng: np.random.Generator, work: Work, scene: SceneDescription, rule: ObjectRule) -> SceneDescription:
    """Return the scene with one more object of a rule, the last of its objects.

    Raises:
        InvalidChangeError: no valid place was found; it says what the last one that was tried failed at.
    """
    rules = work.rules()
    categories, grammar = categories_of(rules, scene), grammar_of(rules, scene)
    label = categories[rule.category].label_id if rule.category in categories else 0
    item = SceneObject(
        id=next_id(scene),
        category=rule.category,
        label=label,
        size_m=draw_size(rng, rule),
        position_m=(0.0, 0.0, 0.0),
        yaw_rad=0.0,
        support=Support(kind="floor" if rule.mount == "object" else rule.mount),
        model=ModelReference(generator=rule.category),
        parts=(),
    )
    scene, item = dressed(rng, rules, scene, item)
    new = NewObject(item, rule, addressed(scene, rule.cores), addressed(scene, rule.supporters))
    last = InvalidChangeError(f"{work.change}: expected a place that is free for a {rule.category}, got none", ())
    found = free_places(rng, scene, categories, new, grammar.validity.penetration_m)
    for _, placed in zip(range(_CHECKED), found, strict=False):
        changed = lit(rng, rules, replace(scene, objects=(*scene.objects, placed)), placed)
        try:
            return checked(rules, scene, changed, work.change)
        except InvalidChangeError as error:
            last = error
    raise last


def addressed(scene: SceneDescription, weights: Mapping[str, float] | None) -> list[SceneObject]:
    """Return the objects that an address can point to."""
    symbols = {node.object: node.symbol for node in scene.parse_graph.nodes if node.kind == "terminal"}
    wanted = {symbol for symbol, weight in (weights or {}).items() if weight > 0.0}
    return [item for item in scene.objects if symbols.get(item.id, item.category) in wanted or item.category in wanted]


def add(work: Work) -> Outcome:
    """Put so many objects of the target's category into the room, one after the other."""
    rules, change = work.rules(), work.change
    category = str(change.target.get("category", ""))
    known = addable(rules)
    if category not in known:
        raise ChangeError(f"{change.factor}: target: expected a category to add ({', '.join(known)}), got '{category}'")
    count, scene, new = whole(change, 0, MOST), work.scene, []
    for k in range(count):
        rng = random_numbers(work.scene, change, k)
        choices = rules_of_category(rules, scene, category)
        try:
            scene = added(rng, work, scene, choices[int(rng.integers(len(choices)))])
        except InvalidChangeError as error:
            raise InvalidChangeError(
                f"{change}: value {count}: expected a valid place for each {category}, got room for {k} ({_reason(error)}); "
                "add fewer or take another seed",
                error.checks,
            ) from None
        new.append(scene.objects[-1].id)
    return Outcome(scene, objects=tuple(new))


def _reason(error: InvalidChangeError) -> str:
    """Return the names of the checks that the last place failed."""
    return f"the last place failed {', '.join(check.name for check in error.checks)}" if error.checks else "nothing else is free"
