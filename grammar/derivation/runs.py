"""Runs of a derivation: which walls a run takes, in which order its units begin, and how wide those are that fill it up to the wall's end.

The order in which a run begins is drawn among some that fit, the likelier the less they cost; the chain goes on from there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from grammar.derivation.drafts import Draft, attribute_node
from grammar.derivation.openings import Attribute
from grammar.derivation.parse_tree import RunPlan
from grammar.derivation.rejection import RejectedError
from grammar.derivation.run_fit import fit_legs
from grammar.derivation.run_units import across_m, along_m, least_along_m, unit_rule
from grammar.geometry.arrays import Boxes, Floats
from grammar.geometry.boxes import HALF_WIDTH, Z_LOW, penetration
from grammar.geometry.run_slots import MOST_LEGS, Frame, Slot, frames, slots, unit_poses
from grammar.geometry.wall_spans import Span, free_spans, outlines, spans_of
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, START_X, START_Y, WALL_YAW, wall_rows
from grammar.geometry.zones import FACE, SWING, VIEW, opening_frame, opening_zones, placed_zones
from grammar.spec.rules import Grammar
from grammar.spec.run_rules import CORNER_UNIT, END, SIDE_WINDOW, WINDOW, RunRule, RunUnit
from scene_description import Room

_TRIES = 3
"""Candidates that are tried for each that is wanted."""

_ENOUGH, _ENOUGH_A_UNIT = 40, 5
"""Candidates that are wanted at most, and for each unit of a run, and for the choice of its place."""

_BEFORE_M = 0.4
"""Free floor before the units of a run that goes past the end of another one, between that and a wall."""

_ROUNDING_M = 1e-9
_ASKEW = 0.5
"""Greatest cosine of the angle between walls that are not opposite each other or in line."""

Pose = tuple[float, float, float, int]


class _Shell(NamedTuple):
    """The room as runs see it: walls, (n, 8) boxes that doors, windows, and windows' frames keep free, and windows by wall and stretch."""

    room: Room
    wall: Floats
    swings: Boxes
    views: Boxes
    faces: Boxes
    windows: tuple[tuple[int, float, float], ...]


class _Taken(NamedTuple):
    """What a unit that stands already takes, (1, 8) world boxes: for units opposite it, and for those at walls at an angle to its own."""

    yaw_rad: float
    ahead: Boxes
    aside: Boxes


class _Candidate(NamedTuple):
    """One way to begin: what it costs (nat), units in order, how many stand in each leg, their widths, slot and poses."""

    cost: float
    units: list[Draft]
    legs: tuple[int, ...]
    widths: list[float]
    frame: Frame
    slot: Slot
    slide_m: float
    poses: list[Pose]


def place_runs(grammar: Grammar, room: Room, drafts: Sequence[Draft], rng: np.random.Generator) -> tuple[RunPlan, ...]:
    """Give every run of a derivation a place to begin at, and its units their widths.

    Raises:
        RejectedError: the room has no place for a run.
    """
    groups = _groups(grammar, drafts)
    if not groups:
        return ()
    shell, plans, taken = _shell(grammar, room), [], list[_Taken]()
    for (symbol, _), units in groups.items():
        rule = grammar.nodes[symbol].run
        assert rule is not None
        chosen = _begin(symbol, rule, shell, units, taken, rng)
        corner_m = rule.aisle_m if rule.corner_aisle_m is None else rule.corner_aisle_m
        for unit, pose in zip(chosen.units, chosen.poses, strict=True):
            aside = _box(unit, pose, corner_m)
            aside[0, HALF_WIDTH] += _BEFORE_M
            taken.append(_Taken(pose[2], _box(unit, pose, rule.aisle_m), aside))
        _note(symbol, chosen, shell)
        plans.append(_plan(rule, shell, chosen))
    return tuple(plans)


def _groups(grammar: Grammar, drafts: Sequence[Draft]) -> Mapping[tuple[str, int], list[Draft]]:
    """Return the units of each run; its key is the symbol and the vertex of its node."""
    groups: dict[tuple[str, int], list[Draft]] = {}
    for draft in drafts:
        if draft.rule.mount == "floor" and draft.pinned is None:
            for symbol, vertex in draft.units.items():
                if symbol in grammar.nodes and grammar.nodes[symbol].run is not None:
                    groups.setdefault((symbol, vertex), []).append(draft)
                    break
    return groups


