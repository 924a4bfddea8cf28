"""The table from the names that layout files use to ours."""

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from grammar.spec.object_rules import CORE, CORNER, NONE
from grammar.spec.room_rules import OPENINGS
from grammar.spec.rules import GrammarError
from grammar.spec.run_rules import END
from grammar.spec.values import Extent, Symbol
from scene_description import FieldError, Limits, from_mapping
from scene_description.yaml_text import read_yaml

Names = Mapping[str, Annotated[str, Limits(max_length=60)]]

FURNITURE, THING = "other_furniture", "other_prop"
"""Categories of what no category of ours is like; they look like plain boxes and keep the source's name as their symbol."""

ALSO_SEEN = "also_seen"
"""The node of what a base graph lacks."""

_RESERVED = {ALSO_SEEN, CORE, CORNER, END, NONE, *OPENINGS}
"""Words of grammars that are no symbols of objects."""

_ALIKE = 0.85
_THING_M = 0.45
_GENERAL = {"big", "double", "kid", "kids", "large", "modern", "new", "old", "single", "small"}


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
    ``standing``: categories that hang; what stands on the floor is of the category that this other name has in the table.
    ``low``: categories of which a source's low pieces are another one.
    ``beside``: categories that ``rooms`` makes of a general name, which are others by what they stand beside.
    ``catalogue``: categories that exist; with it a name that is in no table is taken for the nearest of them
    (:func:`grammar.learning.category_map.nearest_category`) or, of none, for furniture or a thing by its size.
    ``raw`` (the source's own names) wins over ``rooms`` (normalised names whose meaning depends on the room type), that over ``names``.
    """

    room_types: Mapping[str, Symbol]
    names: Names
    raw: Names
    rooms: Mapping[str, Names]
    wide: tuple[Symbol, ...] = ()
    backed: tuple[Symbol, ...] = ()
    highest_m: Mapping[str, Extent] = field(default_factory=dict)
    standing: Mapping[str, str] = field(default_factory=dict)
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
        return from_mapping(CategoryMap, read_yaml(path, GrammarError))
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case, in the singular: ``DeskLamp``, ``desk_lamps`` and ``desk lamp`` are alike."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name)
    words = re.split(r"[^a-z]+", spaced.lower())
    return tuple(word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word for word in words if word)


def symbol_of(name: str) -> str:
    """Return a name as a symbol of a grammar."""
    symbol = "_".join(words_of(name))[:50].strip("_") or "thing"
    return f"{symbol}_thing" if symbol in _RESERVED else symbol


def nearest_category(name: str, catalogue: Collection[str]) -> str | None:
    """Return the category whose words a name has, or that is spelled nearly alike; None if there is none.

    Of several the one with most words counts: a ``white desk lamp`` is a ``desk_lamp``, not a ``desk``.  The last word says what a thing
    is, so a ``lamp table`` is no ``lamp``.
    """
    words = words_of(name)
    if not words:
        return None
    own = {category: words_of(category) for category in sorted(catalogue)}
    inside = [category for category, parts in own.items() if parts[-1] == words[-1] and set(parts) <= set(words)]
    if inside:
        return max(inside, key=lambda category: len(own[category]))
    bare = " ".join(word for word in words if word not in _GENERAL)
    close = {category: difflib.SequenceMatcher(None, bare, " ".join(parts)).ratio() for category, parts in own.items()}
    best = max(close, key=lambda category: close[category], default=None)
    return best if best is not None and close[best] >= _ALIKE else None


def kind_of(size_m: Sequence[float], raised: bool) -> str:
    """Return which of the two general categories a box is of: things are small, or stand on others and are not large."""
    return THING if max(size_m) < _THING_M or (raised and max(size_m) < 2.0 * _THING_M) else FURNITURE
