"""Doors and windows of observed rooms: their numbers, sizes, sills, and places along their walls."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from grammar.geometry.arrays import Bools, Floats
from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, NORMAL_X, NORMAL_Y, START_X, START_Y, wall_lengths, wall_rows
from grammar.learning.door_space import learn_door_space
from grammar.learning.observed import ObservedOpening, ObservedRoom, filled_outline, without_steps
from grammar.spec.object_rules import ObjectRule, Tie
from grammar.spec.room_rules import OpeningRule
from grammar.spec.values import TruncatedNormal

_START, _ALONG, _NORMAL = [START_X, START_Y], [ALONG_X, ALONG_Y], [NORMAL_X, NORMAL_Y]
_NEAR_CORNER_M = 0.5
_LEAST_NEAR = 5
_NICHE_M = 0.5
_ONE_SIZE_M = 0.005
_LEAST_SD_M = 0.005
_TAILS = (0.05, 0.95)
_FEW = 3
"""So many openings have space in any room; of rooms with more is learned how long their walls are."""
_POWERS = np.linspace(0.0, 1.5, 16)


def learn_openings(
    base: Mapping[str, OpeningRule], rooms: Sequence[ObservedRoom], alpha: float, least: int
) -> tuple[dict[str, OpeningRule], dict[str, int]]:
    """Learn the rules of doors and windows.

    A kind's number is learned where rooms differ in it: a source that lists one door in every room lists the door that the room was
    recorded with.  Rooms without a door are left out of the number of doors.

    ``alpha``: pseudo-counts of the base's numbers; ``least``: openings below which sizes and places stay.

    Returns:
        the rules, and for each learned field, ``kind.field``, how many observations made it.
    """
    rules, counts = dict(base), {}
    for kind, rule in base.items():
        known = [room for room in rooms if kind in room.openings]
        numbers = [len(room.openings[kind]) for room in known if room.openings[kind] or kind != "door"]
        if len(numbers) >= least and (kind != "door" or set(numbers) != {1}):
            rule = replace(rule, multiplicity=_multiplicity(rule.multiplicity, numbers, alpha))
            counts[f"{kind}.multiplicity"] = len(numbers)
            if len(rule.multiplicity) > _FEW + 1:
                rule = replace(rule, wall_m=_wall_m(known, kind), length_power=_length_power(known, kind))
                counts |= {f"{kind}.wall_m": len(numbers), f"{kind}.length_power": len(numbers)}
        seen = [(room, opening) for room in known for opening in room.openings[kind]]
        if len(seen) >= least:
            learned = {**_sized(rule, [opening for _, opening in seen]), **_placed(rule, seen)}
            learned |= learn_door_space(rule, seen) if kind == "door" else {}
            rule = replace(rule, **learned)  # type: ignore[arg-type]
            counts |= {f"{kind}.{name}": len(seen) for name in learned}
        rules[kind] = rule
    return rules, counts


def fitted_to_openings(objects: Mapping[str, ObjectRule], openings: Mapping[str, OpeningRule]) -> dict[str, ObjectRule]:
    """Return the rules of objects where what follows the size of an opening, as curtains do, has bounds as wide as that asks for."""
    return {symbol: _fitted(rule, openings) for symbol, rule in objects.items()}


def _fitted(rule: ObjectRule, openings: Mapping[str, OpeningRule]) -> ObjectRule:
    low, high = list(rule.low_m), list(rule.high_m)
    for tie in rule.tied:
        if tie.to not in openings:
            continue
        ends = sorted(tie.factor * value for value in _range_m(tie, openings[tie.to]))
        least, most = ends[0] + tie.add_m - tie.sd_m, ends[1] + tie.add_m + tie.sd_m
        if tie.axis == "middle":
            centre = rule.centre_height_m
            if centre is not None:
                rule = replace(rule, centre_height_m=replace(centre, low=max(min(centre.low, least), 0.0), high=max(centre.high, most)))
        else:
            axis = ("depth", "width", "height").index(tie.axis)
            low[axis], high[axis] = max(min(low[axis], least), 0.1 * low[axis]), max(high[axis], most)
    return replace(rule, low_m=(low[0], low[1], low[2]), high_m=(high[0], high[1], high[2]))


def _range_m(tie: Tie, opening: OpeningRule) -> tuple[float, float]:
    """Return the least and the greatest measure of an opening that a tie may follow."""
    sides = {"width": opening.width_m, "height": opening.height_m, "bottom": opening.sill_m}
    if tie.of == "top":
        return opening.sill_m.low + opening.height_m.low, opening.sill_m.high + opening.height_m.high
    return (sides[tie.of].low, sides[tie.of].high) if tie.of in sides else (0.0, 0.0)


def _multiplicity(base: Sequence[float], numbers: Sequence[int], alpha: float) -> tuple[float, ...]:
    counted, most = Counter(numbers), max(max(numbers) + 1, len(base))
    prior = [*base, *(0.0 for _ in range(most - len(base)))]
    return tuple((counted[k] + alpha * prior[k]) / (len(numbers) + alpha) for k in range(min(most, 16)))


def _wall_m(rooms: Sequence[ObservedRoom], kind: str) -> float:
    """Return how much wall each opening of a room has at least, metres."""
    numbers = [(len(room.openings[kind]), sum(wall_lengths(filled_outline(room.polygon_m)))) for room in rooms]
    return min(length / number for number, length in numbers if number)


def _length_power(rooms: Sequence[ObservedRoom], kind: str) -> float:
    """Return the power of the walls' lengths under which the walls that openings lie in are likeliest."""
    drawn = [
        (np.log(lengths[fits]), int(fits[:wall].sum())) for room in rooms for wall, lengths, fits in _walls_with(room, kind) if fits[wall]
    ]
    likelihoods = [sum(power * logs[wall] - np.log(np.exp(power * logs).sum()) for logs, wall in drawn) for power in _POWERS]
    return float(_POWERS[int(np.argmax(likelihoods))])