def _shell(grammar: Grammar, room: Room) -> _Shell:
    found: dict[int, list[Boxes]] = {SWING: [], VIEW: [], FACE: []}
    for opening in room.openings:
        x, y, yaw = opening_frame(room, opening)
        for zone in opening_zones(opening, grammar.openings[opening.category]):
            found[zone.kind].append(placed_zones([zone], x, y, opening.sill_m, yaw))
    boxes = {kind: np.concatenate([np.zeros((0, 8)), *rows]) for kind, rows in found.items()}
    windows = tuple((o.wall, o.offset_m, o.offset_m + o.width_m) for o in room.openings if o.category == "window")
    return _Shell(room, wall_rows(room.polygon_m), boxes[SWING], boxes[VIEW], boxes[FACE], windows)


def _box(unit: Draft, pose: Pose, before_m: float = 0.0) -> Boxes:
    """Return the (1, 8) world box of a unit, ``before_m`` deeper to its front."""
    x, y, yaw, _ = pose
    c, s = math.cos(yaw), math.sin(yaw)
    depth, width, height = unit.size_m
    middle = 0.5 * before_m
    return np.array([[x + middle * c, y + middle * s, 0.0, height, 0.5 * depth + middle, 0.5 * width, c, s]])


def _begin(
    symbol: str, rule: RunRule, shell: _Shell, units: Sequence[Draft], taken: Sequence[_Taken], rng: np.random.Generator
) -> _Candidate:
    """Draw how a run begins.

    Raises:
        RejectedError: nothing that was tried fits.
    """
    turning = [unit for unit in units if unit_rule(unit).turns]
    if len(turning) >= MOST_LEGS:
        raise RejectedError(f"at most {MOST_LEGS - 1} units that turn in {symbol}")
    for unit in turning:
        _set_width(unit, unit.size_m[0])
    depth = rule.wall_gap_m + max(map(across_m, units))
    spans = _spans(shell, _openings(rule, shell, units), taken, depth)
    corner_m = max((unit.size_m[0] for unit in turning), default=0.0)
    least_m = sum(map(least_along_m, units)) - _ROUNDING_M
    found = [
        frame
        for frame in frames(shell.wall, spans, len(turning) + 1, corner_m, rule.wall_gap_m)
        if sum(leg.high - leg.low for leg in frame.legs) >= least_m
        and (len(frame.legs) < MOST_LEGS or shell.wall[frame.legs[1].wall, LENGTH] >= 2.0 * depth + rule.aisle_m)
    ]
    candidates: list[_Candidate] = []
    enough = min(_ENOUGH, _ENOUGH_A_UNIT * (len(units) + 1))
    for _ in range(_TRIES * enough if found else 0):
        candidate = _try(rule, shell, found[int(rng.integers(len(found)))], _ordered(units, rng), turning, rng)
        if candidate is not None:
            candidates.append(candidate)
            if len(candidates) == enough:
                break
    if not candidates:
        raise RejectedError(f"walls that {symbol} fits at")
    odds = np.exp(min(c.cost for c in candidates) - np.array([c.cost for c in candidates]))
    return candidates[int(rng.choice(len(candidates), p=odds / odds.sum()))]


def _openings(rule: RunRule, shell: _Shell, units: Sequence[Draft]) -> Boxes:
    """Return the boxes (n, 8) of doors and windows whose walls a run keeps free."""
    windows = shell.views
    if rule.window_gap_m is None:
        windows = windows[windows[:, Z_LOW] < min(unit.size_m[2] for unit in units)]
    else:
        windows = windows.copy()
        windows[:, HALF_WIDTH] += rule.window_gap_m
    return np.concatenate([shell.swings, windows])


def _spans(shell: _Shell, openings: Boxes, taken: Sequence[_Taken], depth_m: float) -> list[list[Span]]:
    """Return the stretches of each wall that openings and the runs that stand already leave free."""
    spans = []
    for w, row in enumerate(shell.wall):
        boxes = [one.aside if abs(math.cos(one.yaw_rad - row[WALL_YAW])) < _ASKEW else one.ahead for one in taken]
        spans.append(spans_of(shell.wall, w, outlines(np.concatenate([openings, *boxes])), depth_m))
    return spans


def _ordered(units: Sequence[Draft], rng: np.random.Generator) -> list[Draft]:
    """Return the units that do not turn in a random order, those that like the end of a run at its ends."""
    straight = [unit for unit in units if not unit_rule(unit).turns]
    shuffled = [straight[k] for k in rng.permutation(len(straight))]
    ends = [unit for unit in shuffled if END in (unit_rule(unit).near or ())]
    order = [unit for unit in shuffled if unit not in ends]
    together = rng.random() < 0.5
    for k, unit in enumerate(ends):
        order.insert(0 if together or k % 2 == 0 else len(order), unit)
    return order


