"""The realism table's figures against known answers."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from realism_figures import by_chance, compare, pair_poses
from small_grammar import CATEGORIES

from grammar import SceneRequest, read_room_type, sample_room
from grammar.learning import ObservedObject, ObservedRoom
from grammar.learning.truncation import category_kl
from grammar.spec.energy_terms import HARD_TERMS

ROOT = Path(__file__).resolve().parents[3]
GRAMMAR = read_room_type("bedroom", CATEGORIES)
KNOWN = {"bed", "nightstand"}


def bedroom(gap_m: float, turn_rad: float = 0.0) -> ObservedRoom:
    """Return a room with a bed ``gap_m`` from the wall x = 0 that it has its back to, and a turned nightstand 0.1 m beside it."""
    bed = ObservedObject(category="bed", size_m=(2.0, 1.6, 0.9), position_m=(gap_m + 1.0, 2.0, 0.0), yaw_rad=0.0)
    stand = ObservedObject(
        category="nightstand", size_m=(0.4, 0.4, 0.5), position_m=(gap_m + 0.2, 2.0 + 0.8 + 0.1 + 0.2, 0.0), yaw_rad=turn_rad
    )
    polygon = ((0.0, 0.0), (5.0, 0.0), (5.0, 6.0), (0.0, 6.0))
    return ObservedRoom(id="r", house="r", room_type="bedroom", polygon_m=polygon, height_m=2.5, objects=(bed, stand))


def test_category_kl() -> None:
    p, q = {"a": 0.75, "b": 0.25}, {"a": 0.5, "b": 0.5}
    assert category_kl(p, p) == 0.0
    assert category_kl(p, q) == pytest.approx(0.75 * math.log(1.5) + 0.25 * math.log(0.5), abs=1e-5)


def test_equal_rooms_are_at_no_distance() -> None:
    rooms = [bedroom(0.02)] * 4
    assert compare(GRAMMAR, KNOWN, rooms, rooms) == pytest.approx((0.0,) * 6)


def test_known_distances() -> None:
    # All gaps to the wall grow by 0.1 m; the pair's own gap and flush backs stay; the nightstand's turn by 0.2 rad widens its footprint.
    figures = compare(GRAMMAR, KNOWN, [bedroom(0.02)] * 4, [bedroom(0.12)] * 4)
    assert figures == pytest.approx((0.0, 0.1, 0.0, 0.0, 0.0, 0.0), abs=1e-9)
    turned = compare(GRAMMAR, KNOWN, [bedroom(0.02)] * 4, [bedroom(0.02, 0.2)] * 4)
    assert turned.pair_orientation_rad == pytest.approx(0.2)
    (poses,) = pair_poses([("nightstand", "bed")], [bedroom(0.02, 0.2)]).values()
    half = 0.2 * (math.cos(0.2) + math.sin(0.2))
    assert poses[0] == pytest.approx((0.3 - half, 0.2 - half, 0.2))
    assert turned.wall_orientation_rad == pytest.approx(0.5 * 0.2)


def test_too_few_pairs_have_no_distance() -> None:
    rooms = [bedroom(0.02)] * 4
    alone = [replace(room, objects=room.objects[:1]) for room in rooms]
    figures = compare(GRAMMAR, KNOWN, rooms, alone)
    assert math.isnan(figures.pair_gap_m)
    assert figures.category_kl == pytest.approx(
        0.5 * (math.log(0.500001) - math.log(1.000001)) + 0.5 * (math.log(0.500001) - math.log(1e-6))
    )


def test_the_bench_says_that_nothing_was_measured() -> None:
    said = subprocess.run([sys.executable, "-m", "benchmarks.realism_bench"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert "not measured: give a file" in said


def test_chance_places_the_same_objects_without_relations() -> None:
    grammar = by_chance(GRAMMAR)
    room = sample_room(grammar, CATEGORIES, SceneRequest(max_objects=14), np.random.default_rng(2))
    assert room.validity.valid
    weights, energies = room.parse_graph.weights, room.parse_graph.energies
    assert all((weights[name] == 0.0) == (name not in HARD_TERMS) for name in energies)
    assert energies["wall_distance"] > 0.2
