"""What furniture at a wall stands beside: a corner of the room, or other furniture, close to one of its sides.

People push furniture into corners and against its neighbours, and leave the rest of a wall free.  For each object that stands straight at a
wall, the nearer of its two sides tells what it stands beside.  The shares become the probabilities of its address, which draws among what
a room holds (Luce, Individual Choice Behavior 1959); the gaps become modes of its place there.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import NamedTuple

from grammar.geometry.walls import ALONG_X, ALONG_Y, LENGTH, START_X, START_Y, wall_rows
from grammar.learning.assign import AssignedObject, AssignedRoom
from grammar.learning.mixtures import place_mixture
from grammar.learning.modes import LEAST_PLACE_M, Scale
from grammar.learning.observed import filled_outline, fitting_gap, fitting_wall, half_extents, relative_pose
from grammar.spec.categories import Categories, Role
from grammar.spec.object_rules import CORNER, NONE, AroundMode, ObjectRule
from grammar.spec.rules import Grammar

_BESIDE_M = 0.15
_AT_WALL_M, _STRAIGHT_RAD = 0.15, 0.1
_LEAST_SEEN, _LEAST_TIMES = 5, 3
_ROUNDS, _LEAST_COUNT = 50, 0.01
_ANGLE_RAD = 0.01
"""How straight a place beside something is: walls say it more closely."""

_PULLED_UP: Role = "pulled_up"


class Beside(NamedTuple):
    """What one object stands beside: symbol, "corner" or "none"; gaps in metres to that and to the wall; what else the room holds."""

    target: str
    gap_m: float
    wall_gap_m: float
    offered: frozenset[str]


def with_neighbours(
    grammar: Grammar, categories: Categories, rooms: Sequence[AssignedRoom], alpha: float
) -> tuple[Grammar, Mapping[str, int]]:
    """Return the grammar where furniture keeps to corners and to its neighbours as often and as closely as observed.

    An object that has exclusive places of its own, or is pulled up to another one, keeps these.  No symbol comes to belong to itself or to
    what belongs to it.

    ``alpha``: pseudo-counts of objects that stand beside nothing.

    Returns:
        the grammar, and for each learned path how many observations made it.
    """
    free = {symbol for symbol, rule in grammar.objects.items() if _is_free(grammar, categories, symbol, rule)}
    seen = {symbol: [found for room in rooms for found in _seen_beside(room, symbol)] for symbol in sorted(free)}
    belongs = {symbol: set(rule.cores or ()) - {CORNER, NONE} for symbol, rule in grammar.objects.items()}
    targets: dict[str, set[str]] = {symbol: set() for symbol in seen}
    still = {name for name, rule in grammar.objects.items() if _PULLED_UP not in categories[rule.category].roles} | {CORNER}
    pairs = Counter((symbol, found.target) for symbol, items in seen.items() for found in items if len(items) >= _LEAST_SEEN)
    for (symbol, target), _ in sorted(pairs.items(), key=lambda pair: (-pair[1], pair[0])):
        times = sum(found.target not in (CORNER, NONE) if target != CORNER else found.target == CORNER for found in seen[symbol])
        if target not in still or times < _LEAST_TIMES or (target != CORNER and symbol in _all_below(belongs, target)):
            continue
        targets[symbol].add(target)
        belongs[symbol] |= {target} - {CORNER}
    weights = grammar.weights
    scale = Scale.of(weights.group_distance, weights.group_orientation, grammar.schedule.beta)
    objects = dict(grammar.objects)
    counts: dict[str, int] = {}
    for symbol, wanted in targets.items():
        if wanted:
            objects[symbol] = _beside_rule(objects[symbol], seen[symbol], wanted, scale, alpha)
            counts |= {f"objects.{symbol}.{name}": len(seen[symbol]) for name in ("cores", "around")}
    return replace(grammar, objects=objects), counts


def _is_free(grammar: Grammar, categories: Categories, symbol: str, rule: ObjectRule) -> bool:
    followed = any(other.same_place_as == symbol for other in grammar.objects.values())
    bound = rule.one_each is not None or followed or rule.in_run is not None or _PULLED_UP in categories[rule.category].roles
    alone = rule.cores is None or NONE in rule.cores
    return rule.mount == "floor" and bool(rule.wall) and alone and CORNER not in (rule.cores or {}) and not bound


def _all_below(belongs: Mapping[str, AbstractSet[str]], symbol: str) -> set[str]:
    """Return a symbol and all that it belongs to, one through the other."""
    found, left = set[str](), {symbol}
    while left:
        one = left.pop()
        found.add(one)
        left |= set(belongs.get(one, ())) - found
    return found


def _seen_beside(room: AssignedRoom, symbol: str) -> list[Beside]:
    """Return what the objects of a symbol that stand straight at a wall are beside."""
    outline, found = filled_outline(room.room.polygon_m), []
    lengths = wall_rows(outline)[:, LENGTH]
    for item in room.objects:
        pose = fitting_wall(outline, item.seen) if item.symbol == symbol else None
        if pose is None or pose.gap_m > _AT_WALL_M or abs(pose.turn_rad) > _STRAIGHT_RAD:
            continue
        others = [other for other in room.objects if other is not item and other.symbol != symbol and other.on is None]
        near = [(gap, other.symbol) for other in others if (gap := _side_gap(item, other)) is not None]
        row = wall_rows(outline)[pose.wall]
        along = (item.seen.position_m[0] - row[START_X]) * row[ALONG_X] + (item.seen.position_m[1] - row[START_Y]) * row[ALONG_Y]
        end = min(along, float(lengths[pose.wall]) - along) - 0.5 * item.seen.size_m[1]
        gap, target = min([*near, (end, CORNER), (_BESIDE_M, NONE)], key=lambda pair: (fitting_gap(pair[0]), pair[1]))
        offered = frozenset({other.symbol for other in others} | {CORNER, NONE})
        found.append(Beside(target, fitting_gap(gap), fitting_gap(pose.gap_m), offered))
    return found


def _side_gap(item: AssignedObject, other: AssignedObject) -> float | None:
    """Return the gap in metres between the sides of two objects that stand in line, or None where they do not."""
    place = relative_pose(other.seen, item.seen)
    half_d, half_w = half_extents(other.seen.size_m, place.turn_rad)
    back = abs(place.x_m - half_d + 0.5 * item.seen.size_m[0])
    stands = other.seen.position_m[2] < _AT_WALL_M and abs(place.turn_rad) < _STRAIGHT_RAD and back < 2.0 * _AT_WALL_M
    return abs(place.y_m) - half_w - 0.5 * item.seen.size_m[1] if stands else None


def _beside_rule(rule: ObjectRule, seen: Sequence[Beside], wanted: AbstractSet[str], scale: Scale, alpha: float) -> ObjectRule:
    """Return the rule with places beside the ``wanted``; its own cores share the rest."""
    shares = _shares([(found.target if found.target in wanted else NONE, found.offered & (wanted | {NONE})) for found in seen], alpha)
    own = dict(rule.cores or {NONE: 1.0})
    cores = {**{name: shares[name] for name in sorted(wanted)}, **{name: shares[NONE] * share for name, share in own.items()}}
    total = sum(cores.values())
    others = sorted(wanted - {CORNER})
    parts = [part for part in (others, [CORNER]) if part and wanted >= set(part)]
    modes = []
    for part in parts:
        gaps = [(found.gap_m, found.wall_gap_m) for found in seen if found.target in part]
        modes.append([replace(mode, of=tuple(part)) for mode in _modes(gaps, part == [CORNER], scale)])
    if rule.around:
        was = tuple(name for name in own if name != NONE)
        modes.append([replace(mode, of=mode.of or was, probability=mode.probability or 1.0 / len(rule.around)) for mode in rule.around])
    around = tuple(replace(mode, probability=(mode.probability or 0.0) / len(modes)) for group in modes for mode in group)
    return replace(rule, cores={name: share / total for name, share in cores.items()}, around=around)


def _shares(choices: Sequence[tuple[str, AbstractSet[str]]], alpha: float) -> dict[str, float]:
    """Return weights of greatest likelihood for choices, each (what was chosen, what there was), in proportion to their weights.

    ``alpha``: pseudo-counts of choices of "none" where all was there.
    """
    times = Counter(chosen for chosen, _ in choices)
    weights = {name: 1.0 for _, offered in choices for name in sorted(offered)}
    for _ in range(_ROUNDS):
        sums = [sum(weights[name] for name in sorted(offered)) for _, offered in choices]
        shares = {
            name: (times[name] + alpha * (name == NONE) + _LEAST_COUNT)
            / (
                alpha / sum(weights.values())
                + sum(1.0 / total for total, (_, offered) in zip(sums, choices, strict=True) if name in offered)
            )
            for name in weights
        }
        weights = {name: share / sum(shares.values()) for name, share in shares.items()}
    return weights


def _modes(gaps: Sequence[tuple[float, float]], corner: bool, scale: Scale) -> list[AroundMode]:
    """Return the places at which an object has such gaps, each (to its neighbour, to the wall), at either side of that or of a corner.

    A corner lies at the right of what stands at the wall that begins there, and its frame is turned by a quarter to the wall before.
    """
    modes = []
    for part in place_mixture(gaps, LEAST_PLACE_M):
        side_gap, wall_gap = part.middle
        common = AroundMode(
            probability=0.5 * part.share,
            spread=scale.spread(part.scale),
            orientation_spread=scale.orientation_spread(_ANGLE_RAD),
            side="right",
            gap_m=side_gap,
            align=-1.0,
            along_m=wall_gap if corner else 0.0,
        )
        other = replace(common, gap_m=wall_gap, along_m=side_gap, orientation_rad=-0.5 * math.pi)
        modes += [common, other if corner else replace(common, side="left")]
    return modes
