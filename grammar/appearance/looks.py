"""Looks of a request as texts ``TARGET: {...}``: what single categories, objects and parts shall look like.

They are laid over a finished room.  Each draws numbers of its own, seeded by its text, so that parts which it does not target stay as they
were.
"""

import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from grammar.appearance.appearance import MaterialPool
from grammar.appearance.materials import Hue, Range, linear_rgb
from grammar.spec.request import RequestError, SceneRequest
from scene_description import FieldError, Limits, Material, Part, Room, SceneObject, Texture, from_mapping
from scene_description.color import linear_from_srgb
from scene_description.strict import whole_number
from scene_description.types import Color
from scene_description.yaml_text import load_yaml

ANY, ROOM = "*", "room"
_SHOWN = 200
_TARGET = re.compile(r"(\*|[A-Za-z0-9_]+)(?:/(\*|[A-Za-z0-9_.\-]+))?")
SURFACE = ("roughness", "metallic", "transmission", "diffuse_transmission", "clearcoat", "sheen")
"""Fields of a look that are ranges of the same field of a material."""
_RANGES = (*SURFACE, "lightness", "chroma", "hue_deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What a look sets.  A range is drawn from evenly; a single number stands for itself.

    ``material`` (a name of materials.yaml) or ``family`` draws a new material; the other fields change the one that is there or was drawn:
    ``base_color`` is linear RGB, ``color`` the same as sRGB ``#rrggbb``, ``lightness``, ``chroma`` and ``hue_deg`` together are OKLCH;
    ``plain`` takes textures and images away.  ``each`` draws anew for every object; else all targeted objects look alike.
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
    diffuse_transmission: Range | None = None
    clearcoat: Range | None = None
    sheen: Range | None = None
    texture: Texture | None = None
    plain: bool = False
    each: bool = False


class TargetedLook(NamedTuple):
    """A look with its target: a category, an object's id, ``room`` or ``*``, and a part or ``*``; ``text`` is how it was written."""

    owner: str
    part: str
    look: Look
    text: str

    def matches(self, category: str, identifier: int, part: str) -> bool:
        """Return whether a part of an object is targeted."""
        return self.owner in (ANY, category, str(identifier)) and self.part in (ANY, part)


@lru_cache(maxsize=64)
def read_looks(texts: tuple[str, ...]) -> tuple[TargetedLook, ...]:
    """Parse the looks of a request.

    Raises:
        RequestError: a text does not parse, or a field does not fit; the line names the look.
    """
    return tuple(_read(text) for text in texts)


def _read(text: str) -> TargetedLook:
    """Parse one look; a bare text is a material, a single number a range of one point."""
    where = f"looks: {text[:_SHOWN]!r}"
    data = load_yaml(text, where, RequestError)
    if not isinstance(data, dict) or len(data) != 1:
        raise RequestError(f"{where}: expected one 'TARGET: {{...}}', got {'none' if not isinstance(data, dict) else len(data)}")
    ((target, asked),) = data.items()
    match = _TARGET.fullmatch(str(target))
    if match is None:
        raise RequestError(f"{where}: expected a target category/part, id/part, room/surface or */part, got {str(target)[:_SHOWN]!r}")
    if isinstance(asked, str):
        asked = {"material": asked}
    if isinstance(asked, dict):
        asked = {key: [value, value] if key in _RANGES and isinstance(value, (int, float)) else value for key, value in asked.items()}
    try:
        look = from_mapping(Look, asked)
        _check_ranges(look)
    except FieldError as error:
        raise RequestError(f"{where}: {error}") from None
    return TargetedLook(match[1], match[2] or ANY, look, text)


def _check_ranges(look: Look) -> None:
    """Check that bounds are in order, and that the fields that name a colour or a material exclude each other."""
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


def apply_looks(
    rng: np.random.Generator, pool: MaterialPool, request: SceneRequest, room: Room, objects: Sequence[SceneObject]
) -> tuple[Room, tuple[SceneObject, ...]]:
    """Return the room and its objects with the looks of a request; the materials that they need are added to the pool.

    Raises:
        RequestError: an id is not in the room, or an object has no such part.
    """
    base = int(rng.integers(2**63 - 1))
    items = tuple(objects)
    for targeted in read_looks(request.looks):
        if targeted.owner.isdigit():
            _check_id(targeted, room, items)
        look = _LookOnParts(pool, targeted, np.random.default_rng([base, zlib.crc32(targeted.text.encode())]))
        room = replace(
            room,
            surfaces=look.applied(ROOM, 0, room.surfaces) if targeted.owner in (ROOM, ANY) else room.surfaces,
            openings=tuple(replace(opening, parts=look.applied(opening.category, opening.id, opening.parts)) for opening in room.openings),
        )
        items = tuple(replace(item, parts=look.applied(item.category, item.id, item.parts)) for item in items)
    return room, items


class _LookOnParts:
    """Lays one look over the parts that it targets; parts that shared a material share the new one."""

    def __init__(self, pool: MaterialPool, targeted: TargetedLook, rng: np.random.Generator) -> None:
        self._pool, self._targeted, self._rng = pool, targeted, rng
        self._made: dict[tuple[int, str], str] = {}
        self._values: dict[str, Any] | None = None
        self._drawn: str | None = None

    def applied(self, category: str, identifier: int, parts: tuple[Part, ...]) -> tuple[Part, ...]:
        """Return the parts of one object with the look."""
        targeted = self._targeted
        if targeted.look.each:
            self._values = self._drawn = None
        return tuple(
            replace(part, material=self._material(identifier, part.material)) if targeted.matches(category, identifier, part.name) else part
            for part in parts
        )

    def _material(self, identifier: int, before: str) -> str:
        key = (identifier if self._targeted.look.each else -1, before)
        if key not in self._made:
            self._made[key] = self._make(before)
        return self._made[key]

    def _make(self, before: str) -> str:
        """Return the id of the material that takes the place of the one with the id ``before``."""
        look, pool = self._targeted.look, self._pool
        pool.use(self._rng)
        # draw a new material once, if the look names one
        if look.material is not None or look.family is not None:
            if self._drawn is None:
                self._drawn = pool.draw_material(look.material) if look.material else pool.choose({str(look.family): 1.0})
            before = self._drawn
        # draw the fields that the look sets once
        if self._values is None:
            self._values = _draw_values(look, self._rng)
        if not self._values:
            return before
        material = next(known for known in pool.materials if known.id == before)
        number = sum(known.id.startswith("look_") for known in pool.materials) + 1
        changed: Material = replace(material, id=f"look_{number}_{before}"[:120], **self._values)
        pool.materials.append(changed)
        return changed.id


def _draw_values(look: Look, rng: np.random.Generator) -> dict[str, Any]:
    """Return the fields of a material that a look sets."""
    values: dict[str, Any] = {name: _drawn(rng, getattr(look, name)) for name in SURFACE if getattr(look, name) is not None}
    if look.base_color is not None:
        values["base_color"] = look.base_color
    elif look.color is not None:
        values["base_color"] = _color_of_hex(look.color)
    elif look.lightness is not None and look.chroma is not None and look.hue_deg is not None:
        values["base_color"] = linear_rgb(*(_drawn(rng, bounds) for bounds in (look.lightness, look.chroma, look.hue_deg)))
    if look.plain:
        values |= {"texture": None, "images": None}
    elif look.texture is not None:
        values |= {"texture": look.texture, "images": None}
    return values


def _drawn(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    return round(float(rng.uniform(*bounds)), 6)


def _color_of_hex(text: str) -> Color:
    """Return the linear RGB of an sRGB colour ``#rrggbb``."""
    encoded = np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    red, green, blue = linear_from_srgb(encoded).round(6).tolist()
    return (red, green, blue)


def _check_id(targeted: TargetedLook, room: Room, items: Sequence[SceneObject]) -> None:
    """Check that the room has the object that a look targets by its id, and that it has the part."""
    parts = {opening.id: opening.parts for opening in room.openings} | {item.id: item.parts for item in items}
    number = whole_number(targeted.owner)
    if number is None or number not in parts:
        raise RequestError(
            f"looks: {targeted.text!r}: expected the id of an object of this room (1 to {max(parts, default=0)}), got {targeted.owner:.40}"
        )
    names = [part.name for part in parts[number]]
    if targeted.part != ANY and targeted.part not in names:
        raise RequestError(
            f"looks: {targeted.text!r}: expected a part of object {targeted.owner} ({', '.join(names)}), got '{targeted.part}'"
        )
