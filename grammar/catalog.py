"""Models of the user's catalogue in rooms: which objects take one, at which size, with which materials.

Models that stretch are chosen like styles, after the layout, and shared as their category's looks are.  A model with a size or support
surfaces of its own decides the layout, so it is chosen before it: then all objects of its category in the room are this model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from grammar.appearance.appearance import MaterialPool, core_of, draw_index_by_odds
from grammar.appearance.appearance_rules import Appearance, CategoryLook, PartRule, StyleRule
from grammar.derivation.densities import draw_size
from grammar.spec.categories import Categories, Category, Solid, SupportSurface
from grammar.spec.object_rules import ObjectRule, SizeMode
from grammar.spec.rules import Grammar, GrammarError
from scene_description import FieldError, ModelReference, Part, SceneObject, from_mapping
from scene_description.catalog import Catalog, CatalogEntry, CatalogList, CatalogModel
from scene_description.scene_json import check_file_path
from scene_description.yaml_text import read_yaml

FILE_NAME = "catalog.yaml"
Choice = CatalogModel | None
"""A model, or None for the procedural styles."""


def read_catalog(folder: Path) -> CatalogList:
    """Read ``catalog.yaml`` of a folder.

    Raises:
        GrammarError: there is none, it does not parse, or a field does not fit; one line with file and field.
    """
    path = folder / FILE_NAME
    try:
        catalog = from_mapping(CatalogList, read_yaml(path, GrammarError))
        for i, entry in enumerate(catalog.models):
            check_file_path(f"models[{i}].file", entry.file)
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return catalog


def entry_faults(entry: CatalogEntry, appearance: Appearance, parts: Sequence[str] | None = None) -> list[str]:
    """Return what an entry asks for that cannot be, one line each; ``parts`` are the model's, once it has been read."""
    if entry.category not in appearance.categories:
        return [f"category: expected one of {', '.join(sorted(appearance.categories))}, got '{entry.category}'"]
    look = appearance.categories[entry.category]
    faults = []
    for part, odds in entry.families.items():
        unknown = sorted(set(odds) - set(appearance.families))
        if unknown:
            faults.append(f"families.{part}: expected families of materials.yaml, got '{unknown[0]}'")
        elif not sum(odds.values()) > 0.0:
            faults.append(f"families.{part}: expected odds above 0, got 0")
        if parts is not None and part not in (*parts, "*"):
            faults.append(f"families.{part}: expected a part of the model ({', '.join(parts)})")
    if parts is not None:
        if look.emits is not None and look.emits not in parts:
            faults.append(f"parts: expected the part '{look.emits}' that shines, got {', '.join(parts)}; rename one")
        if entry.materials == "sample":
            lost = [part for part in parts if _families(entry, look, part) is None]
            if lost:
                faults.append(f"families: expected families for the parts {', '.join(lost)}, or for '*'")
    return faults


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomModels:
    """What is chosen before the layout of one room: grammar and categories for it, and category -> model."""

    grammar: Grammar
    categories: Categories
    chosen: Mapping[str, CatalogModel]


def choose_before(
    rng: np.random.Generator, catalog: Catalog, appearance: Appearance, grammar: Grammar, categories: Categories
) -> RoomModels:
    """Choose for each category of a grammar whether all its objects are one model with a size or support surfaces of its own."""
    chosen: dict[str, CatalogModel] = {}
    rules, table = dict(grammar.objects), dict(categories)
    for category in sorted({rule.category for rule in rules.values()}):
        choices = _choices(catalog, category, appearance)
        ahead = [(model, odds) for model, odds in choices if model is not None and _decides_layout(model)]
        if not ahead:
            continue
        rest = sum(odds for model, odds in choices) - sum(odds for _, odds in ahead)
        model = _pick(rng, [*ahead, (None, rest)])
        if model is None:
            continue
        chosen[category] = model
        for symbol, rule in rules.items():
            if rule.category == category:
                rules[symbol] = _sized(rng, rule, model)
        if model.entry.surfaces is not None:
            surfaces = [
                SupportSurface(height_fraction=s.height_fraction, height_m=s.height_m, inset_m=s.inset_m) for s in model.entry.surfaces
            ]
            table[category] = replace(table[category], surfaces=tuple(surfaces), solids=_solids(table[category], surfaces, model.size_m[2]))
    return RoomModels(grammar=replace(grammar, objects=rules), categories=table, chosen=chosen)


def choose_after(
    rng: np.random.Generator, catalog: Catalog, appearance: Appearance, models: RoomModels, objects: Sequence[SceneObject]
) -> tuple[tuple[SceneObject, ...], dict[int, CatalogModel]]:
    """Return the objects with references to their files, and their models by object id."""
    by_id = {item.id: item for item in objects}
    taken: dict[int, CatalogModel] = {}
    shared: dict[tuple[str, int], Choice] = {}
    for item in objects:
        model: Choice = models.chosen.get(item.category)
        if model is None:
            choices = [
                (choice, odds)
                for choice, odds in _choices(catalog, item.category, appearance)
                if choice is None or not _decides_layout(choice)
            ]
            if len(choices) < 2:
                continue
            key = (item.category, _sharing(appearance, item, by_id))
            if key not in shared:
                shared[key] = _pick(rng, choices)
            model = shared[key]
        if model is not None:
            taken[item.id] = model
    return tuple(_with_file(item, taken.get(item.id)) for item in objects), taken


