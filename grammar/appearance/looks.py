"""What a request says about the appearance of single categories, objects and parts.

A look is a text ``TARGET: {...}``.  Styles, excluded materials and the palette's hue change what can be drawn; everything else is laid over
the finished room, by numbers of its own, so that all other parts stay as they were.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from grammar.appearance.appearance import (
    Appearance,
    CategoryLook,
    Families,
    HueOdds,
    MaterialPool,
    PartRule,
    can_draw_materials,
    check_appearance,
)
from grammar.appearance.materials import linear_rgb
from grammar.spec.grammar_file import parse_yaml
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import GrammarError
from scene_description import FieldError, Limits, Material, Part, Room, SceneObject, Texture, from_mapping
from scene_description.types import Color

Share = Annotated[float, Limits(ge=0.0, le=1.0)]
Range = tuple[Share, Share]
Hue = Annotated[float, Limits(ge=-360.0, le=720.0, unit="deg")]

ANY, ROOM = "*", "room"
_TARGET = re.compile(r"(\*|[A-Za-z0-9_]+)(?:/(\*|[A-Za-z0-9_.\-]+))?")
_RANGES = ("roughness", "metallic", "transmission", "clearcoat", "sheen", "lightness", "chroma", "hue_deg")
_SURFACE = ("roughness", "metallic", "transmission", "clearcoat", "sheen")


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What a look asks for; ranges are drawn from, a single number stands for itself.

    ``material`` (a name of materials.yaml) or ``family`` draws a new material; the other fields change the one that is there or was drawn:
    ``base_color`` is linear RGB, ``color`` the same as sRGB ``#rrggbb``, ``lightness``, ``chroma`` and ``hue_deg`` together are OKLCH;
    ``plain`` takes patterns and images away.  ``each`` draws for every object anew; else all that the target names look alike.
    """

    styles: Annotated[tuple[str, ...], Limits(max_length=32)] = ()
    material: str | None = None
    family: str | None = None
    base_color: Color | None = None
    color: Annotated[str, Limits(pattern="#[0-9a-fA-F]{6}")] | None = None
    lightness: Range | None = None
    chroma: Range | None = None
    hue_deg: tuple[Hue, Hue] | None = None
    roughness: Range | None = None
    metallic: Range | None = None
    transmission: Range | None = None
    clearcoat: Range | None = None
    sheen: Range | None = None
    texture: Texture | None = None
    plain: bool = False
    each: bool = False


class Aim(NamedTuple):
    """A look with its target: a category, an object's id, ``room`` or ``*``, and a part or ``*``; ``text`` is how it was written."""

    owner: str
    part: str
    look: Look
    text: str

    def meets(self, category: str, identifier: int, part: str) -> bool:
        """Return whether a part of an object is meant."""
        return self.owner in (ANY, category, str(identifier)) and self.part in (ANY, part)


@lru_cache(maxsize=64)
def read_looks(texts: tuple[str, ...]) -> tuple[Aim, ...]:
    """Parse the looks of a request.

    Raises:
        RequestError: a text does not parse, or a field does not fit; the line names the look.
    """
    return tuple(_read(text) for text in texts)


def restricted(
    appearance: Appearance,
    request: SceneRequest,
    needed: Collection[str] = (),
    more_parts: Mapping[str, Collection[str]] | None = None,
) -> Appearance:
    """Return the appearance with the styles, the palette and without the materials that a request says, having checked its looks.

    Styles that need what is excluded are not taken.

    Args:
        appearance: of all categories.
        request: whose looks, excluded materials and palette count.
        needed: categories that the room may hold.
        more_parts: category -> parts of models of the user's catalogue.

    Raises:
        RequestError: a category, part, style, material or family is unknown, or nothing is left to draw from.
    """
    aims = read_looks(request.looks)
    for aim in aims:
        _check(aim, appearance, request.exclude_materials, more_parts or {})
    excluded = ", ".join(request.exclude_materials)
    changed = _without_materials(appearance, request.exclude_materials, request.room_type) if excluded else appearance
    categories = dict(changed.categories)
    for aim in aims:
        if aim.look.styles and aim.owner in categories:
            categories[aim.owner] = _with_styles(categories[aim.owner], aim)
    for category in needed:
        if category not in categories or not categories[category].styles:
            raise RequestError(f"exclude_materials: {excluded}: expected materials to be left for a style of {category}, got none")
    palette = changed.palette
    if request.palette_hue_deg >= 0.0:
        palette = replace(palette, hues_deg=(HueOdds(hue=request.palette_hue_deg, odds=1.0),), jitter_deg=0.0)
    changed = replace(changed, categories=categories, palette=palette)
    try:
        check_appearance(changed)
    except FieldError as error:
        raise RequestError(f"exclude_materials: {excluded}: expected materials to be left for every part, got none ({error})") from None
    return changed


