"""Objects taken out of a room, with what they carry and with their lamps."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from grammar.counterfactual.change import ChangeError, random_numbers
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.gate import checked
from grammar.counterfactual.targets import OBJECTS, chosen_objects, names
from grammar.counterfactual.values import whole
from scene_description import SceneDescription, SceneObject
from scene_description.types import MAX_OBJECTS


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


FACTORS = (
    Factor(
        name="object_removed",
        label="objects removed",
        unit=None,
        value="true: the targeted objects are taken out, with what they carry; a number: so many of them; false or 0: none",
        attribute="objects",
        touches="geometry",
        targets=OBJECTS,
        make=remove,
        current=lambda work: 0 if chosen_objects(work.scene, work.change) else None,
    ),
)
