"""Runs: where they can stand, what their order costs, and that their moves sample what they must."""

import itertools
import math
from collections import Counter

import numpy as np
import pytest
from scipy import stats
from small_grammar import CATEGORIES, closet, item, mapping, small_grammar

from grammar.derivation.derive import derive
from grammar.derivation.row_fit import order_cost
from grammar.geometry.walls import WALL_YAW
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.energies import full_energy
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import move_settings
from grammar.layout.schedule import leaders
from grammar.layout.unit_row_tables import begin_rows
from grammar.layout.unit_rows import arrange
from grammar.spec.energy_terms import TERM
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import SceneRequest
from grammar.spec.rules import Grammar
from scene_description import from_mapping

WISHES = {
    "small": "near: {end: 1.5}",
    "larger": "near: {end: 0.4}",
    "middle": "near: {corner: 0.7}",
    "large": "apart: {small: 0.9}",
}


def row_text(run, *symbols):
    return closet(*symbols).replace("kind: and,", f"kind: and, run: {run},")


def row_of(widths, run="{}", more=""):
    """Return a grammar of one run with units of these widths in a room of 4 x 4 m with no window."""
    text = row_text(run, *widths) + "".join(
        item(symbol, "dresser", (0.5, width, 0.8), f", in_run: {{{WISHES.get(symbol, '')}}}") for symbol, width in widths.items()
    )
    return small_grammar(text + more, weights={"run_order": 1.0})


def assembled(grammar, seed=0):
    rng = np.random.default_rng(seed)
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), rng)
    problem, state = assemble(grammar, CATEGORIES, tree)
    return tree, problem, state


def settings_of(moves):
    return move_settings(small_grammar(closet("a") + item("a", "dresser", (0.5, 0.5, 0.5)), moves=moves).moves)


def order_of(problem, state, run=0):
    units = np.flatnonzero(problem.link[:, col.ROW] == run)
    return tuple(units[np.argsort(state.hold[units, col.PLACE])].tolist())


def wall_behind(problem, line):
    """Return the number of the wall that the line of a leg lies on."""
    off = (line[:2] - problem.wall[:, :2]) * problem.wall[:, 5:7]
    same = np.cos(problem.wall[:, WALL_YAW] - line[2]) > 0.99
    return int(np.flatnonzero(same & (np.abs(off.sum(1)) < 1e-6))[0])


def test_units_touch_each_other_and_keep_off_the_wall():
    tree, problem, state = assembled(row_of({"small": 0.4, "middle": 0.6, "large": 0.9}))
    plan = tree.unit_rows[0]
    for slot in range(len(plan.slots)):
        state.hold[problem.link[:, col.ROW] == 0, col.SLOT] = slot
        arrange(problem, state, 0, 0.5 * plan.slots[slot].slide)
        order = order_of(problem, state)
        wall = problem.wall[wall_behind(problem, plan.slots[slot].line(0))]
        along = [(state.pose[i, :2] - wall[:2]) @ wall[2:4] for i in order]
        across = [(state.pose[i, :2] - wall[:2]) @ wall[5:7] for i in order]
        assert across == pytest.approx([0.255] * 3)
        half = [problem.object[i, col.HALF_WIDTH] for i in order]
        steps = [half[0] + half[1], half[1] + half[2]]
        assert np.diff(along) == pytest.approx([plan.slots[slot].direction * step for step in steps])


