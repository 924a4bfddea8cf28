"""Energy terms against values computed by hand, and incremental against full energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, closet, entered, item, small_grammar

from grammar.derivation.derive import derive
from grammar.geometry.walls import REFLEX, WALL_YAW, outside_distance, rectangle_outside, wall_rows
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.energies import full_energy
from grammar.layout.entrants import enter
from grammar.layout.frames import place_object
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import move_settings
from grammar.spec.energy_terms import TERMS
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import SceneRequest

TEXT = (
    closet("table", "stool", "mug")
    + item("table", "desk", (0.8, 1.6, 0.7), ", wall: [{distance_m: 0.1}], access: [{side: front, depth_m: 0.5}]")
    + item("stool", "wardrobe", (0.4, 0.4, 0.5), ", cores: {table: 1}, around: [{side: front, gap_m: 0.2, orientation_rad: 3.0}]")
    + item("mug", "mug", (0.1, 0.1, 0.1), ", mount: object, supporters: {table: 1}, placements: [{depth_fraction: 0, width_fraction: 0}]")
)


@pytest.fixture
def placed():
    """A table whose back is 0.3 m from the wall x = -2 and turned by 0.1, a stool before it, a mug on it."""
    grammar = small_grammar(TEXT)
    problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0)))
    first = len(state.active) - 3
    state.surface[first + 2] = 0
    state.z[first + 2] = 0.7
    return problem, state, first


def put(problem, state, i, x, y, yaw):
    state.pose[i] = x, y, yaw
    state.active[i] = True
    place_object(problem, state, i)


def energies(problem, state):
    return dict(zip(TERMS, full_energy(problem, state), strict=True))


def test_wall_group_and_support_losses_are_differences_to_their_means(placed):
    problem, state, table = placed
    turn = 0.1
    reach = 0.4 * math.cos(turn) + 0.8 * math.sin(turn)
    put(problem, state, table, -2 + 0.3 + reach, 0.0, turn)
    losses = energies(problem, state)
    assert losses["wall_distance"] == pytest.approx(0.3 - 0.1)
    assert losses["wall_orientation"] == pytest.approx(0.1)

    x, y = state.pose[table, :2]
    c, s = math.cos(turn), math.sin(turn)
    # the mode means: 0.4 + 0.2 + half the stool's extent, turned by 3 rad, before the table
    ahead = 0.6 + 0.2 * (abs(math.cos(3.0)) + math.sin(3.0))
    put(problem, state, table + 1, x + ahead * c - 0.07 * s, y + ahead * s + 0.07 * c, turn + 3.0 - 0.25)
    losses = energies(problem, state)
    assert losses["group_distance"] == pytest.approx(0.07)
    assert losses["group_orientation"] == pytest.approx(0.25)
    assert losses["occlusion"] == 0.0

    put(problem, state, table + 2, x + 0.1 * c, y + 0.1 * s, turn - 0.2)
    losses = energies(problem, state)
    assert losses["support_position"] == pytest.approx(0.2)
    assert losses["support_orientation"] == pytest.approx(0.2)
    assert losses["support_address"] == pytest.approx(0.0)
    assert losses["overhang"] == losses["overlap"] == losses["out_of_room"] == 0.0


def test_hard_losses_are_depths(placed):
    problem, state, table = placed
    put(problem, state, table, -2 + 0.4 - 0.05, 0.0, 0.0)
    assert energies(problem, state)["out_of_room"] == pytest.approx(0.05)
    put(problem, state, table, 0.0, 0.0, 0.0)
    # a block of 0.4 m that begins 0.03 m inside the top's front edge, and overlaps nothing else of the table
    put(problem, state, table + 1, 0.4 + 0.2 - 0.03, 0.0, 0.0)
    assert energies(problem, state)["overlap"] == 0.0  # it is lower than the top and fits between the legs
    put(problem, state, table + 1, 0.4 + 0.2 - 0.03, 0.8, 0.0)
    assert energies(problem, state)["overlap"] == pytest.approx(0.03)
    # the top ends 0.01 m inside the edge, at 0.79; the mug's half is 0.05
    put(problem, state, table + 2, 0.0, 0.78, 0.0)
    assert energies(problem, state)["overhang"] == pytest.approx(0.04)


def test_walls_take_accessible_space_as_furniture_does(placed):
    problem, state, table = placed
    put(problem, state, table, 2.0 - 0.4 - 0.3, 0.0, 0.0)
    assert energies(problem, state)["occlusion"] == pytest.approx((0.5 - 0.3) / 0.5)


def test_distance_outside_of_a_room_with_a_corner_that_sticks_in():
    polygon = np.array([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)], float)
    wall = wall_rows(polygon)
    assert wall[:, WALL_YAW] == pytest.approx([math.pi / 2, math.pi, -math.pi / 2, math.pi, -math.pi / 2, 0.0])
    for point, expected in (((1, 3), 0.0), ((3, 1), 0.0), ((3, 3), 1.0), ((2.2, 3), 0.2), ((-0.5, -0.5), math.sqrt(0.5)), ((5, 1), 1.0)):
        assert outside_distance(wall, *map(float, point)) == pytest.approx(expected)
    assert wall[wall[:, REFLEX] > 0, :2].tolist() == [[2.0, 2.0]]
    # a diagonal plank across the corner: its own corners are inside, the room's is 0.1 inside of it
    c = s = math.sqrt(0.5)
    assert rectangle_outside(wall, 2.0 - 0.2 * c, 2.0 - 0.2 * s, c, s, 0.3, 1.0) == pytest.approx(0.1)


def test_what_reaches_through_a_sloped_ceiling_is_out_of_the_room(placed):
    """The ceiling rises from 0.5 m at the wall y = -2 by 1 m a metre; the table is 0.7 m high, the mug on it 0.1 m."""
    problem, state, table = placed
    problem = problem._replace(slope=np.array([(0.0, 1.0, 2.5, math.sqrt(0.5))]))
    put(problem, state, table, 0.0, -1.1, 0.0)
    assert energies(problem, state)["out_of_room"] == pytest.approx((0.7 - 0.6) * math.sqrt(0.5))
    put(problem, state, table, 0.0, -0.9, 0.0)
    assert energies(problem, state)["out_of_room"] == 0.0
    put(problem, state, table + 2, 0.0, -1.69, 0.0)
    assert energies(problem, state)["out_of_room"] == pytest.approx((0.8 + 1.74 - 2.5) * math.sqrt(0.5))


def test_incremental_energy_is_the_full_energy():
    for seed, kind, ceiling, least in ((0, "by_hand", "flat", 18), (2, "learned", "two_slopes", 12)):
        grammar = read_room_type("bedroom", CATEGORIES, kind)
        rng = np.random.default_rng(seed)
        request = SceneRequest(min_objects=least, max_objects=30, room_ceiling=ceiling)
        problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, request, rng))
        settings = move_settings(replace(grammar.moves, swap=grammar.moves.translate))  # few pairs can be swapped
        for i in np.concatenate(
            [np.flatnonzero((state.active == 0) & (problem.mount != col.OBJECT)), np.flatnonzero(problem.mount == col.OBJECT)]
        ):
            assert enter(rng, problem, state, settings, i, 3)
        movable = np.flatnonzero(problem.mount != col.FIXED)
        # a low beta accepts moves of every kind, overlaps included
        info = run_chain(rng, Chain(problem, settings), state, ChainRun(150_000, 0.02, 0.0), movable)
        assert info.counts[:, col.ACCEPTED].min() >= 20
        scale = np.maximum(1.0, full_energy(problem, state))
        assert np.abs(info.energy - full_energy(problem, state)) / scale == pytest.approx(0.0, abs=1e-9)


HUNG = (
    closet("desk", "picture", "shelf", "vase")
    + item("desk", "desk", (0.7, 1.4, 0.75), ", wall: [{distance_m: 0.02}]")
    + "".join(
        item(symbol, category, size, f", mount: wall, centre_height_m: {{mean: {z}, sd: 0.1, low: {z}, high: {z}}}, cores: {{desk: 1}}, "
             f"around: [{{side: centre, align: -1, along_m: 0.0}}]")
        for symbol, category, size, z in (("picture", "picture", (0.02, 0.5, 0.4), 2.0), ("shelf", "wall_shelf", (0.2, 0.8, 0.04), 1.4))
    )
    + item("vase", "vase", (0.1, 0.1, 0.2), ", mount: object, supporters: {shelf: 1}, placements: [{depth_fraction: 0}]")
)  # fmt: skip


def test_what_hangs_over_a_thing_that_stands_follows_it_from_wall_to_wall():
    grammar = small_grammar(HUNG)
    rng = np.random.default_rng(3)
    problem, state, settings = entered(grammar, rng)
    desk, shelf = (int(np.argmin(np.abs(problem.object[:, col.HALF_WIDTH] - 0.5 * width))) for width in (1.4, 0.8))
    vase = int(np.flatnonzero(problem.mount == col.OBJECT)[0])
    movable, walls = np.flatnonzero(problem.mount != col.FIXED), set()
    for _ in range(200):
        energy = run_chain(rng, Chain(problem, settings), state, ChainRun(500, 0.01, 0.0), movable).energy
        wall = problem.wall[state.on_wall[shelf]]
        walls.add(int(state.on_wall[shelf]))
        assert (state.pose[shelf, :2] - wall[:2]) @ wall[5:7] == pytest.approx(0.1)
        nearest = np.abs((state.pose[desk, :2] - problem.wall[:, :2])[:, None] @ problem.wall[:, 5:7, None])[:, 0, 0]
        turned = nearest + 10.0 * (1.0 - np.cos(state.pose[desk, 2] - problem.wall[:, 7]))
        assert state.on_wall[shelf] == np.argmin(turned)
        x, y, _ = state.pose[vase] - state.pose[shelf]
        c, s = math.cos(state.pose[shelf, 2]), math.sin(state.pose[shelf, 2])
        assert abs(x * c + y * s) < 0.1 and abs(y * c - x * s) < 0.4
        assert state.z[vase] == pytest.approx(state.z[shelf] + 0.04)
        scale = np.maximum(1.0, full_energy(problem, state))
        assert np.abs(energy - full_energy(problem, state)) / scale == pytest.approx(0.0, abs=1e-9)
    assert walls == {0, 1, 2, 3}


def test_what_hangs_over_a_thing_at_the_end_of_a_wall_can_always_come_in():
    """The picture, 0.5 m wide, belongs over the middle of the desk, 0.17 m from the end of the wall; nine in ten poses stick out."""
    grammar = small_grammar(HUNG)
    rng = np.random.default_rng(0)
    problem, state, settings = entered(grammar, rng)
    desk, picture = (int(np.argmin(np.abs(problem.object[:, col.HALF_WIDTH] - 0.5 * width))) for width in (1.4, 0.5))
    put(problem, state, desk, float(problem.x_low) + 0.17, float(problem.y_low) + 0.37, 0.5 * math.pi)
    settings = settings._replace(relocate_uniform=1e-9)
    for _ in range(40):
        state.active[picture] = False
        assert enter(rng, problem, state, settings, picture, 1)


def test_carried_things_keep_their_place(placed):
    problem, state, table = placed
    put(problem, state, table, 0.0, 0.0, 0.3)
    put(problem, state, table + 2, 0.1, 0.05, 0.9)
    put(problem, state, table + 1, 1.0, 0.5, 0.0)
    grammar = small_grammar(TEXT, moves={"translate": 0.5, "rotate": 0.5})
    c, s = math.cos(0.3), math.sin(0.3)
    before = (0.1 * c + 0.05 * s, 0.05 * c - 0.1 * s, 0.6)
    chain, run = Chain(problem, move_settings(grammar.moves)), ChainRun(200, 1e-3, 0.0)
    info = run_chain(np.random.default_rng(1), chain, state, run, np.array([table]))
    assert info.counts[:, col.ACCEPTED].sum() > 50
    x, y, yaw = state.pose[table + 2] - state.pose[table]
    c, s = math.cos(state.pose[table, 2]), math.sin(state.pose[table, 2])
    assert (x * c + y * s, y * c - x * s) == pytest.approx(before[:2])
    assert math.cos(yaw - before[2]) == pytest.approx(1.0)


def test_moving_a_core_away_costs_what_its_group_loses_however_far():
    """The chain must feel a far group's loss: with the core alone moving, the distance follows the gamma density around its followers."""
    text = closet("table", "seat") + item("table", "desk", (0.3, 0.3, 0.7))
    text += item("seat", "desk_chair", (0.3, 0.3, 0.8), ", cores: {table: 1}, around: [{side: front, gap_m: 1.0}]")
    grammar = small_grammar(text, weights={"group_distance": 10.0}, moves={"translate": 1.0})
    rng = np.random.default_rng(8)
    problem, start = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), rng))
    settings = move_settings(replace(grammar.moves, carry=0.0))
    table = len(start.active) - 2
    state = start
    put(problem, state, table, -0.3, 0.0, 0.0)
    put(problem, state, table + 1, 1.0, 0.0, 0.0)
    seen = []
    for _ in range(1500):
        run_chain(rng, Chain(problem, settings), state, ChainRun(40, 1.0, 1e9), np.array([table]))
        seen.append(energies(problem, state)["group_distance"])
    # r is gamma distributed with shape 2 and scale 1 / 10: mean 0.2, standard error of 1500 draws 0.004 and, as they hang together, more
    assert np.mean(seen) == pytest.approx(0.2, abs=0.03)
    assert np.quantile(seen, 0.99) < 1.0


