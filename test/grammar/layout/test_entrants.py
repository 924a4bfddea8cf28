"""Which begun layout the chain goes on with, and which structures are given up."""

from dataclasses import replace

import numpy as np
from small_grammar import CATEGORIES, closet, item, small_grammar

from grammar import SceneRequest
from grammar.derivation.derive import derive
from grammar.layout.assemble import assemble
from grammar.layout.columns import TRIED
from grammar.layout.entrants import Beginning, Stage, best_entrant
from grammar.layout.mcmc import Chain
from grammar.layout.problem import move_settings
from grammar.layout.schedule import begin, run_stages


def pair(length_m: float) -> str:
    return closet("bed", "shelf") + item("bed", "bed", (length_m, 2.8 / length_m, 0.5)) + item("shelf", "bookshelf", (0.3, 0.8, 1.8))


def furnishing(text, **schedule):
    grammar = small_grammar(text)
    grammar = replace(grammar, schedule=replace(grammar.schedule, **schedule))
    tree = derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(0))
    problem, start = assemble(grammar, CATEGORIES, tree)
    return Chain(problem, move_settings(grammar.moves)), start, grammar.schedule


def test_rounds_share_their_proposals_and_halve_the_entrants():
    chain, start, schedule = furnishing(pair(2.0), entrants=4, hopeless=1000.0)
    objects = np.flatnonzero(~chain.problem.pinned)
    stages = [Stage(objects[:1], objects[:1], 40), Stage(objects[1:], objects, 80)]
    for rooms in (1, 2, 3):
        beginnings = [Beginning(chain, start, stages, Stage(objects[:0], objects, 20))] * rooms
        begun = best_entrant(np.random.default_rng(1), beginnings, schedule, 1.0)
        # four entrants at 10 sweeps of one object and 20 of two, two at 10 sweeps, one at 20, in however many rooms
        assert begun.counts[:, TRIED].sum() == 4 * (10 + 2 * 20) + 2 * 10 * 2 + 20 * 2
        assert begun.fits and begun.state.active[objects].all() and not start.active[objects].any()


def test_a_structure_that_fits_nowhere_is_given_up_after_the_first_round():
    # longer than the diagonal of the room
    chain, start, schedule = furnishing(closet("sofa") + item("sofa", "sofa", (0.3, 5.9, 0.8)), entrants=4, unpaired=40, together=50)
    for hopeless, proposals, sweeps in ((0.05, 40, 0), (1000.0, 40 + 2 * 20 + 50, 50)):
        rng, given = np.random.default_rng(2), replace(schedule, hopeless=hopeless)
        begun = begin(rng, [(chain.problem, start)], chain.moves, given, 1.0)
        result = run_stages(rng, chain, begun, given, 1.0)
        assert result.layout is None
        assert (result.counts[:, TRIED].sum(), len(result.trace.energy)) == (proposals, sweeps)


def test_of_several_rooms_the_one_that_furniture_fits_best_is_found():
    (chain, start, schedule), (cramped, bare, _) = (furnishing(pair(length_m), hopeless=1000.0) for length_m in (2.0, 5.9))
    rooms, moves = [(cramped.problem, bare), (chain.problem, start), (cramped.problem, bare)], chain.moves
    for seed in range(4):
        begun = begin(np.random.default_rng(seed), rooms, moves, schedule, 1.0)
        assert begun.room == 1 and begun.fits
    assert not begin(np.random.default_rng(0), rooms[:1], moves, replace(schedule, hopeless=0.05), 1.0).fits
