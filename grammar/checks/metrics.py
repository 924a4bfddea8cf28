"""Metrics of sampled rooms under the names and definitions of the literature: of one room, and over many.

Sources of the definitions: PhyScene (Yang et al., CVPR 2024: Col_obj, Col_scene, R_out, R_walkable, R_reach), SceneEval (accessibility of
functional sides, opening clearance, support).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from grammar.checks.faults import scene_faults
from grammar.spec.categories import Categories
from grammar.spec.rules import Grammar
from scene_description import SceneDescription

Rooms = Sequence["RoomMetrics"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SamplingCost:
    """The cost of a room: layouts tried, proposals of their chains, processor seconds of the chains."""

    attempts: int
    proposals: int
    chain_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomMetrics:
    """Metrics of one room.

    ``checks`` maps the name of a validity check to (value, limit, objects at fault), ``faults`` that of a fault of use to the objects at
    fault.
    """

    index: int
    room_type: str
    objects: int
    valid: bool
    checks: dict[str, tuple[float, float, int]]
    faults: dict[str, list[int]]
    to_be_reached: int
    seconds: float
    cost: SamplingCost


class Metric(NamedTuple):
    """One row of a report; limit and passed are None where nothing is asked."""

    name: str
    definition: str
    value: float
    unit: str
    limit: str
    passed: bool | None


def measure_room(grammar: Grammar, categories: Categories, scene: SceneDescription, cost: SamplingCost, seconds: float) -> RoomMetrics:
    """Return the metrics of a finished room with its validity report; ``seconds``: processor time of the whole synthesis."""
    symbol = {node.object: node.symbol for node in scene.parse_graph.nodes if node.kind == "terminal" and node.object is not None}
    rules = [grammar.objects.get(symbol.get(item.id, "")) for item in scene.objects]
    return RoomMetrics(
        index=scene.index,
        room_type=scene.category,
        objects=len(scene.objects),
        valid=scene.validity.valid,
        checks={check.name: (check.value, check.limit, len(check.objects)) for check in scene.validity.checks},
        faults=scene_faults(scene, categories),
        to_be_reached=sum(rule is not None and bool(rule.reach_any) for rule in rules),
        seconds=seconds,
        cost=cost,
    )


def summarise(rooms: Rooms, failures: int) -> list[Metric]:
    """Return the metrics over rooms, validity first, then cost.

    Args:
        rooms: at least one.
        failures: rooms asked for that could not be sampled.
    """
    items = sum(room.objects for room in rooms)
    needed = sum(room.to_be_reached for room in rooms)
    seconds = np.array([room.seconds for room in rooms])
    attempts = np.array([room.cost.attempts for room in rooms])
    proposals, chain_s = sum(room.cost.proposals for room in rooms), sum(room.cost.chain_s for room in rooms)

    def share(name: str, of: float) -> float:
        return _at_fault(rooms, name) / max(of, 1)

    return [
        _zero("failures", "rooms asked for that could not be sampled within the budget", failures),
        _zero("Col_obj", "objects that penetrate another one deeper than the limit / objects", share("collision", items)),
        _zero("Col_scene", "rooms with such an object / rooms", _rooms_at_fault(rooms, "collision")),
        _most(rooms, "penetration", "deepest penetration of two objects' solids", "collision", "mm", 1000.0),
        _zero("R_out", "objects that stick out of the room further than the limit / objects", share("out_of_bounds", items)),
        _most(rooms, "outside", "furthest that a solid sticks out of walls, floor or ceiling", "out_of_bounds", "mm", 1000.0),
        _zero("floating", "objects whose gap to their support is above the limit / objects", share("floating", items)),
        _most(rooms, "gap", "largest gap between an object and its support", "floating", "mm", 1000.0),
        _most(rooms, "overhang", "furthest that an object's footprint sticks out of the support surface below", "overhang", "mm", 1000.0),
        _zero("doors blocked", "rooms where something stands in a door's swing or its free space / rooms",
               _rooms_at_fault(rooms, "door_clear")),
        _zero("windows blocked", "rooms where furniture stands before a window above its sill / rooms",
               _rooms_at_fault(rooms, "window_clear")),
        _zero("wall space blocked", "rooms where something hangs over an opening, or a picture is hidden / rooms",
               _rooms_at_fault(rooms, "wall_clear")),
        _least(rooms, "R_walkable, least", "floor where the robot can stand that is connected to the door / all such floor", np.min),
        _least(rooms, "R_walkable, mean", "the same, mean over rooms", np.mean),
        Metric("R_reach", "seats, beds and stores that the robot gets to / all of them", 1.0 - share("reachable", needed),
               "", ">= 1", _at_fault(rooms, "reachable") == 0),
        _side(rooms),
        _figure("odd rooms", "rooms with a fault of use, as docs/grammar.md lists them / rooms", _odd(rooms), ""),
        _figure("objects", "mean number of objects in a room", items / len(rooms), ""),
        _figure("time p50", "processor time of a room, everything included, median", float(np.median(seconds)), "s"),
        _figure("time p99", "the same, 99th percentile", float(np.quantile(seconds, 0.99)), "s"),
        _figure("attempts", "layouts tried for a room, mean", float(attempts.mean()), ""),
        _figure("first try", "rooms whose first layout passed all checks / rooms", float((attempts == 1).mean()), ""),
        _figure("proposals", "proposals of the chain for a room, mean", proposals / len(rooms), ""),
        _figure("proposals/s", "proposals of the chain per second of one core", proposals / max(chain_s, 1e-9), "1/s"),
    ]  # fmt: skip


def _zero(name: str, definition: str, value: float) -> Metric:
    return Metric(name, definition, float(value), "", "0", value == 0.0)


def _figure(name: str, definition: str, value: float, unit: str) -> Metric:
    return Metric(name, definition, float(value), unit, "", None)


def _odd(rooms: Rooms) -> float:
    return sum(bool(room.faults) for room in rooms) / len(rooms)


def _at_fault(rooms: Rooms, name: str) -> int:
    """Return the number of objects at fault in a check."""
    return sum(room.checks[name][2] for room in rooms if name in room.checks)


def _rooms_at_fault(rooms: Rooms, name: str) -> float:
    return float(np.mean([room.checks[name][2] > 0 for room in rooms if name in room.checks]))


def _most(rooms: Rooms, name: str, definition: str, check: str, unit: str, scale: float) -> Metric:
    rows = [room.checks[check] for room in rooms if check in room.checks]
    limit = max(row[1] for row in rows)
    return Metric(name, definition, scale * max(row[0] for row in rows), unit, f"<= {scale * limit:g}", all(row[2] == 0 for row in rows))


def _least(rooms: Rooms, name: str, definition: str, reduce: Callable[[Sequence[float]], float]) -> Metric:
    rows = [room.checks["walkable_share"] for room in rooms if "walkable_share" in room.checks]
    limit = min(row[1] for row in rows)
    return Metric(name, definition, float(reduce([row[0] for row in rows])), "", f">= {limit:g}", all(v >= low for v, low, _ in rows))


def _side(rooms: Rooms) -> Metric:
    rows = [room.checks["side_clear"] for room in rooms if "side_clear" in room.checks]
    return Metric(
        "functional side, least",
        "free share of a strip of 0.2 m, 5 cm off the freest of the sides by which an object is used",
        min((row[0] for row in rows), default=1.0),
        "",
        f">= {min((row[1] for row in rows), default=0.0):g}",
        all(row[0] >= row[1] for row in rows),
    )
