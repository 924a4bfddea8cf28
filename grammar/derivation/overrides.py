"""A request's replacements of the grammar's own numbers: shape and height of the room, probabilities, sizes, weights, thresholds.

Each is folded into the grammar before anything is drawn.  A range of sizes truncates an object's distribution: the probability of each
component of the mixture is multiplied by the component's mass within the range, which gives the distribution of sizes given the range.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from scipy.special import ndtr

from grammar.derivation.densities import truncated_normal_log_density
from grammar.derivation.slopes import with_ceiling
from grammar.spec.object_rules import ObjectRule
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.room_rules import SHAPES, RoomRule
from grammar.spec.rules import Branch, Grammar, Node
from grammar.spec.values import TruncatedNormal
from scene_description import FieldError
from scene_description.strict import field_types, read_value

Range = tuple[float, float]

_AXES = ("depth", "width", "height")
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_RANGE = re.compile(rf"({_NUMBER})(?:\.\.({_NUMBER}))?")


def overridden(grammar: Grammar, request: SceneRequest) -> Grammar:
    """Return the grammar with a request's numbers in place of its own; applying a request twice is the same as once.

    Raises:
        RequestError: a text does not parse, names something that the grammar does not have, or a value that it cannot take.
    """
    nodes, openings = dict(grammar.nodes), dict(grammar.openings)
    for text in request.odds:
        path, *numbers = (part.strip() for part in text.split(":"))
        values = [_probability(text, number) for number in numbers]
        symbol, _, branch = path.partition("/")
        if symbol in openings and not branch:
            _check_copies(text, values)
            openings[symbol] = replace(openings[symbol], multiplicity=tuple(values))
        else:
            nodes[symbol] = _with_probabilities(grammar.room_type, nodes, text, symbol, branch, values)
    objects = dict(grammar.objects)
    for text in request.sizes:
        objects |= _truncated_sizes(grammar.room_type, objects, text)
    return replace(
        grammar,
        nodes=nodes,
        openings=openings,
        objects=objects,
        room=_room(grammar, request),
        weights=_replaced(grammar.weights, "weights", request.weights),
        validity=_replaced(grammar.validity, "validity", request.validity),
    )


def _room(grammar: Grammar, request: SceneRequest) -> RoomRule:
    """Return the rule of the room with the shape and the height that a request gives."""
    room = grammar.room
    if request.room_shape != "any":
        if request.room_polygon_m:
            raise RequestError(f"room_shape: expected 'any' beside room_polygon_m, got '{request.room_shape}'; leave out one of them")
        shapes = {name: float(name == request.room_shape) for name in SHAPES}
        room = replace(room, shapes=replace(room.shapes, **cast(Any, shapes)))
    if request.room_height_m > 0.0:
        least = 2.0
        if request.room_height_m < least:
            raise RequestError(f"room_height_m: expected at least {least:g} m or 0, got {request.room_height_m:g}")
        tall = request.room_height_m
        room = replace(room, height_m=TruncatedNormal(mean=tall, sd=room.height_m.sd, low=tall, high=tall))
        room = replace(room, slopes=replace(room.slopes, height_m=room.height_m))
    return replace(room, slopes=with_ceiling(room.slopes, request))


def _replaced(section: Any, name: str, texts: Sequence[str]) -> Any:
    """Return a section of the grammar with values of texts 'key:value' in place of its own."""
    hints = field_types(cast(Any, type(section)))
    for text in texts:
        key, colon, number = text.partition(":")
        key = key.strip()
        if key not in hints or not colon:
            raise RequestError(f"{name}: expected texts 'key:value' with a key among {', '.join(hints)}, got '{text}'")
        try:
            value = float(number)
        except ValueError:
            raise RequestError(f"{name}: {text}: expected a number after '{key}:', got '{number}'") from None
        try:
            section = replace(section, **{key: read_value(hints[key], value, f"{name}: {key}")})
        except FieldError as error:
            raise RequestError(str(error)) from None
    return section


def _with_probabilities(
    room_type: str, nodes: Mapping[str, Node], text: str, symbol: str, branch_symbol: str, values: Sequence[float]
) -> Node:
    """Return an Or or Set node with the probabilities that a text of ``odds`` gives one of its branches."""
    node = nodes.get(symbol)
    if node is None or node.kind == "and":
        known = ", ".join(name for name, other in nodes.items() if other.kind != "and")
        raise RequestError(f"odds: {text}: expected 'node/branch:p' with an Or or Set node of the {room_type} grammar ({known})")
    at = [i for i, branch in enumerate(node.branches) if branch.symbol == branch_symbol]
    if not at:
        known = ", ".join(branch.symbol for branch in node.branches)
        raise RequestError(f"odds: {text}: expected a branch of {symbol} ({known}), got '{branch_symbol}'")
    if node.kind == "set":
        _check_copies(text, values)
        return _with_branches(node, {at[0]: replace(node.branches[at[0]], multiplicity=tuple(values))})
    if len(values) != 1:
        raise RequestError(f"odds: {text}: expected one probability, since {symbol} is an Or node, got {len(values)}")
    rest = sum(branch.probability or 0.0 for i, branch in enumerate(node.branches) if i != at[0])
    if rest <= 0.0 and values[0] != 1.0:
        raise RequestError(f"odds: {text}: expected 1, since no other branch of {symbol} has a probability, got {values[0]:g}")
    changed: dict[int, Branch] = {}
    for i, branch in enumerate(node.branches):
        share = values[0] if i == at[0] else (branch.probability or 0.0) * (1.0 - values[0]) / max(rest, 1e-300)
        changed[i] = replace(branch, probability=share)
    return _with_branches(node, changed)


def _check_copies(text: str, values: Sequence[float]) -> None:
    if not values or abs(sum(values) - 1.0) > 1e-6:
        raise RequestError(f"odds: {text}: expected probabilities of 0, 1, ... copies that sum to 1, got a sum of {sum(values):.6g}")


def _probability(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= 1.0:
        raise RequestError(f"odds: {text}: expected probabilities in [0, 1] after the branch, got '{number}'")
    return value


def _with_branches(node: Node, changed: Mapping[int, Branch]) -> Node:
    return replace(node, branches=tuple(changed.get(i, branch) for i, branch in enumerate(node.branches)))


def _truncated_sizes(room_type: str, objects: Mapping[str, ObjectRule], text: str) -> dict[str, ObjectRule]:
    """Return the rules of the objects that a text about sizes names; a rule that is left without sizes keeps its object out of rooms."""
    name, colon, rest = text.partition(":")
    axes = [part.strip() for part in rest.split("x")]
    if not colon or len(axes) != 3:
        raise RequestError(f"sizes: expected texts 'name:depth x width x height', got '{text}'")
    symbols = [symbol for symbol, rule in objects.items() if name.strip() in (symbol, rule.category)]
    if not symbols:
        known = ", ".join(sorted({rule.category for rule in objects.values()}))
        raise RequestError(f"sizes: {text}: expected a category or object of the {room_type} grammar ({known}), got '{name}'")
    asked = [_range(text, axis) for axis in axes]
    kept = {symbol: rule for symbol in symbols if (rule := _truncated(objects[symbol], asked)) is not None}
    if not kept:
        spans = [
            f"{axis} {min(objects[s].low_m[i] for s in symbols):g} to {max(objects[s].high_m[i] for s in symbols):g}"
            for i, axis in enumerate(_AXES)
        ]
        raise RequestError(f"sizes: {text}: expected sizes that the {room_type} grammar has for {name} ({', '.join(spans)} m)")
    excluded = {symbol: replace(objects[symbol], sizes=()) for symbol in symbols if symbol not in kept}
    return kept | excluded


def _range(text: str, axis: str) -> Range | None:
    if axis == "*":
        return None
    match = _RANGE.fullmatch(axis)
    if match is None:
        raise RequestError(f"sizes: {text}: expected a number, a range 'low..high' or '*', got '{axis}'")
    low = float(match[1])
    high = low if match[2] is None else float(match[2])
    if low > high:
        raise RequestError(f"sizes: {text}: expected a lower bound up to the upper one, got {axis}")
    return low, high


def _truncated(rule: ObjectRule, asked: Sequence[Range | None]) -> ObjectRule | None:
    """Return a rule whose sizes lie in the ranges, or None if it has none there."""
    low = tuple(max(a, b[0]) if b else a for a, b in zip(rule.low_m, asked, strict=True))
    high = tuple(min(a, b[1]) if b else a for a, b in zip(rule.high_m, asked, strict=True))
    if any(a > b for a, b in zip(low, high, strict=True)) or not rule.sizes:
        return None
    # weigh each component by its mass within the ranges
    logs = []
    for mode in rule.sizes:
        log = math.log(mode.probability) if mode.probability > 0.0 else -math.inf
        for axis in zip(mode.mean_m, mode.sd_m, rule.low_m, rule.high_m, low, high, strict=True):
            log += _log_mass(*axis)
        logs.append(log)
    # normalise; where no component has mass left, keep the proportions
    top = max(logs)
    shares = [math.exp(log - top) if top > -math.inf else mode.probability for log, mode in zip(logs, rule.sizes, strict=True)]
    modes = tuple(replace(mode, probability=share / sum(shares)) for mode, share in zip(rule.sizes, shares, strict=True))
    return replace(rule, sizes=modes, low_m=(low[0], low[1], low[2]), high_m=(high[0], high[1], high[2]))


def _log_mass(mean: float, sd: float, low: float, high: float, new_low: float, new_high: float) -> float:
    """Return the log of the mass in [new_low, new_high] of a normal truncated to [low, high]; its log-density if the range is one point."""
    if (new_low, new_high) == (low, high):
        return 0.0
    if new_low == new_high:
        return truncated_normal_log_density(new_low, mean, sd, low, high)
    whole = float(ndtr((high - mean) / sd) - ndtr((low - mean) / sd))
    part = float(ndtr((new_high - mean) / sd) - ndtr((new_low - mean) / sd))
    return math.log(max(part, 1e-300) / max(whole, 1e-300))
