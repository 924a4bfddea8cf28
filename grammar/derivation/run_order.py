"""What the order of a run's units costs."""

from __future__ import annotations

from collections.abc import Sequence

from grammar.spec.run_rules import CORNER_UNIT, END, SIDE_WINDOW, WINDOW, RunUnit


def order_cost(units: Sequence[tuple[str, RunUnit]], windows_met: Sequence[frozenset[str]], has_window: bool) -> float:
    """Return what the order of a run costs in nat: wishes that are not met; what the room or the run lacks costs nothing.

    The compiled twin is :func:`grammar.layout.runs.add_run_order`.
    """
    cost, last = 0.0, len(units) - 1
    likes_end = [END in (unit.near or ()) for _, unit in units]
    held = {symbol for symbol, _ in units} | {END}
    held |= {CORNER_UNIT} if any(unit.turns for _, unit in units) else set()
    held |= {WINDOW, SIDE_WINDOW} if has_window else set()
    for k, (_, unit) in enumerate(units):
        beside = [units[n] for n in (k - 1, k + 1) if 0 <= n <= last]
        met = {symbol for symbol, _ in beside} | ({CORNER_UNIT} if any(other.turns for _, other in beside) else set())
        met |= ({END} if all(likes_end[:k]) or all(likes_end[k + 1 :]) else set()) | windows_met[k]
        cost += sum(nat for target, nat in (unit.near or {}).items() if target in held - met)
        cost += sum(nat for target, nat in (unit.apart or {}).items() if target in met)
    return cost
