"""Layout files -> observed rooms: one JSON object a line; whatever does not fit is left out and counted, with its line.

Two kinds of lines are read.  Those with ``"schema": "scene_synth.layout/1"`` are in our conventions, as
:mod:`grammar.learning.write_layouts` writes them.  All others have boxes by centre and [width, depth, height], whose front faces -y at
yaw 0.  A room has the doors that other rooms of its house list and that lead into it too.
"""

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grammar.learning.category_map import CategoryMap
from grammar.learning.layout_fields import UnfitError, quoted, read_number, read_openings, read_polygon, shared_doors
from grammar.learning.layout_objects import read_objects
from grammar.learning.observed import ObservedRoom
from grammar.spec.rules import GrammarError
from scene_description.errors import error_line, read_at_most

LAYOUT_SCHEMA = "scene_synth.layout/1"

_MAX_FILE_BYTES = 256 * 2**20
_MAX_LINE_CHARACTERS = 4_000_000
_MOST_LISTED, _MOST_USED, _MOST_ALIKE = 1000, 250, 63
"""Objects of a room: in its line, that can be used, and of one category, which is what a grammar may give."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipped:
    """Something left out: file, line (from 1), why, and how many objects are lost with it."""

    file: str
    line: int
    reason: str
    objects: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutFile:
    """What one file gave: its rooms of the wanted type, everything left out, and how many lines were rooms of other types.

    A reason that begins with "name:" leaves nothing out: it says what a name is taken for.
    """

    name: str
    rooms: tuple[ObservedRoom, ...]
    skipped: tuple[Skipped, ...]
    other_rooms: int

    def reasons(self) -> Counter[str]:
        """Return how often each reason occurs."""
        return Counter(item.reason for item in self.skipped)

    def lost_objects(self) -> Counter[str]:
        """Return how many objects of the wanted rooms are left out for each reason, with all of a room that is."""
        lost: Counter[str] = Counter()
        for item in self.skipped:
            if item.objects:
                lost[item.reason.removeprefix("object: ")] += item.objects
        return lost


def read_layouts(path: Path, names: CategoryMap, room_type: str) -> LayoutFile:
    """Read the rooms of one type.

    Raises:
        GrammarError: the file itself cannot be read.
    """
    try:
        text = read_at_most(path, _MAX_FILE_BYTES, GrammarError)
    except OSError as error:
        raise GrammarError(f"layouts: {error_line(error)}") from None
    rooms: list[ObservedRoom] = []
    skipped: list[Skipped] = []
    others = 0
    parsed: list[tuple[int, dict[str, Any] | UnfitError]] = [
        (number, _parsed(line, names, room_type)) for number, line in enumerate(text.splitlines(), 1) if line.strip()
    ]
    houses = lines_by_house(data for _, data in parsed if isinstance(data, dict))
    for number, data in parsed:
        try:
            room, reasons = _read_room(data, houses, names, room_type)
        except UnfitError as unfit:
            skipped.append(Skipped(file=path.name, line=number, reason=str(unfit), objects=unfit.objects))
            continue
        lost = (Skipped(file=path.name, line=number, reason=reason, objects=int(reason.startswith("object:"))) for reason in reasons)
        skipped.extend(lost)
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


def _parsed(line: bytes, names: CategoryMap, room_type: str) -> dict[str, Any] | UnfitError:
    """Return a line's object, or why it is none; a room of another type is there for its doors, and its objects are dropped."""
    if len(line) > _MAX_LINE_CHARACTERS:
        return UnfitError("room: line too long")
    try:
        data = json.loads(line)
    except (ValueError, RecursionError):
        return UnfitError("room: not JSON")
    if not isinstance(data, dict):
        return UnfitError("room: not a JSON object")
    found = data.get("room_type")
    if isinstance(found, str) and names.room_type(found) != room_type:
        data.pop("objects", None)
    return data


def _read_room(
    data: Mapping[str, Any] | UnfitError, houses: Mapping[str, Sequence[Mapping[str, Any]]], names: CategoryMap, room_type: str
) -> tuple[ObservedRoom | None, list[str]]:
    """Return a room of the wanted type, None for one of another type, and the reasons why parts of it cannot be used."""
    if isinstance(data, UnfitError):
        raise data
    found, objects = data.get("room_type"), data.get("objects")
    if not isinstance(found, str):
        raise UnfitError("room: no room_type")
    if names.room_type(found) != room_type:
        return None, []
    if not isinstance(objects, list):
        raise UnfitError("room: no list of objects")
    try:
        return _room_with(objects, data, houses, names, room_type)
    except UnfitError as unfit:
        raise UnfitError(str(unfit), len(objects)) from None


def _room_with(
    objects: Sequence[Any], data: Mapping[str, Any], houses: Mapping[str, Sequence[Mapping[str, Any]]], names: CategoryMap, room_type: str
) -> tuple[ObservedRoom, list[str]]:
    """Return a room of the wanted type with those of its objects that can be used, and why others cannot."""
    own, identifier = data.get("schema") == LAYOUT_SCHEMA, data.get("id")
    polygon = read_polygon(data.get("polygon_m" if own else "polygon"))
    height = read_number(data.get("height_m" if own else "height"), "room: no height", 1.5, 10.0)
    text = identifier if isinstance(identifier, str) and identifier else "unnamed"
    if len(objects) > _MOST_LISTED:
        raise UnfitError(f"room: {quoted(text)} has {len(objects)} objects, more than {_MOST_LISTED}")
    items, reasons = read_objects(objects, names, room_type, polygon, own=own)
    if objects and not items:
        raise UnfitError("room: no usable object")
    if len(items) > _MOST_USED:
        raise UnfitError(f"room: {quoted(text)} has {len(items)} objects that can be used, more than {_MOST_USED}")
    for category, count in Counter(item.category for item in items).items():
        if count > _MOST_ALIKE:
            raise UnfitError(f"room: {quoted(text)} has {count} of {category}, more than {_MOST_ALIKE}")
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
