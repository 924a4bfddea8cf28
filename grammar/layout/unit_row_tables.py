"""Rows of units of a parse tree as tables of a layout problem, and the state in which they begin.

Apart from their kernels, which would be compiled anew at every change of the derivation.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from grammar.derivation.parse_tree import Item, ParseTree
from grammar.geometry.arrays import Floats, Ints
from grammar.layout import columns as col
from grammar.layout.frames import place_object
from grammar.layout.problem import Problem, State
from grammar.layout.unit_rows import arrange, hang_in_line
from grammar.spec.run_rules import CORNER_UNIT, END, HANGING_LOW_M, SIDE_WINDOW, WINDOW

Wish = tuple[float, float, float]
"""Columns WISH_TARGET, WISH_NEAR and WISH_COST of a row of ``Problem.mode``."""

_CODES = {END: col.END, CORNER_UNIT: col.CORNER_UNIT, WINDOW: col.WINDOW, SIDE_WINDOW: col.SIDE_WINDOW}


def row_table(tree: ParseTree) -> Ints:
    """Return ``Problem.row``."""
    ends = np.cumsum([0, *(len(row.slots) for row in tree.unit_rows)])
    rows = [(row.units[0] - 1, len(row.units), ends[k], ends[k + 1]) for k, row in enumerate(tree.unit_rows)]
    return np.array(rows, np.int64).reshape(-1, col.ROW_WIDTH)


def slot_table(tree: ParseTree) -> Floats:
    """Return ``Problem.slot``."""
    return np.array([(*slot, row.wall_gap_m, row.joint_m) for row in tree.unit_rows for slot in row.slots], np.float64).reshape(
        -1, col.SLOT_WIDTH
    )


def write_links(tree: ParseTree, link: Ints) -> None:
    """Write the columns of ``Problem.link`` about rows."""
    link[:, [col.ROW, col.LEG]] = -1
    items = {item.id: item for item in tree.items}
    kinds = _kinds(tree)
    for k, row in enumerate(tree.unit_rows):
        legs = [leg for leg, count in enumerate(row.legs) for _ in range(count)]
        for leg, key in zip(legs, sorted(row.units), strict=True):
            rule = items[key].rule.in_run
            link[key - 1, [col.ROW, col.LEG]] = k, leg
            link[key - 1, [col.TURNS, col.UNIT_KIND]] = rule is not None and rule.turns, kinds[items[key].symbol]
            link[key - 1, col.END_ON] = rule is not None and rule.end_on
            link[key - 1, col.LIKES_END] = rule is not None and END in (rule.near or ())
            link[key - 1, col.JUTS] = rule is not None and rule.juts
            link[key - 1, col.FILLS] = items[key].size_m[2] > HANGING_LOW_M
    for item in tree.items:
        link[item.id - 1, col.IN_LINE] = _is_in_line(item, link)
        if item.core is not None and link[item.id - 1, col.IN_LINE]:
            link[item.core - 1, col.FILLS] = 1


def _is_in_line(item: Item, link: Ints) -> bool:
    return item.rule.in_line and item.pinned is None and item.core is not None and link[item.core - 1, col.ROW] >= 0


def _kinds(tree: ParseTree) -> Mapping[str, int]:
    """Return a number for every symbol of the objects."""
    return {symbol: number for number, symbol in enumerate(sorted({item.symbol for item in tree.items}))}


def wishes(tree: ParseTree, beta: float) -> Mapping[int, list[Wish]]:
    """Return the wishes of units by their ids that the room and the row can meet or break."""
    items, kinds = {item.id: item for item in tree.items}, _kinds(tree)
    has_window = any(opening.category == "window" for opening in tree.room.openings)
    carrying = {item.core for item in tree.items if item.rule.in_line}
    found: dict[int, list[Wish]] = {}
    for row in tree.unit_rows:
        units = [items[key] for key in row.units]
        held = {unit.symbol for unit in units} | {END} | ({WINDOW, SIDE_WINDOW} if has_window else set())
        held |= {CORNER_UNIT} if any(unit.rule.in_run is not None and unit.rule.in_run.turns for unit in units) else set()
        for unit in units:
            found[unit.id] = [
                (float(_CODES.get(target, kinds.get(target, col.NOTHING))), near, cost / beta)
                for target, near, cost in _declared(unit, held)
            ]
            if unit.id in carrying and row.line_cost > 0.0:
                found[unit.id].append((float(col.LINE), 1.0, row.line_cost / beta))
    return found


def _declared(unit: Item, held: set[str]) -> Iterator[tuple[str, float, float]]:
    if unit.rule.in_run is not None:
        for near, targets in ((1.0, unit.rule.in_run.near), (0.0, unit.rule.in_run.apart)):
            yield from ((target, near, cost) for target, cost in (targets or {}).items() if target in held)


def begin_rows(problem: Problem, tree: ParseTree, state: State) -> None:
    """Put all rows, and what hangs in line above their units, where the derivation has them begin."""
    for k, row in enumerate(tree.unit_rows):
        for place, key in enumerate(row.units):
            state.hold[key - 1, [col.ACTIVE, col.PLACE, col.SLOT]] = 1, place, problem.row[k, col.ROW_SLOTS] + row.slot
        arrange(problem, state, k, row.slide_m)
        for key in row.units:
            place_object(problem, state, key - 1)
    for i in np.flatnonzero(problem.link[:, col.IN_LINE]).tolist():
        state.hold[i, col.ACTIVE] = 1
        hang_in_line(problem, state, i)
        place_object(problem, state, i)