def test_what_belongs_to_a_thing_may_stand_in_its_access_space_but_not_its_core():
    text = closet("bed", "wardrobe") + item("bed", "bed", (2.0, 1.0, 0.6), ", access: [{side: front, depth_m: 0.5}]")
    text += item(
        "wardrobe",
        "wardrobe",
        (0.6, 1.0, 2.0),
        ", cores: {bed: 1}, around: [{side: front, gap_m: 0.3}], access: [{side: front, depth_m: 0.6}]",
    )
    grammar = small_grammar(text)
    problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0)))
    bed = len(state.active) - 2
    put(problem, state, bed, -1.0, 0.0, 0.0)
    # the wardrobe looks at the foot of the bed from 0.45 m: it takes 0.05 of the bed's 0.5 for free, the bed 0.15 of its 0.6
    put(problem, state, bed + 1, 0.45 + 0.3, 0.0, math.pi)
    assert energies(problem, state)["occlusion"] == pytest.approx(0.15 / 0.6)


def test_a_chair_whose_rule_names_no_access_needs_room_behind_it_and_keeps_to_its_table():
    text = closet("table", "chair") + item("table", "desk", (0.8, 1.6, 0.75))
    around = "around: [{side: front, gap_m: 0, orientation_rad: 3.141592653589793, spread: 9}]"
    grammar = small_grammar(text + item("chair", "desk_chair", (0.5, 0.5, 0.9), f", cores: {{table: 1}}, {around}"))
    problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0)))
    table = len(state.active) - 2
    put(problem, state, table, 1.0, 0.0, math.pi)
    put(problem, state, table + 1, 0.35 - 0.1, 0.0, 0.0)
    losses = energies(problem, state)
    # 0.1 m off its place, by a spread of 2.5 at most; 2 m of floor behind it
    assert (losses["group_distance"], losses["occlusion"]) == pytest.approx((0.1 / 2.5, 0.0))
    put(problem, state, table, -0.9, 0.0, math.pi)
    put(problem, state, table + 1, -1.55, 0.0, 0.0)
    assert energies(problem, state)["occlusion"] == pytest.approx((0.3 - 0.2) / 0.3)


