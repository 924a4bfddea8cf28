"""Whether the tables of a structure have a place for every chair, and chairs, before anything stands anywhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from grammar.derivation.parse_tree import Item
from grammar.layout.assemble import around_target
from grammar.spec.categories import Categories

SEAT_M = 0.5
"""Least distance between the middles of chairs that stand side by side."""
COMPANY_M = 1.2
"""A table for meals that is as wide has more than one chair."""


def oddly_seated(categories: Categories, items: Sequence[Item]) -> bool:
    """Return whether every layout of these objects is odd for the chairs at its tables: too many or, for a large table, one alone."""
    return crowded(categories, items) or lone_chair(categories, items)


def lone_chair(categories: Categories, items: Sequence[Item]) -> bool:
    """Return whether a table for meals that is at least ``COMPANY_M`` wide has one chair only."""
    chairs = Counter(item.core for item in items if "pulled_up" in categories[item.rule.category].roles)
    tables = (item for item in items if "dining" in categories[item.rule.category].roles)
    return any(chairs[table.id] == 1 and max(table.size_m[:2]) >= COMPANY_M for table in tables)


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
