"""What rooms say about unit rows: how far the backs of their units stand off the wall and apart, and how high worktops are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

import numpy as np

from grammar.learning.assign import AssignedRoom
from grammar.learning.observed import fitting_gap, fitting_wall, half_extents, relative_pose
from grammar.learning.sizes import Size, is_norm
from grammar.spec.object_rules import ObjectRule
from grammar.spec.rules import Grammar, Node
from grammar.spec.run_rules import RowUnit

_LEAST, _MOST, _AT_WALL_M, _JOINT_M, _STRAIGHT_RAD = 5, 24, 0.1, 0.03, 0.1
_HEIGHT = 2


def learn_unit_rows(grammar: Grammar, rooms: Sequence[AssignedRoom], counts: dict[str, float]) -> Grammar:
    """Return the grammar whose units stand as far off their walls and apart as those of the rooms.

    Units of few observations take the gaps of all units.  ``counts`` is given the numbers of units behind each node.
    """
    unit_rows = {name: node.run for name, node in grammar.nodes.items() if node.run is not None and not node.run.free}
    units = {symbol for name in unit_rows for symbol in _below(grammar.nodes, name) if _is_unit(grammar.objects.get(symbol))}
    gaps = {symbol: [fitting_gap(gap) for room in rooms for gap in _gaps(room, symbol)] for symbol in sorted(units)}
    every = [gap for found in gaps.values() for gap in found]
    if len(every) < _LEAST:
        return grammar
    nodes, objects = dict(grammar.nodes), dict(grammar.objects)
    apart = [joint for room in rooms for joint in _joints(room, units)]
    joints = _quantiles(apart) if len(apart) >= _LEAST else ()
    for name, wall_row in unit_rows.items():
        nodes[name] = replace(nodes[name], run=replace(wall_row, wall_gap_m=0.0, joints_m=joints))
        counts.setdefault(f"nodes.{name}", float(len(every)))
    for symbol, found in gaps.items():
        unit = objects[symbol].in_run or RowUnit()
        if not unit.turns and not unit.juts:
            objects[symbol] = replace(objects[symbol], in_run=replace(unit, gaps_m=_quantiles(found if len(found) >= _LEAST else every)))
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


def _gaps(room: AssignedRoom, symbol: str) -> Iterator[float]:
    for item in room.objects:
        pose = fitting_wall(room.room.polygon_m, item.seen) if item.symbol == symbol else None
        if pose is not None and abs(pose.gap_m) < _AT_WALL_M:
            yield pose.gap_m


def _joints(room: AssignedRoom, units: AbstractSet[str]) -> Iterator[float]:
    """Yield the gaps in metres between units that stand side by side, each pair once."""
    found = [item.seen for item in room.objects if item.symbol in units]
    for k, item in enumerate(found):
        for other in found[:k]:
            place = relative_pose(other, item)
            half_d, half_w = half_extents(other.size_m, place.turn_rad)
            gap = abs(place.y_m) - half_w - 0.5 * item.size_m[1]
            if abs(place.turn_rad) < _STRAIGHT_RAD and abs(place.x_m) < half_d and abs(gap) < _JOINT_M:
                yield abs(gap)


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
