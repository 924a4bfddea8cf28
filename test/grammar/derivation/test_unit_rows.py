"""How units stand in a run: end-on, with joints, with light from the side; and how runs meet at corners."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, item, mapping, small_grammar

from grammar.derivation.derive import derive
from grammar.geometry.run_slots import unit_poses
from grammar.geometry.walls import WALL_YAW
from grammar.geometry.zones import opening_frame
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.energies import full_energy
from grammar.layout.unit_rows import arrange
from grammar.spec.energy_terms import TERM
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import RequestError, SceneRequest
from grammar.spec.rules import Grammar
from scene_description import FieldError, from_mapping


def with_run(text, run):
    return text.replace("kind: and,", f"kind: and, run: {run},")


def assembled(grammar, counts=()):
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet", counts=counts), np.random.default_rng(0))
    return (tree, *assemble(grammar, CATEGORIES, tree))


def test_end_on_units_stand_back_to_back_and_a_joint_apart_in_every_slot():
    text = with_run(closet("a", "b"), "{wall_gap_m: 0.02, joint_m: 0.1, flush: false}")
    text += "".join(item(symbol, "desk", (0.8, 1.5, 0.74), ", in_run: {end_on: true}") for symbol in "ab")
    tree, problem, state = assembled(small_grammar(text))
    plan, rule = tree.unit_rows[0], small_grammar(text).nodes["closet"].run
    rules = [small_grammar(text).objects["a"].in_run] * 2
    assert {slot.direction for slot in plan.slots} == {1.0, -1.0}
    for k, slot in enumerate(plan.slots):
        units = np.flatnonzero(problem.link[:, col.ROW] == 0)
        state.hold[units, col.SLOT] = k
        arrange(problem, state, 0, 0.5 * slot.slide)
        first, last = units[np.argsort(state.hold[units, col.PLACE])]
        line, apart = slot.line(0), state.pose[last, :2] - state.pose[first, :2]
        normal = np.array([math.cos(line.yaw_rad), math.sin(line.yaw_rad)])
        assert np.hypot(*apart) == pytest.approx(0.9) and apart @ normal == pytest.approx(0.0, abs=1e-9)
        for i, away in ((first, -apart), (last, apart)):
            assert (state.pose[i, :2] - (line.x_m, line.y_m)) @ normal == pytest.approx(0.02 + 0.75)
            assert math.cos(state.pose[i, 2] - math.atan2(away[1], away[0])) == pytest.approx(1.0)
        twin = unit_poses(slot, 0.5 * slot.slide, [[(1.5, 0.8)] * 2], rules, rule)
        assert np.array([pose[:2] for pose in twin]) == pytest.approx(state.pose[[first, last], :2])
        assert np.cos([pose[2] for pose in twin] - state.pose[[first, last], 2]) == pytest.approx(1.0)


def test_a_run_with_free_ends_touches_no_side_wall():
    text = with_run(closet("a"), "{end_gap_m: 1.1, ends_free: true}") + item("a", "dresser", (0.5, 1.6, 0.8), ", in_run: {}")
    data = mapping(text)
    data["openings"]["door"] |= {"end_gap_m": 1.5, "near_corner": 0.0}  # its leaf reaches no other wall
    tree, problem, state = assembled(from_mapping(Grammar, data))
    door_yaw = problem.wall[tree.room.openings[0].wall, WALL_YAW]
    free = [(k, slot) for k, slot in enumerate(tree.unit_rows[0].slots) if math.cos(slot.yaw_a - door_yaw) < 0.9]
    assert free
    for k, slot in free:
        state.hold[problem.link[:, col.ROW] == 0, col.SLOT] = k
        for shift in (0.0, slot.slide):
            arrange(problem, state, 0, shift)
            at = state.pose[np.flatnonzero(problem.link[:, col.ROW] == 0)[0], :2]
            wall = next(row for row in problem.wall if math.cos(row[WALL_YAW] - slot.yaw_a) > 0.9)
            assert 0.8 + 1.1 - 1e-9 <= (at - wall[:2]) @ wall[2:4] <= 4.0 - 1.9 + 1e-9


def test_an_end_on_unit_that_stretches_is_refused():
    text = with_run(closet("a"), "{}") + item("a", "desk", (0.8, 1.5, 0.74), ", in_run: {end_on: true, stretches: true}")
    with pytest.raises(FieldError, match=r"objects\.a\.in_run\.end_on: expected no value with turns or stretches"):
        small_grammar(text)


def test_a_unit_that_likes_light_from_the_side_pays_at_the_window_s_wall_and_opposite():
    text = with_run(closet("a"), "{bare_cost: 0}") + item("a", "dresser", (0.5, 0.6, 0.8), ", in_run: {near: {side_window: 1.5}}")
    tree, problem, state = assembled(small_grammar(text, weights={"run_order": 1.0}), counts=("window:1:1",))
    windows = {opening.wall for opening in tree.room.openings if opening.category == "window"}
    seen = set()
    for k, slot in enumerate(tree.unit_rows[0].slots):
        state.hold[problem.link[:, col.ROW] == 0, col.SLOT] = k
        arrange(problem, state, 0, 0.0)
        aside = any(abs(math.cos(slot.yaw_a - problem.wall[window, WALL_YAW])) < 0.5 for window in windows)
        seen.add(aside)
        assert full_energy(problem, state)[TERM.run_order] == pytest.approx(0.0 if aside else 1.5)
    assert seen == {True, False}


@pytest.mark.parametrize(("corner_aisle", "fits"), [(", corner_aisle_m: 0", True), ("", False)])
def test_a_second_run_begins_beside_the_first_one_where_the_corner_s_aisle_lets_it(corner_aisle, fits):
    """The first takes a whole wall of 4 m, 0.5 m deep, and 3.2 m before it; the second is 3.4 m long."""
    run = f"{{aisle_m: 3.2{corner_aisle}}}"
    text = (
        f"""budget: {{derivations: 60, structures: 1, layouts: 1, rounds: 1, odd: 0}}