def test_screens_and_the_largest_seat_face_each_other_and_keep_off_windows():
    text = (
        closet("sofa", "armchair", "stand", "screen")
        + item("sofa", "sofa", (0.9, 2.0, 0.8))
        + item("armchair", "armchair", (0.8, 0.8, 0.8))
    )
    text += item("stand", "side_table", (0.4, 1.2, 0.5))
    text += item("screen", "television", (0.1, 0.8, 0.5), ", mount: object, supporters: {stand: 1}, placements: [{depth_fraction: 0}]")
    grammar = small_grammar(text)
    problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0)))
    screen = len(state.active) - 1
    state.surface[screen], state.z[screen] = 0, 0.5
    assert problem.link[screen, col.WATCHED] == screen - 3
    windows = np.flatnonzero(state.active)
    state.active[windows] = False
    put(problem, state, screen - 3, -1.5, 0.0, 0.0)
    put(problem, state, screen - 1, 1.5, 1.0, math.pi)
    put(problem, state, screen, 1.5, 0.0, math.pi)
    assert energies(problem, state)["screen_aside"] == 0.0
    put(problem, state, screen, 1.5, 3.0, math.pi)  # 45 degrees aside of both, 20 more than is free
    assert energies(problem, state)["screen_aside"] == pytest.approx(math.radians(20.0))
    put(problem, state, screen, 1.5, 0.0, math.pi + 0.75)
    assert energies(problem, state)["screen_aside"] == pytest.approx(0.75 - math.radians(25.0))


