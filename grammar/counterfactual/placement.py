"""An object put where it is asked for: of a category and style, on what carries it there, if the room stays valid with it."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from grammar.counterfactual.addition import addable, next_id, rules_of_category
from grammar.counterfactual.change import ChangeError, Outcome, Work, random_numbers
from grammar.counterfactual.gate import categories_of, checked
from grammar.counterfactual.surfaces import dressed, lit
from grammar.counterfactual.values import read_as
from grammar.derivation.densities import draw_size
from grammar.geometry.solids import rest_top, surface_top
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, WALL_YAW, wall_rows
from grammar.spec.categories import Categories
from scene_description import ModelReference, SceneDescription, SceneObject, Support
from scene_description.types import Angle, Name, Point3, Seed

REACH_M = 0.05
"""So far from a place that is asked for, what carries the object there may be: it is put exactly on that."""
_TURN_RAD = 0.1
"""So far what hangs on a wall may be turned from it: it is turned exactly to that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Placement:
    """Where an object is to be: the middle of its underside and its yaw in the world; None leaves style and model's seed open."""

    at_m: Point3
    yaw_rad: Angle = 0.0
    style: Name | None = None
    seed: Seed | None = None


def place(work: Work) -> Outcome:
    """Put one object of the target's category where the value says; what its rules let it stand on or hang from must be there."""
    rules, change, scene = work.rules(), work.change, work.scene
    category = str(change.target.get("category", ""))
    if category not in addable(rules):
        raise ChangeError(f"{change.factor}: target: expected a category to add ({', '.join(addable(rules))}), got '{category}'")
    wanted = read_as(change, Placement)
    assert isinstance(wanted, Placement)
    styles = rules.appearance.categories[category].styles
    if wanted.style is not None and wanted.style not in styles:
        raise ChangeError(f"{change}: value.style: expected one of {', '.join(sorted(styles))}, got '{wanted.style}'")
    categories, rng, known = categories_of(rules, scene), random_numbers(scene, change), rules_of_category(rules, scene, category)
    label = categories[category].label_id if category in categories else 0
    for rule in {rule.mount: rule for rule in known}.values():
        item = SceneObject(
            id=next_id(scene),
            category=category,
            label=label,
            size_m=draw_size(rng, rule),
            position_m=wanted.at_m,
            yaw_rad=math.remainder(wanted.yaw_rad, 2.0 * math.pi),
            support=Support(kind="floor"),
            model=ModelReference(generator=category),
            parts=(),
        )
        seat = min(_SEATS[rule.mount](scene, categories, item), key=lambda seat: math.dist(seat.position_m, wanted.at_m), default=None)
        if seat is None:
            continue
        dressed_scene, item = dressed(rng, rules, scene, seat, wanted.style or "")
        if wanted.seed is not None:
            item = replace(item, model=replace(item.model, seed=wanted.seed))
        after = lit(rng, rules, replace(dressed_scene, objects=(*scene.objects, item)), item)
        return Outcome(checked(rules, scene, after, change), objects=(item.id,))
    mounts = " or ".join(sorted({_NEEDED[rule.mount] for rule in known}))
    at = "({:.3g}, {:.3g}, {:.3g})".format(*wanted.at_m)
    raise ChangeError(f"{change}: value.at_m: expected a place on {mounts}, got {at}, where that is not within {REACH_M:g} m")


def _on_floor(scene: SceneDescription, categories: Categories, item: SceneObject) -> Iterator[SceneObject]:
    x, y, z = item.position_m
    if abs(z) <= REACH_M:
        yield replace(item, position_m=(x, y, 0.0))


def _on_object(scene: SceneDescription, categories: Categories, item: SceneObject) -> Iterator[SceneObject]:
    """Yield the object on the tops beneath it, and on the floor."""
    yield from _on_floor(scene, categories, item)
    x, y, z = item.position_m
    for below in scene.objects:
        c, s = math.cos(below.yaw_rad), math.sin(below.yaw_rad)
        dx, dy = x - below.position_m[0], y - below.position_m[1]
        for height, mid_x, mid_y, half_d, half_w in _tops(categories, below):
            top = below.position_m[2] + height
            is_over = abs(dx * c + dy * s - mid_x) <= half_d and abs(dy * c - dx * s - mid_y) <= half_w
            if is_over and abs(top - z) <= REACH_M:
                yield replace(item, position_m=(x, y, top), support=Support(kind="object", id=below.id))


def _tops(categories: Categories, below: SceneObject) -> Iterator[tuple[float, float, float, float, float]]:
    """Yield height, x and y of the middle, half depth and half width (m) of what an object carries things on, in its frame."""
    category = categories[below.category]
    for surface in category.surfaces:
        height, half_d, half_w = surface_top(surface, below.size_m)
        yield height, 0.0, 0.0, half_d, half_w
    for rest in category.rests:
        yield rest_top(rest, below.size_m)


def _on_wall(scene: SceneDescription, categories: Categories, item: SceneObject) -> Iterator[SceneObject]:
    x, y, z = item.position_m
    for number, row in enumerate(wall_rows(scene.room.polygon_m)):
        dx, dy = x - row[START_X], y - row[START_Y]
        along, across = dx * row[ALONG_X] + dy * row[ALONG_Y], dx * row[NORMAL_X] + dy * row[NORMAL_Y]
        short = 0.5 * item.size_m[0] - across
        turn = math.remainder(item.yaw_rad - row[WALL_YAW], 2.0 * math.pi)
        if 0.0 <= along <= row[LENGTH] and abs(short) <= REACH_M and abs(turn) <= _TURN_RAD:
            at = (float(x + short * row[NORMAL_X]), float(y + short * row[NORMAL_Y]), z)
            yield replace(item, position_m=at, yaw_rad=float(row[WALL_YAW]), support=Support(kind="wall", wall=number))


def _on_ceiling(scene: SceneDescription, categories: Categories, item: SceneObject) -> Iterator[SceneObject]:
    x, y, z = item.position_m
    hung = scene.room.height_m - item.size_m[2]
    if abs(z - hung) <= REACH_M or abs(z - scene.room.height_m) <= REACH_M:
        yield replace(item, position_m=(x, y, hung), support=Support(kind="ceiling"))


_SEATS = {"floor": _on_floor, "object": _on_object, "wall": _on_wall, "ceiling": _on_ceiling}
"""Mount of a rule -> what yields the object where it would be carried, near the place that was asked for."""
_NEEDED: Mapping[str, str] = {
    "floor": "the floor",
    "object": "the floor or a top",
    "wall": "a wall, with its back to it",
    "ceiling": "the ceiling",
}
