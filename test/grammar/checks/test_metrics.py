"""Metrics of rooms against values worked out by hand."""

from dataclasses import replace

import pytest

from grammar.checks.metrics import RoomMetrics, SamplingCost, summarise

CHECKS = {
    "collision": (0.0004, 0.001, 0),
    "out_of_bounds": (0.0, 0.001, 0),
    "floating": (0.0, 0.01, 0),
    "overhang": (0.0, 0.001, 0),
    "door_clear": (0.0, 0.001, 0),
    "window_clear": (0.0, 0.001, 0),
    "wall_clear": (0.0, 0.001, 0),
    "walkable_share": (0.97, 0.95, 0),
    "reachable": (0.0, 0.0, 0),
    "side_clear": (0.8, 0.3, 0),
}


def room(**changes: object) -> RoomMetrics:
    base = RoomMetrics(
        index=0,
        room_type="bedroom",
        objects=10,
        valid=True,
        checks=CHECKS,
        faults={},
        to_be_reached=4,
        seconds=0.2,
        cost=SamplingCost(attempts=1, proposals=1000, chain_s=0.01),
    )
    return replace(base, **changes)


def test_rates_are_over_objects_or_rooms_as_their_definitions_say():
    bad = CHECKS | {
        "collision": (0.02, 0.001, 2),
        "walkable_share": (0.9, 0.95, 0),
        "reachable": (1.0, 0.0, 1),
        "door_clear": (0.1, 0.001, 1),
    }
    odd = {"chair_at_no_table": [3]}
    metric = {m.name: m for m in summarise([room(), room(checks=bad, faults=odd, objects=30, seconds=0.6)], 3)}
    expected = {
        "failures": 3.0, "odd rooms": 0.5, "Col_obj": 2 / 40, "Col_scene": 0.5, "penetration": 20.0, "R_out": 0.0, "doors blocked": 0.5,
        "R_walkable, least": 0.9, "R_walkable, mean": 0.935, "R_reach": 7 / 8, "functional side, least": 0.8,
        "objects": 20.0, "time p50": 0.4, "attempts": 1.0, "proposals": 1000.0, "proposals/s": 100_000.0,
    }  # fmt: skip
    assert {name: metric[name].value for name in expected} == pytest.approx(expected)
    failed = {m.name for m in metric.values() if m.passed is False}
    assert failed == {
        "failures", "Col_obj", "Col_scene", "penetration", "doors blocked", "R_walkable, least", "R_walkable, mean", "R_reach",
    }  # fmt: skip
    assert not any(m.passed is False for m in summarise([room()], 0))
