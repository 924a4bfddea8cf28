"""Tables for meals keep apart from what people lounge on."""

import numpy as np
import pytest
from small_grammar import closet, entered, item, small_grammar

from grammar.layout.energies import full_energy
from grammar.layout.frames import place_object
from grammar.spec.energy_terms import TERM


@pytest.mark.parametrize(("category", "gap_m", "taken"), [("armchair", 0.05, 0.75), ("armchair", 0.2, 0.0), ("sideboard", 0.05, 0.0)])
def test_what_people_lounge_on_costs_within_a_fifth_of_a_metre_of_a_table(category: str, gap_m: float, taken: float) -> None:
    things = item("table", "dining_table", (0.8, 0.8, 0.75)) + item("seat", category, (0.4, 0.4, 0.6))
    problem, state, _ = entered(small_grammar(closet("table", "seat") + things, {"occlusion": 1.0}), np.random.default_rng(1))
    table, seat = len(problem.link) - 2, len(problem.link) - 1
    state.pose[table], state.pose[seat] = (-0.4, 0.0, 0.0), (0.2 + gap_m, 0.0, np.pi)
    for thing in (table, seat):
        place_object(problem, state, thing)
    alone = full_energy(problem, state)[TERM.occlusion]
    state.pose[seat] = -1.4, 1.4, np.pi
    place_object(problem, state, seat)
    apart = full_energy(problem, state)[TERM.occlusion]
    assert alone - apart == pytest.approx(taken, abs=1e-6)
