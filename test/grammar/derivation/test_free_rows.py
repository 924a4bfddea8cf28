"""Runs away from walls: islands before other runs, and legs that jut out behind a unit that turns."""

import math

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar.derivation.derive import derive
from grammar.derivation.free_rows import Standing, free_slots, juts_clear
from grammar.geometry.run_slots import Line, jutting, slot_at, unit_poses
from grammar.geometry.walls import wall_rows
from grammar.layout.assemble import assemble
from grammar.layout.schedule import leaders
from grammar.spec.request import SceneRequest
from grammar.spec.run_rules import RowUnit, UnitRowRule

SQUARE = wall_rows([(0, 0), (4, 0), (4, 4), (0, 4)])
NOTHING = np.zeros((0, 8))


def test_an_island_faces_the_units_at_a_wall_from_across_the_aisle():
    standing = [Standing(0, 1.0, 3.0, 0.6)]
    slots = free_slots(SQUARE, NOTHING, standing, (0.9, 1.5), 1.0, 0.9)
    assert {slot.direction for slot in slots} == {1.0, -1.0}
    for slot in slots:
        for slide in (0.0, slot.slide):
            poses = unit_poses(slot, slide, [[(0.9, 0.75), (0.9, 0.75)]], [RowUnit()] * 2, UnitRowRule(wall_gap_m=0.0))
            assert all(abs(math.remainder(yaw + 0.5 * math.pi, 2.0 * math.pi)) < 1e-9 for _, _, yaw in poses)
            # fronts 1.0 to 1.3 m before those of the units, ends 0.9 m off the side walls, backs off the wall behind
            assert all(1.6 - 1e-9 <= y - 0.45 <= 1.9 + 1e-9 and y + 0.45 <= 4.0 - 0.9 + 1e-3 for _, y, _ in poses)
            ends = [x + side * 0.375 for x, _, _ in poses for side in (-1.0, 1.0)]
            assert min(ends) >= 0.9 - 1e-3 and max(ends) <= 3.1 + 1e-3 and max(ends) - min(ends) == pytest.approx(1.5)
            assert 1.0 <= sum(ends) / 4.0 <= 3.0


def test_an_island_needs_the_floor_around_it():
    standing = [Standing(0, 1.0, 3.0, 0.6)]
    assert not free_slots(SQUARE, NOTHING, standing, (0.9, 2.3), 1.0, 0.9)
    assert not free_slots(SQUARE, NOTHING, standing, (0.9, 1.5), 1.7, 0.9)
    assert not free_slots(SQUARE, np.array([[2.0, 2.0, 0.0, 1.0, 0.3, 0.3, 1.0, 0.0]]), standing, (0.9, 1.5), 1.0, 0.9)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_leg_juts_out_behind_the_unit_that_turns(direction):
    """One unit and one that turns at a wall along x, then a unit 0.9 m deep away from the wall, its front even with the side."""
    start = slot_at(direction, [Line(0.0 if direction > 0 else 4.0, 0.0, 0.5 * math.pi)], 0.0)
    slot = jutting(start, 0, 1.6, 0.6, 0.9, 0.0)
    poses = unit_poses(
        slot, 0.0, [[(0.6, 1.0), (0.6, 0.6)], [(0.9, 0.8)]], [RowUnit(), RowUnit(turns=True), RowUnit()], UnitRowRule(wall_gap_m=0.0)
    )
    mirrored = (lambda x: x) if direction > 0 else (lambda x: 4.0 - x)
    assert [(mirrored(x), y) for x, y, _ in poses] == [pytest.approx(place) for place in ((0.5, 0.3), (1.3, 0.3), (1.45, 1.0))]
    # the unit that juts out looks back along the run
    assert math.cos(poses[2][2]) == pytest.approx(-direction)
    assert juts_clear(SQUARE, NOTHING, slot, 1, (0.9, 0.8), 1.0, 0.9)
    assert not juts_clear(SQUARE, NOTHING, slot, 1, (0.9, 0.8), 1.1, 0.9)  # the aisle before it
    assert not juts_clear(SQUARE, NOTHING, slot, 1, (0.9, 2.6), 1.0, 0.9)  # the walkway beyond its end
    assert not juts_clear(SQUARE, NOTHING, slot, 1, (0.9, 0.8), 1.0, 2.2)  # the walkway behind it


def test_a_derivation_puts_the_island_last_and_keeps_what_it_stands_before():
    """A row at a wall, an island before it with a stool behind each unit; both are runs, and the stool is a unit of neither."""
    nodes = "  row: {kind: and, run: {}, branches: [{symbol: side}]}\n"
    nodes += "  block: {kind: and, run: {free: true}, branches: [{symbol: middle}, {symbol: stool}]}\nobjects:"
    text = closet("block", "row").replace("objects:", nodes)
    text += item("side", "dresser", (0.5, 2.2, 0.8)) + item("middle", "dresser", (0.6, 0.8, 0.8))
    text += item("stool", "pouf", (0.3, 0.3, 0.4), ", cores: {middle: 1}, around: [{side: back, gap_m: 0.1}]")
    grammar = small_grammar(text)
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(3))
    side, middle = ({item.symbol: item.id for item in tree.items}[name] for name in ("side", "middle"))
    assert [run.units for run in tree.unit_rows] == [(side,), (middle,)]
    assert len(tree.unit_rows[0].slots) == 1 and len(tree.unit_rows[1].slots) >= 2
    problem, state = assemble(grammar, CATEGORIES, tree)
    assert math.cos(state.where[side - 1, 2] - state.where[middle - 1, 2]) == pytest.approx(-1.0)
    assert {side - 1, middle - 1} <= set(leaders(problem).tolist())
