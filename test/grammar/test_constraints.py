"""Requests about the contents of rooms: exact conditioning, bounds, clutter, and what cannot be met."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from small_grammar import CATEGORIES, item, small_grammar

from grammar.constraints import constrained, tilt
from grammar.derive import derive
from grammar.grammar_file import read_room_type
from grammar.request import RequestError, SceneRequest
from grammar.structure import draw_structure

TEXT = (
    """
nodes:
  closet: {kind: and, branches: [{symbol: rest}, {symbol: bins}]}
  rest: {kind: or, branches: [{symbol: bed, probability: 0.25}, {symbol: shelf, probability: 0.45}, {symbol: pair, probability: 0.3}]}
  pair: {kind: and, branches: [{symbol: shelf}, {symbol: bins}]}
  bins: {kind: set, branches: [{symbol: bin, multiplicity: [0.1, 0.2, 0.3, 0.4]}, {symbol: vase, multiplicity: [0.5, 0.3, 0.2]}]}
objects:
"""
    + item("bed", "bed", (2.0, 1.0, 0.9))
    + item("bin", "waste_bin", (0.2, 0.2, 0.3))
    + item("shelf", "bookshelf", (0.3, 1.0, 2.0))
    + item("vase", "vase", (0.1, 0.1, 0.2), ", mount: object, supporters: {shelf: 1}, placements: [{depth_fraction: 0}]")
)


def categories_of(grammar, rng):
    structure = draw_structure(grammar, rng)
    return tuple(sorted(Counter(vertex.choice for vertex in structure if vertex.kind == "terminal").items()))


def test_what_must_not_appear_is_conditioned_away_exactly():
    grammar = small_grammar(TEXT)
    bare = constrained(grammar, SceneRequest(room_type="closet", must_not=("waste_bin",)))
    rng = np.random.default_rng(1)
    free = [contents for contents in (categories_of(grammar, rng) for _ in range(60_000)) if "waste_bin" not in dict(contents)]
    drawn = [categories_of(bare, rng) for _ in range(len(free))]
    assert all("waste_bin" not in dict(contents) for contents in drawn)
    expected, seen = Counter(free), Counter(drawn)
    keys = [key for key, number in expected.items() if number > 20]
    table = np.array([[expected[key] for key in keys], [seen[key] for key in keys]])
    assert stats.chi2_contingency(table).pvalue > 1e-4
    # 0.1 without bins at the root; a pair needs a second draw without them: 0.3 * 0.1 against 0.7
    total = 0.25 + 0.45 + 0.3 * 0.1
    assert bare.nodes["rest"].branches[2].probability == pytest.approx(0.03 / total)


def test_counts_hold_in_every_room():
    grammar = read_room_type("bedroom", CATEGORIES)
    request = SceneRequest(must_have=("television", "armchair"), must_not=("wardrobe", "rug"), counts=("nightstand:2:2", "picture:0:1"))
    for seed in range(15):
        tree = derive(grammar, CATEGORIES, request, np.random.default_rng(seed))
        count = Counter(thing.rule.category for thing in tree.things)
        assert count["television"] >= 1 and count["armchair"] >= 1 and count["wardrobe"] == count["rug"] == 0
        assert count["nightstand"] == 2 and count["picture"] <= 1


def test_clutter_scales_the_mean_number_of_supported_things():
    odds = (0.5, 0.3, 0.2)
    for scale in (0.3, 1.0, 1.7, 2.5):
        tilted = tilt(odds, scale)
        assert sum(tilted) == pytest.approx(1.0)
        assert sum(k * p for k, p in enumerate(tilted)) == pytest.approx(0.7 * scale)
        assert tilted[1] ** 2 / (tilted[0] * tilted[2]) == pytest.approx(0.3**2 / (0.5 * 0.2))
    assert tilt(odds, 0.0) == (1.0, 0.0, 0.0)
    assert tilt(odds, 9.0) == (0.0, 0.0, 1.0)
    grammar = constrained(small_grammar(TEXT), SceneRequest(room_type="closet", clutter=0.0))
    assert grammar.nodes["bins"].branches[0].multiplicity == (0.1, 0.2, 0.3, 0.4)
    assert grammar.nodes["bins"].branches[1].multiplicity == (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"must_have": ("unicorn",)}, r"^must_have: unicorn: expected a category of the bedroom grammar"),
        ({"must_not": ("bed",)}, r"^must_not: bed: expected a range that meets the 1 to 2 of the bedroom grammar, got 0 to 0"),
        ({"counts": ("bed",)}, r"^counts: expected texts 'category:least:most', got 'bed'"),
        ({"counts": ("bed:3:1",)}, r"^counts: bed:3:1: expected a least number up to the greatest one, got 3 and 1"),
        ({"counts": ("bed:5:9",)}, r"^counts: bed:5:9: expected a range that meets the 1 to 2"),
        ({"must_have": ("desk",), "must_not": ("desk",)}, r"^must_not: desk: .* together with must_have: desk"),
        ({"must_not": ("laptop", "monitor"), "must_have": ("desk",)}, r"expected a bedroom within 300 derivations, .* must_have: desk"),
    ],
)
def test_what_cannot_be_met_ends_in_an_error_that_names_it(fields, expected):
    grammar = read_room_type("bedroom", CATEGORIES)
    grammar = replace(grammar, budget=replace(grammar.budget, derivations=300))
    with pytest.raises(RequestError, match=expected):
        derive(grammar, CATEGORIES, SceneRequest(**fields), np.random.default_rng(0))
