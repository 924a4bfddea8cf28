"""The chain against what it must sample: enumerated probabilities and analytic densities."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats
from small_grammar import CATEGORIES, closet, entered, item, small_grammar

from grammar.derivation.derive import derive
from grammar.layout.assemble import assemble
from grammar.layout.circulation import circulation_losses
from grammar.layout.columns import ACCEPTED, AROUND_MODES, FLOOR, MODE_X, MODE_Y, MODE_YAW, OBJECT, TRIED, WALL
from grammar.layout.energies import full_energy
from grammar.layout.frames import place_object
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import move_settings
from grammar.sampled_room import room_floor
from grammar.spec.request import SceneRequest


def chain(rng, problem, state, settings, movable, proposals, beta=1.0):
    return run_chain(rng, Chain(problem, settings), state, ChainRun(proposals, beta, 1.0), np.asarray(movable)).counts


PLACES = np.array([(-1.6, 0.0, 0.0), (0.0, 0.0, 0.0), (0.3, 1.1, 0.0)])


def test_swaps_on_three_places_are_in_detailed_balance_with_the_enumerated_energies():
    text = closet("small", "middle", "large")
    for symbol, side in (("small", 0.2), ("middle", 0.5), ("large", 0.9)):
        text += item(symbol, "dresser", (side, side, 0.5), ", wall: [{distance_m: 0.3}]")
    grammar = small_grammar(text, weights={"wall_distance": 3.0, "overlap": 1.0}, moves={"swap": 1.0})
    rng = np.random.default_rng(1)
    problem, state, settings = entered(grammar, rng)
    items = np.flatnonzero(problem.mount == FLOOR)
    orders = list(itertools.permutations(range(3)))

    def arrange(order):
        for place, i in zip(order, items, strict=True):
            state.pose[i] = PLACES[place]
            place_object(problem, state, i)

    energy = []
    for order in orders:
        arrange(order)
        energy.append(float(full_energy(problem, state) @ problem.weight))
    assert max(energy) - min(energy) > 0.5
    target = np.exp(-np.array(energy))
    target /= target.sum()

    # of the nine ordered pairs of objects, each unordered pair is drawn twice
    exact = np.zeros((6, 6))
    for a, b in itertools.permutations(range(6), 2):
        if sum(x != y for x, y in zip(orders[a], orders[b], strict=True)) == 2:
            exact[a, b] = 2.0 / 9.0 * min(1.0, math.exp(energy[a] - energy[b]))
    exact += np.diag(1.0 - exact.sum(1))
    flow = target[:, None] * exact
    assert flow == pytest.approx(flow.T)

    repeats = 4000
    for a, order in enumerate(orders):
        seen = np.zeros(6)
        for _ in range(repeats):
            arrange(order)
            chain(rng, problem, state, settings, items, 1)
            after = tuple(int(np.argmin(np.abs(PLACES - state.pose[i]).sum(1))) for i in items)
            seen[orders.index(after)] += 1
        reachable = exact[a] > 0
        assert seen[~reachable].sum() == 0
        assert stats.chisquare(seen[reachable], repeats * exact[a, reachable]).pvalue > 1e-4

    seen = np.zeros(6)
    for _ in range(6000):
        chain(rng, problem, state, settings, items, 25)
        after = tuple(int(np.argmin(np.abs(PLACES - state.pose[i]).sum(1))) for i in items)
        seen[orders.index(after)] += 1
    assert stats.chisquare(seen, target * seen.sum()).pvalue > 1e-4


def test_swaps_are_in_balance_with_circulation_and_reach():
    """A barrier in one of three places parts the room, so the orders differ in what a robot gets to, and in nothing else."""
    text = closet("small", "seat", "barrier") + item("small", "dresser", (0.2, 0.2, 0.5))
    text += item("seat", "armchair", (0.5, 0.5, 0.5), ", reach_any: [front]") + item("barrier", "wardrobe", (0.3, 3.9, 0.5))
    grammar = small_grammar(text, weights={"circulation": 4.0, "reach": 1.0}, moves={"swap": 1.0})
    rng = np.random.default_rng(7)
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), rng)
    problem, state = assemble(grammar, CATEGORIES, tree)
    floor = room_floor(grammar, tree.room)
    settings, items = move_settings(grammar.moves), np.flatnonzero(problem.mount == FLOOR)
    middle = np.mean(tree.room.polygon_m, axis=0)
    orders, energy = list(itertools.permutations(range(3))), []

    def arrange(order):
        for place, i in zip(order, items, strict=True):
            state.pose[i] = PLACES[place] + (*middle, 0.0)
            state.active[i] = 1
            place_object(problem, state, i)

    for order in orders:
        arrange(order)
        circulation, reach = circulation_losses(problem, state, floor)
        energy.append(4.0 * circulation + reach)
    assert max(energy) - min(energy) > 0.5
    target, seen, chain = np.exp(-np.array(energy)), np.zeros(6), Chain(problem, settings, floor)
    target /= target.sum()
    for _ in range(5000):
        run_chain(rng, chain, state, ChainRun(25, 1.0, 1.0), items)
        after = tuple(int(np.argmin(np.abs(PLACES[:, :2] + middle - state.pose[i, :2]).sum(1))) for i in items)
        seen[orders.index(after)] += 1
    assert stats.chisquare(seen, target * seen.sum()).pvalue > 1e-4


TOPS = (
    closet("low", "high", "mug")
    + item("low", "dresser", (0.52, 1.02, 0.5))
    + item("high", "bookshelf", (0.32, 0.42, 1.0))
    + item("mug", "mug", (0.1, 0.1, 0.1), ", mount: object, supporters: {low: 0.3, high: 0.7}, placements: [{orientation_rad: null}]")
)


@pytest.mark.parametrize("moves", [{"repoint": 1.0}, {"relocate": 1.0}, {"repoint": 0.3, "relocate": 0.3, "translate": 0.4}])
def test_supporters_are_taken_by_area_and_address_probability(moves):
    grammar = small_grammar(TOPS, weights={"support_address": 1.0}, moves=moves)
    rng = np.random.default_rng(2)
    problem, state, settings = entered(grammar, rng)
    mug = np.flatnonzero(problem.mount == OBJECT)
    seen, inside = np.zeros(2), []
    for _ in range(4000):
        chain(rng, problem, state, settings, mug, 12)
        seen[state.surface[mug[0]]] += 1
        owner = problem.surface_owner[state.surface[mug[0]]]
        inside.append(np.abs(state.pose[mug[0], :2] - state.pose[owner, :2]).max())
    expected = np.array([0.3 * 0.5 * 1.0, 0.7 * 0.3 * 0.4])
    assert stats.chisquare(seen, expected / expected.sum() * seen.sum()).pvalue > 1e-4
    assert max(inside) <= 0.75


PAIR = (
    closet("table", "seat")
    + item("table", "desk", (0.6, 1.0, 0.7))
    + item(
        "seat",
        "desk_chair",
        (0.4, 0.4, 0.8),
        ", cores: {table: 1}, around: [{side: front, gap_m: 0.1, orientation_rad: 1.0}], wall: [{distance_m: 0.2}]",
    )
)


WIDE = {"around_sd_m": 0.15, "around_orientation_sd_rad": 0.2}


@pytest.mark.parametrize(
    "moves",
    [
        {"relocate": 1.0},
        {"translate": 0.5, "rotate": 0.3, "slide": 0.2},
        {"translate": 0.2, "rotate": 0.2, "slide": 0.1, "swap": 0.1, "relocate": 0.4},
    ],
    ids=["relocate", "diffuse", "all"],
)
def test_long_chains_of_two_objects_reproduce_the_analytic_density(moves):
    """The density exp(-a r - b |angle|) of a pose around a core: r is gamma distributed with shape 2, the angle's size exponentially."""
    a, b = 12.0, 8.0
    grammar = small_grammar(PAIR, weights={"group_distance": a, "group_orientation": b}, moves=moves | WIDE)
    rng = np.random.default_rng(3)
    problem, state, settings = entered(grammar, rng)
    table, seat = np.flatnonzero(problem.mount == FLOOR)
    state.pose[table] = 0.1, -0.2, 0.4
    place_object(problem, state, table)
    mean = problem.modes(int(seat), AROUND_MODES)[0]
    distance, angle = [], []
    for _ in range(3000):
        chain(rng, problem, state, settings, [seat], 150)
        dx, dy = state.pose[seat, :2] - state.pose[table, :2]
        c, s = math.cos(0.4), math.sin(0.4)
        distance.append(math.hypot(dx * c + dy * s - mean[MODE_X], dy * c - dx * s - mean[MODE_Y]))
        angle.append(abs((state.pose[seat, 2] - 0.4 - mean[MODE_YAW] + math.pi) % (2 * math.pi) - math.pi))
    edges = np.linspace(0, 1, 11)
    for values, law in ((distance, stats.gamma(2, scale=1 / a)), (angle, stats.expon(scale=1 / b))):
        counts, _ = np.histogram(law.cdf(values), edges)
        assert stats.chisquare(counts).pvalue > 1e-4


