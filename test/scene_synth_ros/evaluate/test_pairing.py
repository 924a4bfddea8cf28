"""Stamps of truth and estimates: late, missing, swapped, repeated and foreign ones, each with its known answer."""

from __future__ import annotations

from scene_synth_ros.evaluate.judged_bag import match_stamps, stamp_notes
from scene_synth_ros.evaluate.stamp_buffer import Gathered, StampBuffer


def test_a_stamp_is_whole_when_every_stream_has_brought_it() -> None:
    buffer = StampBuffer[str](("truth", "estimate"), window=4)
    assert buffer.add("truth", 1, "t1") is None
    assert buffer.add("estimate", 2, "e2") is None
    assert buffer.add("estimate", 1, "e1") == Gathered(1, {"truth": "t1", "estimate": "e1"})
    assert buffer.add("truth", 2, "t2") == Gathered(2, {"truth": "t2", "estimate": "e2"})
    assert (buffer.counts, buffer.waiting) == ({}, 0)


def test_swapped_stamps_go_with_the_truth_of_the_stamp_that_they_claim() -> None:
    buffer = StampBuffer[str](("truth", "estimate"), window=4)
    assert [buffer.add("truth", stamp, f"t{stamp}") for stamp in (1, 2)] == [None, None]
    assert buffer.add("estimate", 2, "of frame 1") == Gathered(2, {"truth": "t2", "estimate": "of frame 1"})
    assert buffer.add("estimate", 1, "of frame 2") == Gathered(1, {"truth": "t1", "estimate": "of frame 2"})


def test_what_waits_is_bounded_and_what_comes_after_is_late() -> None:
    buffer = StampBuffer[str](("truth", "estimate"), window=2)
    given_up = [buffer.add("truth", stamp, f"t{stamp}") for stamp in range(1, 5)]
    assert given_up == [None, None, Gathered(1, {"truth": "t1"}), Gathered(2, {"truth": "t2"})]
    assert buffer.add("estimate", 2, "too late") is None
    assert buffer.add("estimate", 9, "of nothing") == Gathered(3, {"truth": "t3"})
    assert (buffer.counts, buffer.waiting) == ({"late": 1}, 2)
    assert buffer.finish() == [Gathered(4, {"truth": "t4"}), Gathered(9, {"estimate": "of nothing"})]
    assert buffer.waiting == 0


def test_a_stamp_counts_once() -> None:
    buffer = StampBuffer[str](("truth", "estimate"), window=2)
    buffer.add("estimate", 1, "first")
    buffer.add("estimate", 1, "again")
    assert buffer.add("truth", 1, "t") == Gathered(1, {"truth": "t", "estimate": "first"})
    buffer.add("estimate", 1, "after all")
    assert buffer.counts == {"repeated": 2}
    buffer.add("truth", 2, "t")
    for stamp in (3, 4):
        buffer.add("truth", stamp, "t")
    for _ in range(2):
        buffer.add("estimate", 2, "given up before")
    assert buffer.counts == {"repeated": 3, "late": 1}


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