def apply_looks(
    rng: np.random.Generator, pool: MaterialPool, request: SceneRequest, room: Room, objects: Sequence[SceneObject]
) -> tuple[Room, tuple[SceneObject, ...]]:
    """Return the room and its objects with the looks of a request; the closet gets the materials that they need.

    Raises:
        RequestError: an id is not in the room, or an object has no such part.
    """
    base = int(rng.integers(2**63 - 1))
    items = tuple(objects)
    for aim in read_looks(request.looks):
        if aim.owner.isdigit():
            _check_id(aim, room, items)
        changer = _Changer(pool, aim, np.random.default_rng([base, zlib.crc32(aim.text.encode())]))
        room = replace(
            room,
            surfaces=changer.changed(ROOM, 0, room.surfaces) if aim.owner in (ROOM, ANY) else room.surfaces,
            openings=tuple(replace(item, parts=changer.changed(item.category, item.id, item.parts)) for item in room.openings),
        )
        items = tuple(replace(thing, parts=changer.changed(thing.category, thing.id, thing.parts)) for thing in items)
    return room, items


class _Changer:
    """Lays one look over parts; materials that were alike stay alike."""

    def __init__(self, pool: MaterialPool, aim: Aim, rng: np.random.Generator) -> None:
        self._closet, self._aim, self._rng = pool, aim, rng
        self._done: dict[tuple[int, str], str] = {}
        self._values: dict[str, Any] | None = None
        self._drawn: str | None = None

    def changed(self, category: str, identifier: int, parts: tuple[Part, ...]) -> tuple[Part, ...]:
        """Return an object's parts."""
        if self._aim.look.each:
            self._values = self._drawn = None
        return tuple(
            replace(part, material=self._material(identifier, part.material)) if self._aim.meets(category, identifier, part.name) else part
            for part in parts
        )

    def _material(self, identifier: int, before: str) -> str:
        look = self._aim.look
        key = (identifier if look.each else -1, before)
        if key not in self._done:
            self._done[key] = self._make(before)
        return self._done[key]

    def _make(self, before: str) -> str:
        look, pool = self._aim.look, self._closet
        pool.use(self._rng)
        if look.material is not None or look.family is not None:
            if self._drawn is None:
                self._drawn = pool.draw_material(look.material) if look.material else pool.choose({str(look.family): 1.0})
            before = self._drawn
        if self._values is None:
            self._values = _draw_values(look, self._rng)
        if not self._values:
            return before
        material = next(item for item in pool.materials if item.id == before)
        number = sum(item.id.startswith("look_") for item in pool.materials) + 1
        changed: Material = replace(material, id=f"look_{number}_{before}"[:120], **self._values)
        pool.materials.append(changed)
        return changed.id


def _draw_values(look: Look, rng: np.random.Generator) -> dict[str, Any]:
    """Return the fields of a material that a look sets."""
    values: dict[str, Any] = {name: _drawn(rng, getattr(look, name)) for name in _SURFACE if getattr(look, name) is not None}
    if look.base_color is not None:
        values["base_color"] = look.base_color
    elif look.color is not None:
        values["base_color"] = _from_srgb(look.color)
    elif look.lightness is not None and look.chroma is not None and look.hue_deg is not None:
        values["base_color"] = linear_rgb(*(_drawn(rng, bounds) for bounds in (look.lightness, look.chroma, look.hue_deg)))
    if look.plain:
        values |= {"texture": None, "images": None}
    elif look.texture is not None:
        values |= {"texture": look.texture, "images": None}
    return values


def _drawn(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    return round(float(rng.uniform(*bounds)), 6)


def _from_srgb(text: str) -> Color:
    encoded = np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    red, green, blue = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).round(6).tolist()
    return (red, green, blue)


def _read(text: str) -> Aim:
    where = f"looks: {text!r}"
    try:
        data = parse_yaml(text, where)
    except GrammarError as error:
        raise RequestError(str(error)) from None
    if not isinstance(data, dict) or len(data) != 1:
        raise RequestError(f"{where}: expected one 'TARGET: {{...}}', got {'none' if not isinstance(data, dict) else len(data)}")
    ((target, asked),) = data.items()
    match = _TARGET.fullmatch(str(target))
    if match is None:
        raise RequestError(f"{where}: expected a target category/part, id/part, room/surface or */part, got {str(target)!r}")
    if isinstance(asked, str):
        asked = {"material": asked}
    if isinstance(asked, dict):
        asked = {key: [value, value] if key in _RANGES and isinstance(value, (int, float)) else value for key, value in asked.items()}
    try:
        look = from_mapping(Look, asked)
        _check_ranges(look)
    except FieldError as error:
        raise RequestError(f"{where}: {error}") from None
    return Aim(match[1], match[2] or ANY, look, text)


def _check_ranges(look: Look) -> None:
    for name in _RANGES:
        bounds = getattr(look, name)
        if bounds is not None and bounds[0] > bounds[1]:
            raise FieldError(name, "low <= high", f"[{bounds[0]}, {bounds[1]}]")
    tones = [name for name in ("lightness", "chroma", "hue_deg") if getattr(look, name) is not None]
    if len(tones) not in (0, 3):
        raise FieldError("lightness", "lightness, chroma and hue_deg together", " and ".join(tones))
    kinds = [name for name in ("base_color", "color") if getattr(look, name) is not None] + tones[:1]
    for names in (kinds, [name for name in ("material", "family") if getattr(look, name) is not None]):
        if len(names) > 1:
            raise FieldError(names[0], f"{names[0]} or {names[1]}", "both")
    if look == Look() or look == Look(each=True):
        raise FieldError("", "something to change", "nothing")


