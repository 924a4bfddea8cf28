"""The rows of the energy terms: each is counted, each says how its weight is learned, and the manual shows them."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_grammar import CATEGORIES

from grammar.derivation.derive import derive
from grammar.layout import columns as col
from grammar.layout.assemble import assemble
from grammar.layout.entrants import enter
from grammar.layout.losses import LOSSES
from grammar.layout.mcmc import Chain, ChainRun, run_chain
from grammar.layout.problem import COUNTERS, move_settings
from grammar.layout.schedule import layout_energy
from grammar.sampled_room import room_floor
from grammar.spec.energy_terms import ENERGY_TERMS, FLOOR_TERMS, HARD_TERMS, TERMS, EnergyTerm, weight_vector
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import SceneRequest

DOCS = Path(__file__).resolve().parents[3] / "docs"
with_tables = runpy.run_path(str(DOCS / "energy_terms.py"))["with_tables"]


def test_terms_by_kind():
    assert HARD_TERMS == ("overlap", "out_of_room", "blocked", "overhang", "off_wall")
    assert FLOOR_TERMS == ("circulation", "reach")
    learned = {name for name, term in ENERGY_TERMS.items() if term.learned_from}
    assert learned == {
        "wall_distance", "wall_orientation", "occlusion", "support_position", "support_orientation", "group_distance", "group_orientation",
        "room_centre",
    }  # fmt: skip
    assert {term.learned_from for term in ENERGY_TERMS.values()} - {None} == set(COUNTERS)


def test_a_term_is_learned_or_says_why_not():
    for given in ({}, {"learned_from": "wall", "not_learned": "it is"}):
        with pytest.raises(ValueError, match="expected either learned_from or not_learned"):
            EnergyTerm(kind="soft", unit="m", measures="nothing", formula="0", **given)


def test_weights_keep_the_order_of_the_rows():
    weights = replace(read_room_type("bedroom", CATEGORIES).weights, blocked=3.5, reach=7.0)
    vector = weight_vector(weights)
    assert (vector[TERMS.index("blocked")], vector[TERMS.index("reach")]) == (3.5, 7.0)


def test_every_term_is_counted():
    """A row whose kernel is missing, or adds to another column, has no loss in any layout."""
    met = np.zeros(len(TERMS), bool)
    rooms = (("bedroom", "learned", 0), ("bedroom", "by_hand", 1), ("kitchen", "by_hand", 0), ("living_room", "by_hand", 0))
    for room_type, set_name, seed in rooms:
        grammar, rng = read_room_type(room_type, CATEGORIES, set_name), np.random.default_rng(seed)
        wanted = ("television",) if room_type == "bedroom" else ()
        tree = derive(grammar, CATEGORIES, SceneRequest(room_type=room_type, min_objects=14, must_have=wanted), rng)
        problem, state = assemble(grammar, CATEGORIES, tree)
        chain = Chain(problem, move_settings(grammar.moves), room_floor(grammar, tree.room))
        for i in sorted(np.flatnonzero(state.active == 0), key=lambda i, p=problem: len(p.targets(i)) > 0):
            assert enter(rng, problem, state, chain.moves, i, 20)
        # a low beta takes things from where they belong
        run_chain(rng, chain, state, ChainRun(300, 1e-3, 0.0), np.flatnonzero(problem.mount != col.FIXED))
        met |= layout_energy(chain, state) > 0.0
    assert met.all(), [name for name, is_met in zip(TERMS, met, strict=True) if not is_met]


def test_every_term_has_a_kernel_and_every_kernel_a_term():
    added = [name for row in LOSSES for name in row.terms]
    assert set(added) == set(TERMS)
    assert {name for row in LOSSES if row.scope == "room" for name in row.terms} == set(FLOOR_TERMS)
    assert all((row.partner is not None) == (row.scope == "partner") for row in LOSSES)


def test_the_manual_shows_the_rows():
    text = (DOCS / "grammar.md").read_text(encoding="utf-8")
    assert with_tables(text) == text, "docs/grammar.md: expected the tables of its energy terms, got others; run make docs"


def test_a_page_without_marks_is_told():
    with pytest.raises(ValueError, match="expected the lines <!-- energy terms --> and"):
        with_tables("# Grammar")
