"""Objects that a request puts in the room: reading them, and matching them with the objects that the grammar draws.

A fixed object takes the place of an object of its category that the grammar draws, so that the addresses of other objects find it.  One of
a category that the room type does not know joins the room as an object of its own.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Literal, NamedTuple

from grammar.spec.object_rules import ObjectRule, SizeMode
from grammar.spec.request import RequestError, SceneRequest

Size = tuple[float, float, float]

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_PATTERN = re.compile(rf"([a-z][a-z0-9_]*):({_NUMBER}):({_NUMBER}):({_NUMBER})((?::[a-z]+=[^:]*)*)")
_FORM = "'name:x:y:yaw' and after it ':size=DxWxH', ':on=K' or ':middle=Z'"
_FARTHEST_M = 60.0
_SMALLEST_M, _LARGEST_M = 0.001, 20.0


class FixedObject(NamedTuple):
    """One fixed object.

    text: as the request has it; name: category or symbol; x_m, y_m, yaw_rad: pose in the world; size_m: if given; on: place in the list of
    its supporter; middle_m: height of the middle of what hangs.
    """

    text: str
    name: str
    x_m: float
    y_m: float
    yaw_rad: float
    size_m: Size | None
    on: int | None
    middle_m: float | None


def read_fixed(request: SceneRequest) -> tuple[FixedObject, ...]:
    """Return a request's fixed objects.

    Raises:
        RequestError: a text does not parse, a number is absurd, or an address leads nowhere.
    """
    return tuple(_read_text(text, k) for k, text in enumerate(request.fixed))


def _read_text(text: str, place: int) -> FixedObject:
    """Read one text; ``place`` is its number in the list, from 0."""
    match = _PATTERN.fullmatch(text.replace(" ", ""))
    if match is None:
        raise RequestError(f"fixed: expected texts {_FORM}, got '{text}'")
    x, y, yaw = (float(match[k]) for k in (2, 3, 4))
    if max(abs(x), abs(y)) > _FARTHEST_M or abs(yaw) > 1000.0:
        raise RequestError(f"fixed: {text}: expected x and y within {_FARTHEST_M:g} m and yaw in radians, got {x:g}, {y:g}, {yaw:g}")
    size: Size | None = None
    on, middle = None, None
    for option in filter(None, match[5].split(":")):
        key, _, value = option.partition("=")
        if key == "size":
            size = _read_size(text, value)
        elif key == "on":
            if not re.fullmatch(r"\d{1,3}", value) or not 1 <= int(value) <= place:
                raise RequestError(f"fixed: {text}: expected ':on=K' with K from 1 to {place}, one before it in the list, got '{value}'")
            on = int(value) - 1
        elif key == "middle" and re.fullmatch(_NUMBER, value) and 0.0 <= float(value) <= _LARGEST_M:
            middle = float(value)
        else:
            raise RequestError(f"fixed: expected texts {_FORM}, got '{text}'")
    return FixedObject(text, match[1], x, y, math.remainder(yaw, 2.0 * math.pi), size, on, middle)


def _read_size(text: str, value: str) -> Size:
    sides = [float(side) if re.fullmatch(_NUMBER, side) else math.nan for side in value.split("x")]
    if len(sides) != 3 or not all(_SMALLEST_M <= side <= _LARGEST_M for side in sides):
        raise RequestError(
            f"fixed: {text}: expected ':size=DxWxH' with sides from {_SMALLEST_M:g} to {_LARGEST_M:g} m, depth first, got '{value}'"
        )
    return sides[0], sides[1], sides[2]


def match_terminals(fixed_objects: Sequence[FixedObject], symbols: Sequence[str], rules: Sequence[ObjectRule]) -> dict[int, int] | None:
    """Return terminal -> fixed object that takes its place, both as places in their lists, or None if there are too few terminals.

    Args:
        fixed_objects: all of them.
        symbols: of the drawn terminals.
        rules: of the drawn terminals.
    """
    taken: dict[int, int] = {}
    # match names that are symbols before names of categories, which more terminals can satisfy
    for k in sorted(range(len(fixed_objects)), key=lambda k: (fixed_objects[k].name not in symbols, k)):
        name, stands = fixed_objects[k].name, fixed_objects[k].on is not None
        terminals = enumerate(zip(symbols, rules, strict=True))
        free = [i for i, (symbol, rule) in terminals if i not in taken and name in (symbol, rule.category)]
        wanted = [i for i in free if (rules[i].mount == "object") == stands]
        if not wanted:
            return None
        taken[wanted[0]] = k
    return taken


def rule_of_fixed(fixed: FixedObject) -> ObjectRule:
    """Return the rule of a fixed object of a category that the grammar does not have."""
    assert fixed.size_m is not None
    mount: Literal["floor", "object"] = "floor" if fixed.on is None else "object"
    sizes = (SizeMode(mean_m=fixed.size_m, sd_m=(0.01, 0.01, 0.01)),)
    return ObjectRule(category=fixed.name, mount=mount, sizes=sizes, low_m=fixed.size_m, high_m=fixed.size_m)
