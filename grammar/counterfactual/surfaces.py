"""What things are made of: materials of objects, parts and categories, and the finish of walls, floor and ceiling.

A changed material is a new one at the end of the scene's list, so that parts which are not targeted keep theirs and all indices stay.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from grammar.appearance.appearance import MaterialPool
from grammar.counterfactual.change import Change, ChangeError, random_numbers
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.targets import ALL, OBJECTS, all_things, chosen_things
from grammar.counterfactual.values import number, one_of, read_as
from scene_description import Material, Part
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


def _finish(surface: str) -> Callable[[Work], Outcome]:
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


def _field(name: str) -> Callable[[Work], Outcome]:
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
    parts = _patterned(work)

    def edit(material: Material) -> Material:
        if material.texture is None:
            return material
        return replace(material, texture=replace(material.texture, scale_m=min(max(factor * material.texture.scale_m, 0.0005), 100.0)))

    return parts.changed(edit)


def set_contrast(work: Work) -> Outcome:
    """Set how far patterns depart from their plain colours; materials without one stay as they are."""
    contrast = number(work.change, 0.0, 1.0)
    return _patterned(work).changed(
        lambda material: material if material.texture is None else replace(material, texture=replace(material.texture, contrast=contrast))
    )


def _patterned(work: Work) -> _Parts:
    parts = _Parts(work)
    if all(material.texture is None for material in parts.materials):
        raise ChangeError(f"{work.change}: target: expected a part with a pattern, got plain materials; see the factor texture")
    return parts


def _shared(read: Callable[[Material], object]) -> Callable[[Work], object]:
    """Return a function that returns what the materials of all targeted parts have in common, or None."""

    def current(work: Work) -> object:
        values = {read(material) for material in _Parts(work).materials}
        value = values.pop() if len(values) == 1 else None
        return list(value) if isinstance(value, tuple) else value

    return current


_TARGETS = (*OBJECTS, "part", "surface")


def _row(
    name: str,
    label: str,
    value: str,
    make: Callable[[Work], Outcome],
    current: Callable[[Work], object] = lambda work: None,
    targets: tuple[str, ...] = _TARGETS,
) -> Factor:
    return Factor(
        name=name, label=label, unit=None, value=value, attribute="material", touches="surface", targets=targets, make=make, current=current
    )


FACTORS = (
    _row("material", "material", "name of a material of config/materials.yaml, of which one is drawn for all targeted parts", set_material),
    _row(
        "base_color",
        "base colour",
        "linear [r, g, b], 0 to 1, or sRGB '#rrggbb'",
        set_color,
        _shared(lambda material: material.base_color),
    ),
    _row("roughness", "roughness", "perceptual roughness, 0 (smooth) to 1", _field("roughness"), _shared(lambda m: m.roughness)),
    _row("metallic", "metalness", "0 (dielectric) to 1 (metal)", _field("metallic"), _shared(lambda m: m.metallic)),
    _row("texture", "texture", "name of a pattern that a material of config/materials.yaml has, or 'none'", set_texture),
    _row(
        "texture_scale",
        "scale of textures",
        "factor on the size of the pattern's unit, 0.01 to 100; 1: as it is",
        scale_texture,
        lambda work: 1.0 if _patterned(work) else None,
    ),
    _row(
        "texture_contrast",
        "contrast of textures",
        "how far a pattern departs from its plain colours, 0 to 1",
        set_contrast,
        _shared(lambda material: None if material.texture is None else material.texture.contrast),
    ),
    *(
        _row(f"{surface}_finish", f"finish of the {surface}", "name of a material of config/materials.yaml", _finish(surface), targets=())
        for surface in ("wall", "floor", "ceiling")
    ),
)
