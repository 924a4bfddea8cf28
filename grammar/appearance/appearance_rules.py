"""How rooms look, as data: the palette, the styles and parts of every category, the room's surfaces, the families of materials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from grammar.appearance.materials import Hue, MaterialRange, Range, Share
from grammar.spec.rules import GrammarError
from scene_description import FieldError, Limits, WearLayer, from_mapping
from scene_description.yaml_text import read_yaml

Odds = Annotated[float, Limits(ge=0.0, le=1e6)]
Families = Mapping[str, Odds]


@dataclass(frozen=True, slots=True, kw_only=True)
class HueOdds:
    """A hue, or a distance between hues, in degrees, with its odds."""

    hue: Hue
    odds: Odds


@dataclass(frozen=True, slots=True, kw_only=True)
class PaletteRule:
    """How a room's palette is drawn; see ``config/appearance.yaml``."""

    hues_deg: Annotated[tuple[HueOdds, ...], Limits(min_length=1)]
    jitter_deg: Hue
    apart_deg: Annotated[tuple[HueOdds, ...], Limits(min_length=1)]
    avoided_deg: tuple[Hue, Hue]
    accents_deg: Annotated[tuple[HueOdds, ...], Limits(min_length=1)]
    accent_apart_deg: Annotated[float, Limits(ge=0.0, le=180.0, unit="deg")]
    first_odds: Share
    kept: Mapping[str, Annotated[int, Limits(ge=1, le=32)]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PartRule:
    """Where a part's material comes from.

    With probability ``like_odds`` it is that of the part ``like``, else one of the ``families``.  ``by_style`` replaces both for a style.
    """

    like: str | None = None
    like_odds: Share = 1.0
    families: Families = field(default_factory=dict)
    by_style: Mapping[str, Families] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceRule:
    """What a surface of the room is made of: families of materials with odds; ``by_room`` replaces them for a room type.

    ``not_on``: there is no such surface where the walls are of one of these families.
    """

    families: Families
    by_room: Mapping[str, Families] = field(default_factory=dict)
    not_on: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class StyleRule:
    """The odds of a style, and the parts that its models have."""

    odds: Odds
    parts: Annotated[tuple[str, ...], Limits(min_length=1, max_length=64)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CategoryLook:
    """What a category looks like.

    ``generator`` of models is the category's own name where absent.  ``shared``: which objects of the category look alike: all of the room,
    those of one functional group, or none.  ``emits`` is the part that shines.  Categories with the same ``suite`` take the same style
    within a room, that of the first of them, where they have it.
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
class WearRule:
    """How rooms are worn.

    layers: traces of use of a room that is worn through; rooms: bounds of how far from new (0) to that (1) rooms are, by type, ``any``
    where the type is not named; shown: how much of it materials show, by family.
    """

    layers: Mapping[str, WearLayer]
    rooms: Mapping[str, Range]
    shown: Mapping[str, Share]


@dataclass(frozen=True, slots=True, kw_only=True)
class _MaterialFile:
    wear: WearRule
    materials: Annotated[Mapping[str, MaterialRange], Limits(min_length=1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """All rules of appearance: the palette, looks by category, room surfaces, named materials, and the names of each family."""

    palette: PaletteRule
    surfaces: Mapping[str, SurfaceRule]
    categories: Mapping[str, CategoryLook]
    materials: Mapping[str, MaterialRange]
    families: Mapping[str, tuple[str, ...]]
    wear: WearRule


def load_appearance(appearance_path: Path, materials_path: Path) -> Appearance:
    """Read and check ``appearance.yaml`` and ``materials.yaml``.

    Raises:
        GrammarError: a file does not parse, a field does not fit, or a family or part is named that does not exist; one line.
    """
    try:
        file = from_mapping(_MaterialFile, read_yaml(materials_path, GrammarError))
        materials = file.materials
        families: dict[str, tuple[str, ...]] = {}
        for name, material in materials.items():
            if (material.hue == "own") == (material.hue_deg is None):
                raise FieldError(f"materials.{name}", "either hue_deg or a hue of the palette", "both" if material.hue_deg else "neither")
            families[material.family] = (*families.get(material.family, ()), name)
        for family in file.wear.shown:
            _check_families(f"wear.shown.{family}", {family: 1.0}, families)
        if "any" not in file.wear.rooms:
            raise FieldError("wear.rooms", "bounds for 'any'", "none")
    except FieldError as error:
        raise GrammarError(f"{materials_path}: {error}") from None
    try:
        look = from_mapping(_AppearanceFile, read_yaml(appearance_path, GrammarError))
        _check(look, families)
    except FieldError as error:
        raise GrammarError(f"{appearance_path}: {error}") from None
    return Appearance(
        palette=look.palette, surfaces=look.surfaces, categories=look.categories, materials=materials, families=families, wear=file.wear
    )


def sample_wear(rng: np.random.Generator, rule: WearRule, room_type: str, asked: float) -> tuple[WearLayer, ...]:
    """Return the wear of a room: ``asked``, from 0 (new) to 1, or drawn for its type where that is below 0."""
    drawn = float(rng.uniform(*rule.rooms.get(room_type, rule.rooms["any"])))
    worn = asked if asked >= 0.0 else drawn
    return tuple(
        replace(layer, strength=round(worn * layer.strength, 4), roughness=round(worn * layer.roughness, 4))
        for layer in rule.layers.values()
        if worn > 0.0
    )


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
    for family in look.palette.kept:
        _check_families(f"palette.kept.{family}", {family: 1.0}, families)
    for name, rule in look.surfaces.items():
        _check_families(f"surfaces.{name}.families", rule.families, families)
        for room_type, odds in rule.by_room.items():
            _check_families(f"surfaces.{name}.by_room.{room_type}", odds, families)
    for category, category_look in look.categories.items():
        _check_category(f"categories.{category}", category_look, families)


def _check_category(path: str, look: CategoryLook, families: Mapping[str, tuple[str, ...]]) -> None:
    if not sum(style.odds for style in look.styles.values()) > 0.0:
        raise FieldError(f"{path}.styles", "odds with a sum above 0", "0")
    for style, style_rule in look.styles.items():
        before: list[str] = []
        for part in style_rule.parts:
            if part not in look.parts:
                raise FieldError(f"{path}.styles.{style}.parts", f"one of {', '.join(look.parts)}", repr(part))
            _check_part(f"{path}.parts.{part}", look.parts[part], style, before, families)
            before.append(part)
        if look.emits is not None and look.emits not in style_rule.parts:
            raise FieldError(f"{path}.emits", f"a part of style '{style}'", repr(look.emits))


def _check_part(path: str, rule: PartRule, style: str, before: Sequence[str], families: Mapping[str, tuple[str, ...]]) -> None:
    """Check that a part of a style has a material; ``before`` are the parts that have theirs already."""
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