@pytest.mark.parametrize("moves", [{"swap": 1.0}, {"relocate": 1.0}, {"swap": 0.5, "relocate": 0.2, "slide": 0.3}])
def test_orders_and_slots_are_in_detailed_balance_with_the_enumerated_energies(moves):
    """Every order of three units in every slot: the chain is as often there as energy and the uniform measure over slots say."""
    grammar = row_of({"small": 0.4, "middle": 0.6, "large": 0.9}, "{end_gap_m: 0.3}")
    _, problem, state = assembled(grammar)
    settings = settings_of(moves)
    units, slots = np.flatnonzero(problem.link[:, col.ROW] == 0), np.arange(*problem.row[0, [col.ROW_SLOTS, col.ROW_SLOTS_END]])
    assert len(slots) >= 4 and np.ptp(problem.slot[slots, col.SLIDE]) >= 0.0
    orders = list(itertools.permutations(units.tolist()))
    energy = {}
    for order in orders:
        for place, i in enumerate(order):
            state.hold[i, col.PLACE] = place
        arrange(problem, state, 0, 0.0)
        energy[order] = float(full_energy(problem, state) @ problem.weight)
    assert max(energy.values()) - min(energy.values()) > 0.5
    moves_slots = "relocate" in moves
    states = list(
        itertools.product(
            orders if "swap" in moves else [order_of(problem, state)], slots if moves_slots else [state.hold[units[0], col.SLOT]]
        )
    )
    target = np.array([math.exp(-energy[order]) for order, _ in states])
    seen: Counter = Counter()
    rng, chain = np.random.default_rng(4), Chain(problem, settings)
    for _ in range(3000):
        run_chain(rng, chain, state, ChainRun(40, 1.0, 1.0), leaders(problem))
        seen[order_of(problem, state), state.hold[units[0], col.SLOT]] += 1
    assert set(seen) <= set(states)
    counts = np.array([seen[key] for key in states])
    assert stats.chisquare(counts, target / target.sum() * counts.sum()).pvalue > 1e-4


def test_the_shift_of_a_run_is_uniform_along_its_slot():
    """In a room without doors in the way a run that need not touch a side wall slides freely."""
    _, problem, state = assembled(row_of({"small": 0.4, "large": 0.9}, "{flush: false, end_gap_m: 0.2}"))
    slides = np.flatnonzero(problem.slot[:, col.SLIDE] > 1.0)
    settings = settings_of({"slide": 1.0})
    state.hold[problem.link[:, col.ROW] == 0, col.SLOT] = slides[0]
    arrange(problem, state, 0, 0.3)
    slot, head = problem.slot[slides[0]], order_of(problem, state)[0]
    start, yaw, rng, shares = slot[[col.LEG_X, col.LEG_Y]], slot[col.LEG_YAW], np.random.default_rng(5), []
    for _ in range(400):
        run_chain(rng, Chain(problem, settings), state, ChainRun(400, 1.0, 1.0), leaders(problem))
        along = (state.pose[head, :2] - start) @ [math.sin(yaw), -math.cos(yaw)]
        shift = slot[col.DIRECTION] * along - problem.object[head, col.HALF_WIDTH]
        shares.append(shift / slot[col.SLIDE])
    assert 0.0 <= min(shares) and max(shares) <= 1.0
    assert stats.kstest(shares, "uniform").pvalue > 1e-4


