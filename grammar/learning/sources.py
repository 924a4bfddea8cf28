"""Several sources of rooms together, each with its weight."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from grammar.learning.observed import ObservedRoom


def mixed(sources: Sequence[tuple[Sequence[ObservedRoom], float]]) -> list[ObservedRoom]:
    """Return the rooms of all sources such that a room of each counts in proportion to its weight.

    Of the source of greatest weight all rooms are taken, of the others the share that their weight is of that, in the order of the hashes
    of the rooms' names: which rooms these are depends on nothing else.

    Args:
        sources: rooms and positive weight of each.
    """
    most = max((weight for _, weight in sources), default=1.0)
    kept: list[ObservedRoom] = []
    for rooms, weight in sources:
        count = round(len(rooms) * weight / most)
        digests = [hashlib.sha256(room.id.encode(errors="surrogatepass")).hexdigest() for room in rooms]
        order = sorted(zip(digests, range(len(rooms)), strict=True))
        chosen = [i for _, i in order[:count]]
        kept.extend(rooms[i] for i in sorted(chosen))
    return kept
