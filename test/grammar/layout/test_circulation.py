"""The chain's circulation and reach against the exact check of finished rooms."""

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar.checks.validity import check_room
from grammar.derivation.derive import derive
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.circulation import circulation_losses
from grammar.layout.energies import full_energy
from grammar.layout.entrants import enter
from grammar.layout.floor_raster import FREE
from grammar.layout.frames import place_object
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import move_settings
from grammar.sampled_room import _objects, room_floor
from grammar.spec.energy_terms import HARD_TERMS, TERM, TERMS
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import SceneRequest


@pytest.fixture(scope="module")
def grammar():
    return read_room_type("bedroom", CATEGORIES)


def entered(grammar, seed):
    rng = np.random.default_rng(seed)
    tree = derive(grammar, CATEGORIES, SceneRequest(min_objects=12, max_objects=24), rng)
    problem, state = assemble(grammar, CATEGORIES, tree)
    floor = room_floor(grammar, tree.room)
    settings = move_settings(grammar.moves)
    for i in np.concatenate(
        [np.flatnonzero((state.active == 0) & (problem.mount != col.OBJECT)), np.flatnonzero(problem.mount == col.OBJECT)]
    ):
        assert enter(rng, problem, state, settings, i, 6)
    return rng, tree, problem, state, floor, settings


def test_losses_are_those_of_the_check_of_finished_rooms(grammar):
    short, missed = 0, 0
    for seed in range(25):
        _, tree, problem, state, floor, _ = entered(grammar, seed)
        before = floor.covered.copy()
        circulation, reach = circulation_losses(problem, state, floor)
        assert np.array_equal(floor.covered, before)
        # what stands on things may still hang over their edges here
        objects = [thing for thing in _objects(tree, CATEGORIES, problem, state) if thing.support.kind != "object"]
        report = check_room(grammar, CATEGORIES, tree.room, objects, {thing.id: thing.rule for thing in tree.items}, 1)
        value = {check.name: check.value for check in report.checks}
        assert circulation == pytest.approx(max(grammar.validity.walkable_share - value["walkable_share"], 0.0), abs=1e-12)
        assert reach == value["reachable"]
        short, missed = short + (circulation > 0), missed + (reach > 0)
    assert short > 3 and missed > 3


def test_the_chain_keeps_the_raster_up_to_date_and_leaves_it_as_it_was(grammar):
    rng, _, problem, state, floor, settings = entered(grammar, 3)
    before = floor.covered.copy()
    movable = np.flatnonzero(problem.mount != col.FIXED)
    info = run_chain(rng, Chain(problem, settings, floor), state, ChainRun(20_000, 0.05, 0.0), movable)
    assert np.array_equal(floor.covered, before) and floor.tally[FREE] == np.count_nonzero(before == 0)
    assert info.counts[:, col.ACCEPTED].sum() > 500
    expected = full_energy(problem, state)
    expected[TERM.circulation], expected[TERM.reach] = circulation_losses(problem, state, floor)
    assert info.energy == pytest.approx(expected, abs=1e-9 * max(1.0, expected.max()))


def test_a_kept_layout_is_feasible_in_every_respect(grammar):
    rng, _, problem, state, floor, settings = entered(grammar, 5)
    movable = np.flatnonzero(problem.mount != col.FIXED)
    kept = run_chain(rng, Chain(problem, settings, floor), state, ChainRun(40_000, 1.0, 2e-4), movable).kept
    assert kept is not None
    for i in range(len(problem.link)):
        place_object(problem, kept, i)
    losses = dict(zip(TERMS, full_energy(problem, kept), strict=True))
    assert max(losses[name] for name in HARD_TERMS) <= 2.1e-4
    assert circulation_losses(problem, kept, floor) == (0.0, 0.0)
