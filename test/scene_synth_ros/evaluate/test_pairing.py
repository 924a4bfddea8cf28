"""Stamps of truth and estimates: late, missing, swapped, repeated and foreign ones, each with its known answer."""

from __future__ import annotations

from scene_synth_ros.evaluate.pair_buffer import Pair, PairBuffer
from scene_synth_ros.evaluate.stamp_match import match_stamps, stamp_notes


def test_equal_stamps_pair_whichever_comes_first() -> None:
    buffer = PairBuffer[str](window=4)
    assert buffer.add("truth", 1, "t1") is None
    assert buffer.add("estimate", 2, "e2") is None
    assert buffer.add("estimate", 1, "e1") == Pair(1, "t1", "e1")
    assert buffer.add("truth", 2, "t2") == Pair(2, "t2", "e2")
    assert (buffer.counts, buffer.waiting) == ({"paired": 2}, 0)


def test_swapped_stamps_pair_with_the_truth_of_the_stamp_that_they_claim() -> None:
    buffer = PairBuffer[str](window=4)
    assert [buffer.add("truth", stamp, f"t{stamp}") for stamp in (1, 2)] == [None, None]
    assert buffer.add("estimate", 2, "of frame 1") == Pair(2, "t2", "of frame 1")
    assert buffer.add("estimate", 1, "of frame 2") == Pair(1, "t1", "of frame 2")


def test_what_waits_is_bounded_and_what_is_given_up_is_counted() -> None:
    buffer = PairBuffer[str](window=2)
    for stamp in range(1, 6):
        buffer.add("truth", stamp, "t")
    assert (buffer.waiting, buffer.counts) == (2, {"missing": 3})
    assert buffer.add("estimate", 3, "too late") is None
    assert buffer.counts["late"] == 1
    for stamp in (7, 8, 9):
        buffer.add("estimate", stamp, "of nothing")
    assert (buffer.counts["foreign"], buffer.waiting) == (1, 4)
    buffer.finish()
    assert (buffer.counts, buffer.waiting) == ({"missing": 5, "late": 1, "foreign": 3}, 0)


def test_a_stamp_counts_once() -> None:
    buffer = PairBuffer[str](window=2)
    buffer.add("estimate", 1, "first")
    buffer.add("estimate", 1, "again")
    assert buffer.add("truth", 1, "t") == Pair(1, "t", "first")
    buffer.add("estimate", 1, "after all")
    buffer.add("truth", 1, "again")
    assert buffer.counts == {"paired": 1, "repeated": 3}


def test_stamps_of_bags_are_matched_before_anything_is_decoded() -> None:
    match = match_stamps({10: 1, 20: 1, 30: 2}, {30: 1, 10: 3, 15: 1})
    assert (match.paired, match.missing, match.foreign, match.repeated) == ((10, 30), (20,), (15,), 2)
    foreign, repeated = stamp_notes("depth", "/my/depth", match)
    assert foreign == (
        "depth: /my/depth: expected estimates at the stamps of the truth, got 1 of 3 stamps that no truth has, the first 15 ns;"
        " copy the stamp of the image"
    )
    assert repeated == "depth: /my/depth: 2 messages repeat a stamp; the first of each stamp counts"
    assert stamp_notes("depth", "/my/depth", match_stamps({1: 1}, {1: 1})) == []
