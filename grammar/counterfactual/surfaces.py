"""What things are made of: materials of objects, parts and categories, and the finish of walls, floor and ceiling.

A changed material is a new one at the end of the scene's list, so that parts which are not targeted keep theirs and all indices stay.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.appearance.appearance import MaterialPool, sample_appearance
from grammar.appearance.lighting import sample_lighting
from grammar.appearance.restrict import restricted
from grammar.counterfactual.change import Change, ChangeError, Outcome, Work, random_numbers
from grammar.counterfactual.targets import ALL, OBJECTS, all_things, chosen_things
from grammar.counterfactual.values import number, one_of, read_as
from grammar.spec.request import SceneRequest
from grammar.synthesize import SceneSynthesizer
from scene_description import Material, Part, SceneDescription, SceneObject
from scene_description.color import linear_from_srgb
from scene_description.types import Color

_HEX = re.compile("#[0-9a-fA-F]{6}")
_LONGEST_ID = 120
NO_TEXTURE = "none"

Edit = Callable[[Material], Material]


def adopted(materials: Sequence[Material], new: Material) -> Material:
    """Return a new material of a scene under an id that is free."""
    count = sum(material.id.startswith("changed_") for material in materials) + 1
    return replace(new, id=f"changed_{count}_{new.id}"[:_LONGEST_ID])


class _Parts:
    """The parts that a target means: it tells their materials, and replaces these."""

    def __init__(self, work: Work) -> None:
        scene, target = work.scene, work.change.target
        self._part = str(target.get("part", ALL))
        self._surface = str(target.get("surface", ALL))
        only_surfaces = "surface" in target
        whole_room = not any(key in target and target[key] != ALL for key in OBJECTS)
        self._things = set() if only_surfaces else {thing.id for thing in chosen_things(scene, work.change)}
        self._room = only_surfaces or whole_room
        owners = [(thing.id, thing.parts) for thing in all_things(scene) if thing.id in self._things]
        found = [(owner, part) for owner, parts in [*owners, (0, scene.room.surfaces if self._room else ())] for part in parts]
        chosen = [(owner, part) for owner, part in found if self._means(owner, part)]
        if not chosen:
            key, asked = ("surface", self._surface) if only_surfaces else ("part", self._part)
            there = ", ".join(sorted({part.name for _, part in found})) or "there is none"
            raise ChangeError(f"{work.change.factor}: target: expected {key} of what is targeted ({there}), got '{asked}'")
        self.owners = tuple(sorted({owner for owner, _ in chosen if owner}))
        by_id = {material.id: material for material in scene.materials}
        self.materials = tuple(by_id[key] for key in dict.fromkeys(part.material for _, part in chosen))
        self._scene = scene

    def _means(self, owner: int, part: Part) -> bool:
        name = self._part if owner or self._surface == ALL else self._surface
        return name in (ALL, part.name)

    def changed(self, edit: Edit) -> Outcome:
        """Return the scene with an edited copy of each material in the targeted parts."""
        materials = list(self._scene.materials)
        new_id: dict[str, str] = {}
        same: dict[Material, str] = {}
        for material in self.materials:
            edited = edit(material)
            if edited == material:
                continue
            if edited not in same:
                materials.append(adopted(materials, edited))
                same[edited] = materials[-1].id
            new_id[material.id] = same[edited]

        def parts(owner: int, old: tuple[Part, ...]) -> tuple[Part, ...]:
            return tuple(
                replace(part, material=new_id.get(part.material, part.material)) if self._means(owner, part) else part for part in old
            )

        room = self._scene.room
        openings = tuple(replace(o, parts=parts(o.id, o.parts)) if o.id in self._things else o for o in room.openings)
        surfaces = parts(0, room.surfaces) if self._room else room.surfaces
        objects = tuple(
            replace(item, parts=parts(item.id, item.parts)) if item.id in self._things else item for item in self._scene.objects
        )
        scene = replace(self._scene, room=replace(room, openings=openings, surfaces=surfaces), objects=objects, materials=tuple(materials))
        return Outcome(scene, objects=self.owners)


def drawn_material(work: Work, name: str) -> Material:
    """Return a material of ``materials.yaml``, drawn from its ranges."""
    pool = MaterialPool(random_numbers(work.scene, work.change), work.rules().appearance)
    pool.draw_material(name)
    return pool.materials[-1]


def set_material(work: Work) -> Outcome:
    """Make the targeted parts of a named material; they share it."""
    parts = _Parts(work)
    new = drawn_material(work, one_of(work.change, work.rules().appearance.materials, "a material of materials.yaml"))
    return parts.changed(lambda material: new)


def set_finish(surface: str) -> Callable[[Work], Outcome]:
    """Return a function that makes one surface of the room of a named material."""

    def make(work: Work) -> Outcome:
        return set_material(work._replace(change=replace(work.change, target={"surface": surface})))

    return make


def set_color(work: Work) -> Outcome:
    """Give materials another base colour; the further colours of a pattern stay."""
    color = _color(work.change)
    return _Parts(work).changed(lambda material: replace(material, base_color=color))


def _color(change: Change) -> Color:
    if isinstance(change.value, str):
        if not _HEX.fullmatch(change.value):
            raise ChangeError(f"{change}: value: expected linear [r, g, b] or sRGB '#rrggbb', got '{change.value}'")
        encoded = np.array([int(change.value[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
        red, green, blue = linear_from_srgb(encoded).round(6).tolist()
        return (red, green, blue)
    color = read_as(change, Color)
    assert isinstance(color, tuple)
    return color


def set_number(name: str) -> Callable[[Work], Outcome]:
    """Return a function that sets one number of materials."""

    def make(work: Work) -> Outcome:
        value = number(work.change, 0.0, 1.0)
        return _Parts(work).changed(lambda material: replace(material, **{name: value}))  # type: ignore[arg-type]

    return make


def set_texture(work: Work) -> Outcome:
    """Give materials the pattern of another generator, or none; images of model files go."""
    kinds = {
        kind.texture.generator: name for name, kind in reversed(list(work.rules().appearance.materials.items())) if kind.texture is not None
    }
    chosen = one_of(work.change, {NO_TEXTURE, *kinds}, "a pattern")
    texture = None if chosen == NO_TEXTURE else drawn_material(work, kinds[chosen]).texture
    return _Parts(work).changed(lambda material: replace(material, texture=texture, images=None))


def scale_texture(work: Work) -> Outcome:
    """Stretch patterns; materials without one stay as they are."""
    factor = number(work.change, 0.01, 100.0)
    parts = patterned_parts(work)

    def edit(material: Material) -> Material:
        if material.texture is None:
            return material
        return replace(material, texture=replace(material.texture, scale_m=min(max(factor * material.texture.scale_m, 0.0005), 100.0)))

    return parts.changed(edit)


def set_contrast(work: Work) -> Outcome:
    """Set how far patterns depart from their plain colours; materials without one stay as they are."""
    contrast = number(work.change, 0.0, 1.0)
    return patterned_parts(work).changed(
        lambda material: material if material.texture is None else replace(material, texture=replace(material.texture, contrast=contrast))
    )


def patterned_parts(work: Work) -> _Parts:
    """Return the targeted parts, of which some have a pattern."""
    parts = _Parts(work)
    if all(material.texture is None for material in parts.materials):
        raise ChangeError(f"{work.change}: target: expected a part with a pattern, got plain materials; see the factor texture")
    return parts


def shared_by_materials(read: Callable[[Material], object]) -> Callable[[Work], object]:
    """Return a function that returns what the materials of all targeted parts have in common, or None."""

    def current(work: Work) -> object:
        values = {read(material) for material in _Parts(work).materials}
        value = values.pop() if len(values) == 1 else None
        return list(value) if isinstance(value, tuple) else value

    return current


def dressed(
    rng: np.random.Generator,
    rules: SceneSynthesizer,
    scene: SceneDescription,
    item: SceneObject,
    style: str = "",
    kept: Mapping[str, str] | None = None,
) -> tuple[SceneDescription, SceneObject]:
    """Return the scene with the materials that an object needs, and the object with model and parts.

    Args:
        rng: source of randomness.
        rules: looks and materials.
        scene: the room; the object need not be in it.
        item: the object.
        style: the one it shall have; "" leaves it open.
        kept: part -> material of the scene that is taken for a part of that name.
    """
    request = SceneRequest(looks=(f"{item.category}: {{styles: [{style}]}}",)) if style else SceneRequest()
    appearance = restricted(rules.appearance, request)
    like = next((other for other in scene.objects if other.category == item.category and other.id != item.id), None)
    shares = rules.appearance.categories[item.category].shared != "none"
    if not style and not kept and like is not None and shares and like.model.generator is not None:
        return scene, replace(item, model=like.model, parts=like.parts)
    room = replace(scene.room, openings=())
    bare = replace(item, support=item.support, group=None, model=replace(item.model, file=None, reading=None, generator=item.category))
    _, (drawn,), new = sample_appearance(rng, appearance, room, [bare], scene.category)
    by_id = {material.id: material for material in new}
    materials, parts = list(scene.materials), []
    id_of: dict[str, str] = {}
    for part in drawn.parts:
        known = (kept or {}).get(part.name)
        if known is None and part.material not in id_of:
            materials.append(adopted(materials, by_id[part.material]))
            id_of[part.material] = materials[-1].id
        parts.append(replace(part, material=known or id_of[part.material]))
    return replace(scene, materials=tuple(materials)), replace(item, model=drawn.model, parts=tuple(parts))


def lit(rng: np.random.Generator, rules: SceneSynthesizer, scene: SceneDescription, item: SceneObject) -> SceneDescription:
    """Return the scene with a light for a new object, if that is a lamp."""
    lights, _ = sample_lighting(rng, rules.lighting, [item])
    return replace(scene, lights=(*scene.lights, *lights))
