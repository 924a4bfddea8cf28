"""The table from the names that layout files use to ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from grammar.spec.grammar_file import read_yaml
from grammar.spec.rules import GrammarError
from grammar.spec.values import Extent, Symbol
from scene_description import FieldError, Limits, from_mapping

Names = Mapping[str, Annotated[str, Limits(max_length=60)]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Low:
    """What objects lower than ``below_m`` are: of the category ``is_a``."""

    below_m: Extent
    is_a: Symbol


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """What an object within ``within_m`` of one of the category ``of`` is (``there``), and others (``elsewhere``); "": as named."""

    of: Symbol
    within_m: Extent
    there: str = ""
    elsewhere: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CategoryMap:
    """Names of categories and room types; an empty target means: known, but nothing that the grammars speak of.

    ``wide``: categories whose front is a long side; what is recorded deeper than wide is turned so that its back is at the nearer wall.
    ``backed``: categories whose box does not tell the front, so that sources guess it: what stands at a wall has its back there.
    ``highest_m``: categories that sources record with what is above them (taps, mirrors); they are cut to this height.
    ``low``: categories of which a source's low pieces are another one.
    ``beside``: categories that ``rooms`` makes of a general name, which are others by what they stand beside.
    ``catalogue``: categories that exist; with it a name that is in no table is taken for the nearest of them
    (:func:`grammar.learning.name_guess.nearest_category`) or, of none, for furniture or a thing by its size.
    ``raw`` (the source's own names) wins over ``rooms`` (normalised names whose meaning depends on the room type), that over ``names``.
    """

    room_types: Mapping[str, Symbol]
    names: Names
    raw: Names
    rooms: Mapping[str, Names]
    wide: tuple[Symbol, ...] = ()
    backed: tuple[Symbol, ...] = ()
    highest_m: Mapping[str, Extent] = field(default_factory=dict)
    low: Mapping[str, Low] = field(default_factory=dict)
    beside: Mapping[str, Beside] = field(default_factory=dict)
    catalogue: frozenset[str] = frozenset()

    def room_type(self, name: str) -> str:
        """Return our name of a room type."""
        return self.room_types.get(name, name)

    def is_general(self, room_type: str, name: str, raw: str) -> bool:
        """Return whether it is the room type that tells what a name means."""
        return raw not in self.raw and name in self.rooms.get(room_type, {})

    def category(self, room_type: str, name: str, raw: str) -> str | None:
        """Return our category, "" for what is known but left out, None for a name that is not in the table."""
        for table, key in ((self.raw, raw), (self.rooms.get(room_type, {}), name), (self.names, name)):
            if key in table:
                return table[key]
        return None


def read_category_map(path: Path) -> CategoryMap:
    """Read the table, for example ``config_path("learning/category_map.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit.
    """
    try:
        return from_mapping(CategoryMap, read_yaml(path))
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
