"""The appearance of a room: style, model seed and a material for every part, harmonised by a palette of the room.

A room has a main and a second hue, and keeps a few materials of each family (two woods, one metal, ...), which its parts share; so objects
match without being all alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.appearance.appearance_rules import Appearance, CategoryLook
from grammar.appearance.material_pool import MaterialPool, draw_name
from grammar.spec.rules import GrammarError
from scene_description import Material, ModelReference, Opening, Part, Room, SceneObject

_MAX_SEED = 2**63 - 1

ModelAndParts = tuple[ModelReference, tuple[Part, ...]]
"""Model and parts of an object."""


def sample_appearance(
    rng: np.random.Generator, appearance: Appearance, room: Room, objects: Sequence[SceneObject], room_type: str = ""
) -> tuple[Room, tuple[SceneObject, ...], tuple[Material, ...]]:
    """Sample models and materials of parts for a room and its objects; return both and the scene's materials.

    The room's surfaces follow the rules of ``room_type``.  Objects with a model file keep it and their parts.  Objects share style, seed
    and materials as their category says.

    Raises:
        GrammarError: a category has no look.
    """
    pool = MaterialPool(rng, appearance)
    changed, new_objects = sample_appearance_from(pool, rng, appearance, room, objects, room_type)
    return changed, new_objects, tuple(pool.materials)


def sample_appearance_from(
    pool: MaterialPool, rng: np.random.Generator, appearance: Appearance, room: Room, objects: Sequence[SceneObject], room_type: str
) -> tuple[Room, tuple[SceneObject, ...]]:
    """Do as :func:`sample_appearance`, but draw the materials into a new pool that the caller keeps."""
    for category in (*(opening.category for opening in room.openings), *(item.category for item in objects)):
        if category not in appearance.categories:
            raise GrammarError(
                f"appearance: expected a look for category '{category}', got none; known are {', '.join(sorted(appearance.categories))}"
            )
    surfaces = tuple(
        Part(name=name, material=pool.choose(rule.by_room.get(room_type, rule.families))) for name, rule in appearance.surfaces.items()
    )
    looks: dict[tuple[str, int], ModelAndParts] = {}
    by_id = {item.id: item for item in objects}
    openings: list[Opening] = []
    for opening in room.openings:
        model, parts = _look(rng, appearance, pool, looks, opening.category, opening.id, 0)
        openings.append(replace(opening, model=model, parts=parts))
    new_objects: list[SceneObject] = []
    for item in objects:
        if item.model.file is not None:
            new_objects.append(item)
            continue
        owner = core_of(item, by_id)
        model, parts = _look(rng, appearance, pool, looks, item.category, item.id, owner)
        new_objects.append(replace(item, model=model, parts=parts))
    return replace(room, surfaces=surfaces, openings=tuple(openings)), tuple(new_objects)


def _look(
    rng: np.random.Generator,
    appearance: Appearance,
    pool: MaterialPool,
    looks: dict[tuple[str, int], ModelAndParts],
    category: str,
    identifier: int,
    core: int,
) -> ModelAndParts:
    """Return model and parts of one object: those of an object that it shares its look with, if there is one, else new ones."""
    rule = appearance.categories[category]
    key = (category, {"room": -1, "group": core or -1 - identifier, "none": -1 - identifier}[rule.shared])
    if key not in looks:
        style = _style(rng, pool, rule)
        chosen: dict[str, str] = {}
        for name in rule.styles[style].parts:
            chosen[name] = _part_material(rng, pool, rule, style, name, chosen)
        model = ModelReference(generator=rule.generator or category, style=style, seed=int(rng.integers(_MAX_SEED)))
        looks[key] = (model, tuple(Part(name=name, material=material) for name, material in chosen.items()))
    return looks[key]


def _style(rng: np.random.Generator, pool: MaterialPool, rule: CategoryLook) -> str:
    """Return the style of the category's suite in this room, if it has one, else a drawn one."""
    taken = None if rule.suite is None else pool.suites.get(rule.suite)
    if taken is not None and taken in rule.styles:
        return taken
    style = draw_name(rng, {name: item.odds for name, item in rule.styles.items()})
    if rule.suite is not None:
        pool.suites.setdefault(rule.suite, style)
    return style


def _part_material(
    rng: np.random.Generator, pool: MaterialPool, rule: CategoryLook, style: str, name: str, chosen: Mapping[str, str]
) -> str:
    """Return the id of a part's material; ``chosen`` are those of the parts before it."""
    part = rule.parts[name]
    if style in part.by_style:
        return pool.choose(part.by_style[style])
    if part.like is not None and part.like in chosen and (not part.families or rng.random() < part.like_odds):
        return chosen[part.like]
    return pool.choose(part.families)


def core_of(item: SceneObject, by_id: Mapping[int, SceneObject]) -> int:
    """Return the id of the last object above an object, up from core to core or from supporter to supporter; 0 for none."""
    seen: set[int] = set()
    current = item
    while current.id not in seen:
        seen.add(current.id)
        above = current.group if current.group is not None else current.support.id
        if above is None or above not in by_id or above == current.id:
            break
        current = by_id[above]
    return 0 if current.id == item.id else current.id
