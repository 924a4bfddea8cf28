"""Relations learned from rooms made by hand."""

import math

import pytest
from small_grammar import CATEGORIES

from grammar import read_room_type
from grammar.learning import ObservedObject, ObservedRoom
from grammar.learning.assign import assign
from grammar.learning.relations import LearnShares, learn_object

GRAMMAR = read_room_type("living_room", CATEGORIES)
TABLE, CHAIR = (0.9, 1.5, 0.75), (0.5, 0.45, 0.9)


def dining(under_m: float) -> ObservedRoom:
    """Return a room with a table and two chairs before its front and back, so deep under it."""
    outline = ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0))
    away = 0.5 * TABLE[0] + 0.5 * CHAIR[0] - under_m
    chairs = [
        ObservedObject(category="dining_chair", size_m=CHAIR, position_m=(3.0 + side * away, 2.5 + along, 0.0), yaw_rad=turn)
        for side, turn in ((1.0, math.pi), (-1.0, 0.0))
        for along in (-0.31, 0.31)
    ]
    table = ObservedObject(category="dining_table", size_m=TABLE, position_m=(3.0, 2.5, 0.0), yaw_rad=0.0)
    return ObservedRoom(id="r", house="r", room_type="living_room", polygon_m=outline, height_m=2.6, objects=(table, *chairs))


@pytest.mark.parametrize(("rooms", "gap_m"), [(3, -0.4), (1, -0.25)], ids=["seen often enough", "seen too rarely"])
def test_chairs_are_as_deep_under_tables_as_those_seen(rooms: int, gap_m: float) -> None:
    assigned = [assign(GRAMMAR, dining(0.4), False) for _ in range(rooms)]
    rule, _ = learn_object(GRAMMAR, CATEGORIES, "dining_chair", assigned, [], LearnShares(2.0, 5.0, 3), frozenset({"sizes"}))
    gaps = {(mode.side, mode.of): mode.gap_m for mode in rule.around}
    assert gaps["front", ("dining_table",)] == pytest.approx(gap_m) and gaps["back", ("dining_table",)] == pytest.approx(gap_m)
    # sides that no chair was seen at
    assert gaps["left", ("dining_table",)] == gaps["right", ("small_table",)] == -0.2


def test_chairs_are_as_straight_at_tables_as_those_seen() -> None:
    seen, elsewhere = ([assign(GRAMMAR, dining(0.4), False) for _ in range(rooms)] for rooms in (3, 0))
    rule, counts = learn_object(GRAMMAR, CATEGORIES, "dining_chair", seen, elsewhere, LearnShares(2.0, 5.0, 3), frozenset({"sizes"}))
    assert counts["around"] == 12
    assert {mode.orientation_spread for mode in GRAMMAR.objects["dining_chair"].around} == {1.0}
    assert max(mode.orientation_spread for mode in rule.around) < 0.05
