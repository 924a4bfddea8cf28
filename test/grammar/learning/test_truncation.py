"""Odds of structures of which some never pass, against the counts that are wanted."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from small_grammar import CATEGORIES, item, small_grammar

from grammar import Grammar
from grammar.derivation.openings import COUNT
from grammar.derivation.structure import draw_structure
from grammar.learning.choices import ROOM_SIZES, SampledCounts
from grammar.learning.learn import room_sampler
from grammar.learning.truncation import (
    TruncationOptions,
    TruncationRow,
    correct_truncation,
    count_kl,
    kept_round,
)
from grammar.spec.room_rules import RoomSize

NODES = """
nodes:
  closet: {kind: and, branches: [{symbol: sleeping}, {symbol: storage}]}
  sleeping: {kind: or, branches: [{symbol: bed, probability: 0.5}, {symbol: sofa, probability: 0.5}]}
  storage: {kind: set, branches: [{symbol: wardrobe, multiplicity: [0.3, 0.4, 0.3]}, {symbol: lamp, multiplicity: [0.4, 0.6]}]}
objects:
"""
OBJECTS = (
    item("bed", "bed", (2.0, 1.0, 0.5))
    + item("sofa", "sofa", (0.8, 1.5, 0.8))
    + item("wardrobe", "wardrobe", (0.6, 1.0, 2.0))
    + item("lamp", "floor_lamp", (0.3, 0.3, 1.5))
)
COVERED = {"bed", "sofa", "wardrobe"}
WANTED = {"bed": 0.5, "sofa": 0.5, "wardrobe": 1.0}


def thin_sampler(grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
    """Return structures of which nine in ten with two wardrobes, and half of those with a bed, do not pass."""
    rooms = []
    for index in indices:
        rng = np.random.default_rng([stream, index])
        while True:
            vertices = draw_structure(grammar, rng)
            found = Counter(vertex.symbol for vertex in vertices if vertex.kind == "terminal")
            if (found["wardrobe"] < 2 or rng.random() < 0.1) and (not found["bed"] or rng.random() < 0.5):
                break
        branches = [("sleeping", -1, 0 if found["bed"] else 1), ("storage", 0, found["wardrobe"]), ("storage", 1, found["lamp"])]
        categories = {grammar.objects[symbol].category: count for symbol, count in found.items()}
        rooms.append(SampledCounts(failed=False, branches=tuple(branches), categories=categories))
    return rooms


def test_rooms_that_pass_get_the_counts_of_the_data() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    before = thin_sampler(grammar, 9, range(4000))
    assert np.mean([room.categories.get("wardrobe", 0) for room in before]) < 0.7
    corrected, rows = correct_truncation(grammar, WANTED, COVERED, TruncationOptions(iterations=3, rooms=1500), thin_sampler)
    after = thin_sampler(corrected, 8, range(4000))
    # a mean of 4000 rooms has a standard error of 0.013 or less, the 1500 that the odds were found from one of 0.021
    for category, mean in WANTED.items():
        assert np.mean([room.categories.get(category, 0) for room in after]) == pytest.approx(mean, abs=0.08)
    twice = np.bincount([room.categories.get("wardrobe", 0) for room in after], minlength=3) / 4000
    assert twice == pytest.approx([0.3, 0.4, 0.3], abs=0.07)
    assert corrected.nodes["storage"].branches[1] == grammar.nodes["storage"].branches[1]
    assert rows[0].category_kl > 0.03
    assert rows[-1].category_kl < 0.003
    # exactly: an odds ratio of two wardrobes against one that is ten times as great, of a bed against a sofa twice
    two = corrected.nodes["storage"].branches[0].multiplicity or ()
    assert two[2] / two[1] == pytest.approx(10 * 0.3 / 0.4, rel=0.4)
    bed, sofa = (branch.probability or 0.0 for branch in corrected.nodes["sleeping"].branches)
    assert bed / sofa == pytest.approx(2.0, rel=0.25)


def test_real_rooms_are_counted_by_their_derivations() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    for room in room_sampler(CATEGORIES, 1)(grammar, 0, range(6)):
        assert not room.failed
        taken = {(node, branch): choice for node, branch, choice in room.branches}
        assert taken["sleeping", -1] == (0 if room.categories.get("bed") else 1)
        assert taken["storage", 0] == room.categories.get("wardrobe", 0)
        assert taken["storage", 1] == room.categories.get("floor_lamp", 0)


def test_sizes_of_rooms_that_seldom_pass_are_raised_and_those_that_never_do_are_given_up() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    modes = tuple(RoomSize(probability=p, mean_m=(4.0, d), sd_m=(0.1, 0.1)) for p, d in ((0.4, 3.0), (0.4, 4.0), (0.2, 5.0)))
    grammar = replace(grammar, room=replace(grammar.room, sizes=modes))

    def half_pass(grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
        rng = np.random.default_rng(stream)
        odds = np.array([size.probability for size in grammar.room.sizes]) * (1.0, 0.5, 0.0)
        chosen = rng.choice(3, size=len(indices), p=odds / odds.sum())
        return [SampledCounts(failed=False, branches=((ROOM_SIZES, -1, int(k)),), categories={"bed": 1}) for k in chosen]

    corrected, _ = correct_truncation(grammar, {"bed": 1.0}, COVERED, TruncationOptions(iterations=3, rooms=1500), half_pass)
    first, second, third = (size.probability for size in corrected.room.sizes)
    assert second / first == pytest.approx(2.0, rel=0.2)
    assert third < 0.05


def half_with_one_window_pass(grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
    """Return rooms of a grammar of which half of those with one window pass and none with three."""
    odds = np.array(grammar.openings["window"].multiplicity) * (1.0, 0.5, 1.0, 0.0)
    chosen = np.random.default_rng(stream).choice(4, size=len(indices), p=odds / odds.sum())
    return [SampledCounts(failed=False, branches=((f"window{COUNT}", -1, int(k)),), categories={"bed": 1}) for k in chosen]


def test_numbers_of_windows_are_corrected_impossible_ones_stay_impossible_and_those_that_never_pass_are_given_up() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    window = replace(grammar.openings["window"], multiplicity=(0.45, 0.45, 0.0, 0.1))
    grammar = replace(grammar, openings={**grammar.openings, "window": window})
    options = TruncationOptions(iterations=3, rooms=1500)
    corrected, _ = correct_truncation(grammar, {"bed": 1.0}, COVERED | {f"window{COUNT}"}, options, half_with_one_window_pass)
    assert correct_truncation(grammar, {"bed": 1.0}, COVERED, options, half_with_one_window_pass)[0].openings == grammar.openings
    none, one, two, three = corrected.openings["window"].multiplicity
    assert one / none == pytest.approx(2.0, rel=0.2)
    assert two == 0.0
    assert 0.0 < three < 0.02


def test_without_iterations_the_grammar_stays() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    same, rows = correct_truncation(grammar, WANTED, COVERED, TruncationOptions(iterations=0), thin_sampler)
    assert rows == ()
    assert same.nodes["storage"].branches[0].multiplicity == pytest.approx((0.3, 0.4, 0.3))


def test_rooms_are_no_more_crowded_than_all_but_the_fullest_of_the_first_round() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    grammar, limits = replace(grammar, room=replace(grammar.room, used_share_max=0.5)), []

    def sampler(grammar: Grammar, stream: int, indices: Sequence[int]) -> list[SampledCounts]:
        limits.append((grammar.room.used_share_max, grammar.room.wall_share_max))
        room = SampledCounts(failed=False, branches=(("sleeping", -1, 0),), categories={"bed": 1}, wall_share=0.3)
        full = [replace(room, categories={"bed": 1 + (k > 95)}, used_share=0.01 * (k + 1) * (stream + 1)) for k in range(101)]
        return [*full, replace(room, failed=True, used_share=3.0)]

    corrected, rows = correct_truncation(grammar, {"bed": 1.0}, COVERED, TruncationOptions(iterations=2, rooms=3), sampler)
    assert rows[0].objects == 1.0 and rows[1].objects > 1.0  # the fullest of the first round, with two beds, do not count
    assert limits == [(10.0, 10.0), pytest.approx((0.96, 0.3)), pytest.approx((0.96, 0.3))]
    assert (corrected.room.used_share_max, corrected.room.wall_share_max) == pytest.approx((0.96, 0.3))
    kept, _ = correct_truncation(grammar, {"bed": 1.0}, COVERED, TruncationOptions(iterations=0), sampler)
    assert kept.room.used_share_max == 0.5


def test_counted_rooms_tell_how_full_they_are() -> None:
    grammar = small_grammar(NODES + OBJECTS)
    rooms = room_sampler(CATEGORIES, 1)(grammar, 0, range(6))
    full = [room.used_share for room in rooms if room.categories.get("wardrobe", 0) == 2]
    bare = [room.used_share for room in rooms if not room.categories.get("wardrobe", 0)]
    assert full and bare and min(full) > max(bare) > 0.0


def test_the_last_round_is_kept_that_differs_from_the_best_by_no_more_than_chance() -> None:
    wanted = {"bed": 1.0, "desk": 0.5}
    near, far = count_kl(wanted, {"bed": 1.05, "desk": 0.5}, 100), count_kl(wanted, {"bed": 1.0, "desk": 1.0}, 100)
    assert near == pytest.approx(math.log(1.005 / 1.055) + 0.05, abs=1e-9)
    # one that no room has counts as half an object in all of them
    assert count_kl(wanted, {"bed": 1.0}, 100) == pytest.approx(0.5 * math.log(0.505 / 0.005) - 0.5)
    figures = {"category_kl": 0.0, "objects": 1.5, "failed": 0, "scatter": 0.01}
    rows = [TruncationRow(iteration=k, count_kl=kl, **figures) for k, kl in enumerate((0.0, near, far))]
    assert near < 0.01 < far
    assert kept_round(rows) == 1
