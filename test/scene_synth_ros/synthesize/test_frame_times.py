"""Times of frames."""

from scene_description import CameraPose
from scene_synth_ros.synthesize.room_schedule import FrameTimes, moved_to


def test_stamps_are_exact_nanoseconds_without_drift() -> None:
    times = FrameTimes(1_000_000_000, 30.0)
    assert [times.stamp_ns(frame) for frame in (0, 1, 2, 3)] == [1_000_000_000, 1_033_333_333, 1_066_666_667, 1_100_000_000]
    assert times.stamp_ns(30 * 3600 * 24) == 1_000_000_000 + 24 * 3600 * 1_000_000_000


def test_a_new_rate_goes_on_where_the_old_one_was() -> None:
    times = FrameTimes(0, 10.0).at_rate(20.0, 5)
    assert times.stamp_ns(5) == 500_000_000
    assert times.stamp_ns(6) == 550_000_000


def test_a_path_is_moved_as_a_whole() -> None:
    path = [CameraPose(stamp_ns=stamp, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0)) for stamp in (7, 107, 240)]
    moved = moved_to(path, 10**18)
    assert [pose.stamp_ns - 10**18 for pose in moved] == [0, 100, 233]
    assert {pose.position_m for pose in moved} == {(0.0, 0.0, 1.0)}
