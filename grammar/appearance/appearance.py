"""How a room is dressed: style, model seed and a material for every part, harmonised by a palette of the room.

A room has a main and a second hue, and keeps a few materials of each family (two woods, one metal, ...), which its parts share; so things
match without being all alike.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from grammar.appearance.materials import Hue, MaterialRange, Palette, Share, draw_material
from grammar.spec.grammar_file import read_yaml
from grammar.spec.rules import GrammarError
from scene_description import FieldError, Limits, Material, ModelReference, Opening, Part, Room, SceneObject, from_mapping

Odds = Annotated[float, Limits(ge=0.0, le=1e6)]
Families = Mapping[str, Odds]

_MAX_SEED = 2**63 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class HueOdds:
    """A hue, or a distance between hues, in degrees, and how often it is taken."""

    hue: Hue
    odds: Odds


@dataclass(frozen=True, slots=True, kw_only=True)
class PaletteRule:
    """How a room's palette is drawn; see ``config/appearance.yaml``."""

    hues_deg: Annotated[tuple[HueOdds, ...], Limits(min_length=1)]
    jitter_deg: Hue
    apart_deg: Annotated[tuple[HueOdds, ...], Limits(min_length=1)]
    first_odds: Share
    kept: Mapping[str, Annotated[int, Limits(ge=1, le=32)]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PartRule:
    """Where a part's material comes from: another part (with ``like_odds``), else a family; ``by_style`` replaces both for a style."""

    like: str | None = None
    like_odds: Share = 1.0
    families: Families = field(default_factory=dict)
    by_style: Mapping[str, Families] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceRule:
    """What a surface of the room is made of: families with odds; ``by_room`` replaces them for a room type."""

    families: Families
    by_room: Mapping[str, Families] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class StyleRule:
    """How often a style is taken, and the parts that its models have."""

    odds: Odds
    parts: Annotated[tuple[str, ...], Limits(min_length=1, max_length=64)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CategoryLook:
    """What a category looks like; ``generator`` is the category's own name where absent.

    Categories with the same ``suite`` take the same style within a room, that of the first that is dressed, where they have it.
    """

    styles: Annotated[Mapping[str, StyleRule], Limits(min_length=1)]
    parts: Mapping[str, PartRule]
    generator: str | None = None
    shared: Literal["room", "group", "none"] = "group"
    emits: str | None = None
    suite: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _AppearanceFile:
    palette: PaletteRule
    surfaces: Mapping[str, SurfaceRule]
    categories: Mapping[str, CategoryLook]


@dataclass(frozen=True, slots=True, kw_only=True)
class _MaterialFile:
    materials: Annotated[Mapping[str, MaterialRange], Limits(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """Everything that dressing needs: the palette rule, looks by category, room surfaces, named materials and their families."""

    palette: PaletteRule
    surfaces: Mapping[str, SurfaceRule]
    categories: Mapping[str, CategoryLook]
    materials: Mapping[str, MaterialRange]
    families: Mapping[str, tuple[str, ...]]


def load_appearance(appearance_path: Path, materials_path: Path) -> Appearance:
    """Read and check ``appearance.yaml`` and ``materials.yaml``.

    Raises:
        GrammarError: a file does not parse, a field does not fit, or a family or part is named that does not exist; one line.
    """
    try:
        materials = from_mapping(_MaterialFile, read_yaml(materials_path)).materials
        families: dict[str, tuple[str, ...]] = {}
        for name, material in materials.items():
            if (material.hue == "own") == (material.hue_deg is None):
                raise FieldError(f"materials.{name}", "either hue_deg or a hue of the palette", "both" if material.hue_deg else "neither")
            families[material.family] = (*families.get(material.family, ()), name)
    except FieldError as error:
        raise GrammarError(f"{materials_path}: {error}") from None
    try:
        look = from_mapping(_AppearanceFile, read_yaml(appearance_path))
        _check(look, families)
    except FieldError as error:
        raise GrammarError(f"{appearance_path}: {error}") from None
    return Appearance(palette=look.palette, surfaces=look.surfaces, categories=look.categories, materials=materials, families=families)


def sample_appearance(
    rng: np.random.Generator, appearance: Appearance, room: Room, objects: Sequence[SceneObject], room_type: str = ""
) -> tuple[Room, tuple[SceneObject, ...], tuple[Material, ...]]:
    """Return room and objects with models and materials of parts, and the scene's materials.

    The room's surfaces are as usual in rooms of ``room_type``.  Objects with a model file keep it and the parts they have.  Style, seed
    and materials are shared as the category says.

    Raises:
        GrammarError: a category has no look.
    """
    pool = MaterialPool(rng, appearance)
    dressed_room, dressed = sample_appearance_from(pool, rng, appearance, room, objects, room_type)
    return dressed_room, dressed, tuple(pool.materials)


def sample_appearance_from(
    pool: MaterialPool, rng: np.random.Generator, appearance: Appearance, room: Room, objects: Sequence[SceneObject], room_type: str
) -> tuple[Room, tuple[SceneObject, ...]]:
    """Do as :func:`dress` with the materials of a closet, which is new, and keeps them."""
    for category in (*(opening.category for opening in room.openings), *(item.category for item in objects)):
        if category not in appearance.categories:
            raise GrammarError(
                f"appearance: expected a look for category '{category}', got none; known are {', '.join(sorted(appearance.categories))}"
            )
    surfaces = tuple(
        Part(name=name, material=pool.choose(rule.by_room.get(room_type, rule.families))) for name, rule in appearance.surfaces.items()
    )
    looks: dict[tuple[str, int], tuple[ModelReference, tuple[Part, ...]]] = {}
    by_id = {item.id: item for item in objects}
    openings: list[Opening] = []
    for opening in room.openings:
        model, parts = _look(rng, appearance, pool, looks, opening.category, opening.id, 0)
        openings.append(replace(opening, model=model, parts=parts))
    dressed: list[SceneObject] = []
    for item in objects:
        if item.model.file is not None:
            dressed.append(item)
            continue
        owner = core_of(item, by_id)
        model, parts = _look(rng, appearance, pool, looks, item.category, item.id, owner)
        dressed.append(replace(item, model=model, parts=parts))
    return replace(room, surfaces=surfaces, openings=tuple(openings)), tuple(dressed)


class MaterialPool:
    """The materials of one room while it is dressed: those kept by family, and all that were drawn, in order; the suites' styles."""

    def __init__(self, rng: np.random.Generator, appearance: Appearance) -> None:
        self.materials: list[Material] = []
        self.suites: dict[str, str] = {}
        self._rng, self._appearance = rng, appearance
        palette = appearance.palette
        main = _pick(rng, {str(k): item.odds for k, item in enumerate(palette.hues_deg)})
        apart = _pick(rng, {str(k): item.odds for k, item in enumerate(palette.apart_deg)})
        hue = palette.hues_deg[int(main)].hue + float(rng.uniform(-palette.jitter_deg, palette.jitter_deg))
        second = hue + palette.apart_deg[int(apart)].hue + float(rng.uniform(-palette.jitter_deg, palette.jitter_deg))
        self._palette = Palette(main_deg=hue, second_deg=second)
        self._kept: dict[str, tuple[str, ...]] = {}
        self._count: dict[str, int] = {}

    def use(self, rng: np.random.Generator) -> None:
        """Draw from another source from now on."""
        self._rng = rng

    def choose(self, families: Families) -> str:
        """Return the id of a material of one of the families, a kept one where the family is kept."""
        family = _pick(self._rng, families)
        wanted = self._appearance.palette.kept.get(family, 0)
        if not wanted:
            return self._draw(family, ())
        if family not in self._kept:
            self._kept[family] = self._draw_kept(family, wanted)
        kept = self._kept[family]
        first = self._appearance.palette.first_odds
        if len(kept) == 1 or (len(kept) == 2 and self._rng.random() < first):
            return kept[0]
        return kept[int(self._rng.integers(len(kept)))] if len(kept) > 2 else kept[1]

    def _draw_kept(self, family: str, count: int) -> tuple[str, ...]:
        """Draw the room's materials of a family, as many different kinds as there are."""
        ids: list[str] = []
        kinds: list[str] = []
        for _ in range(count):
            ids.append(self._draw(family, kinds))
            kinds.append(ids[-1].rsplit("_", 1)[0])
        return tuple(ids)

    def _draw(self, family: str, avoid: Collection[str]) -> str:
        names = [name for name in self._appearance.families[family] if name not in avoid] or list(self._appearance.families[family])
        return self.draw_material(_pick(self._rng, {name: self._appearance.materials[name].odds for name in names}))

    def draw_material(self, name: str) -> str:
        """Draw a new material of a name; return its id."""
        self._count[name] = self._count.get(name, 0) + 1
        material = draw_material(self._rng, self._appearance.materials[name], f"{name}_{self._count[name]}", self._palette)
        self.materials.append(material)
        return material.id


def _look(
    rng: np.random.Generator,
    appearance: Appearance,
    pool: MaterialPool,
    looks: dict[tuple[str, int], tuple[ModelReference, tuple[Part, ...]]],
    category: str,
    identifier: int,
    core: int,
) -> tuple[ModelReference, tuple[Part, ...]]:
    """Return model and parts of one object, taken over from the one that it shares its look with, if there is one."""
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
    """Draw a category's style, or take over that of its suite in this room."""
    taken = None if rule.suite is None else pool.suites.get(rule.suite)
    if taken is not None and taken in rule.styles:
        return taken
    style = _pick(rng, {name: item.odds for name, item in rule.styles.items()})
    if rule.suite is not None:
        pool.suites.setdefault(rule.suite, style)
    return style


def _part_material(rng: np.random.Generator, pool: MaterialPool, rule: CategoryLook, style: str, name: str, chosen: Mapping[str, str]) -> str:
    part = rule.parts[name]
    if style in part.by_style:
        return pool.choose(part.by_style[style])
    if part.like is not None and part.like in chosen and (not part.families or rng.random() < part.like_odds):
        return chosen[part.like]
    return pool.choose(part.families)


def core_of(item: SceneObject, by_id: Mapping[int, SceneObject]) -> int:
    """Return the id of the object that a thing belongs to in the end: its group's core, or what it stands on; 0 for none."""
    seen: set[int] = set()
    current = item
    while current.id not in seen:
        seen.add(current.id)
        above = current.group if current.group is not None else current.support.id
        if above is None or above not in by_id or above == current.id:
            break
        current = by_id[above]
    return 0 if current.id == item.id else current.id


def _pick(rng: np.random.Generator, odds: Mapping[str, float]) -> str:
    names = list(odds)
    share = np.array([odds[name] for name in names], np.float64)
    return names[int(np.searchsorted(np.cumsum(share) / share.sum(), rng.random(), side="right"))]


def check_appearance(appearance: Appearance) -> None:
    """Check that every family, part and emitting part that is named exists, and that odds can be drawn from.

    Raises:
        FieldError: with the path of what does not fit.
    """
    _check(appearance, appearance.families)


def can_draw_materials(look: CategoryLook, style: str, families: Mapping[str, tuple[str, ...]]) -> bool:
    """Return whether every part of a style has a material to draw from."""
    before: list[str] = []
    try:
        for part in look.styles[style].parts:
            _check_part(part, look.parts[part], style, before, families)
            before.append(part)
    except FieldError:
        return False
    return True


def _check(look: _AppearanceFile | Appearance, families: Mapping[str, tuple[str, ...]]) -> None:
    """Check that every family, part and emitting part that is named exists, and that odds can be drawn from."""
    for family in look.palette.kept:
        _check_families(f"palette.kept.{family}", {family: 1.0}, families)
    for name, rule in look.surfaces.items():
        _check_families(f"surfaces.{name}.families", rule.families, families)
        for room_type, odds in rule.by_room.items():
            _check_families(f"surfaces.{name}.by_room.{room_type}", odds, families)
    for category, item in look.categories.items():
        path = f"categories.{category}"
        if not sum(style.odds for style in item.styles.values()) > 0.0:
            raise FieldError(f"{path}.styles", "odds with a sum above 0", "0")
        for style, style_rule in item.styles.items():
            before: list[str] = []
            for part in style_rule.parts:
                if part not in item.parts:
                    raise FieldError(f"{path}.styles.{style}.parts", f"one of {', '.join(item.parts)}", repr(part))
                _check_part(f"{path}.parts.{part}", item.parts[part], style, before, families)
                before.append(part)
            if item.emits is not None and item.emits not in style_rule.parts:
                raise FieldError(f"{path}.emits", f"a part of style '{style}'", repr(item.emits))


def _check_part(path: str, rule: PartRule, style: str, before: Sequence[str], families: Mapping[str, tuple[str, ...]]) -> None:
    if style in rule.by_style:
        _check_families(f"{path}.by_style.{style}", rule.by_style[style], families)
    elif rule.like is None or rule.families:
        _check_families(f"{path}.families", rule.families, families)
    elif rule.like not in before:
        raise FieldError(f"{path}.like", f"a part listed before it in style '{style}', or families", repr(rule.like))


def _check_families(path: str, odds: Families, families: Mapping[str, tuple[str, ...]]) -> None:
    for family in odds:
        if family not in families:
            raise FieldError(path, f"one of {', '.join(sorted(families))}", repr(family))
    if not sum(odds.values()) > 0.0:
        raise FieldError(path, "families with odds above 0", "none")
