"""Counting of branches: by hand where a bag has one derivation, by Bayes' rule where it has two, and back from sampled structures."""

import numpy as np
import pytest
from small_grammar import item, small_grammar

from grammar.derivation.structure import draw_structure
from grammar.learning.branching import learn_branching

OBJECTS = (
    "objects:\n"
    + item("bed", "bed", (2.0, 1.5, 1.0))
    + item("nightstand", "nightstand", (0.4, 0.4, 0.5))
    + item("wardrobe", "wardrobe", (0.6, 1.0, 2.0))
    + item("pouf", "pouf", (0.4, 0.4, 0.4))
)
NODES = """
nodes:
  closet: {kind: and, branches: [{symbol: sleeping}, {symbol: storage}]}
  sleeping: {kind: or, branches: [{symbol: bed, probability: 0.5}, {symbol: pair, probability: 0.5}]}
  pair: {kind: and, branches: [{symbol: bed}, {symbol: nightstand}]}
  storage: {kind: set, branches: [{symbol: wardrobe, multiplicity: [0.4, 0.3, 0.3]}, {symbol: pouf, multiplicity: [0.25, 0.75]}]}
"""
AMBIGUOUS = """
nodes:
  closet: {kind: and, branches: [{symbol: bed}, {symbol: first}, {symbol: second}]}
  first: {kind: set, branches: [{symbol: pouf, multiplicity: [0.8, 0.2]}]}
  second: {kind: set, branches: [{symbol: pouf, multiplicity: [0.5, 0.5]}]}
"""
ALL = {"bed", "nightstand", "wardrobe", "pouf"}


def test_counts_by_hand() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    rooms = [["bed"], ["bed", "wardrobe"], ["bed", "nightstand", "wardrobe", "wardrobe", "pouf"], ["bed", "wardrobe"]]
    learned = learn_branching(grammar, rooms, ALL, alpha=0.0)
    choice = [branch.probability for branch in learned.nodes["sleeping"].branches]
    assert choice == pytest.approx([3 / 4, 1 / 4], abs=0.003)
    wardrobe, pouf = learned.nodes["storage"].branches
    assert wardrobe.multiplicity == pytest.approx([1 / 4, 2 / 4, 1 / 4], abs=0.003)
    assert pouf.multiplicity == pytest.approx([3 / 4, 1 / 4], abs=0.003)
    assert learned.counts["storage"] == pytest.approx(4.0)


def test_dirichlet_smoothing() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    learned = learn_branching(grammar, [["bed"]] * 6, ALL, alpha=2.0)
    choice = [branch.probability for branch in learned.nodes["sleeping"].branches]
    assert choice == pytest.approx([(6 + 2 * 0.5) / 8, 2 * 0.5 / 8], abs=0.003)


def test_uncovered_symbols_keep_the_base() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    learned = learn_branching(grammar, [["bed", "wardrobe"]] * 5, ALL - {"pouf"}, alpha=1.0)
    assert learned.nodes["storage"].branches[1] == grammar.nodes["storage"].branches[1]


def test_uncovered_symbols_of_an_or_node_tell_nothing() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    learned = learn_branching(grammar, [["bed", "wardrobe"]] * 5, {"bed", "wardrobe"}, alpha=1.0)
    assert [branch.probability for branch in learned.nodes["sleeping"].branches] == pytest.approx([0.5, 0.5])


def test_more_copies_than_the_base_has_and_objects_without_a_derivation() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    learned = learn_branching(grammar, [["bed"] + ["wardrobe"] * 3] * 3 + [["wardrobe"] * 9], ALL, alpha=1.0)
    wardrobe = learned.nodes["storage"].branches[0].multiplicity
    assert wardrobe is not None
    assert len(wardrobe) == 10
    # three rooms have 3, one has 9; the prior's 0.02 is spread over ten multiplicities
    assert wardrobe[3] == pytest.approx((3 + 0.002) / 5, abs=0.02)
    assert wardrobe[9] == pytest.approx((1 + 0.002) / 5, abs=0.02)
    assert sum(wardrobe) == pytest.approx(1.0)


def test_hidden_derivations_maximise_the_likelihood() -> None:
    # Bags with k poufs: the probabilities of k under the learned numbers must equal the observed shares (0.3, 0.5, 0.2), as they can.
    grammar = small_grammar(AMBIGUOUS + OBJECTS)
    rooms = [["bed"]] * 30 + [["bed", "pouf"]] * 50 + [["bed", "pouf", "pouf"]] * 20
    learned = learn_branching(grammar, rooms, ALL, alpha=0.0)
    a, b = (learned.nodes[name].branches[0].multiplicity for name in ("first", "second"))
    assert a is not None
    assert b is not None
    shares = np.convolve(a, b)
    assert shares[:3] == pytest.approx([0.3, 0.5, 0.2], abs=0.015)


def test_recovers_the_probabilities_of_sampled_structures() -> None:
    truth = small_grammar(NODES.replace("0.4, 0.3, 0.3", "0.1, 0.7, 0.2").replace("bed, probability: 0.5", "bed, probability: 0.8").replace(
        "pair, probability: 0.5", "pair, probability: 0.2") + OBJECTS)  # fmt: skip
    rng = np.random.default_rng(5)
    rooms = [[v.symbol for v in draw_structure(truth, rng) if v.kind == "terminal"] for _ in range(400)]
    learned = learn_branching(small_grammar(NODES + OBJECTS), rooms, ALL, alpha=1.0)
    # Four standard errors of a share estimated from 400 rooms: 4 sqrt(p (1 - p) / 400) <= 0.1.
    assert [branch.probability for branch in learned.nodes["sleeping"].branches] == pytest.approx([0.8, 0.2], abs=0.08)
    assert learned.nodes["storage"].branches[0].multiplicity == pytest.approx([0.1, 0.7, 0.2], abs=0.1)


def test_absurd_rooms_do_not_count() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    rooms = [["bed", "wardrobe"]] * 4
    absurd = [["pouf"] * 300]
    assert learn_branching(grammar, rooms + absurd, ALL, 1.0).counts["storage"] == pytest.approx(4.0)
