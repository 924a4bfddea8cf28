"""The look of a new object: model, parts and materials, those of its kind in the room where these are shared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from grammar.appearance.appearance import sample_appearance
from grammar.appearance.lighting import sample_lighting
from grammar.appearance.restrict import restricted
from grammar.counterfactual.surfaces import adopted
from grammar.spec.request import SceneRequest
from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, SceneObject


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
