"""What furniture stands beside, learned from rooms where it is known."""

import math

import numpy as np
import pytest
from small_grammar import CATEGORIES, small_grammar

from grammar.learning import ObservedRoom
from grammar.learning.assign import assign
from grammar.learning.beside import with_neighbours
from grammar.learning.observed import ObservedObject
from grammar.spec.rules import Grammar

ROOM = ((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
FURNITURE = """
nodes:
  closet: {kind: and, branches: [{symbol: wardrobe}, {symbol: dresser}]}
objects:
  wardrobe:
    category: wardrobe
    sizes: [{mean_m: [0.6, 1.0, 2.0], sd_m: [0.05, 0.1, 0.1]}]
    low_m: [0.5, 0.8, 1.8]
    high_m: [0.7, 1.2, 2.2]
    wall: [{distance_m: 0.01}]
  dresser:
    category: dresser
    sizes: [{mean_m: [0.5, 0.8, 0.8], sd_m: [0.02, 0.1, 0.05]}]
    low_m: [0.4, 0.6, 0.6]
    high_m: [0.6, 1.0, 1.0]
    wall: [{distance_m: 0.01}]
"""


def _room(number: int, gap_m: float, between_m: float) -> ObservedRoom:
    """Return a room whose wardrobe stands so far from a corner, and whose dresser so far beyond the wardrobe, at the wall y = 0."""
    wardrobe = ObservedObject(category="wardrobe", size_m=(0.6, 1.0, 2.0), position_m=(gap_m + 0.5, 0.3, 0.0), yaw_rad=0.5 * math.pi)
    dresser = ObservedObject(
        category="dresser", size_m=(0.5, 0.8, 0.8), position_m=(gap_m + 1.0 + between_m + 0.4, 0.25, 0.0), yaw_rad=0.5 * math.pi
    )
    return ObservedRoom(id=f"r{number}", house=f"h{number}", room_type="closet", polygon_m=ROOM, height_m=2.5, objects=(wardrobe, dresser))


@pytest.fixture
def base() -> Grammar:
    return small_grammar(FURNITURE)


def _learned(base: Grammar, rooms: list[ObservedRoom], alpha: float = 0.0) -> Grammar:
    return with_neighbours(base, CATEGORIES, [assign(base, room) for room in rooms], alpha)[0]


def test_a_wardrobe_in_the_corner_and_a_dresser_beside_it(base: Grammar) -> None:
    learned = _learned(base, [_room(k, 0.02, 0.03) for k in range(8)])
    wardrobe, dresser = learned.objects["wardrobe"], learned.objects["dresser"]
    assert wardrobe.cores is not None and wardrobe.cores["corner"] == pytest.approx(1.0, abs=0.01)
    places = [(mode.gap_m, mode.along_m, mode.orientation_rad) for mode in wardrobe.around]
    assert np.allclose(places, [(0.02, 0.0, 0.0), (0.0, 0.02, -0.5 * math.pi)])
    assert dresser.cores is not None and dresser.cores["wardrobe"] == pytest.approx(1.0, abs=0.01)
    assert {(mode.side, mode.of) for mode in dresser.around} == {("left", ("wardrobe",)), ("right", ("wardrobe",))}
    assert [mode.gap_m for mode in dresser.around] == pytest.approx([0.03, 0.03])


def test_half_in_corners_and_pseudo_counts_beside_nothing(base: Grammar) -> None:
    rooms = [_room(k, 0.02 if k % 2 else 0.5, 0.6) for k in range(8)]
    for alpha, share in ((0.0, 0.5), (2.0, 0.4)):
        cores = _learned(base, rooms, alpha).objects["wardrobe"].cores
        assert cores is not None and cores["corner"] == pytest.approx(share, abs=0.01)


def test_what_stands_apart_keeps_its_rule(base: Grammar) -> None:
    assert _learned(base, [_room(k, 0.5, 0.6) for k in range(8)]).objects == base.objects


def test_no_two_symbols_belong_to_each_other(base: Grammar) -> None:
    objects = _learned(base, [_room(k, 0.5, 0.03) for k in range(8)]).objects
    assert [("dresser" in (objects["wardrobe"].cores or {})), ("wardrobe" in (objects["dresser"].cores or {}))].count(True) == 1
