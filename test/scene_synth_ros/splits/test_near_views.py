"""Views are left out that are near one that stays and look like it, and no others."""

import math

import numpy as np
import pytest

from scene_synth_ros.splits.assignment import SplitError
from scene_synth_ros.splits.frame_facts import GRID, FrameFacts
from scene_synth_ros.splits.near_views import KeptViews, Nearness, read_nearness, turn_rad

NEAR = Nearness(distance_m=0.1, angle_rad=math.radians(5.0))


def view(number: int, x_m: float = 0.0, yaw_deg: float = 0.0, changed: float = 0.0, luma: int = 100) -> FrameFacts:
    """Return a view of a wall with two objects; ``changed``: share of the ids that are others."""
    ids = np.ones(GRID, np.uint16)
    ids.ravel()[: round(changed * ids.size)] = 2
    turn = math.radians(yaw_deg)
    axes = np.array([[math.cos(turn), -math.sin(turn), 0.0], [math.sin(turn), math.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    return FrameFacts(number=number, position_m=np.array([x_m, 0.0, 1.5]), axes=axes, ids=ids, thumbnail=np.full(GRID, luma, np.uint8))


@pytest.mark.parametrize(
    ("second", "equals"),
    [
        (view(1), 0),
        (view(1, x_m=0.099), 0),
        (view(1, x_m=0.101), None),
        (view(1, x_m=-0.099), 0),
        (view(1, yaw_deg=4.9), 0),
        (view(1, yaw_deg=5.1), None),
        (view(1, changed=0.09), 0),
        (view(1, changed=0.11), None),
        (view(1, luma=112), 0),
        (view(1, luma=113), None),
    ],
)
def test_a_second_view(second: FrameFacts, equals: int | None) -> None:
    kept = KeptViews(NEAR)
    assert kept.equal_to(view(0)) is None
    assert kept.equal_to(second) == equals


def test_along_a_slow_path_every_third_view_stays() -> None:
    kept = KeptViews(NEAR)
    left_out = {number: kept.equal_to(view(number, x_m=0.04 * number)) for number in range(9)}
    assert left_out == {0: None, 1: 0, 2: 0, 3: None, 4: 3, 5: 3, 6: None, 7: 6, 8: 6}


def test_without_pictures_poses_decide() -> None:
    kept = KeptViews(NEAR)
    assert kept.equal_to(FrameFacts(number=0)) is None
    assert kept.equal_to(FrameFacts(number=1)) == 0


def test_angle_between_cameras() -> None:
    assert turn_rad(view(0, yaw_deg=170.0), view(1, yaw_deg=-170.0)) == pytest.approx(math.radians(20.0))


def test_words() -> None:
    assert read_nearness("0.05:5") == Nearness(distance_m=0.05, angle_rad=math.radians(5.0))
    assert read_nearness("1:90:0.5:0.25") == Nearness(distance_m=1.0, angle_rad=math.pi / 2, ids_equal=0.5, luma_difference=0.25)
    for words in ("0:5", "5", "1:200", "1:5:2", "a:b"):
        with pytest.raises(SplitError, match="expected METRES:DEGREES"):
            read_nearness(words)
