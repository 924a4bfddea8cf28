"""Trajectories in TUM's form: exact both ways, refused by line."""

import pytest
from sample_scene import sample_scene

from scene_description import CameraPose, FieldError
from scene_description.tum_trajectory import trajectory_from_tum, trajectory_to_tum


def test_a_path_reads_back_exactly() -> None:
    path = sample_scene().camera_path
    text = trajectory_to_tum(path)
    again = trajectory_from_tum(text)
    assert [pose.stamp_ns for pose in again] == [pose.stamp_ns for pose in path]
    for pose, other in zip(path, again, strict=True):
        assert other.position_m == pose.position_m and other.orientation == pytest.approx(pose.orientation, abs=1e-12)


def test_the_benchmarks_own_form() -> None:
    """A line as the TUM RGB-D benchmark prints it, with comments and four decimals."""
    text = "# ground truth\n# timestamp tx ty tz qx qy qz qw\n\n1305031098.6659 1.3563 0.6305 1.6380 0.6132 0.5962 -0.3311 -0.3986\n"
    (pose,) = trajectory_from_tum(text)
    assert pose.stamp_ns == 1_305_031_098_665_900_000
    assert pose.position_m == (1.3563, 0.6305, 1.6380)
    assert sum(value * value for value in pose.orientation) == pytest.approx(1.0, abs=1e-12)
    assert pose.orientation == pytest.approx((0.6132, 0.5962, -0.3311, -0.3986), abs=1e-3)


def test_stamps_keep_their_nanoseconds() -> None:
    pose = CameraPose(stamp_ns=1_700_000_000_123_456_789, position_m=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0))
    assert trajectory_from_tum(trajectory_to_tum([pose])) == (pose,)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected lines 'timestamp tx ty tz qx qy qz qw', got none"),
        ("1 0 0 0 0 0 0", "line 1: expected 8 numbers"),
        ("1 0 0 0 0 0 zero 1", "line 1: expected 8 numbers"),
        ("# x\n1 0 0 nan 0 0 0 1", "line 2: expected a position within 1000 m and a unit quaternion"),
        ("1 0 0 0 0 0 0 0.5", "line 1: expected a position within 1000 m and a unit quaternion"),
        ("-1 0 0 0 0 0 0 1", r"line 1: expected a timestamp in \[0, 4e9\] s"),
        ("inf 0 0 0 0 0 0 1", r"line 1: expected a timestamp in \[0, 4e9\] s"),
        ("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1", "line 2: expected timestamps that increase"),
    ],
)
def test_what_does_not_fit_is_refused(text: str, message: str) -> None:
    with pytest.raises(FieldError, match=message):
        trajectory_from_tum(text)
