"""Layout files -> observed rooms: one JSON object a line; whatever does not fit is left out and counted, with its line.

Two kinds of lines are read.  Those with ``"schema": "scene_synth.layout/1"`` are in our conventions, as
:mod:`grammar.learning.write_layouts` writes them.  All others have boxes by centre and [width, depth, height], whose front faces -y at
yaw 0.  A room has the doors that other rooms of its house list and that lead into it too.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grammar.learning.category_map import CategoryMap
from grammar.learning.layout_fields import UnfitError, read_number, read_openings, read_polygon, shared_doors
from grammar.learning.layout_objects import read_objects
from grammar.learning.observed import ObservedRoom
from grammar.spec.rules import GrammarError
from scene_description import error_line

LAYOUT_SCHEMA = "scene_synth.layout/1"

_MAX_LINE_CHARACTERS = 4_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipped:
    """Something left out: file, line (from 1), and why."""

    file: str
    line: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutFile:
    """What one file gave: its rooms of the wanted type, everything left out, and how many lines were rooms of other types."""

    name: str
    rooms: tuple[ObservedRoom, ...]
    skipped: tuple[Skipped, ...]
    other_rooms: int

    def reasons(self) -> Counter[str]:
        """Return how often each reason occurs."""
        return Counter(item.reason for item in self.skipped)


def read_layouts(path: Path, names: CategoryMap, room_type: str) -> LayoutFile:
    """Read the rooms of one type.

    Raises:
        GrammarError: the file itself cannot be read.
    """
    try:
        lines = path.read_bytes().splitlines()
    except OSError as error:
        raise GrammarError(f"layouts: {error_line(error)}") from None
    rooms: list[ObservedRoom] = []
    skipped: list[Skipped] = []
    others = 0
    parsed: list[tuple[int, dict[str, Any] | UnfitError]] = [
        (number, _parsed(line)) for number, line in enumerate(lines, 1) if line.strip()
    ]
    houses = lines_by_house(data for _, data in parsed if isinstance(data, dict))
    for number, data in parsed:
        try:
            room, reasons = _read_room(data, houses, names, room_type)
        except UnfitError as unfit:
            skipped.append(Skipped(file=path.name, line=number, reason=str(unfit)))
            continue
        skipped.extend(Skipped(file=path.name, line=number, reason=reason) for reason in reasons)
        if room is None:
            others += 1
        else:
            rooms.append(room)
    return LayoutFile(name=path.name, rooms=tuple(rooms), skipped=tuple(skipped), other_rooms=others)


def lines_by_house(lines: Iterable[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Return the lines of each house; those without a name of their own count as a house each."""
    houses: dict[str, list[Mapping[str, Any]]] = {}
    for data in lines:
        if (house := _house(data)) is not None:
            houses.setdefault(house, []).append(data)
    return houses


def with_shared_doors(data: Mapping[str, Any], houses: Mapping[str, Sequence[Mapping[str, Any]]]) -> Mapping[str, Any]:
    """Return a line with the doors that it shares with the other rooms of its house."""
    house = _house(data)
    more = shared_doors(data, [other for other in houses.get(house, ()) if other is not data]) if house is not None else []
    return {**data, "doors": [*data["doors"], *more]} if more else data


def _house(data: Mapping[str, Any]) -> str | None:
    house, identifier = data.get("house"), data.get("id")
    if isinstance(house, str) and house:
        return house
    return house_of(identifier) if isinstance(identifier, str) and identifier else None


def _parsed(line: bytes) -> dict[str, Any] | UnfitError:
    """Return a line's object, or why it is none."""
    if len(line) > _MAX_LINE_CHARACTERS:
        return UnfitError("room: line too long")
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        return UnfitError("room: not JSON")
    return data if isinstance(data, dict) else UnfitError("room: not a JSON object")


def _read_room(
    data: Mapping[str, Any] | UnfitError, houses: Mapping[str, Sequence[Mapping[str, Any]]], names: CategoryMap, room_type: str
) -> tuple[ObservedRoom | None, list[str]]:
    """Return a room of the wanted type, None for one of another type, and the reasons why parts of it cannot be used."""
    if isinstance(data, UnfitError):
        raise data
    found, identifier, objects = data.get("room_type"), data.get("id"), data.get("objects")
    if not isinstance(found, str):
        raise UnfitError("room: no room_type")
    if names.room_type(found) != room_type:
        return None, []
    if not isinstance(objects, list):
        raise UnfitError("room: no list of objects")
    own = data.get("schema") == LAYOUT_SCHEMA
    polygon = read_polygon(data.get("polygon_m" if own else "polygon"))
    height = read_number(data.get("height_m" if own else "height"), "room: no height", 1.5, 10.0)
    text = identifier if isinstance(identifier, str) and identifier else "unnamed"
    items, reasons = read_objects(objects, names, room_type, polygon, own=own)
    if objects and not items:
        raise UnfitError("room: no usable object")
    room = ObservedRoom(
        id=text,
        house=_house(data) or text,
        room_type=room_type,
        polygon_m=polygon,
        height_m=height,
        objects=items,
        openings=read_openings(with_shared_doors(data, houses), polygon, reasons),
    )
    return room, reasons


def house_of(identifier: str) -> str:
    """Return the house that a room's name speaks of: the part before the first "-" if it ends in a digit, else the whole name."""
    first = identifier.split("-", 1)[0]
    return first if re.search(r"\d$", first) else identifier