@pytest.mark.parametrize("turning_m", [0.502, 0.4])
def test_a_run_round_a_corner_leaves_no_gap_and_mirrors(turning_m):
    """Two legs and a unit that turns: in every slot each unit touches the next, and the turning one has two walls at its back and right.

    The others are no deeper than it is wide, as those of the second leg would stand before the front of the first leg's last.  A unit that
    is nearly square is made square, and can be walked past either way; another is not, and the run keeps its direction.
    """
    widths = {"small": 0.4, "middle": 0.6, "large": 0.9, "wide": 1.1}
    text = row_text("{}", *widths, "turn")
    text += "".join(item(symbol, "dresser", (min(0.5, turning_m), width, 0.8), ", in_run: {}") for symbol, width in widths.items())
    text += item("turn", "dresser", (0.5, turning_m, 0.8), ", in_run: {turns: true}")
    tree, problem, state = assembled(small_grammar(text, weights={}))
    plan, corner = tree.unit_rows[0], int(np.flatnonzero(problem.link[:, col.TURNS])[0])
    width = 0.5 if turning_m > 0.5 else turning_m
    assert len(plan.legs) == 2 and len({slot.direction for slot in plan.slots}) == (2 if width == 0.5 else 1)
    assert problem.object[corner, col.HALF_WIDTH] == pytest.approx(0.5 * width)
    for k in range(len(plan.slots)):
        state.hold[problem.link[:, col.ROW] == 0, col.SLOT] = k
        arrange(problem, state, 0, 0.0)
        boxes = []
        for i in order_of(problem, state):
            x, y, yaw = state.pose[i]
            c, s = abs(math.cos(yaw)), abs(math.sin(yaw))
            d, w = problem.object[i, [col.HALF_DEPTH, col.HALF_WIDTH]]
            boxes.append((x, y, d * c + w * s, d * s + w * c))
        for (ax, ay, au, av), (bx, by, bu, bv) in itertools.pairwise(boxes):
            gap = max(abs(ax - bx) - au - bu, abs(ay - by) - av - bv)
            assert gap == pytest.approx(0.0, abs=1e-9)
        x, y, yaw = state.pose[corner]
        for turn, side in ((math.pi, 0.5), (-0.5 * math.pi, width)):  # 5 mm to a wall behind it and to its right
            half = 0.5 * side + 0.005
            px, py = x + half * math.cos(yaw + turn), y + half * math.sin(yaw + turn)
            gaps = (np.array([px, py]) - problem.wall[:, :2])[:, None] @ problem.wall[:, 5:7, None]
            assert np.abs(gaps).min() == pytest.approx(0.0, abs=1e-9)


def test_wishes_cost_what_is_written_in_the_chain_and_in_the_derivation():
    grammar = row_of({"small": 0.4, "middle": 0.6, "large": 0.9, "larger": 0.95})
    tree, problem, state = assembled(grammar)
    symbol = {item.id - 1: item.symbol for item in tree.items}
    rules = {name: rule.in_run for name, rule in grammar.objects.items()}
    for order in itertools.permutations(np.flatnonzero(problem.link[:, col.ROW] == 0).tolist()):
        for place, i in enumerate(order):
            state.hold[i, col.PLACE] = place
        arrange(problem, state, 0, 0.0)
        names = [symbol[i] for i in order]
        # the run has no unit that turns, so that wish costs nothing
        expected = 0.9 * (abs(names.index("large") - names.index("small")) == 1)
        for name, other, cost in (("small", "larger", 1.5), ("larger", "small", 0.4)):  # beside the other at an end is at an end too
            place = names.index(name)
            expected += cost * (place in (1, 2) and names[0 if place == 1 else 3] != other)
        assert full_energy(problem, state)[TERM.run_order] == pytest.approx(expected)
        assert order_cost([(name, rules[name]) for name in names], [frozenset()] * 4, False) == pytest.approx(expected)


