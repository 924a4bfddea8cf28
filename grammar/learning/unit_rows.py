"""What rooms say about unit rows: how far their units stand off the wall and apart, which of them side by side, how high worktops are."""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np

from grammar.derivation.hung_rows import hangs_in_row
from grammar.learning.assign import AssignedObject, AssignedRoom
from grammar.learning.observed import box_gap, fitting_gap, fitting_wall, half_extents, relative_pose
from grammar.learning.sizes import Size, is_norm
from grammar.spec.object_rules import ObjectRule
from grammar.spec.rules import Grammar, Node
from grammar.spec.run_rules import HANGING_LOW_M, RowUnit

_LEAST, _MOST, _AT_WALL_M, _JOINT_M, _STRAIGHT_RAD = 5, 24, 0.1, 0.03, 0.1
_HEIGHT = 2
_LEAST_COST, _MOST_CHANCE = 0.05, 0.95


def learn_unit_rows(grammar: Grammar, rooms: Sequence[AssignedRoom], counts: dict[str, float], alpha: float) -> Grammar:
    """Return the grammar whose units stand as far off their walls and apart as those of the rooms, and side by side as often.

    The least gap of the units at a wall is that of the run, what a unit stands further off is its own; units of few observations take those
    of all units.  ``counts`` is given the numbers of units behind each node; ``alpha`` pseudo-counts say that units stand beside each other
    by chance.
    """
    unit_rows = {name: node.run for name, node in grammar.nodes.items() if node.run is not None and not node.run.free}
    units = {symbol for name in unit_rows for symbol in _below(grammar.nodes, name) if _is_unit(grammar.objects.get(symbol))}
    standing = [[item for item in room.objects if item.symbol in units] for room in rooms]
    at_walls = [gaps for room, items in zip(rooms, standing, strict=True) for gaps in _gaps(room, items)]
    every = [gap - min(gap for _, gap in gaps) for gaps in at_walls for _, gap in gaps]
    if len(every) < _LEAST:
        return grammar
    own = defaultdict(list)
    for gaps in at_walls:
        least = min(gap for _, gap in gaps)
        for symbol, gap in gaps:
            own[symbol].append(gap - least)
    nodes, objects = dict(grammar.nodes), dict(grammar.objects)
    apart = [joint for items in standing for joint in _joints(items)]
    joints = _quantiles(apart) if len(apart) >= _LEAST else ()
    wall_gaps = _quantiles([min(gap for _, gap in gaps) for gaps in at_walls])
    for name, wall_row in unit_rows.items():
        nodes[name] = replace(nodes[name], run=replace(wall_row, wall_gap_m=0.0, wall_gaps_m=wall_gaps, joints_m=joints))
        counts.setdefault(f"nodes.{name}", float(len(every)))
    wishes = _wishes(standing, alpha)
    for symbol in sorted(units):
        unit = _ordered(objects[symbol].in_run or RowUnit(), wishes.get(symbol, {}))
        if not unit.turns and not unit.juts:
            unit = replace(unit, gaps_m=_quantiles(own[symbol] if len(own[symbol]) >= _LEAST else every))
        objects[symbol] = replace(objects[symbol], in_run=unit)
    for symbol, rule in grammar.objects.items():
        tall = list(_hung_beside_tall(rooms, units, symbol)) if hangs_in_row(rule) else []
        if len(tall) >= _LEAST:
            objects[symbol] = replace(objects[symbol], beside_tall=round(sum(tall) / len(tall), 3))
    return replace(grammar, nodes=nodes, objects=objects)


def _is_unit(rule: ObjectRule | None) -> bool:
    return rule is not None and rule.mount == "floor" and not rule.cores


def _quantiles(gaps: Sequence[float]) -> tuple[float, ...]:
    """Return at most 24 lengths, to the millimetre, that are as often as short as those given."""
    count = min(len(gaps), _MOST)
    return tuple(round(float(gap), 3) for gap in np.quantile(gaps, (np.arange(count) + 0.5) / count))


def _below(nodes: Mapping[str, Node], name: str) -> Iterator[str]:
    """Yield the symbols below a node."""
    for branch in nodes[name].branches:
        yield branch.symbol
        if branch.symbol in nodes:
            yield from _below(nodes, branch.symbol)


def _gaps(room: AssignedRoom, items: Sequence[AssignedObject]) -> Iterator[list[tuple[str, float]]]:
    """Yield for each wall the symbols of the units at it, and how far their backs are off it."""
    found = defaultdict(list)
    for item in items:
        pose = fitting_wall(room.room.polygon_m, item.seen)
        if pose is not None and abs(pose.gap_m) < _AT_WALL_M:
            found[pose.wall].append((item.symbol, fitting_gap(pose.gap_m)))
    yield from found.values()


