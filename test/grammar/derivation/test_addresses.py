"""Places and sides of a core that belong to one object each."""

from collections import Counter

import numpy as np
import pytest
from scipy import stats
from small_grammar import CATEGORIES, small_grammar

from grammar.derivation.derive import derive
from grammar.derivation.parse_tree import Item
from grammar.spec.request import SceneRequest

ODDS = {"left": 0.2 + 0.3, "right": 0.4, "front": 0.1}


def stands(multiplicity: str, each: str) -> list[list[Item]]:
    """Return the nightstands of 600 rooms; two of the four places, with half of the odds, are at the bed's left."""
    grammar = small_grammar(f"""
nodes:
  closet: {{kind: and, branches: [{{symbol: bed}}, {{symbol: stands}}]}}
  stands: {{kind: set, branches: [{{symbol: stand, multiplicity: {multiplicity}}}]}}
objects:
  bed: {{category: bed, sizes: [{{mean_m: [2, 1, 1], sd_m: [0.1, 0.1, 0.1]}}], low_m: [1.8, 0.8, 0.9], high_m: [2.2, 1.2, 1.1]}}
  stand:
    category: nightstand
    sizes: [{{mean_m: [0.4, 0.4, 0.5], sd_m: [0.02, 0.02, 0.02]}}]
    low_m: [0.3, 0.3, 0.4]
    high_m: [0.5, 0.5, 0.6]
    cores: {{bed: 1}}
    around:
      - {{probability: 0.2, side: left, gap_m: 0, align: -1}}
      - {{probability: 0.3, side: left, gap_m: 0.2, align: -1}}
      - {{probability: 0.4, side: right, gap_m: 0.1, align: -1}}
      - {{probability: 0.1, side: front, gap_m: 0.1}}
    {each}
""")
    trees = (derive(grammar, CATEGORIES, SceneRequest(room_type="closet"), np.random.default_rng(seed)) for seed in range(600))
    return [[item for item in tree.items if item.symbol == "stand"] for tree in trees]


def test_two_at_one_core_have_a_side_each_and_all_places_at_it() -> None:
    drawn = Counter[tuple[str, str]]()
    for pair in stands("[0, 0, 1]", "one_each: side"):
        sides = [{mode.side for mode in item.rule.around} for item in pair]
        assert [len(side) for side in sides] == [1, 1]
        assert sum(mode.probability or 0.0 for mode in pair[0].rule.around) == pytest.approx(1.0)
        (first,), (second,) = sides
        drawn[first, second] += 1
        for item in pair:
            if item.rule.around[0].side == "left":
                assert [mode.probability for mode in item.rule.around] == pytest.approx([0.4, 0.6])
    expected = {(a, b): ODDS[a] * ODDS[b] / (1.0 - ODDS[a]) for a in ODDS for b in ODDS if a != b}
    assert set(drawn) <= set(expected)  # never two at one side
    assert stats.chisquare([drawn[pair] for pair in expected], [600.0 * p for p in expected.values()]).pvalue > 1e-3


def test_alone_at_its_core_one_keeps_all_places() -> None:
    for (item,) in stands("[0, 1]", "one_each: side"):
        assert [mode.probability for mode in item.rule.around] == pytest.approx([0.2, 0.3, 0.4, 0.1])


def test_places_of_their_own_may_lie_at_one_side() -> None:
    both_left = 0
    for pair in stands("[0, 0, 1]", "one_each: place"):
        places = [item.rule.around for item in pair]
        assert [len(place) for place in places] == [1, 1]
        assert places[0] != places[1]
        both_left += all(place[0].side == "left" for place in places)
    # first 0.2, then 0.3 of the other 0.8, or first 0.3, then 0.2 of the other 0.7
    assert stats.binomtest(both_left, 600, 0.2 * 0.3 / 0.8 + 0.3 * 0.2 / 0.7).pvalue > 1e-3


def test_more_objects_than_sides_are_a_structure_that_cannot_be() -> None:
    assert max(len(items) for items in stands("[0, 0.2, 0.2, 0.2, 0.4]", "one_each: side")) == 3
