"""Units of a row as it sees them: how they stand in it, how much of the wall they take, and how far they reach into the room."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from grammar.derivation.drafts import Draft
from grammar.geometry.run_slots import Frame, leaves_gap
from grammar.spec.run_rules import CORNER_UNIT, END, SIDE_WINDOW, WINDOW, RowUnit, UnitRowRule

_PLAIN = RowUnit()

_STRETCH_COST = 4.0
"""Nat for each stretched unit at a squared logarithm of 1 of its width over the drawn one."""

_ROUNDING_M, _NEARLY_M = 1e-9, 1e-6


def unit_rule(draft: Draft) -> RowUnit:
    """Return how a unit stands in its row."""
    return draft.rule.in_run or _PLAIN


def along_m(draft: Draft) -> float:
    """Return how much of the wall a unit takes, metres."""
    return draft.size_m[0 if unit_rule(draft).end_on else 1]


def least_along_m(draft: Draft) -> float:
    """Return the least that a unit takes of the wall, metres."""
    return draft.rule.low_m[1] if unit_rule(draft).stretches else along_m(draft)


def across_m(draft: Draft) -> float:
    """Return how far a unit reaches into the room from its back, metres."""
    return draft.size_m[1 if unit_rule(draft).end_on else 0]


def reach_m(draft: Draft) -> float:
    """Return how far a unit reaches into the room from the line of its unit row, metres."""
    return draft.behind_m + across_m(draft)


def order_cost(units: Sequence[tuple[str, RowUnit]], windows_met: Sequence[frozenset[str]], has_window: bool) -> float:
    """Return what the order of a unit row costs in nat: wishes that are not met; what the room or the row lacks costs nothing.

    The compiled twin is :func:`grammar.layout.unit_rows.add_row_order`.
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


class LegFit(NamedTuple):
    """What the best cut costs (nat), its legs, and the widths of their units."""

    cost: float
    legs: list[list[Draft]]
    widths: list[list[float]]


def fit_legs(rule: UnitRowRule, frame: Frame, order: Sequence[Draft], turning: Sequence[tuple[Draft, float]]) -> LegFit | None:
    """Return the cheapest way to share units between the legs of a frame; None if there is none.

    Args:
        rule: of the row.
        frame: the legs at walls.
        order: the units that do not turn, in order.
        turning: the units that turn, and how much of the wall each takes; each ends a leg.  The last leg has one only if
            another leg juts out behind it.
    """
    best: LegFit | None = None
    known: dict[tuple[int, tuple[int, int]], tuple[float, list[float]] | None] = {}
    reach = _reaches(rule, frame, order, turning)
    for cuts in _cuts(len(order), len(frame.legs) - 1):
        edges = (0, *cuts, len(order))
        spans = list(itertools.pairwise(edges))
        if not reach.may_fit(spans):
            continue
        legs = [[*order[a:b], *(unit for unit, _ in turning[k : k + 1])] for k, (a, b) in enumerate(spans)]
        cost, widths, bare = 0.0, [], 0.0
        for k, (leg, span) in enumerate(zip(legs, spans, strict=True)):
            if (k, span) not in known:
                known[k, span] = _fit_leg(rule, frame, k, leg, turning[k][1] if k < len(turning) else None)
            fitted = known[k, span]
            if fitted is None or (best is not None and cost + fitted[0] >= best.cost):
                break
            cost += fitted[0]
            widths.append(fitted[1])
            bare += frame.legs[k].high - frame.legs[k].low - rule.joint_m * (len(leg) - 1) - sum(fitted[1])
        else:
            if bare <= rule.most_bare_m + _ROUNDING_M:
                best = LegFit(cost, legs, widths)
    return best


class _Reach(NamedTuple):
    """What tells that a cut fits nowhere: sums of the units' least and greatest widths up to each of them, and each leg's own."""

    least: list[float]
    most: list[float]
    rooms: list[float]
    joint_m: float
    most_bare_m: float

    def may_fit(self, spans: Sequence[tuple[int, int]]) -> bool:
        """Return whether no leg is too short for its units, and the bare wall is not surely too much."""
        bare = 0.0
        for (a, b), room in zip(spans, self.rooms, strict=True):
            left = room - self.joint_m * (b - a)
            if self.least[b] - self.least[a] > left + _NEARLY_M:
                return False
            bare += max(left - (self.most[b] - self.most[a]), 0.0)
        return bare <= self.most_bare_m + _NEARLY_M


