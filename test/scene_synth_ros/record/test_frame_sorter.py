"""Order of release: independent of arrival, bounded, never backwards."""

import itertools
import random

from hypothesis import given, settings
from hypothesis import strategies as st

from scene_synth_ros.record.frame_sorter import FrameSorter

ORDER = ["/clock", "/scene", "/color", "/depth"]
FRAME = {"/clock", "/color", "/depth"}


def names(messages):
    return [(message.topic, message.stamp_ns) for message in messages]


def test_a_group_leaves_when_it_is_complete_in_topic_order():
    sorter = FrameSorter(FRAME)
    assert sorter.add("/depth", 10, b"d") == []
    assert sorter.add("/clock", 10, b"t") == []
    assert sorter.missing() == {10: frozenset({"/color"})}
    assert [tuple(message) for message in sorter.add("/color", 10, b"c")] == [
        ("/clock", 10, 10, b"t"),
        ("/color", 10, 10, b"c"),
        ("/depth", 10, 10, b"d"),
    ]
    assert sorter.waiting_stamps == sorter.waiting_bytes == 0


def test_a_complete_group_waits_for_an_earlier_one():
    sorter = FrameSorter({"/color", "/depth"})
    sorter.add("/color", 1, b"")
    sorter.add("/color", 2, b"")
    assert sorter.add("/depth", 2, b"") == []
    assert names(sorter.add("/depth", 1, b"")) == [("/color", 1), ("/depth", 1), ("/color", 2), ("/depth", 2)]


@settings(max_examples=60, deadline=None)
@given(st.randoms(use_true_random=False))
def test_same_output_for_every_arrival_that_keeps_topics_in_order(source: random.Random):
    stamps = [100, 200, 300, 400]
    queues = {topic: [(topic, stamp, f"{topic}{stamp}".encode()) for stamp in stamps] for topic in FRAME}
    sorter = FrameSorter(FRAME)
    released = [*sorter.add("/scene", 300, b"room 1"), *sorter.add("/scene", 100, b"room 0")]
    while any(queues.values()):
        topic = source.choice([name for name, queue in queues.items() if queue])
        released += sorter.add(*queues[topic].pop(0))
    expected = [(topic, stamp) for stamp in stamps for topic in ORDER if topic in FRAME or stamp in (100, 300)]
    assert names(released) == expected
    assert sorter.late == sorter.forced == 0


def test_without_an_expectation_everything_waits_for_a_flush():
    sorter = FrameSorter(None)
    assert sorter.add("/color", 5, b"c") == []
    assert names(sorter.flush()) == [("/color", 5)]


def test_clock_scene_and_transforms_lead_others_follow_by_name_and_repeats_keep_their_order():
    sorter = FrameSorter({"/b"})
    for topic, data in (("/z", b"1"), ("/a", b"2"), ("/tf", b"3"), ("/z", b"4"), ("/synth/scene", b"5"), ("/clock", b"6")):
        sorter.add(topic, 1, data)
    released = [(message.topic, message.data) for message in sorter.add("/b", 1, b"7")]
    leading = [("/clock", b"6"), ("/synth/scene", b"5"), ("/tf", b"3")]
    assert released == [*leading, ("/a", b"2"), ("/b", b"7"), ("/z", b"1"), ("/z", b"4")]


def test_flush_releases_incomplete_groups_up_to_a_stamp():
    sorter = FrameSorter(FRAME)
    for stamp in (3, 1, 2):
        sorter.add("/color", stamp, b"")
    assert names(sorter.flush(2)) == [("/color", 1), ("/color", 2)]
    assert names(sorter.flush()) == [("/color", 3)]
    assert sorter.forced == 0


def test_windows_force_the_oldest_group_out():
    sorter = FrameSorter(FRAME, max_stamps=2)
    sorter.add("/color", 1, b"")
    sorter.add("/color", 2, b"")
    assert names(sorter.add("/color", 3, b"")) == [("/color", 1)]
    assert (sorter.forced, sorter.waiting_stamps) == (1, 2)
    sorter = FrameSorter(FRAME, max_bytes=10)
    sorter.add("/color", 1, bytes(6))
    assert names(sorter.add("/color", 2, bytes(5))) == [("/color", 1)]
    assert (sorter.forced, sorter.waiting_bytes) == (1, 5)


def test_late_messages_leave_at_once_and_log_time_never_decreases():
    sorter = FrameSorter({"/color"})
    sorter.add("/color", 10, b"")
    (late,) = sorter.add("/depth", 4, b"late")
    assert (late.stamp_ns, late.log_ns, sorter.late) == (4, 10, 1)
    (timeless,) = sorter.add("/diagnostics", None, b"")
    assert (timeless.stamp_ns, timeless.log_ns, sorter.late) == (None, 10, 1)