def test_carried_groups_are_uniform_in_the_room_and_keep_their_density():
    """Moves of the core, alone or with what is grouped around it, leave the relative pose as above and the core uniform."""
    a, b = 12.0, 8.0
    moves = {"translate": 0.3, "rotate": 0.2, "slide": 0.1, "swap": 0.1, "relocate": 0.3, "carry": 0.5} | WIDE
    grammar = small_grammar(PAIR, weights={"group_distance": a, "group_orientation": b}, moves=moves)
    rng = np.random.default_rng(8)
    problem, state, settings = entered(grammar, rng)
    table, seat = (int(i) for i in np.flatnonzero(problem.mount == FLOOR))
    mean, middle = problem.modes(seat, AROUND_MODES)[0], (problem.x_centre, problem.y_centre)
    distance, angle, place = [], [], []
    for _ in range(9000):
        chain(rng, problem, state, settings, [table, seat], 100)
        x, y, yaw = state.pose[table]
        if max(abs(x - middle[0]), abs(y - middle[1])) < 1.0:  # nearer to the walls the seat has less room
            dx, dy = state.pose[seat, :2] - (x, y)
            c, s = math.cos(yaw), math.sin(yaw)
            distance.append(math.hypot(dx * c + dy * s - mean[MODE_X], dy * c - dx * s - mean[MODE_Y]))
            angle.append(abs((state.pose[seat, 2] - yaw - mean[MODE_YAW] + math.pi) % (2 * math.pi) - math.pi))
            place.append(0.5 * (x - middle[0] + 1.0))
    assert len(place) > 1500
    edges = np.linspace(0, 1, 11)
    for values, law in ((distance, stats.gamma(2, scale=1 / a)), (angle, stats.expon(scale=1 / b)), (place, stats.uniform())):
        counts, _ = np.histogram(law.cdf(values), edges)
        assert stats.chisquare(counts).pvalue > 1e-4