def _reaches(rule: UnitRowRule, frame: Frame, order: Sequence[Draft], turning: Sequence[tuple[Draft, float]]) -> _Reach:
    bounds = [bounds_along_m(unit) for unit in order]
    sums = [[0.0, *itertools.accumulate(pair[end] for pair in bounds)] for end in (0, 1)]
    rooms = [
        leg.high - leg.low - sum(width for _, width in turning[k : k + 1]) + rule.joint_m * (1 - len(turning[k : k + 1]))
        for k, leg in enumerate(frame.legs)
    ]
    return _Reach(sums[0], sums[1], rooms, rule.joint_m, rule.most_bare_m)


def _cuts(count: int, turns: int) -> Iterator[tuple[int, ...]]:
    """Yield the numbers of units before each turn; no leg is without a unit that does not turn."""
    if turns == 0:
        yield ()
    elif turns == 1:
        yield from ((k,) for k in range(1, count))
    else:
        yield from ((j, k) for j in range(1, count) for k in range(j + 1, count))


def _fit_leg(rule: UnitRowRule, frame: Frame, k: int, leg: Sequence[Draft], turn_m: float | None) -> tuple[float, list[float]] | None:
    """Return cost and widths of leg ``k``: filled up to its end, or with its units as wide as they were drawn, or as that end asks.

    The last unit turns and takes ``turn_m`` of the wall, unless that is None.
    """
    room = frame.legs[k].high - frame.legs[k].low - rule.joint_m * (len(leg) - 1)
    bounds, wanted = [bounds_along_m(unit) for unit in leg], [along_m(unit) for unit in leg]
    if turn_m is not None:
        bounds[-1], wanted[-1] = (turn_m, turn_m), turn_m
    least, most = sum(low for low, _ in bounds), sum(high for _, high in bounds)
    if least > room:
        return None
    only = len(frame.legs) == 1
    between = not only and 0 < k < len(frame.legs) - 1
    closed = (frame.closed_start and frame.closed_end) if only else frame.closed_start if k == 0 else frame.closed_end
    found: list[tuple[float, list[float]]] = []
    if most >= room - _ROUNDING_M:
        found.append(_stretched(wanted, bounds, room))
    if not between:
        drawn = min(max(sum(wanted), least), most)
        if leaves_gap(closed, room - drawn, rule.end_gap_m):
            drawn = room - rule.end_gap_m
        if least <= drawn <= min(room, most):
            cost, widths = _stretched(wanted, bounds, drawn)
            found.append((cost + rule.bare_cost * (room - drawn), widths))
    return min(found, default=None, key=lambda one: one[0])


def bounds_along_m(unit: Draft) -> tuple[float, float]:
    """Return the least and the most that a unit takes of the wall, metres."""
    width = along_m(unit)
    if unit.rule.in_run is None or not unit.rule.in_run.stretches:
        return width, width
    return unit.rule.low_m[1], unit.rule.high_m[1]


def _stretched(drawn: Sequence[float], bounds: Sequence[tuple[float, float]], length: float) -> tuple[float, list[float]]:
    """Return cost and widths of units that together are ``length`` wide: all scaled by one factor, as far as their bounds let them."""
    widths, free = list(drawn), [low < high for low, high in bounds]
    while any(free):
        # scale the free ones, and hold those at their bounds that would miss them by most
        loose = sum(w for w, f in zip(drawn, free, strict=True) if f)
        factor = (length - sum(w for w, f in zip(widths, free, strict=True) if not f)) / loose
        widths = [d * factor if f else w for d, w, f in zip(drawn, widths, free, strict=True)]
        above = [max(w - high, 0.0) if f else 0.0 for w, f, (_, high) in zip(widths, free, bounds, strict=True)]
        below = [max(low - w, 0.0) if f else 0.0 for w, f, (low, _) in zip(widths, free, bounds, strict=True)]
        worst = above if sum(above) >= sum(below) else below
        if not any(worst):
            break
        widths = [min(max(w, low), high) if miss else w for w, miss, (low, high) in zip(widths, worst, bounds, strict=True)]
        free = [f and not miss for f, miss in zip(free, worst, strict=True)]
    return _STRETCH_COST * sum(math.log(w / d) ** 2 for w, d in zip(widths, drawn, strict=True)), widths