nodes:
  closet: {{kind: and, branches: [{{symbol: first}}, {{symbol: second}}]}}
  first: {{kind: and, run: {run}, branches: [{{symbol: a}}]}}
  second: {{kind: and, run: {run}, branches: [{{symbol: b}}]}}
objects:
"""
        + item("a", "dresser", (0.5, 3.98, 0.8))
        + item("b", "dresser", (0.5, 3.4, 0.8))
    )
    grammar = small_grammar(text)
    if not fits:
        with pytest.raises(RequestError, match="walls that second fits at"):
            assembled(grammar)
        return
    tree, _problem, _state = assembled(grammar)
    first, second = (run.slots[run.slot] for run in tree.unit_rows)
    assert math.cos(first.yaw_a - second.yaw_a) == pytest.approx(0.0, abs=1e-9)


def test_the_deepest_unit_does_not_stand_before_a_front_round_the_corner():
    """Units 0.5 m deep turn and stand beside one of 0.6 m, which would reach 0.1 m before the front of what stands round the corner."""
    text = with_run(closet("turn", "deep", "b", "c"), "{bare_cost: 0}")
    text += item("turn", "dresser", (0.5, 0.5, 0.8), ", in_run: {turns: true}") + item("deep", "dresser", (0.6, 0.8, 0.8), ", in_run: {}")
    text += "".join(item(symbol, "dresser", (0.5, 0.8, 0.8), ", in_run: {}") for symbol in "bc")
    for seed in range(16):
        tree = derive(small_grammar(text), CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed))
        symbols = {item.id: item.symbol for item in tree.items}
        order = [symbols[unit] for unit in tree.unit_rows[0].units]
        corner = order.index("turn")
        assert corner not in (0, 3)  # something stands on both sides of the corner
        assert "deep" not in order[corner - 1 : corner + 2]


def test_the_corners_of_one_row_are_one_model():
    """Of two sizes, the smaller one would leave a gap beside it."""
    grammar = read_room_type("kitchen", CATEGORIES, "learned")
    bent = tuple(replace(branch, probability=float(branch.symbol == "u_shaped")) for branch in grammar.nodes["rows"].branches)
    grammar = replace(grammar, nodes=dict(grammar.nodes) | {"rows": replace(grammar.nodes["rows"], branches=bent)})
    for seed in range(4):
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type="kitchen"), np.random.default_rng(seed))
        first, second = (item.size_m for item in tree.items if item.symbol == "corner_unit")
        assert first == second


def test_unit_rows_keep_free_what_hangs_at_windows():
    grammar, seen = read_room_type("study", CATEGORIES), 0
    for seed in range(12):
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type="study"), np.random.default_rng(seed))
        _, state = assemble(grammar, CATEGORIES, tree)
        windows = {opening.id: opening for opening in tree.room.openings if opening.category == "window"}
        units = [tree.items[k - tree.items[0].id] for plan in tree.unit_rows for k in plan.units]
        for hung in (one for one in tree.items if one.core in windows and one.rule.mount == "wall"):
            x, y, yaw = opening_frame(tree.room, windows[hung.core])
            for unit in units:
                dx, dy, turn = *(state.pose[unit.id - 1, :2] - (x, y)), state.pose[unit.id - 1, 2] - yaw
                into, along = dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw)
                half_d, half_w = 0.5 * unit.size_m[0], 0.5 * unit.size_m[1]
                deep, wide = (half_d, half_w) if abs(math.cos(turn)) > 0.5 else (half_w, half_d)
                seen += 1
                assert unit.size_m[2] < hung.bottom_m or into - deep > hung.size_m[0] or abs(along) > wide + 0.5 * hung.size_m[1] - 1e-6
    assert seen > 30