def test_a_frame_on_its_way_stays_whole_when_more_or_less_is_expected():
    sorter = FrameSorter({"/color", "/depth"})
    assert sorter.add("/color", 10, b"c") == sorter.add("/color", 11, b"c") == []
    assert sorter.configure({"/color", "/depth", "/clock"}) == []
    assert names(sorter.add("/depth", 10, b"d")) == [("/color", 10), ("/depth", 10)]
    assert sorter.add("/color", 12, b"c") == sorter.add("/depth", 12, b"d") == []
    assert names(sorter.configure({"/color"})) == [("/color", 11), ("/color", 12), ("/depth", 12)]


def test_a_group_that_is_set_aside_leaves_whole_at_the_time_of_the_bag():
    sorter = FrameSorter({"/clock", "/color", "/depth"})
    frame = [("/clock", b"t"), ("/color", b"c"), ("/depth", b"d")]
    for topic, data in frame:
        released = sorter.add(topic, 10, data)
    assert len(released) == 3
    sorter.add("/color", 77, b"asked")
    assert sorter.set_aside(77, {"/clock", "/tf"}) == []
    sorter.add("/tf", 77, b"derived")
    assert [len(sorter.add(topic, 20, data)) for topic, data in frame] == [0, 0, 3]
    assert [(message.topic, message.stamp_ns, message.log_ns) for message in sorter.add("/depth", 77, b"asked")] == [
        ("/color", None, 20),
        ("/depth", None, 20),
    ]
    sorter.set_aside(25, {"/clock"})
    sorter.add("/color", 25, b"half an answer")
    assert [len(sorter.add(topic, 30, data)) for topic, data in frame] == [0, 0, 3]
    assert sorter.clock_ns == 30 and sorter.finish() == [] and sorter.waiting_bytes == 0


def test_a_first_expectation_empties_the_sorter_and_keeps_the_clock():
    sorter = FrameSorter(None)
    sorter.add("/color", 10, b"")
    assert names(sorter.configure({"/color", "/depth"})) == [("/color", 10)]
    assert sorter.add("/color", 9, b"")[0].log_ns == 10
    sorter.add("/color", 11, b"")
    assert names(sorter.add("/depth", 11, b"")) == [("/color", 11), ("/depth", 11)]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["/a", "/b", "/c"]), st.integers(0, 12)), max_size=60), st.integers(1, 4))
def test_nothing_is_lost_and_log_times_never_decrease(arrivals, max_stamps):
    sorter = FrameSorter({"/a", "/b"}, max_stamps=max_stamps)
    released = []
    for number, (topic, stamp) in enumerate(arrivals):
        released += sorter.add(topic, stamp, str(number).encode())
        assert sorter.waiting_stamps <= max_stamps
    released += sorter.flush()
    assert sorted(int(message.data) for message in released) == list(range(len(arrivals)))
    assert all(first.log_ns <= second.log_ns for first, second in itertools.pairwise(released))
    assert sum(message.stamp_ns != message.log_ns for message in released) <= sorter.late


def test_topics_that_follow_leave_with_the_next_group_that_leads_and_never_move_the_clock():
    sorter = FrameSorter({"/color"}, max_stamps=3)
    sorter.follow("/other", True)
    assert sorter.add("/other", 5, b"") == []
    assert names(sorter.add("/color", 10, b"")) == [("/other", 5), ("/color", 10)]
    for stamp in (100, 200, 300):
        assert sorter.add("/other", stamp, str(stamp).encode()) == []
    assert sorter.add("/other", 400, b"")[0][:] == ("/other", None, 10, b"100"), "the earliest leaves at the time of the bag"
    assert names(sorter.add("/color", 20, b"")) == [("/color", 20)]
    assert [message.log_ns for message in sorter.flush()] == [20, 20, 20]
    assert sorter.clock_ns == 20 and sorter.late == 0


def test_many_stamps_of_a_patient_topic_may_come_between_two_frames():
    sorter = FrameSorter({"/color"}, max_stamps=3)
    sorter.follow("/imu", True, patient=True)
    for stamp in range(1, 500):
        assert sorter.add("/imu", stamp, b"") == []
    assert [message.log_ns for message in sorter.add("/color", 400, b"")] == [*range(1, 401), 400]
    assert (sorter.forced, sorter.late, sorter.waiting_stamps) == (0, 0, 99)


def test_a_group_that_is_complete_leads_even_if_all_of_it_follows():
    sorter = FrameSorter({"/color", "/depth"})
    for topic in ("/color", "/depth"):
        sorter.follow(topic, True)
    sorter.add("/color", 1, b"")
    assert names(sorter.add("/depth", 1, b"")) == [("/color", 1), ("/depth", 1)]


