"""Features of rooms and the classifier that tells rooms apart by them, against known answers."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from room_features import features, folds_of, schema_of, table, told_apart

from grammar.learning import ObservedObject, ObservedRoom

ROOT = Path(__file__).resolve().parents[3]


def bedroom(gap_m: float, house: str = "r") -> ObservedRoom:
    """Return a room with a bed ``gap_m`` from the wall x = 0, in it where that is below zero, and a nightstand 0.1 m beside the bed."""
    bed = ObservedObject(category="bed", size_m=(2.0, 1.6, 0.9), position_m=(gap_m + 1.0, 2.0, 0.0), yaw_rad=0.0004)
    stand = ObservedObject(category="nightstand", size_m=(0.4, 0.4, 0.5), position_m=(0.2, 3.1, 0.0), yaw_rad=0.0)
    polygon = ((0.0, 0.0), (2.0, 0.0), (2.0, -0.1), (2.8, -0.1), (2.8, 0.0), (4.0, 0.0), (4.0, 5.0), (0.0, 5.0))
    return ObservedRoom(id=house, house=house, room_type="bedroom", polygon_m=polygon, height_m=2.5, objects=(bed, stand))


def test_features_of_a_room() -> None:
    rooms = [bedroom(-0.02)] * 3
    found = features(schema_of(rooms), rooms[0])
    assert (found["counts: all"], found["counts: bed"], found["sizes: width of bed"]) == (2.0, 1.0, 1.6)
    # As far in the wall is as far off it, 0.4 mrad are none; the niche of the door is no floor, and a fifth of that less a bit is covered.
    assert (found["walls: least gap of bed"], found["walls: greatest turn of bed"]) == (pytest.approx(0.02), 0.0)
    assert found["walls: least gap of nightstand"] == 0.0
    assert found["pairs: gap of bed and nightstand"] == pytest.approx(0.1, abs=1.5e-3)
    assert found["room: area"] == pytest.approx(20.0)
    assert found["room: proportion"] == pytest.approx(1.25)
    assert found["room: share of the floor covered"] == pytest.approx((3.2 + 0.16) / 20.0)


def test_a_corner_is_as_near_as_its_nearer_wall_and_what_hangs_is_at_its_wall() -> None:
    room = bedroom(0.0)
    # 3 cm in the wall y = 5 and 1 cm off x = 0; the mirror in the air 2 cm from x = 0 hangs there
    rack = ObservedObject(category="shoe_rack", size_m=(0.4, 1.0, 0.5), position_m=(0.21, 4.53, 0.0), yaw_rad=0.0)
    mirror = ObservedObject(category="wall_mirror", size_m=(0.04, 0.5, 0.8), position_m=(0.04, 4.5, 1.2), yaw_rad=0.01)
    room = replace(room, objects=(rack, mirror))
    found = features(schema_of([room] * 3), room)
    assert found["walls: least side gap of shoe_rack"] == pytest.approx(0.01)
    assert (found["walls: least gap of wall_mirror"], found["walls: greatest turn of wall_mirror"]) == (0.0, 0.0)
    # from 1 cm off the wall to the mirror's front at 4 cm
    assert found["pairs: gap of shoe_rack and wall_mirror"] == pytest.approx(0.03, abs=1.5e-3)


def test_told_apart_where_rooms_differ_and_not_where_they_are_alike() -> None:
    rng = np.random.default_rng(3)
    rooms = [bedroom(abs(rng.normal(0.1, 0.03)), f"h{k}") for k in range(60)]
    moved = [bedroom(abs(rng.normal(0.4, 0.03)), f"m{k}") for k in range(30)]
    schema = schema_of(rooms)
    names, data = table(schema, rooms)
    _, other = table(schema, moved)
    folds = folds_of(rooms, 3)
    assert told_apart(names, data, other, (folds, np.arange(30) % 3), 40).auc == 1.0
    alike = told_apart(names, data[:30], data[30:], (folds[:30], folds[30:]), 40)
    # The standard error of the area with 30 against 30 alike is sqrt(61 / (12 * 30 * 30)) = 0.075.
    assert alike.auc == pytest.approx(0.5, abs=4.0 * 0.075)


def test_rooms_of_a_house_share_their_fold() -> None:
    rooms = [bedroom(0.1, house) for house in ("a", "a", "b", "c", "c", "d")]
    folds = folds_of(rooms, 2)
    assert folds[0] == folds[1]
    assert folds[3] == folds[4]
    assert sorted(np.bincount(folds)) == [3, 3]


def test_the_bench_says_that_nothing_was_measured() -> None:
    command = [sys.executable, "-m", "benchmarks.realism_bench", "--classifier"]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert "not measured: give a file" in said.stdout
