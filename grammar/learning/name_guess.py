"""Names that the table does not know: the nearest category of ours by its words, or furniture or a thing of no category of ours."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Sequence

from grammar.spec.object_rules import CORE, CORNER, NONE
from grammar.spec.room_rules import OPENINGS
from grammar.spec.run_rules import END

FURNITURE, THING = "other_furniture", "other_prop"
"""Categories of what no category of ours is like; they look like plain boxes and keep the source's name as their symbol."""

ALSO_SEEN = "also_seen"
"""The node of what a base graph lacks."""

_RESERVED = {ALSO_SEEN, CORE, CORNER, END, NONE, *OPENINGS}
"""Words of grammars that are no symbols of objects."""

_ALIKE = 0.85
_THING_M = 0.45
_GENERAL = {"big", "double", "kid", "kids", "large", "modern", "new", "old", "single", "small"}


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
