"""Requests about the contents of rooms: exact conditioning, bounds, and what cannot be met."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from small_grammar import CATEGORIES, item, small_grammar

from grammar.derivation.constraints import CountBound, constrained
from grammar.derivation.densities import draw_size
from grammar.derivation.derive import derive
from grammar.derivation.overrides import overridden
from grammar.derivation.structure import ConditionalStructures, draw_structure
from grammar.sampled_room import sample_room
from grammar.spec.grammar_file import read_room_type
from grammar.spec.request import RequestError, SceneRequest

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
        count = Counter(item.rule.category for item in tree.items)
        assert count["television"] >= 1 and count["armchair"] >= 1 and count["wardrobe"] == count["rug"] == 0
        assert count["nightstand"] == 2 and count["picture"] <= 1


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"must_have": ("unicorn",)}, r"^must_have: unicorn: expected a category of the bedroom grammar"),
        ({"must_not": ("bed",)}, r"^must_not: bed: expected a range that meets the 1 to 2 of the bedroom grammar, got 0 to 0"),
        ({"counts": ("bed",)}, r"^counts: expected texts 'category:least:most', got 'bed'"),
        ({"counts": ("bed:3:1",)}, r"^counts: bed:3:1: expected a least number up to the greatest one, got 3 and 1"),
        ({"counts": ("bed:5:9",)}, r"^counts: bed:5:9: expected a range that meets the 1 to 2"),
        ({"must_have": ("desk",), "must_not": ("desk",)}, r"^must_not: desk: .* together with must_have: desk"),
        ({"must_not": ("laptop", "monitor"), "must_have": ("desk",)}, r"expected constraints that some bedroom meets, .* must_have: desk"),
        ({"counts": ("bed:2:2", "nightstand:2:2"), "must_not": ("single_bed",)}, r"counts: bed:2:2"),
        ({"must_not": ("unicorn",)}, r"^must_not: unicorn: expected a category of categories.yaml"),
        ({"min_objects": 30, "room_polygon_m": (0, 0, 3, 0, 3, 3, 0, 3)}, r"failed at: furniture on at most 0.42 of the floor"),
        ({"min_objects": 60, "max_objects": 70}, r"^min_objects: expected at most \d+, the most objects of a bedroom"),
        ({"room_shape": "l_shape", "room_polygon_m": (0, 0, 3, 0, 3, 3, 0, 3)}, r"^room_shape: expected 'any' beside room_polygon_m"),
        ({"room_height_m": 1.0}, r"^room_height_m: expected at least 2 m"),
        ({"sizes": ("bed:4x4x4",)}, r"^sizes: bed:4x4x4: expected sizes that the bedroom grammar has for bed \(depth 1.95 to 2.3"),
        ({"sizes": ("bed:2x1",)}, r"^sizes: expected texts 'name:depth x width x height', got 'bed:2x1'"),
        ({"sizes": ("bed:2..1x*x*",)}, r"^sizes: .* expected a lower bound up to the upper one"),
        ({"sizes": ("sofa:1x1x1",)}, r"^sizes: sofa:1x1x1: expected a category or object of the bedroom grammar"),
        ({"sizes": ("bed:-1x1x1",)}, r"^sizes: .* expected a number, a range 'low..high' or '\*', got '-1'"),
        ({"weights": ("overlap:-3",)}, r"^weights: overlap: expected a number in \[0.0, 1000000.0\], got -3"),
        ({"weights": ("tidiness:3",)}, r"^weights: expected texts 'key:value' with a key among overlap"),
        ({"weights": ("overlap:much",)}, r"^weights: overlap:much: expected a number after 'overlap:', got 'much'"),
        ({"validity": ("walkable_share:2",)}, r"^validity: walkable_share: expected a number in \[0.0, 1.0\], got 2"),
        ({"odds": ("sleeping/double_sleeping:2",)}, r"^odds: .* expected probabilities in \[0, 1\]"),
        ({"odds": ("sleeping/hammock:1",)}, r"^odds: .* expected a branch of sleeping \(double_sleeping"),
        ({"odds": ("bedroom/sleeping:1",)}, r"^odds: .* expected 'node/branch:p' with an Or or Set node"),
        ({"odds": ("storage/wardrobe:0.5:0.6",)}, r"^odds: .* copies that sum to 1, got a sum of 1.1"),
        ({"odds": ("sleeping/double_sleeping:0.5:0.5",)}, r"^odds: .* expected one probability"),
        ({"counts": ("window:5:5",)}, r"^counts: window:5:5: expected a range that meets the 1 to 2"),
        ({"fixed": ("bed",)}, r"^fixed: expected texts 'name:x:y:yaw'"),
        ({"fixed": ("bed:nan:0:0",)}, r"^fixed: expected texts 'name:x:y:yaw'"),
        ({"fixed": ("bed:1000:0:0",)}, r"^fixed: bed:1000:0:0: expected x and y within 60 m"),
        ({"fixed": ("unicorn:0:0:0",)}, r"^fixed: unicorn:0:0:0: expected a category of categories.yaml"),
        ({"fixed": ("treadmill:0:0:0",)}, r"^fixed: treadmill:0:0:0: expected ':size=DxWxH', since the bedroom grammar has no treadmill"),
        ({"fixed": ("bed:0:0:0", "bed:2:0:0", "bed:0:3:0")}, r"^fixed: 3 of bed: expected a range that meets the 1 to 2"),
        ({"fixed": ("bed:0:0:0:size=2x1.5x1", "wardrobe:0.5:0:0:size=0.6x1.2x2")}, r"^fixed: bed.* expected objects that do not overlap"),
        ({"fixed": ("bed:9:0:0",)}, r"failed at: fixed: bed:9:0:0: inside the room"),
        ({"fixed": ("laptop:0:0:0",)}, r"^fixed: laptop:0:0:0: expected ':on=K', since it stands on objects"),
        (
            {"fixed": ("bed:0:0:0", "laptop:0:0:0:on=1")},
            r"^fixed: laptop.* expected ':on=K' of an object with a support surface, got bed",
        ),
        ({"fixed": ("bed:0:0:0:on=1",)}, r"^fixed: bed:0:0:0:on=1: expected ':on=K' with K from 1 to 0"),
        ({"fixed": ("picture:0:0:0",), "room_shape": "rectangle"}, r"failed at: fixed: picture:0:0:0: on a wall"),
    ],
)
def test_what_cannot_be_met_ends_in_an_error_that_names_it(fields, expected):
    grammar = read_room_type("bedroom", CATEGORIES)
    grammar = replace(grammar, budget=replace(grammar.budget, derivations=300))
    with pytest.raises(RequestError, match=expected):
        derive(grammar, CATEGORIES, SceneRequest(**fields), np.random.default_rng(0))


def test_structures_given_their_numbers_have_the_grammars_distribution_given_them():
    grammar = small_grammar(TEXT)
    bounds = [
        CountBound(3, 5, "total", frozenset(grammar.objects)),
        CountBound(2, 10_000, "bins", frozenset({"bin"})),
        CountBound(0, 1, "vases", frozenset({"vase"})),
    ]
    tables = ConditionalStructures(grammar, bounds, [9, 6, 4])
    rng = np.random.default_rng(2)

    def fits(contents):
        number = dict(contents)
        return 3 <= sum(number.values()) <= 5 and number.get("waste_bin", 0) >= 2 and number.get("vase", 0) <= 1

    drawn = [categories_of(grammar, rng) for _ in range(40_000)]
    free = Counter(contents for contents in drawn if fits(contents))
    assert tables.probability == pytest.approx(sum(free.values()) / 40_000, abs=0.01)
    given = Counter()
    for _ in range(3000):
        structure = tables.draw(rng)
        given[tuple(sorted(Counter(vertex.choice for vertex in structure if vertex.kind == "terminal").items()))] += 1
    assert all(fits(contents) for contents in given)
    keys = [key for key, number in free.items() if number > 60]
    table = np.array([[free[key] for key in keys], [given[key] for key in keys]])
    assert stats.chi2_contingency(table).pvalue > 1e-4


def test_sizes_given_a_range_are_those_of_the_mixture_given_it():
    grammar = read_room_type("bedroom", CATEGORIES)
    rule = grammar.objects["double_bed"]
    cut = overridden(grammar, SceneRequest(sizes=("double_bed:*x1.5..1.8x*",))).objects["double_bed"]
    rng = np.random.default_rng(3)
    free = [size[1] for size in (draw_size(rng, rule) for _ in range(12_000)) if 1.5 <= size[1] <= 1.8]
    drawn = [draw_size(rng, cut)[1] for _ in range(4000)]
    assert min(drawn) >= 1.5 and max(drawn) <= 1.8
    assert stats.ks_2samp(free, drawn).pvalue > 1e-4
    fixed = overridden(grammar, SceneRequest(sizes=("bed:2.0x1.5x0.9",)))
    assert draw_size(rng, fixed.objects["double_bed"]) == (2.0, 1.5, 0.9)
    assert fixed.objects["single_bed"].sizes == ()


def test_the_grammars_numbers_are_replaced():
    grammar = read_room_type("bedroom", CATEGORIES)
    request = SceneRequest(
        odds=("sleeping/double_sleeping:0", "storage/wardrobe:0:1", "window:0:0:1"),
        weights=("overlap:7",), validity=("robot_radius_m:0.3",), room_shape="l_shape", room_height_m=2.8,
    )  # fmt: skip
    changed = overridden(grammar, request)
    assert [branch.probability for branch in changed.nodes["sleeping"].branches] == pytest.approx([0.0, 0.3 / 0.38, 0.08 / 0.38])
    assert overridden(changed, request) == changed
    assert (changed.weights.overlap, changed.validity.robot_radius_m, changed.room.shapes.l_shape) == (7.0, 0.3, 1.0)
    for seed in range(8):
        tree = derive(grammar, CATEGORIES, request, np.random.default_rng(seed))
        number = Counter(item.rule.category for item in tree.items)
        assert number["wardrobe"] == 1 and sum(opening.category == "window" for opening in tree.room.openings) == 2
        assert tree.room.height_m == 2.8 and len(tree.room.polygon_m) == 6


def test_fixed_objects_stay_and_the_rest_is_laid_out_around_them():
    grammar = read_room_type("bedroom", CATEGORIES)
    request = SceneRequest(
        room_width_m=5.0, room_depth_m=4.6, counts=("nightstand:1:1", "bed:1:1"),
        fixed=(
            "bed:-1.4:0.2:0:size=2.1x1.6x1.0", "desk:1.9:-1.5:3.14159:size=0.66x1.3x0.74", "laptop:1.9:-1.5:3.14159:on=2",
            "treadmill:1.2:1.4:0:size=1.7x0.8x1.4", "picture:0:2.3:0:middle=1.5",
        ),
    )  # fmt: skip
    for seed in range(3):
        room = sample_room(grammar, CATEGORIES, request, np.random.default_rng(seed))
        first = {item.category: item for item in reversed(room.objects)}
        assert room.validity.valid
        assert first["bed"].position_m == (-1.4, 0.2, 0.0) and first["bed"].size_m == (2.1, 1.6, 1.0) and first["bed"].yaw_rad == 0.0
        assert first["treadmill"].position_m == (1.2, 1.4, 0.0)
        assert first["laptop"].position_m == pytest.approx((1.9, -1.5, 0.74)) and first["laptop"].support.id == first["desk"].id
        hung = [item for item in room.objects if item.category == "picture" and item.position_m[0] == pytest.approx(0.0, abs=1e-9)]
        assert hung and hung[0].position_m[2] + 0.5 * hung[0].size_m[2] == pytest.approx(1.5)
        stands = [item for item in room.objects if item.category == "nightstand"]
        assert stands and all(item.group == first["bed"].id for item in stands)
        assert all(math.dist(item.position_m[:2], first["bed"].position_m[:2]) < 1.8 for item in stands)
