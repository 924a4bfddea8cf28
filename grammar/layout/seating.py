"""Whether the tables of a structure have a place for every chair, before anything stands anywhere."""

from __future__ import annotations

from collections.abc import Sequence

from grammar.derivation.parse_tree import Item
from grammar.layout.assemble import around_target
from grammar.spec.categories import Categories

SEAT_M = 0.5
"""Least distance between the middles of chairs that stand side by side."""


def crowded(categories: Categories, items: Sequence[Item]) -> bool:
    """Return whether chairs of one table have to stand closer than ``SEAT_M`` side by side if each takes one of its preferred places."""
    by_id = {item.id: item for item in items}
    taken: dict[int, list[tuple[str, float, float]]] = {}
    for item in items:
        table = by_id.get(item.core or 0)
        if table is None or not item.rule.around or "pulled_up" not in categories[item.rule.category].roles:
            continue
        seats = taken.setdefault(table.id, [])
        free = (
            place
            for mode in item.rule.around
            for place in [(mode.side, *around_target(mode, item.size_m, table.size_m)[:2])]
            if all(place[0] != seat[0] or abs(place[1] - seat[1]) + abs(place[2] - seat[2]) >= SEAT_M for seat in seats)
        )
        place = next(free, None)
        if place is None:
            return True
        seats.append(place)
    return False
