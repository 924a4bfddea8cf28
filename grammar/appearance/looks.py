"""Looks of a request as texts ``TARGET: {...}``: what single categories, objects and parts shall look like."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, NamedTuple

from grammar.appearance.materials import Hue, Range
from grammar.spec.grammar_file import parse_yaml
from grammar.spec.request import RequestError
from grammar.spec.rules import GrammarError
from scene_description import FieldError, Limits, Texture, from_mapping
from scene_description.types import Color

ANY, ROOM = "*", "room"
_TARGET = re.compile(r"(\*|[A-Za-z0-9_]+)(?:/(\*|[A-Za-z0-9_.\-]+))?")
SURFACE = ("roughness", "metallic", "transmission", "clearcoat", "sheen")
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