def test_what_waits_of_a_topic_can_be_taken_back():
    sorter = FrameSorter(FRAME)
    sorter.add("/color", 1, b"abc")
    sorter.add("/other", 1, b"de")
    sorter.add("/other", 2, b"f")
    assert sorter.take_back("/other") == [(1, b"de"), (2, b"f")]
    assert (sorter.waiting_stamps, sorter.waiting_bytes) == (1, 3)


def test_a_clock_that_is_restarted_takes_earlier_stamps():
    sorter = FrameSorter({"/color"})
    sorter.add("/color", 10**18, b"")
    sorter.restart_clock()
    assert names(sorter.add("/color", 5, b"")) == [("/color", 5)]
    assert sorter.late == 0


def test_messages_between_frames_leave_with_the_next_frame_in_the_order_of_stamps():
    sorter = FrameSorter({"/color"})
    sorter.follow("/scan", True)
    assert sorter.add("/scan", 5, b"") == sorter.add("/scan", 15, b"") == []
    assert names(sorter.add("/color", 10, b"")) == [("/scan", 5), ("/color", 10)]
    assert names(sorter.add("/color", 20, b"")) == [("/scan", 15), ("/color", 20)]


def test_a_frame_waits_until_another_topic_has_come_up_to_a_stamp():
    sorter = FrameSorter({"/color"})
    sorter.follow("/scan", True)
    sorter.wait_for(10, "/scan", 7)
    assert sorter.add("/color", 10, b"") == []
    assert sorter.held == "10 {'/scan': 7}"
    assert sorter.add("/scan", 3, b"") == sorter.reach("/scan", 3) == []
    assert sorter.add("/scan", 7, b"") == []
    assert names(sorter.reach("/scan", 7)) == [("/scan", 3), ("/scan", 7), ("/color", 10)]
    assert sorter.held == ""
    sorter.wait_for(20, "/scan", 7)  # it has come already
    sorter.wait_for(5, "/scan", 9)  # for a frame that has left
    assert names(sorter.add("/color", 20, b"")) == [("/color", 20)]
    sorter.wait_for(30, "/scan", 25)
    sorter.add("/color", 30, b"")
    assert names(sorter.flush()) == [("/color", 30)]


def test_a_message_aside_is_not_the_one_that_a_frame_misses():
    sorter = FrameSorter({"/color", "/tf"})
    assert sorter.add("/tf", 8, b"a", aside=True) == sorter.add("/tf", 10, b"b", aside=True) == []
    assert sorter.add("/color", 10, b"") == []
    left = sorter.add("/tf", 10, b"c")
    assert [(message.topic, message.log_ns, message.data) for message in left] == [
        ("/tf", 8, b"a"), ("/tf", 10, b"c"), ("/tf", 10, b"b"), ("/color", 10, b""),
    ]  # fmt: skip
    assert sorter.waiting_bytes == 0


def test_samples_after_the_last_whole_frame_are_logged_at_their_own_stamps() -> None:
    """A run that is interrupted ends between two frames; what the body sensed until then has come at its time."""
    sorter = FrameSorter({"/color", "/depth"})
    sorter.follow("/imu", True, patient=True)
    sorter.follow("/stranger", True)
    for topic, stamp in (("/color", 10), ("/depth", 10), ("/imu", 12), ("/imu", 14), ("/stranger", 15), ("/color", 20), ("/imu", 20)):
        sorter.add(topic, stamp, b"")
    assert [(message.topic, message.stamp_ns, message.log_ns) for message in sorter.finish()] == [
        ("/imu", 12, 12), ("/imu", 14, 14), ("/imu", 20, 20), ("/stranger", None, 20),
    ]  # fmt: skip


def test_what_comes_between_frames_takes_no_longer_where_frames_are_late():
    """Of two streams 4,000 messages wait for a frame; none looks at all that wait."""
    sorter = FrameSorter({"/a", "/b"})
    looked = 0

    class Groups(dict):
        def values(self):
            nonlocal looked
            looked += len(self)
            return super().values()

        def items(self):
            nonlocal looked
            looked += len(self)
            return super().items()

    sorter._groups = Groups()
    for topic in ("/imu", "/odom"):
        sorter.follow(topic, True, patient=True)
    sorter.wait_for(10**10, "/imu", 10**10)
    for stamp in range(5_000_000, 10**10 + 1, 5_000_000):
        for topic in ("/imu", "/odom"):
            assert sorter.add(topic, stamp, b"reading") == [] == sorter.reach(topic, stamp)
    assert sorter.waiting_stamps == 2000 and looked < 5000
    sorter.add("/a", 10**10, b"")
    released = sorter.add("/b", 10**10, b"")
    assert len(released) == 4002 and [message.log_ns for message in released] == sorted(message.log_ns for message in released)
