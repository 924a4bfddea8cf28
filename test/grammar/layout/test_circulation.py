"""The chain's circulation and reach against the exact check of finished rooms."""

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar.checks.validity import check_room, door_start_m
from grammar.derivation.derive import derive
from grammar.layout.assemble import assemble
from grammar.layout.circulation import circulation_losses, empty_floor
from grammar.layout.energies import CIRCULATION, REACHED, full_energy, place_object
from grammar.layout.floor_raster import FREE
from grammar.layout.mcmc import Goal, enter, run_chain
from grammar.layout.moves import move_settings
from grammar.layout.problem import copy_state
from grammar.sample_room import _objects
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import SceneRequest


@pytest.fixture(scope="module")
def grammar():
    return read_room_type("bedroom", CATEGORIES)


def entered(grammar, seed):
    rng = np.random.default_rng(seed)
    tree = derive(grammar, CATEGORIES, SceneRequest(min_objects=12, max_objects=24), rng)
    problem, state = assemble(grammar, CATEGORIES, tree)
    floor = empty_floor(tree.room.polygon_m, door_start_m(tree.room, grammar.validity.robot_radius_m), grammar.validity)
    settings = move_settings(grammar.moves)
    for i in np.concatenate([np.flatnonzero((state.active == 0) & (problem.mount != 3)), np.flatnonzero(problem.mount == 3)]):
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
    movable = np.flatnonzero(problem.mount != 4)
    goal, counts = Goal(0.05, 0.05, 0.0, False), np.zeros((6, 2), np.int64)
    _, energy = run_chain(rng, problem, state, settings, goal, movable, 20_000, copy_state(state), counts, floor)
    assert np.array_equal(floor.covered, before) and floor.tally[FREE] == np.count_nonzero(before == 0)
    assert counts[:, 1].sum() > 500
    expected = full_energy(problem, state)
    expected[CIRCULATION], expected[REACHED] = circulation_losses(problem, state, floor)
    assert energy == pytest.approx(expected, abs=1e-9 * max(1.0, expected.max()))


def test_a_kept_layout_is_feasible_in_every_respect(grammar):
    rng, _, problem, state, floor, settings = entered(grammar, 5)
    kept, movable = copy_state(state), np.flatnonzero(problem.mount != 4)
    counts = np.zeros((6, 2), np.int64)
    found, _ = run_chain(rng, problem, state, settings, Goal(1.0, 1.0, 2e-4, False), movable, 40_000, kept, counts, floor)
    assert found
    for i in range(len(problem.link)):
        place_object(problem, kept, i)
    assert full_energy(problem, kept)[:4].max() <= 2.1e-4
    assert circulation_losses(problem, kept, floor) == (0.0, 0.0)