def test_a_run_stretches_to_the_end_of_its_wall_and_what_hangs_in_line_is_as_wide():
    """Four metres less two gaps of 5 mm: three units of 0.5, 0.5 and 1.2 m stretch, the one of 0.6 m does not."""
    data = mapping(
        row_text("{bare_cost: 100}", "a", "b", "c", "fixed_width").replace("{symbol: fixed_width}", "{symbol: fixed_width}, {symbol: top}")
        + item("fixed_width", "stove", (0.6, 0.6, 0.9), ", in_run: {}")
    )
    size = {"category": "kitchen_counter", "low_m": [0.6, 0.3, 0.9], "high_m": [0.6001, 1.9, 0.9001], "in_run": {"stretches": True}}
    for symbol, width in (("a", 0.5), ("b", 0.5), ("c", 1.2)):
        data["objects"][symbol] = size | {"sizes": [{"mean_m": [0.6, width, 0.9], "sd_m": [1e-6, 1e-6, 1e-6]}]}
    data["objects"]["top"] = {
        "category": "wall_cabinet", "mount": "wall", "in_line": True, "cores": {"c": 1}, "around": [{"side": "centre", "align": -1}],
        "sizes": [{"mean_m": [0.3, 0.9, 0.7], "sd_m": [0.1, 0.1, 0.1]}], "low_m": [0.3, 0.1, 0.7], "high_m": [0.31, 3.0, 0.71],
        "centre_height_m": {"mean": 1.8, "sd": 0.1, "low": 1.8, "high": 1.81}, "tied": [{"axis": "width", "to": "core", "of": "width"}],
    }  # fmt: skip
    data["openings"]["door"] |= {"end_gap_m": 1.0, "near_corner": 0.0}
    grammar = from_mapping(Grammar, data)
    # at a wall without a door
    found = (assembled(grammar, seed) for seed in range(20))
    tree, problem, state = next(
        (tree, problem, state)
        for tree, problem, state in found
        if wall_behind(problem, tree.unit_rows[0].slots[tree.unit_rows[0].slot].line(0)) != tree.room.openings[0].wall
    )
    widths = {item.symbol: item.size_m[1] for item in tree.items}
    scale = [widths[name] / drawn for name, drawn in (("a", 0.5), ("b", 0.5), ("c", 1.2))]
    assert scale == pytest.approx([scale[0]] * 3, rel=1e-5) and widths["fixed_width"] == pytest.approx(0.6, abs=1e-6)
    leg = 2.0 * problem.object[problem.link[:, col.ROW] == 0, col.HALF_WIDTH].sum()
    assert leg == pytest.approx(3.99, abs=1e-6)
    top = next(item.id - 1 for item in tree.items if item.symbol == "top")
    below = int(problem.core[top])
    assert widths["top"] == widths["c"] and problem.link[top, col.IN_LINE] == 1
    # wherever the run goes, the cabinet hangs above the middle of its unit, with its back to the wall
    rng, walls = np.random.default_rng(1), set()
    chain = Chain(problem, move_settings(grammar.moves))
    for _ in range(30):
        run_chain(rng, chain, state, ChainRun(50, 0.01, 1e9), leaders(problem))
        wall = problem.wall[state.on_wall[top]]
        walls.add(int(state.on_wall[top]))
        assert (state.pose[top, :2] - state.pose[below, :2]) @ wall[2:4] == pytest.approx(0.0, abs=1e-9)
        assert (state.pose[top, :2] - wall[:2]) @ wall[5:7] == pytest.approx(problem.object[top, col.HALF_DEPTH])
    assert len(walls) >= 2


def test_incremental_energy_is_the_full_energy_where_runs_move():
    grammar = read_room_type("kitchen", CATEGORIES)
    for seed in (0, 1):
        rng = np.random.default_rng(seed)
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type="kitchen"), rng)
        problem, state = assemble(grammar, CATEGORIES, tree)
        movable = problem.row[:, col.ROW_HEAD]
        chain, run = Chain(problem, move_settings(grammar.moves)), ChainRun(3000, 0.005, 0.0)
        info = run_chain(rng, chain, state, run, np.asarray(movable))
        assert info.counts[:, col.ACCEPTED].sum() >= 20
        scale = np.maximum(1.0, full_energy(problem, state))
        assert np.abs(info.energy - full_energy(problem, state)) / scale == pytest.approx(0.0, abs=1e-9)


def test_the_state_in_which_a_run_begins_is_that_of_its_plan():
    grammar = read_room_type("kitchen", CATEGORIES)
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="kitchen"), np.random.default_rng(2))
    problem, state = assemble(grammar, CATEGORIES, tree)
    before = state.where.copy()
    begin_rows(problem, tree, state)
    assert (state.where == before).all()
    for k, plan in enumerate(tree.unit_rows):
        assert tuple(i + 1 for i in order_of(problem, state, k)) == plan.units and sum(plan.legs) == len(plan.units)