def test_tidiness_scales_the_spread():
    grammar = small_grammar(PAIR, weights={"group_distance": 10.0})
    means = []
    for beta in (1.0, 4.0):
        rng = np.random.default_rng(4)
        problem, state, settings = entered(grammar, rng)
        table, seat = np.flatnonzero(problem.mount == FLOOR)
        mean, total = problem.modes(int(seat), AROUND_MODES)[0], 0.0
        for _ in range(800):
            chain(rng, problem, state, settings, [seat], 100, beta)
            dx, dy = state.pose[seat, :2] - state.pose[table, :2]
            c, s = math.cos(state.pose[table, 2]), math.sin(state.pose[table, 2])
            total += math.hypot(dx * c + dy * s - mean[MODE_X], dy * c - dx * s - mean[MODE_Y])
        means.append(total / 800)
    assert means == pytest.approx([2 / 10, 2 / 40], rel=0.12)


def test_what_hangs_is_uniform_along_the_free_walls():
    text = closet("shelf", "picture") + item("shelf", "bookshelf", (0.3, 0.5, 1.0))
    text += item("picture", "picture", (0.02, 1.0, 0.5), ", mount: wall, centre_height_m: {mean: 1.5, sd: 0.1, low: 1.4, high: 1.6}")
    grammar = small_grammar(text, weights={}, moves={"translate": 0.3, "slide": 0.3, "relocate": 0.4})
    rng = np.random.default_rng(5)
    problem, state, settings = entered(grammar, rng)
    (picture,) = np.flatnonzero(problem.mount == WALL)
    along = []
    for _ in range(3000):
        chain(rng, problem, state, settings, [picture], 20)
        wall = problem.wall[state.on_wall[picture]]
        s = float((state.pose[picture, :2] - wall[:2]) @ wall[2:4])
        assert (state.pose[picture, :2] - wall[:2]) @ wall[5:7] == pytest.approx(0.01)
        along.append(state.on_wall[picture] + (s - 0.5) / (wall[4] - 1.0))
    counts, _ = np.histogram(along, np.linspace(0, 4, 17))
    assert stats.chisquare(counts).pvalue > 1e-4


