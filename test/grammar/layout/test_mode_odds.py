"""Modes of relations: their probabilities and spreads in the energy, the proposals and the chain."""

import math
import re

import numpy as np
import pytest
from scipy import stats
from small_grammar import closet, entered, item, small_grammar

from grammar.layout import columns as col
from grammar.layout.energies import full_energy
from grammar.layout.frames import place_object
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.spec.energy_terms import TERM
from scene_description import FieldError

KINDS = (col.WALL_MODES, col.AROUND_MODES, col.PLACEMENTS)
ODDS = np.array([0.6, 0.3, 0.1])
TOP = ", supporters: {table: 1}, mount: object, placements: "
RELATIONS = {
    "wall": (
        closet("thing"),
        "desk",
        ", wall: [{distance_m: 0.15, probability: 0.6}, {distance_m: 0.2, orientation_rad: 1.5, probability: 0.3, spread: 2,"
        " orientation_spread: 3}, {distance_m: 0.9, orientation_rad: 3.0, probability: 0.1, spread: 0.5}]",
        {"wall_distance": 60.0, "wall_orientation": 20.0},
    ),
    "group": (
        closet("table", "thing") + item("table", "desk", (1.0, 1.2, 0.7)),
        "desk_chair",
        ", cores: {table: 1}, around: [{side: left, gap_m: 0.1, probability: 0.6, spread: 1.5}, {side: front, gap_m: 0.1,"
        " orientation_rad: 2.0, probability: 0.3, orientation_spread: 2}, {side: left, gap_m: 0.8, probability: 0.1, spread: 0.7}]",
        {"group_distance": 60.0, "group_orientation": 20.0},
    ),
    "support": (
        closet("table", "thing") + item("table", "desk", (1.4, 1.6, 0.7)),
        "mug",
        f"{TOP}[{{depth_fraction: 0.5, width_fraction: 0.5, probability: 0.6}}, {{depth_fraction: -0.4, width_fraction: 0.4,"
        " orientation_rad: 2.0, probability: 0.3, spread: 2}, {depth_fraction: 0.1, width_fraction: -0.7, probability: 0.1, spread: 0.6}]",
        {"support_position": 60.0, "support_orientation": 20.0},
    ),
}


def problem_of(relation, beta, weights=(), moves=None):
    head, category, more, own = RELATIONS[relation]
    grammar = small_grammar(head + item("thing", category, (0.3, 0.3, 0.3), more), {**own, "relation_odds": 1.0, **dict(weights)}, moves)
    problem, state, settings = entered(grammar, np.random.default_rng(1), beta)
    if relation != "wall":
        table = len(problem.link) - 2
        state.pose[table] = 0.1, -0.2, 0.4
        place_object(problem, state, table)
    return problem, state, settings


def step(rng, problem, state, settings, beta, proposals):
    movable = np.array([len(problem.link) - 1])
    return run_chain(rng, Chain(problem, settings), state, ChainRun(proposals, beta, 1e9), movable)


@pytest.mark.parametrize("relation", RELATIONS)
@pytest.mark.parametrize(
    ("moves", "beta"),
    [({"relocate": 1.0}, 1.0), ({"relocate": 0.4, "translate": 0.3, "rotate": 0.2, "slide": 0.1}, 3.0)],
    ids=["relocate", "all, three times as tidy"],
)
def test_long_chains_take_modes_by_their_probabilities_at_any_tidiness(relation, moves, beta):
    problem, state, settings = problem_of(relation, beta, moves=moves)
    rng, seen = np.random.default_rng(2), np.zeros(3)
    rows = np.concatenate([problem.modes(len(problem.link) - 1, kind) for kind in KINDS])
    for _ in range(3000):
        losses = np.asarray(step(rng, problem, state, settings, beta, 60).energy)
        seen[np.argmin(np.abs(rows[:, col.ODDS_COST] - losses[TERM.relation_odds]))] += 1
    assert stats.chisquare(seen, ODDS * seen.sum()).pvalue > 1e-3, seen / seen.sum()


@pytest.mark.parametrize("relation", RELATIONS)
def test_modes_without_a_probability_are_equally_likely_and_cost_nothing(relation):
    head, category, more, own = RELATIONS[relation]
    more = re.sub(r", +(probability|spread|orientation_spread): [0-9.]+", "", more)
    problem, _, _ = entered(small_grammar(head + item("thing", category, (0.3, 0.3, 0.3), more), own), np.random.default_rng(1))
    rows = np.concatenate([problem.modes(len(problem.link) - 1, kind) for kind in KINDS])
    assert rows[:, [col.ODDS_COST, col.PROBABILITY, col.NEAR, col.STRAIGHT]] == pytest.approx(np.tile([0.0, 1.0 / 3.0, 1.0, 1.0], (3, 1)))