def test_rugs_are_drawn_out_from_under_stores():
    grammar = small_grammar(closet("rug", "shelf") + item("rug", "rug", (1.0, 2.0, 0.01)) + item("shelf", "bookshelf", (0.4, 1.0, 1.8)))
    problem, state = assemble(grammar, CATEGORIES, derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0)))
    rug = len(state.active) - 2
    put(problem, state, rug, 0.0, 0.0, 0.0)
    put(problem, state, rug + 1, 0.7 - 0.12, 0.0, 0.0)
    assert energies(problem, state)["occlusion"] == pytest.approx(0.12 / 0.3)
    put(problem, state, rug + 1, 0.71, 0.0, 0.0)
    assert energies(problem, state)["occlusion"] == 0.0


def test_a_shower_off_its_corner_is_a_hard_loss():
    text = closet("shower") + item("shower", "shower_cabin", (0.9, 0.9, 2.0), ", wall: [{distance_m: 0}]")
    problem, state, _ = entered(small_grammar(text), np.random.default_rng(0))
    i = len(state.active) - 1
    # its back at the wall x = -2, its left side 0.1 and 0.4 m from the wall y = 2: 0.12 m are left free, and 0.08 m behind it
    for back, gap, loss in ((0.0, 0.1, 0.0), (0.0, 0.4, 0.28), (0.2, 0.1, 0.12)):
        put(problem, state, i, -2.0 + 0.45 + back, 2.0 - 0.45 - gap, 0.0)
        assert energies(problem, state)["off_wall"] == pytest.approx(loss)