def _joints(items: Sequence[AssignedObject]) -> Iterator[float]:
    """Yield the gaps in metres between units that stand side by side, each pair once."""
    for k, item in enumerate(items):
        for other in items[:k]:
            place = relative_pose(other.seen, item.seen)
            half_d, half_w = half_extents(other.seen.size_m, place.turn_rad)
            gap = abs(place.y_m) - half_w - 0.5 * item.seen.size_m[1]
            if abs(place.turn_rad) < _STRAIGHT_RAD and abs(place.x_m) < half_d and abs(gap) < _JOINT_M:
                yield abs(gap)


def _wishes(standing: Sequence[Sequence[AssignedObject]], alpha: float) -> dict[str, dict[str, float]]:
    """Return for each symbol what other symbols of its row cost beside it, nat; below zero where they are there more often than by chance.

    That is by how much the logarithm of the odds of a pair to be side by side is below that by chance; either unit bears half of it.
    """
    seen: dict[tuple[str, str], list[tuple[bool, float]]] = defaultdict(list)
    for items in standing:
        beside = [[j for j in range(len(items)) if j != k and box_gap(items[j].seen, item.seen) < _JOINT_M] for k, item in enumerate(items)]
        share = sum(map(len, beside)) / max(len(items) * (len(items) - 1), 1)
        for k, item in enumerate(items):
            others = [other.symbol for j, other in enumerate(items) if j != k]
            met = {items[j].symbol for j in beside[k]}
            for symbol in sorted(set(others) - {item.symbol}):
                seen[item.symbol, symbol].append((symbol in met, min(others.count(symbol) * share, _MOST_CHANCE)))
    wishes: dict[str, dict[str, float]] = defaultdict(dict)
    for (symbol, other), found in seen.items():
        chance = sum(odds for _, odds in found) / len(found)
        if len(found) >= _LEAST and chance > 0.0:
            often = (sum(met for met, _ in found) + alpha * chance) / (len(found) + alpha)
            wishes[symbol][other] = -0.5 * (math.log(often / (1.0 - often)) - math.log(chance / (1.0 - chance)))
    return wishes


def _ordered(unit: RowUnit, wishes: Mapping[str, float]) -> RowUnit:
    """Return a unit that wishes for what it is seen beside; of symbols that it is seldom seen with it keeps its own wishes."""
    kept = [{name: cost for name, cost in (costs or {}).items() if name not in wishes} for costs in (unit.near, unit.apart)]
    for side, sign in zip(kept, (-1.0, 1.0), strict=True):
        side.update({name: round(sign * cost, 2) for name, cost in sorted(wishes.items()) if sign * cost >= _LEAST_COST})
    return replace(unit, near=kept[0] or None, apart=kept[1] or None)


def _hung_beside_tall(rooms: Sequence[AssignedRoom], units: AbstractSet[str], symbol: str) -> Iterator[bool]:
    """Yield for each tall unit of a room where something of a symbol hangs whether one of these is beside it."""
    for room in rooms:
        hung = [item.seen for item in room.objects if item.symbol == symbol]
        for item in room.objects:
            if hung and item.symbol in units and item.seen.size_m[2] > HANGING_LOW_M:
                yield min(box_gap(other, item.seen) for other in hung) < _JOINT_M


def with_even_heights(before: Mapping[str, ObjectRule], learned: Mapping[str, ObjectRule]) -> dict[str, ObjectRule]:
    """Return learned rules where what no room shows has the height that those of the same height in the base were found to have.

    Worktops are even: a peninsula's units are as high as the counters beside them.
    """
    found: dict[tuple[float, float], ObjectRule] = {}
    for symbol, rule in before.items():
        key = rule.low_m[_HEIGHT], rule.high_m[_HEIGHT]
        if is_norm(*key) and learned[symbol].low_m[_HEIGHT] != key[0]:
            found.setdefault(key, learned[symbol])
    rules = dict(learned)
    for symbol, rule in before.items():
        model = found.get((rule.low_m[_HEIGHT], rule.high_m[_HEIGHT]))
        if model is not None and rule.sizes == learned[symbol].sizes:
            height = max(model.sizes, key=lambda mode: mode.probability).mean_m[_HEIGHT]
            off = height - rule.sizes[0].mean_m[_HEIGHT]
            rules[symbol] = replace(
                learned[symbol],
                sizes=tuple(replace(mode, mean_m=_raised(mode.mean_m, off)) for mode in rule.sizes),
                low_m=_raised(rule.low_m, off),
                high_m=_raised(rule.high_m, off),
            )
    return rules


def _raised(size_m: Size, by_m: float) -> Size:
    return size_m[0], size_m[1], size_m[2] + by_m