def test_cost_is_the_log_ratio_of_densities_at_the_modes_middles():
    problem, state, _ = problem_of("wall", 2.0)
    thing = len(problem.link) - 1
    rows = problem.modes(thing, col.WALL_MODES)
    density = ODDS / np.array([1.0, 2.0 * 3.0, 0.5])
    assert rows[:, col.ODDS_COST] == pytest.approx(np.log(density.max() / density) / 2.0)
    # in the middle of the wall x = -2, turned as the second mode, 0.05 m and 0.03 rad from its place
    c, s = math.cos(1.53), math.sin(1.53)
    state.pose[thing] = -2.0 + 0.25 + 0.15 * (abs(c) + abs(s)), 0.0, 1.53
    place_object(problem, state, thing)
    energy = full_energy(problem, state)
    assert energy[TERM.wall_distance] == pytest.approx(0.05 / 2.0)
    assert energy[TERM.wall_orientation] == pytest.approx(0.03 / 3.0)
    assert energy[TERM.relation_odds] == pytest.approx(rows[1, col.ODDS_COST])


@pytest.mark.parametrize("relation", RELATIONS)
def test_incremental_energy_follows_the_full_energy_with_odds(relation):
    problem, state, settings = problem_of(relation, 1.0, {"overlap": 5.0, "overhang": 5.0, "out_of_room": 5.0})
    rng, accepted, movable = np.random.default_rng(3), 0, np.flatnonzero(problem.mount != col.FIXED)
    for _ in range(20):
        info = run_chain(rng, Chain(problem, settings), state, ChainRun(500, 1.0, 1e9), movable)
        assert np.abs(info.energy - full_energy(problem, state)).max() < 1e-9
        accepted += info.counts[:, col.ACCEPTED].sum()
    assert accepted > 500


@pytest.mark.parametrize(
    ("modes", "message"),
    [
        ("{distance_m: 0.1, probability: 0.5}, {distance_m: 0.3}", "objects.thing.wall: expected a probability in all modes or in none"),
        (
            "{distance_m: 0.1, probability: 0.5}, {distance_m: 0.3, probability: 0.4}",
            "objects.thing.wall: expected probabilities that sum to 1",
        ),
        ("{distance_m: 0.1, probability: 1}, {distance_m: 0.3, probability: 0}", "objects.thing.wall: expected modes with positive"),
        ("{distance_m: 0.1, spread: 0}", r"objects.thing.wall\[0\].spread"),
    ],
)
def test_odds_that_do_not_fit_are_refused(modes, message):
    with pytest.raises(FieldError, match=message):
        small_grammar(closet("thing") + item("thing", "dresser", (0.3, 0.3, 0.3), f", wall: [{modes}]"))


def test_relocation_beside_a_core_at_a_wall_has_the_density_that_it_says():
    # Without energy the chain's poses are uniform, whatever is proposed, if the ratio of the proposals' densities is right.
    head = closet("table", "thing") + item("table", "desk", (1.0, 1.2, 0.7))
    more = ", cores: {table: 1}, wall: [{distance_m: 0.1}], around: [{side: left, gap_m: 0.1}, {side: front, gap_m: 0.1, spread: 2}]"
    moves = {"relocate": 1.0, "relocate_uniform": 0.4, "relocate_wall": 0.2, "relocate_around": 0.4, "relocate_beside": 0.5}
    text = head + item("thing", "desk_chair", (0.3, 0.4, 0.3), more)
    problem, state, settings = entered(small_grammar(text, {"relation_odds": 0.0}, moves), np.random.default_rng(1))
    state.pose[len(problem.link) - 2] = 0.9, -1.0, 0.4
    rng, thing, poses = np.random.default_rng(4), len(problem.link) - 1, []
    for _ in range(1500):
        step(rng, problem, state, settings, 1.0, 40)
        poses.append(state.pose[thing].copy())
    places = np.array(poses)
    cells = (np.clip((places[:, :2] + 2.0), 0.0, 3.999) // 1.0).astype(int) @ (4, 1)
    assert stats.chisquare(np.bincount(cells, minlength=16)).pvalue > 1e-3
    assert stats.kstest((places[:, 2] + math.pi) / (2.0 * math.pi), "uniform").pvalue > 1e-3