def _with_file(item: SceneObject, model: Choice) -> SceneObject:
    if model is None:
        return item
    return replace(item, model=ModelReference(file=model.entry.file, reading=model.entry.reading))


def assign_file_materials(
    rng: np.random.Generator, pool: MaterialPool, appearance: Appearance, taken: Mapping[int, CatalogModel], objects: Sequence[SceneObject]
) -> tuple[SceneObject, ...]:
    """Return the objects with the parts of their files: the file's materials, or ours drawn as the entry says."""
    pool.use(rng)
    by_id = {item.id: item for item in objects}
    looks: dict[tuple[str, int], tuple[Part, ...]] = {}
    changed = []
    for item in objects:
        model = taken.get(item.id)
        if model is None:
            changed.append(item)
            continue
        key = (model.entry.file, _sharing(appearance, item, by_id))
        if key not in looks:
            looks[key] = _file_parts(pool, appearance.categories[item.category], model)
        changed.append(replace(item, parts=looks[key]))
    return tuple(changed)


def _sharing(appearance: Appearance, item: SceneObject, by_id: Mapping[int, SceneObject]) -> int:
    """Return a number that is equal for objects of one category which look alike."""
    own = -1 - item.id
    return {"room": 0, "group": core_of(item, by_id) or own, "none": own}[appearance.categories[item.category].shared]


def _file_parts(pool: MaterialPool, look: CategoryLook, model: CatalogModel) -> tuple[Part, ...]:
    if model.entry.materials == "file":
        known = {material.id for material in pool.materials}
        for material in model.parts.values():
            if material.id not in known:
                pool.materials.append(material)
                known.add(material.id)
        return tuple(Part(name=name, material=material.id) for name, material in model.parts.items())
    parts = []
    for name in model.parts:
        families = _families(model.entry, look, name)
        assert families is not None  # entry_faults has looked
        parts.append(Part(name=name, material=pool.choose(families)))
    return tuple(parts)


def _families(entry: CatalogEntry, look: CategoryLook, part: str) -> Mapping[str, float] | None:
    """Return the families of a part's material: of the entry, of the category's part of that name (or what that is like), or of ``*``."""
    if part in entry.families:
        return entry.families[part]
    rule: PartRule | None = look.parts.get(part)
    for _ in range(8):
        if rule is None or rule.families:
            break
        rule = look.parts.get(rule.like or "")
    if rule is not None and rule.families:
        return rule.families
    return entry.families.get("*")


def _choices(catalog: Catalog, category: str, appearance: Appearance) -> list[tuple[Choice, float]]:
    """Return the models of a category with their odds, and None for the procedural styles, first."""
    models = [model for model in catalog.models if model.entry.category == category and model.entry.odds > 0.0]
    styles: Mapping[str, StyleRule] = appearance.categories[category].styles if category in appearance.categories else {}
    own = catalog.procedural.get(category, 1.0) if styles else 0.0
    return [(None, own), *((model, model.entry.odds) for model in models)]


def _solids(category: Category, surfaces: Sequence[SupportSurface], height_m: float) -> tuple[Solid, ...] | None:
    """Return the solids of a model: all below its lowest support surface, and its rim above that, so that objects can stand within it."""
    low = min(surfaces, key=lambda surface: surface.height_fraction * height_m + surface.height_m, default=None)
    if low is None or low.height_fraction * height_m + low.height_m >= height_m - 1e-9:
        return category.solids
    rim = min(surface.inset_m for surface in surfaces)
    base = Solid(high_fraction=(1.0, 1.0, low.height_fraction), high_m=(0.0, 0.0, low.height_m))
    sides = (
        Solid(high_fraction=(0.0, 1.0, 1.0), high_m=(rim, 0.0, 0.0)),
        Solid(low_fraction=(1.0, 0.0, 0.0), low_m=(-rim, 0.0, 0.0)),
        Solid(high_fraction=(1.0, 0.0, 1.0), high_m=(0.0, rim, 0.0)),
        Solid(low_fraction=(0.0, 1.0, 0.0), low_m=(0.0, -rim, 0.0)),
    )
    return (base, *sides) if rim > 0.0 else (base,)


def _decides_layout(model: CatalogModel) -> bool:
    return model.entry.scale != "stretch" or model.entry.surfaces is not None


def _pick(rng: np.random.Generator, choices: Sequence[tuple[Choice, float]]) -> Choice:
    odds = [own for _, own in choices]
    if not sum(odds) > 0.0:
        return choices[0][0]
    return choices[draw_index_by_odds(rng, odds)][0]


def _sized(rng: np.random.Generator, rule: ObjectRule, model: CatalogModel) -> ObjectRule:
    """Return a rule with one size for all its objects: the model's own, or that scaled to the drawn length of its longest side."""
    if model.entry.scale == "stretch":
        return rule
    size = model.size_m
    if model.entry.scale == "uniform":
        drawn = draw_size(rng, rule)
        longest = max(range(3), key=lambda axis: size[axis])
        factor = drawn[longest] / size[longest]
        size = (size[0] * factor, size[1] * factor, size[2] * factor)
    mode = SizeMode(probability=1.0, mean_m=size, sd_m=rule.sizes[0].sd_m)
    return replace(rule, sizes=(mode,), low_m=size, high_m=size)
