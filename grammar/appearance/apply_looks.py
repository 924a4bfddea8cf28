"""Looks laid over a finished room.

Each look draws numbers of its own, seeded by its text, so that parts which it does not target stay as they were.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from grammar.appearance.looks import ANY, ROOM, SURFACE, Look, TargetedLook, read_looks
from grammar.appearance.material_pool import MaterialPool
from grammar.appearance.materials import linear_rgb
from grammar.spec.request import RequestError, SceneRequest
from scene_description import Material, Part, Room, SceneObject
from scene_description.color import linear_from_srgb
from scene_description.types import Color


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
    if int(targeted.owner) not in parts:
        raise RequestError(
            f"looks: {targeted.text!r}: expected the id of an object of this room (1 to {max(parts, default=0)}), got {targeted.owner}"
        )
    names = [part.name for part in parts[int(targeted.owner)]]
    if targeted.part != ANY and targeted.part not in names:
        raise RequestError(
            f"looks: {targeted.text!r}: expected a part of object {targeted.owner} ({', '.join(names)}), got '{targeted.part}'"
        )