def _check(aim: Aim, appearance: Appearance, excluded: Collection[str], more_parts: Mapping[str, Collection[str]]) -> None:
    """Check that what a look names exists."""
    where, look = f"looks: {aim.text!r}", aim.look
    parts = {name: set(rule.parts) | set(more_parts.get(name, ())) for name, rule in appearance.categories.items()}
    parts[ROOM] = set(appearance.surfaces)
    if not aim.owner.isdigit():
        known = set().union(*parts.values()) if aim.owner == ANY else parts.get(aim.owner)
        if known is None:
            raise RequestError(f"{where}: expected an id, *, room or a category ({', '.join(sorted(appearance.categories))})")
        if aim.part != ANY and aim.part not in known:
            raise RequestError(f"{where}: expected a part of {aim.owner} ({', '.join(sorted(known))}), got '{aim.part}'")
    if look.styles:
        if aim.owner not in appearance.categories or aim.part != ANY:
            raise RequestError(f"{where}: expected styles of a category, got the target '{aim.owner}/{aim.part}'")
        known = set(appearance.categories[aim.owner].styles)
        if not set(look.styles) <= known:
            raise RequestError(f"{where}: expected styles among {', '.join(sorted(known))}, got {', '.join(look.styles)}")
    for name, value, known in (("material", look.material, set(appearance.materials)), ("family", look.family, set(appearance.families))):
        if value is not None and value not in known:
            raise RequestError(f"{where}: expected a {name} of materials.yaml ({', '.join(sorted(known))}), got '{value}'")
        family = appearance.materials[value].family if name == "material" and value is not None else value
        if value is not None and (value in excluded or family in excluded):
            raise RequestError(f"{where}: expected a {name} that exclude_materials leaves, got '{value}'")


def _check_id(aim: Aim, room: Room, items: Sequence[SceneObject]) -> None:
    parts = {item.id: item.parts for item in room.openings} | {thing.id: thing.parts for thing in items}
    if int(aim.owner) not in parts:
        raise RequestError(
            f"looks: {aim.text!r}: expected the id of an object of this room (1 to {max(parts, default=0)}), got {aim.owner}"
        )
    names = [part.name for part in parts[int(aim.owner)]]
    if aim.part != ANY and aim.part not in names:
        raise RequestError(f"looks: {aim.text!r}: expected a part of object {aim.owner} ({', '.join(names)}), got '{aim.part}'")


def _with_styles(rule: CategoryLook, aim: Aim) -> CategoryLook:
    kept = {name: style for name, style in rule.styles.items() if name in aim.look.styles}
    if not kept:
        raise RequestError(f"looks: {aim.text!r}: expected a style that exclude_materials leaves ({', '.join(rule.styles)})")
    if not sum(style.odds for style in kept.values()) > 0.0:
        kept = {name: replace(style, odds=1.0) for name, style in kept.items()}
    return replace(rule, styles=kept, suite=None)


def _without_materials(appearance: Appearance, excluded: Collection[str], room_type: str) -> Appearance:
    """Return the appearance, for one room type, without materials and families by name."""
    unknown = sorted(set(excluded) - set(appearance.materials) - set(appearance.families))
    if unknown:
        raise RequestError(
            f"exclude_materials: expected names of materials or families ({', '.join(sorted(appearance.families))}), got '{unknown[0]}'"
        )
    materials = {name: item for name, item in appearance.materials.items() if name not in excluded and item.family not in excluded}
    families = {family: kept for family, names in appearance.families.items() if (kept := tuple(n for n in names if n in materials))}

    def left(odds: Families) -> Families:
        return {family: value for family, value in odds.items() if family in families}

    def rule_left(rule: PartRule) -> PartRule:
        return replace(rule, families=left(rule.families), by_style={style: left(odds) for style, odds in rule.by_style.items()})

    categories = {}
    for name, look in appearance.categories.items():
        cut = replace(look, parts={part: rule_left(rule) for part, rule in look.parts.items()})
        styles = {style: item for style, item in look.styles.items() if can_draw_materials(cut, style, families)}
        if sum(item.odds for item in styles.values()) > 0.0:
            categories[name] = replace(cut, styles=styles)
    return replace(
        appearance,
        materials=materials,
        families=families,
        palette=replace(appearance.palette, kept={family: n for family, n in appearance.palette.kept.items() if family in families}),
        surfaces={
            name: replace(
                rule,
                families=left(rule.families),
                by_room={room: left(odds) for room, odds in rule.by_room.items() if room == room_type},
            )
            for name, rule in appearance.surfaces.items()
        },
        categories=categories,
    )
