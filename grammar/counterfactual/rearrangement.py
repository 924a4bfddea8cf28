"""Objects moved about the room and replaced by others in their places, with what stands on them."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from grammar.counterfactual.addition import addable, rules_of_category
from grammar.counterfactual.change import ChangeError, Outcome, Work, random_numbers
from grammar.counterfactual.gate import categories_of, checked
from grammar.counterfactual.surfaces import dressed, lit
from grammar.counterfactual.targets import chosen_objects, names
from grammar.counterfactual.values import read_as, whole
from grammar.derivation.densities import draw_size
from grammar.geometry.solids import surface_top
from grammar.spec.categories import Categories
from grammar.synthesize import SceneSynthesizer
from scene_description import FieldError, Limits, ModelReference, SceneDescription, SceneObject, from_mapping
from scene_description.strict import shorten
from scene_description.types import MAX_OBJECTS, Name, Point3, Seed

_Motion = tuple[
    Annotated[float, Limits(ge=-100.0, le=100.0, unit="m")],
    Annotated[float, Limits(ge=-100.0, le=100.0, unit="m")],
    Annotated[float, Limits(ge=-7.0, le=7.0, unit="rad")],
]


def carried(scene: SceneDescription, ids: Collection[int]) -> set[int]:
    """Return the ids of objects and of all that stands on them, directly or not."""
    found = set(ids)
    while True:
        more = {item.id for item in scene.objects if item.support.id in found} - found
        if not more:
            return found
        found |= more


def without(scene: SceneDescription, ids: Collection[int]) -> SceneDescription:
    """Return the scene without some objects and their lamps; what belonged to their groups stands for itself."""
    objects = tuple(
        replace(item, group=None) if item.group in ids and item.group is not None else item for item in scene.objects if item.id not in ids
    )
    return replace(scene, objects=objects, lights=tuple(light for light in scene.lights if light.object not in ids))


def taken_out(work: Work, chosen: Sequence[SceneObject]) -> Outcome:
    """Return the scene without the chosen objects and what they carry, checked."""
    scene = work.scene
    gone = carried(scene, [item.id for item in chosen])
    if not gone:
        return Outcome(scene)
    name, asked = names(scene.objects), {item.id for item in chosen}
    along = ", ".join(f"{key} {name[key]}" for key in sorted(gone - asked))
    loose = tuple(item.id for item in scene.objects if item.group in gone and item.id not in gone)
    after = checked(work.rules(), scene, without(scene, gone), work.change)
    return Outcome(after, objects=loose, removed=tuple(sorted(gone)), note=f"taken along with what carried them: {along}" if along else "")


def remove(work: Work) -> Outcome:
    """Take out all targeted objects, or so many of them, in an order that the seed draws."""
    chosen = chosen_objects(work.scene, work.change)
    if not chosen:
        raise ChangeError(f"{work.change}: target: expected objects, got a room without any")
    count = len(chosen)
    if work.change.value is not True:
        count = 0 if work.change.value is False else whole(work.change, 0, MAX_OBJECTS)
    if count > len(chosen):
        raise ChangeError(f"{work.change}: value: expected at most {len(chosen)}, the objects that are targeted, got {count}")
    order = random_numbers(work.scene, work.change).permutation(len(chosen))
    return taken_out(work, [chosen[k] for k in order[:count]])


def shifted(item: SceneObject, about: Point3, dx: float, dy: float, dz: float, turn: float) -> SceneObject:
    """Return an object turned about a vertical line and then moved."""
    c, s = math.cos(turn), math.sin(turn)
    x, y = item.position_m[0] - about[0], item.position_m[1] - about[1]
    moved = (about[0] + x * c - y * s + dx, about[1] + x * s + y * c + dy) if turn else (item.position_m[0] + dx, item.position_m[1] + dy)
    yaw = math.remainder(item.yaw_rad + turn, 2.0 * math.pi) if turn else item.yaw_rad
    return replace(item, position_m=(*moved, item.position_m[2] + dz), yaw_rad=yaw)


def move(work: Work) -> Outcome:
    """Move the targeted objects with all that they carry; a group turns about its core, anything else about itself."""
    value = read_as(work.change, _Motion)
    assert isinstance(value, tuple)
    dx, dy, turn = value
    scene = work.scene
    chosen = {item.id for item in chosen_objects(scene, work.change)}
    by_id = {item.id: item for item in scene.objects}
    pivot: dict[int, int] = {}
    for key in sorted(chosen):
        if not _below(by_id[key], by_id) & chosen:
            core = by_id[key].group if "group" in work.change.target else None
            for other in carried(scene, [key]):
                pivot[other] = core if core in chosen and core is not None else key
    objects = tuple(
        shifted(item, by_id[pivot[item.id]].position_m, dx, dy, 0.0, turn) if item.id in pivot else item for item in scene.objects
    )
    if (dx, dy, turn) == (0.0, 0.0, 0.0):
        return Outcome(scene, objects=tuple(sorted(pivot)))
    return Outcome(checked(work.rules(), scene, replace(scene, objects=objects), work.change), objects=tuple(sorted(pivot)))


def _below(item: SceneObject, by_id: Mapping[int, SceneObject]) -> set[int]:
    """Return the ids of what an object stands on, all the way down."""
    found: set[int] = set()
    while item.support.id is not None and item.support.id in by_id:
        found.add(item.support.id)
        item = by_id[item.support.id]
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Replacement:
    """What takes an object's place: of which category and style, None for the object's own, and the seed of its model, None to draw one."""

    category: Name | None = None
    style: Name | None = None
    seed: Seed | None = None


def exchange(work: Work) -> Outcome:
    """Put another model in the place of each targeted object: another specimen, another style or another category."""
    scene, new = work.scene, []
    removed: set[int] = set()
    for item in chosen_objects(scene, work.change):
        if item.id in removed:
            continue
        wanted = _replacement(work, item)
        rng = random_numbers(scene, work.change, item.id)
        before = {other.id for other in scene.objects}
        scene = _exchanged(rng, work.rules(), scene, item, wanted)
        removed |= before - {other.id for other in scene.objects}
        new.append(item.id)
    scene = checked(work.rules(), work.scene, scene, work.change)
    note = "what stood on them has no place any more and was removed" if removed else ""
    return Outcome(scene, objects=tuple(new), removed=tuple(sorted(removed)), note=note)


def _replacement(work: Work, item: SceneObject) -> Replacement:
    """Return what a value means for an object, checked."""
    change, rules = work.change, work.rules()
    looks, known = rules.appearance.categories, addable(rules)
    styles = sorted(looks[item.category].styles) if item.category in looks else []
    if isinstance(change.value, Mapping):
        try:
            wanted = from_mapping(Replacement, change.value, "value")
        except FieldError as error:
            raise ChangeError(f"{change}: {error}") from None
        styles = sorted(looks[wanted.category].styles) if wanted.category in known else styles
    elif isinstance(change.value, str):
        wanted = Replacement(style=change.value) if change.value in styles else Replacement(category=change.value)
    else:
        raise ChangeError(f"{change}: value: expected a style, a category or {{category, style, seed}}, got {shorten(change.value)}")
    no_category = wanted.category not in (None, item.category, *known)
    if no_category or (wanted.style is not None and wanted.style not in styles):
        asked = wanted.category if no_category else wanted.style
        kind = item.category if no_category else wanted.category or item.category
        there = f"a style of {kind} ({', '.join(styles)}) or a category ({', '.join(known)})"
        raise ChangeError(f"{change}: value: expected {there}, got '{asked}'")
    return wanted


def _exchanged(
    rng: np.random.Generator, rules: SceneSynthesizer, scene: SceneDescription, item: SceneObject, wanted: Replacement
) -> SceneDescription:
    """Return the scene with one object replaced; it keeps its id, its place in the list and its back or middle where they are."""
    categories = categories_of(rules, scene)
    new = item
    if wanted.category not in (None, item.category):
        new = _of_category(rng, rules, scene, item, str(wanted.category))
        new = replace(new, label=categories[new.category].label_id)
    if wanted.style is not None or new.category != item.category:
        kept = {part.name: part.material for part in item.parts} if new.category == item.category else None
        scene, new = dressed(rng, rules, scene, new, wanted.style or "", kept)
    own = int(rng.integers(2**63 - 1)) if wanted.seed is None else wanted.seed
    if new.model.generator is not None:
        new = replace(new, model=replace(new.model, seed=own))
    scene = replace(scene, objects=tuple(new if other.id == item.id else other for other in scene.objects))
    parts = {part.name for part in new.parts}
    if new.category != item.category:
        scene = replace(scene, lights=tuple(light for light in scene.lights if light.object != item.id))
        scene = lit(rng, rules, _reseated(scene, categories, item, new), new)
    return replace(scene, lights=tuple(light for light in scene.lights if light.object != item.id or light.part in parts))


def _of_category(
    rng: np.random.Generator, rules: SceneSynthesizer, scene: SceneDescription, item: SceneObject, category: str
) -> SceneObject:
    """Return an object of another category with its back where the old one's was, and its underside, middle or top at the same height."""
    size = draw_size(rng, rules_of_category(rules, scene, category)[0])
    ahead = 0.5 * (size[0] - item.size_m[0]) if item.support.kind in ("floor", "wall") else 0.0
    up = {"wall": 0.5, "ceiling": 1.0}.get(item.support.kind, 0.0) * (item.size_m[2] - size[2])
    x, y, z = item.position_m
    position = (x + ahead * math.cos(item.yaw_rad), y + ahead * math.sin(item.yaw_rad), z + up)
    return replace(item, category=category, size_m=size, position_m=position, model=ModelReference(generator=category), parts=())


def _reseated(scene: SceneDescription, categories: Categories, old: SceneObject, new: SceneObject) -> SceneDescription:
    """Return the scene with what stood on the old object on the new one's top, or gone if that has none."""
    on_it: Collection[int] = carried(scene, [old.id]) - {old.id}
    surfaces = categories[new.category].surfaces
    if not on_it:
        return scene
    if not surfaces:
        return without(scene, on_it)
    height = max(surface_top(surface, new.size_m)[0] for surface in surfaces)
    foot = {item.id: item.position_m[2] for item in scene.objects if item.support.id == old.id}
    dx, dy = new.position_m[0] - old.position_m[0], new.position_m[1] - old.position_m[1]
    dz = new.position_m[2] + height - min(foot.values())
    objects = tuple(shifted(item, old.position_m, dx, dy, dz, 0.0) if item.id in on_it else item for item in scene.objects)
    return replace(scene, objects=objects)