def _try(
    rule: RunRule, shell: _Shell, frame: Frame, order: list[Draft], turning: Sequence[Draft], rng: np.random.Generator
) -> _Candidate | None:
    """Return how the units fit into a frame in an order, cut into legs in the best way; None if they do not."""
    fit = fit_legs(rule, frame, order, turning)
    if fit is None:
        return None
    cost, legs, widths = fit.cost, fit.legs, fit.widths
    units = [unit for leg in legs for unit in leg]
    sizes = [[(across_m(unit), width) for unit, width in zip(leg, row, strict=True)] for leg, row in zip(legs, widths, strict=True)]
    places = slots(
        shell.wall, frame, [sum(row) + rule.joint_m * (len(row) - 1) for row in widths], rule.end_gap_m, rule.flush, rule.ends_free
    )
    if not places:
        return None
    slot = places[int(rng.integers(len(places)))]
    slide = slot.slide * rng.random()
    poses = unit_poses(shell.wall, slot, slide, sizes, [unit_rule(unit) for unit in units], rule)
    flat = [width for row in widths for width in row]
    for unit, width, pose in zip(units, flat, poses, strict=True):
        box = _box(unit, pose)
        if unit_rule(unit).stretches:
            box[0, 5] = 0.5 * width
        if any(penetration(box, 0, shell.views, k) > 0.0 for k in range(len(shell.views))):
            return None
    cost += order_cost([(unit.symbol, unit_rule(unit)) for unit in units], _windows_met(shell, poses), bool(shell.windows))
    return _Candidate(cost, units, tuple(map(len, legs)), flat, frame, slot, slide, poses)


def _windows_met(shell: _Shell, poses: Sequence[Pose]) -> list[frozenset[str]]:
    """Return for each unit whether its middle is below a window of its wall, and whether a wall at an angle to its own has one."""

    def along(pose: Pose) -> float:
        row = shell.wall[pose[3]]
        return float((pose[0] - row[START_X]) * row[ALONG_X] + (pose[1] - row[START_Y]) * row[ALONG_Y])

    found = []
    for pose in poses:
        below = any(w == pose[3] and low <= along(pose) <= high for w, low, high in shell.windows)
        aside = any(abs(math.cos(pose[2] - shell.wall[w, WALL_YAW])) < _ASKEW for w, _, _ in shell.windows)
        found.append(frozenset(name for name, met in ((WINDOW, below), (SIDE_WINDOW, aside)) if met))
    return found


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


def _set_width(unit: Draft, width: float) -> None:
    unit.size_m = unit.size_m[0], width, unit.size_m[2]
    unit.drawn_axes = tuple(axis for axis in unit.drawn_axes if axis != 1)


def _note(symbol: str, chosen: _Candidate, shell: _Shell) -> None:
    """Give the units their widths, write down the run that they are in, and tell what may hang above them."""
    for k, (unit, width, pose) in enumerate(zip(chosen.units, chosen.widths, chosen.poses, strict=True)):
        if width != along_m(unit):
            _set_width(unit, width)
        unit.beside = tuple(other.id for other in (*chosen.units[max(k - 1, 0) : k], *chosen.units[k + 1 : k + 2]))
        unit.below.append(attribute_node(Attribute("place_in_run", f"{symbol} {k}", 0.0), unit.id))
        above = _box(unit, pose)
        above[0, 2:4] = unit.size_m[2], shell.room.height_m
        unit.carries = not any(penetration(above, 0, shell.faces, n) > 0.0 for n in range(len(shell.faces)))


def _plan(rule: RunRule, shell: _Shell, chosen: _Candidate) -> RunPlan:
    """Return the run with all places that its legs fit in, walls that are free of doors and windows alike."""
    depth = rule.wall_gap_m + max(map(across_m, chosen.units))
    spans = free_spans(shell.room.polygon_m, _openings(rule, shell, chosen.units), depth)
    corner_m = max((unit.size_m[0] for unit in chosen.units if unit_rule(unit).turns), default=0.0)
    lengths = list(_leg_lengths(chosen, rule.joint_m))
    found = [
        slot
        for frame in frames(shell.wall, spans, len(chosen.legs), corner_m, rule.wall_gap_m)
        for slot in slots(shell.wall, frame, lengths, rule.end_gap_m, rule.flush, rule.ends_free)
    ]
    if chosen.slot not in found:
        found.append(chosen.slot)
    return RunPlan(
        units=tuple(unit.id for unit in chosen.units),
        legs=chosen.legs,
        wall_gap_m=rule.wall_gap_m,
        joint_m=rule.joint_m,
        line_cost=rule.line_cost,
        slots=tuple(found),
        slot=found.index(chosen.slot),
        slide_m=chosen.slide_m,
    )


def _leg_lengths(chosen: _Candidate, joint_m: float) -> Iterator[float]:
    first = 0
    for count in chosen.legs:
        yield sum(chosen.widths[first : first + count]) + joint_m * (count - 1)
        first += count