def _walls_with(room: ObservedRoom, kind: str) -> Iterator[tuple[int, Floats, Bools]]:
    """Yield the wall of each opening in the outline without niches, the walls' lengths in metres, and which of them have space for it."""
    rows, own = wall_rows(without_steps(room.polygon_m)), wall_rows(room.polygon_m)
    for opening in room.openings[kind]:
        middle = own[opening.wall, _START] + (opening.offset_m + 0.5 * opening.width_m) * own[opening.wall, _ALONG]
        delta = middle - rows[:, :2]
        along = (delta * rows[:, _ALONG]).sum(1)
        off = np.abs((delta * rows[:, _NORMAL]).sum(1)) + np.maximum(
            0.0, np.maximum(-along, along - rows[:, LENGTH]) + 0.5 * opening.width_m
        )
        yield int(np.argmin(off)), rows[:, LENGTH], rows[:, LENGTH] >= opening.width_m


def _sized(rule: OpeningRule, seen: Sequence[ObservedOpening]) -> dict[str, TruncatedNormal]:
    """Return the distributions of the sides that differ among the openings; one size throughout shows a source with a single model."""
    sides = {"width_m": [item.width_m for item in seen], "height_m": [item.height_m for item in seen]}
    if rule.sill_m.high > 0.0:
        sides["sill_m"] = [item.sill_m for item in seen]
    return {name: _normal(values, 0.0) for name, values in sides.items() if float(np.std(values)) > _ONE_SIZE_M}


def _placed(rule: OpeningRule, seen: Sequence[tuple[ObservedRoom, ObservedOpening]]) -> dict[str, float | TruncatedNormal]:
    """Return the share of openings near a corner of the room, beyond those that are there by chance, and how near they are."""
    gaps = [gap for room, opening in seen if (gap := _end_gap(room, opening)) is not None]
    near = [gap for gap, _ in gaps if gap <= _NEAR_CORNER_M]
    if not gaps:
        return {}
    reach = 2.0 * (_NEAR_CORNER_M - rule.end_gap_m)
    chance = float(np.mean([min(reach / max(slack - 2.0 * rule.end_gap_m, reach), 1.0) for _, slack in gaps]))
    share = (len(near) / len(gaps) - chance) / max(1.0 - chance, 1e-6)
    found: dict[str, float | TruncatedNormal] = {"near_corner": min(max(share, 0.0), 1.0)}
    if len(near) >= _LEAST_NEAR:
        found["corner_gap_m"] = _normal([max(end, rule.end_gap_m) for end in near], rule.end_gap_m)
    return found


def _end_gap(room: ObservedRoom, opening: ObservedOpening) -> tuple[float, float] | None:
    """Return the distance of an opening's nearer end from a corner of the room's bounding box, and the length over which it could lie.

    Return None if the opening is in no side of the box.  The box is taken because outlines have niches at doors and windows, whose corners
    say nothing about the place in the wall.
    """
    wall = wall_rows(room.polygon_m)[opening.wall]
    axis = 0 if abs(wall[ALONG_X]) > abs(wall[ALONG_Y]) else 1
    corners = np.array(room.polygon_m)
    low, high = corners.min(0), corners.max(0)
    across = float(wall[1 - axis])
    if min(across - low[1 - axis], high[1 - axis] - across) > _NICHE_M:
        return None
    ends = [float(wall[axis] + wall[2 + axis] * along) for along in (opening.offset_m, opening.offset_m + opening.width_m)]
    return max(min(min(ends) - float(low[axis]), float(high[axis]) - max(ends)), 0.0), float(high[axis] - low[axis]) - opening.width_m


def _normal(values: Sequence[float], least: float) -> TruncatedNormal:
    """Return a truncated normal of what was observed without its outer twentieths."""
    low, high = (float(value) for value in np.quantile(values, _TAILS))
    inside = [value for value in values if low <= value <= high] or list(values)
    low = max(low, least)
    mean = min(max(float(np.mean(inside)), low), 50.0)
    return TruncatedNormal(mean=mean, sd=max(float(np.std(inside)), _LEAST_SD_M), low=low, high=max(high, low + 0.01))