def test_what_hangs_over_a_thing_that_stands_is_uniform_along_the_wall_behind_it():
    text = closet("shelf", "picture") + item("shelf", "bookshelf", (0.3, 0.5, 1.0))
    text += item(
        "picture", "picture", (0.02, 1.0, 0.5),
        ", mount: wall, centre_height_m: {mean: 1.5, sd: 0.1, low: 1.4, high: 1.6}, cores: {shelf: 1}, around: [{side: centre}]",
    )  # fmt: skip
    grammar = small_grammar(text, weights={}, moves={"translate": 0.3, "rotate": 0.2, "slide": 0.1, "relocate": 0.4})
    rng = np.random.default_rng(6)
    problem, state, settings = entered(grammar, rng)
    (picture,), (shelf,) = np.flatnonzero(problem.mount == WALL), np.flatnonzero(problem.mount == FLOOR)
    along, place = [], []
    for _ in range(4000):
        chain(rng, problem, state, settings, [picture, shelf], 25)
        wall = problem.wall[state.on_wall[picture]]
        along.append(float((state.pose[picture, :2] - wall[:2]) @ wall[2:4]))
        place.append((*(state.pose[shelf, :2] - (problem.x_low, problem.y_low)), state.on_wall[picture]))
    x, y, on_wall = np.array(place).T
    assert stats.chisquare(np.histogram(along, np.linspace(0.5, 3.5, 13))[0]).pvalue > 1e-4
    for values, bins in ((x, np.linspace(0, 4, 9)), (y, np.linspace(0, 4, 9)), (on_wall, np.arange(5) - 0.5)):
        assert stats.chisquare(np.histogram(values, bins)[0]).pvalue > 1e-4


def test_the_last_feasible_layout_is_kept():
    grammar = small_grammar(PAIR, weights={"group_distance": 5.0})
    rng = np.random.default_rng(6)
    problem, state, settings = entered(grammar, rng)
    kept = run_chain(rng, Chain(problem, settings), state, ChainRun(3000, 1.0, 1e9), np.flatnonzero(problem.mount == FLOOR)).kept
    assert kept is not None and np.array_equal(kept.pose, state.pose)


def test_counts_and_trace_are_those_of_the_run():
    grammar = small_grammar(PAIR, weights={"group_distance": 5.0})
    rng = np.random.default_rng(9)
    problem, state, settings = entered(grammar, rng)
    movable = np.flatnonzero(problem.mount == FLOOR)
    info = run_chain(rng, Chain(problem, settings), state, ChainRun(1000, 0.5, 1e9), movable, 10)
    assert info.counts[:, TRIED].sum() == 1000
    assert (info.counts[:, ACCEPTED] <= info.counts[:, TRIED]).all() and info.counts[:, ACCEPTED].sum() > 50
    assert info.trace.counts[:, :, TRIED].sum(1).tolist() == list(range(100, 1001, 100))
    assert np.array_equal(info.trace.counts[-1], info.counts)
    assert np.array_equal(info.trace.energy[-1], info.energy)
    assert info.energy == pytest.approx(full_energy(problem, state), abs=1e-9)
