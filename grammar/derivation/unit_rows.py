"""Unit rows of a derivation: where a row of fitted units begins, in which order its units stand, how wide those are that fill it up.

How a row begins is drawn among some ways that fit, the likelier the less they cost, and units that cost less in each other's places
change these; the chain goes on from there.  Rows that stand free come last.  Grammars call a row ``run``, as kitchen planners do.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import kernel_cache.elementary as el
from grammar.derivation.drafts import Draft
from grammar.derivation.free_rows import Standing, free_slots, juts_clear
from grammar.derivation.hung_rows import hang_rows, hangs_in_row
from grammar.derivation.parse_tree import RejectedError, UnitRowPlan
from grammar.derivation.row_fit import across_m, along_m, fit_legs, order_cost, reach_m, unit_rule
from grammar.derivation.row_walls import (
    ASKEW,
    OFF_WALL,
    Aisle,
    Pose,
    Shell,
    UnitRow,
    box_of,
    boxes_as_wide,
    fronts_of,
    shell_of,
)
from grammar.geometry.arrays import Boxes
from grammar.geometry.boxes import HALF_WIDTH, NO_BOXES, deepest_penetrations
from grammar.geometry.run_slots import MOST_LEGS, Frame, Slot, jutting, unit_poses
from grammar.spec.rules import Grammar
from grammar.spec.run_rules import END, UnitRowRule
from scene_description import Room

_TRIES, _HOPELESS = 60, 24
"""Candidates that are tried at most, and without one that fits."""

_ENOUGH, _ENOUGH_A_UNIT = 12, 5
"""Candidates that are wanted at most, and for each unit of a unit row, and for the choice of its place."""

_LACKING_COST = 6.0
"""Nat for each object that hangs in line and would find no unit to hang above."""

_BEFORE_M = 0.4
"""Free floor before the units of a row that goes past the end of another one, between that and a wall."""

_SQUARE_M = 0.005


class _Candidate(NamedTuple):
    """One way to begin: what it costs (nat), units in order, how many stand in each leg, their widths, slot and poses."""

    cost: float
    units: list[Draft]
    legs: tuple[int, ...]
    widths: list[float]
    slot: Slot
    slide_m: float
    poses: list[Pose]


class _Taken(NamedTuple):
    """What unit rows take: (n, 8) boxes of their units, the same with the aisles before them, and those that stand at walls."""

    units: Boxes
    aisles: tuple[Aisle, ...] = ()
    standing: tuple[Standing, ...] = ()

    def and_row(self, rule: UnitRowRule, shell: Shell, unit_row: _Candidate) -> "_Taken":
        """Return what is taken with a row more."""
        pairs, standing = list(zip(unit_row.units, unit_row.poses, strict=True)), list(self.standing)
        for (unit, pose), width in zip(pairs, unit_row.widths, strict=True):
            if pose[3] != OFF_WALL:
                along = shell.along(pose)
                standing.append(Standing(pose[3], along - 0.5 * width, along + 0.5 * width, rule.wall_gap_m + reach_m(unit)))
        boxes = np.concatenate([self.units, *(box_of(*pair) for pair in pairs)])
        corner_m = rule.aisle_m if rule.corner_aisle_m is None else rule.corner_aisle_m
        aisles = []
        for unit, pose in pairs:
            aside = box_of(unit, pose, corner_m)
            aside[0, HALF_WIDTH] += _BEFORE_M
            aisles.append(Aisle(pose[2], box_of(unit, pose, rule.aisle_m), aside))
        return _Taken(boxes, (*self.aisles, *aisles), tuple(standing))


def place_unit_rows(grammar: Grammar, room: Room, drafts: Sequence[Draft], rng: np.random.Generator) -> tuple[UnitRowPlan, ...]:
    """Give every unit row of a derivation a place to begin at, and its units their widths.

    Raises:
        RejectedError: the room has no place for a row.
    """
    groups = _groups(grammar, drafts)
    if not groups:
        return ()
    shell, taken = shell_of(grammar, room, drafts), _Taken(NO_BOXES)
    begun: list[tuple[UnitRowRule, _Candidate, UnitRow | Sequence[Slot]]] = []
    standing: list[tuple[Draft, Pose]] = []
    in_rows = any(hangs_in_row(draft.rule) for draft in drafts)
    rules = {symbol: _rule(grammar, symbol, rng) for symbol, _ in groups}
    for unit in (unit for units in groups.values() for unit in units):
        if gaps := unit_rule(unit).gaps_m:
            unit.behind_m = gaps[int(rng.integers(len(gaps)))]
    faced = any(rule.free for rule in rules.values())
    for (symbol, _), units in sorted(groups.items(), key=lambda pair: rules[pair[0][0]].free):
        rule = rules[symbol]
        if rule.free:
            chosen, found = _begin_free(symbol, rule, shell, units, taken, rng)
            begun.append((rule, chosen, found))
        else:
            hanging = [draft for draft in drafts if draft.rule.in_line]
            unit_row = _at_walls(symbol, rule, shell, units, taken.aisles)._replace(hanging=hanging)
            chosen = _begin(symbol, unit_row, rng)
            # what an island stands before, and what has a row above it, stays where it is
            chosen = _still(chosen) if in_rows else chosen
            begun.append((rule, chosen, [chosen.slot] if faced or in_rows else unit_row))
        _note(symbol, chosen, shell)
        standing.extend(zip(chosen.units, chosen.poses, strict=True))
        taken = taken.and_row(rule, shell, chosen)
    hang_rows(shell, standing, drafts, rng)
    # the places of a row take long to find, and many a room has none for its last row
    return tuple(_plan(rule, chosen, _places(at, chosen) if isinstance(at, UnitRow) else at) for rule, chosen, at in begun)


def _still(chosen: _Candidate) -> _Candidate:
    """Return a way to begin whose slot leaves no room to shift the row."""
    line = chosen.slot.line(0)
    x, y = line.point(chosen.slot.direction * chosen.slide_m, 0.0)
    return chosen._replace(slot=chosen.slot._replace(x_a=x, y_a=y, slide=0.0), slide_m=0.0)


def _rule(grammar: Grammar, symbol: str, rng: np.random.Generator) -> UnitRowRule:
    rule = grammar.nodes[symbol].run
    assert rule is not None
    if rule.joints_m:
        rule = replace(rule, joint_m=rule.joints_m[int(rng.integers(len(rule.joints_m)))])
    if rule.wall_gaps_m:
        rule = replace(rule, wall_gap_m=rule.wall_gaps_m[int(rng.integers(len(rule.wall_gaps_m)))])
    return rule


def _groups(grammar: Grammar, drafts: Sequence[Draft]) -> Mapping[tuple[str, int], list[Draft]]:
    """Return the units of each row; its key is the symbol and the vertex of its node."""
    groups: dict[tuple[str, int], list[Draft]] = {}
    for draft in drafts:
        if draft.rule.mount == "floor" and draft.pinned is None and not draft.rule.cores:
            for symbol, vertex in draft.units.items():
                if symbol in grammar.nodes and grammar.nodes[symbol].run is not None:
                    groups.setdefault((symbol, vertex), []).append(draft)
                    break
    return groups


def _at_walls(symbol: str, rule: UnitRowRule, shell: Shell, units: Sequence[Draft], taken: tuple[Aisle, ...]) -> UnitRow:
    """Return a unit row at walls.

    Raises:
        RejectedError: it has more legs than a row can have, or no unit behind which a leg could jut out.
    """
    turning, juts = [unit for unit in units if unit_rule(unit).turns], [unit for unit in units if unit_rule(unit).juts]
    if len(turning) >= MOST_LEGS:
        raise RejectedError(f"at most {MOST_LEGS - 1} units that turn in {symbol}")
    if juts and not turning:
        raise RejectedError(f"a unit that turns before those that jut out of {symbol}")
    # the corners of one row are one model, or the smaller one would leave a gap
    for unit in turning[1:]:
        if unit.symbol == turning[0].symbol:
            unit.size_m, unit.drawn_axes = turning[0].size_m, ()
    for unit in turning:
        if juts or abs(unit.size_m[1] - unit.size_m[0]) < _SQUARE_M:
            _set_width(unit, unit.size_m[0])
    return UnitRow(rule, shell, [unit for unit in units if unit not in juts], turning, juts, taken, [])


def _begin(symbol: str, unit_row: UnitRow, rng: np.random.Generator) -> _Candidate:
    """Draw how a unit row at walls begins.

    Raises:
        RejectedError: nothing that was tried fits.
    """
    found = [frame for frame in unit_row.frames(unit_row.taken) if unit_row.fills(frame)]
    candidates: list[_Candidate] = []
    enough = min(_ENOUGH, _ENOUGH_A_UNIT * (len(unit_row.units) + 1))
    for tried in range(_TRIES if found else 0):
        if tried >= _HOPELESS and not candidates:
            break
        candidate = _try(unit_row, found[int(rng.integers(len(found)))], rng)
        if candidate is not None:
            candidates.append(candidate)
            if len(candidates) == enough:
                break
    if not candidates:
        raise RejectedError(f"walls that {symbol} fits at")
    odds = el.exp(min(c.cost for c in candidates) - np.array([c.cost for c in candidates]))
    return _improved(unit_row, candidates[int(rng.choice(len(candidates), p=odds / odds.sum()))], rng)


def _ordered(units: Sequence[Draft], rng: np.random.Generator) -> list[Draft]:
    """Return the units that do not turn in a random order, those that like the end of a unit row at its ends."""
    straight = [unit for unit in units if not unit_rule(unit).turns]
    shuffled = [straight[k] for k in rng.permutation(len(straight))]
    ends = [unit for unit in shuffled if END in (unit_rule(unit).near or ())]
    order = [unit for unit in shuffled if unit not in ends]
    together = rng.random() < 0.5
    for k, unit in enumerate(ends):
        order.insert(0 if together or k % 2 == 0 else len(order), unit)
    return order


def _try(unit_row: UnitRow, frame: Frame, rng: np.random.Generator) -> _Candidate | None:
    """Return how the units fit into a frame in some order, cut into legs in the best way; None if they do not."""
    turning = [(unit, unit.size_m[1] if frame.forward else unit_row.corner_m) for unit in unit_row.turning]
    fit = fit_legs(unit_row.rule, frame, _ordered(unit_row.units, rng), turning)
    if fit is None:
        return None
    places = unit_row.slots(frame, [_length(unit_row.rule, row) for row in fit.widths])
    if not places:
        return None
    slot, walls = places[int(rng.integers(len(places)))], [leg.wall for leg in frame.legs]
    legs, widths = list(fit.legs), list(fit.widths)
    if unit_row.juts:
        legs.append([unit_row.juts[k] for k in rng.permutation(len(unit_row.juts))])
        widths.append([unit.size_m[1] for unit in legs[-1]])
        slot = jutting(slot, len(walls) - 1, _length(unit_row.rule, widths[-2]), unit_row.side_m, unit_row.jut_m, unit_row.rule.wall_gap_m)
        walls.append(OFF_WALL)
    units, flat = [unit for leg in legs for unit in leg], [width for row in widths for width in row]
    counts, slide = tuple(map(len, legs)), slot.slide * rng.random()
    poses = _poses(unit_row.rule, slot, slide, counts, walls, units, flat)
    boxes = boxes_as_wide(units, flat, poses)
    if _barred(unit_row.shell, units, flat, poses, boxes):
        return None
    if unit_row.juts:
        size = unit_row.rule.wall_gap_m + unit_row.jut_m, _length(unit_row.rule, widths[-1])
        own = [box_of(unit, pose) for unit, pose in zip(units[: -counts[-1]], poses, strict=False) if not unit_rule(unit).turns]
        if not _leaves_aisles(unit_row, slot, len(counts) - 1, size, [*(one.ahead for one in unit_row.taken), *own]):
            return None
    return _Candidate(fit.cost + _order_cost(unit_row, units, poses, boxes), units, counts, flat, slot, slide, poses)


def _barred(shell: Shell, units: Sequence[Draft], widths: Sequence[float], poses: Sequence[Pose], boxes: Boxes) -> bool:
    """Return whether a unit stands where it may not.

    That is before a window that must stay free, where a sloped ceiling is too low for it, or before the front of one of another leg.
    """
    if shell.bars(units, boxes):
        return True
    # the legs of a row stand at right angles to each other
    aside = np.array([abs(math.cos(pose[2] - poses[0][2])) < ASKEW for pose in poses], np.int64)
    if not aside.any():
        return False
    opening = [k for k, unit in enumerate(units) if not unit_rule(unit).turns]
    fronts = fronts_of([units[k] for k in opening], [widths[k] for k in opening], [poses[k] for k in opening])
    return bool(deepest_penetrations(fronts, aside[opening], boxes, aside).any())


def _leaves_aisles(unit_row: UnitRow, slot: Slot, leg: int, size: tuple[float, float], standing: Sequence[Boxes]) -> bool:
    obstacles = np.concatenate([unit_row.shell.swings, *standing])
    return juts_clear(unit_row.shell.wall, obstacles, slot, leg, size, unit_row.rule.aisle_m, unit_row.rule.around_m)


def _poses(
    rule: UnitRowRule, slot: Slot, slide: float, legs: Sequence[int], walls: Sequence[int], units: Sequence[Draft], widths: Sequence[float]
) -> list[Pose]:
    sizes = iter([_taken_m(unit, width, slot.direction) for unit, width in zip(units, widths, strict=True)])
    rows = [[next(sizes) for _ in range(count)] for count in legs]
    at = [wall for wall, count in zip(walls, legs, strict=True) for _ in range(count)]
    found = unit_poses(slot, slide, rows, [unit_rule(unit) for unit in units], rule)
    return [(*pose, wall) for pose, wall in zip(found, at, strict=True)]


def _taken_m(unit: Draft, width: float, direction: float) -> tuple[float, float]:
    """Return what a unit takes across its line, as much again behind it as there is, and along it."""
    if unit_rule(unit).turns:
        return (unit.size_m[0], unit.size_m[1]) if direction > 0.0 else (unit.size_m[1], unit.size_m[0])
    return across_m(unit) + 2.0 * unit.behind_m, width


def _order_cost(unit_row: UnitRow, units: Sequence[Draft], poses: Sequence[Pose], boxes: Boxes) -> float:
    """Return what an order costs in nat, and what hangs in line and finds no unit under free wall to hang above."""
    shell = unit_row.shell
    cost = order_cost([(unit.symbol, unit_rule(unit)) for unit in units], shell.windows_met(poses), bool(shell.windows))
    free = [unit.symbol for unit, carries in zip(units, shell.carries(boxes, poses), strict=True) if carries]
    for draft in unit_row.hanging:
        cores = draft.rule.cores or {}
        if not cores.keys() & {unit.symbol for unit in units}:
            continue
        above = next((symbol for symbol in free if symbol in cores), None)
        if above is None:
            cost += _LACKING_COST
        else:
            free.remove(above)
    return cost


def _improved(unit_row: UnitRow, begun: _Candidate, rng: np.random.Generator) -> _Candidate:
    """Return a way to begin in which pairs of units of one leg have changed places, until no such change costs less."""
    best, before = begun, _order_cost(unit_row, begun.units, begun.poses, boxes_as_wide(begun.units, begun.widths, begun.poses))
    leg_of = [leg for leg, count in enumerate(begun.legs) for _ in range(count)]
    walls = [begun.poses[leg_of.index(leg)][3] for leg in range(len(begun.legs))]
    straight = [k for k, unit in enumerate(begun.units) if not unit_rule(unit).turns]
    pairs = [(p, q) for p, q in itertools.combinations(straight, 2) if leg_of[p] == leg_of[q]]
    left = list(pairs)
    while left and before > 0.0:
        p, q = left.pop(int(rng.integers(len(left))))
        units, widths = list(best.units), list(best.widths)
        units[p], units[q], widths[p], widths[q] = units[q], units[p], widths[q], widths[p]
        poses = _poses(unit_row.rule, best.slot, best.slide_m, best.legs, walls, units, widths)
        boxes = boxes_as_wide(units, widths, poses)
        cost = _order_cost(unit_row, units, poses, boxes)
        if cost < before and not _barred(unit_row.shell, units, widths, poses, boxes):
            best, before, left = best._replace(units=units, widths=widths, poses=poses), cost, list(pairs)
    return best


def _begin_free(
    symbol: str, rule: UnitRowRule, shell: Shell, units: Sequence[Draft], taken: _Taken, rng: np.random.Generator
) -> tuple[_Candidate, list[Slot]]:
    """Draw how a unit row that stands free begins, and all its places.

    Raises:
        RejectedError: the room has no floor for it.
    """
    order = [units[k] for k in rng.permutation(len(units))]
    widths = [along_m(unit) for unit in order]
    size = rule.wall_gap_m + max(map(across_m, order)), _length(rule, widths)
    places = free_slots(shell.wall, np.concatenate([shell.swings, taken.units]), taken.standing, size, rule.aisle_m, rule.around_m)
    if not places:
        raise RejectedError(f"floor that {symbol} stands free on")
    slot = places[int(rng.integers(len(places)))]
    slide, counts = slot.slide * rng.random(), (len(order),)
    return _Candidate(0.0, order, counts, widths, slot, slide, _poses(rule, slot, slide, counts, [OFF_WALL], order, widths)), places


def _set_width(unit: Draft, width: float) -> None:
    unit.size_m = unit.size_m[0], width, unit.size_m[2]
    unit.drawn_axes = tuple(axis for axis in unit.drawn_axes if axis != 1)


def _note(symbol: str, chosen: _Candidate, shell: Shell) -> None:
    """Give the units their widths, write down the unit row that they are in, and tell what may hang above them."""
    carry = shell.carries(boxes_as_wide(chosen.units, chosen.widths, chosen.poses), chosen.poses)
    for k, (unit, width) in enumerate(zip(chosen.units, chosen.widths, strict=True)):
        if width != along_m(unit) and not unit_rule(unit).turns:
            _set_width(unit, width)
        unit.beside = tuple(other.id for other in (*chosen.units[max(k - 1, 0) : k], *chosen.units[k + 1 : k + 2]))
        unit.note("place_in_run", f"{symbol} {k}", 0.0)
        unit.carries = carry[k]


def _places(unit_row: UnitRow, chosen: _Candidate) -> list[Slot]:
    """Return all places that the legs of a unit row fit in, walls that are free of doors and windows alike."""
    widths = iter(chosen.widths)
    lengths = [_length(unit_row.rule, list(itertools.islice(widths, count))) for count in chosen.legs]
    at_walls = lengths[:-1] if unit_row.juts else lengths
    found = [
        slot
        for frame in unit_row.frames(())
        if unit_row.is_square or (chosen.slot.direction > 0.0) == frame.forward
        for slot in unit_row.slots(frame, at_walls)
    ]
    if unit_row.juts:
        leg, size = len(at_walls) - 1, (unit_row.rule.wall_gap_m + unit_row.jut_m, lengths[-1])
        found = [jutting(slot, leg, at_walls[-1], unit_row.side_m, unit_row.jut_m, unit_row.rule.wall_gap_m) for slot in found]
        found = [slot for slot in found if _leaves_aisles(unit_row, slot, leg + 1, size, [])]
    return found


def _plan(rule: UnitRowRule, chosen: _Candidate, places: Sequence[Slot]) -> UnitRowPlan:
    """Return a unit row with all its places."""
    found = [*places] if chosen.slot in places else [*places, chosen.slot]
    return UnitRowPlan(
        units=tuple(unit.id for unit in chosen.units),
        legs=chosen.legs,
        wall_gap_m=rule.wall_gap_m,
        joint_m=rule.joint_m,
        line_cost=rule.line_cost,
        slots=tuple(found),
        slot=found.index(chosen.slot),
        slide_m=chosen.slide_m,
    )


def _length(rule: UnitRowRule, widths: Sequence[float]) -> float:
    """Return how long a leg is, the joints between its units included."""
    return sum(widths) + rule.joint_m * (len(widths) - 1)
