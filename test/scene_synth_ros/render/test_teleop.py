"""A driven camera: known motions, and never a place where the disc does not fit."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import Twist, Vector3
from hypothesis import given, settings
from hypothesis import strategies as st

from scene_description import CameraPose
from scene_description.poses import look_at, rotation_from_quaternion
from scene_synth_ros.render.camera_requests import CameraRequests
from scene_synth_ros.render.teleop import DriveConfig, DriveState, FreeFloor, Velocity, drive, drive_pose, start_drive

CONFIG = DriveConfig(enabled=True, radius_m=0.2, max_speed_m_s=2.0)


def floor_with_pillar() -> FreeFloor:
    """4 m x 3 m, cells of 0.05 m, a pillar of 0.5 m x 0.5 m with its corner at (2, 1)."""
    cells = np.zeros((60, 80), np.int8)
    cells[20:30, 40:50] = 100
    return FreeFloor.from_cells(cells, 0.05, (0.0, 0.0))


def distance_to_solid(x: float, y: float) -> float:
    to_pillar = math.hypot(max(2.0 - x, 0.0, x - 2.5), max(1.0 - y, 0.0, y - 1.5))
    return min(to_pillar, x, y, 4.0 - x, 3.0 - y)


def test_a_free_camera_goes_where_the_twist_says() -> None:
    floor = floor_with_pillar()
    state = drive(DriveState(1.0, 0.5, 1.2, 0.0, 0.0), Velocity(forward_m_s=0.5, up_m_s=0.1), 1.0, floor, CONFIG)
    assert state == pytest.approx((1.5, 0.5, 1.3, 0.0, 0.0))
    turned = drive(DriveState(1.0, 2.0, 1.2, 0.0, 0.0), Velocity(yaw_rad_s=math.pi / 4), 2.0, floor, CONFIG)
    assert turned.yaw_rad == pytest.approx(math.pi / 2)
    sideways = drive(DriveState(1.0, 0.5, 1.2, 0.0, 0.0), Velocity(left_m_s=0.4), 1.0, floor, CONFIG)
    assert sideways[:2] == pytest.approx((1.0, 0.9))


def test_it_slides_along_a_wall_and_stops_at_the_pillar() -> None:
    floor = floor_with_pillar()
    slid = drive(DriveState(1.0, 0.4, 1.2, -math.pi / 4, 0.0), Velocity(forward_m_s=1.0), 1.5, floor, CONFIG)
    assert slid.x_m > 1.9 and 0.2 <= slid.y_m < 0.4
    stopped = drive(DriveState(1.0, 1.25, 1.2, 0.0, 0.0), Velocity(forward_m_s=2.0), 3.0, floor, CONFIG)
    assert 2.0 - 0.2 - 0.1 - 2 * 0.05 <= stopped.x_m <= 2.0 - 0.2
    assert stopped.y_m == 1.25


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.tuples(*[st.one_of(st.floats(-1e6, 1e6), st.just(math.nan), st.just(math.inf))] * 5, st.floats(0.0, 2.0)), max_size=12),
    st.floats(0.0, 4.0),
    st.floats(0.0, 3.0),
)
def test_no_twist_brings_it_nearer_than_its_radius(twists: list[tuple[float, ...]], x: float, y: float) -> None:
    floor = floor_with_pillar()
    pose = CameraPose(stamp_ns=0, position_m=(x, y, 1.0), orientation=look_at((x, y, 1.0), (x + 1.0, y, 0.9)))
    state = start_drive(pose, floor, CONFIG)
    assert state is not None
    for *velocity, seconds in twists:
        state = drive(state, Velocity(*velocity), seconds, floor, CONFIG)
        assert distance_to_solid(state.x_m, state.y_m) >= CONFIG.radius_m - 1e-9
        assert CONFIG.min_height_m <= state.z_m <= CONFIG.max_height_m
        assert np.isfinite(drive_pose(state, 1).orientation).all()


def test_driving_begins_at_the_pose_of_the_path() -> None:
    pose = CameraPose(stamp_ns=5, position_m=(1.0, 2.0, 1.1), orientation=look_at((1.0, 2.0, 1.1), (2.0, 2.5, 0.8)))
    state = start_drive(pose, floor_with_pillar(), CONFIG)
    assert state is not None
    again = drive_pose(state, 5)
    np.testing.assert_allclose(again.position_m, pose.position_m, atol=1e-12)
    np.testing.assert_allclose(rotation_from_quaternion(again.orientation), rotation_from_quaternion(pose.orientation), atol=1e-12)


def test_a_room_without_floor_cannot_be_driven() -> None:
    full = FreeFloor.from_cells(np.full((10, 10), 100, np.int8), 0.05, (0.0, 0.0))
    pose = CameraPose(stamp_ns=0, position_m=(0.1, 0.1, 1.0), orientation=look_at((0.1, 0.1, 1.0), (1.0, 0.1, 1.0)))
    assert start_drive(pose, full, CONFIG) is None


def test_a_velocity_holds_for_its_time_by_the_simulated_clock() -> None:
    requests = CameraRequests("map", DriveConfig(enabled=True, timeout_s=0.5))
    assert requests.velocity(0.1) == Velocity()
    requests.take_twist(Twist(linear=Vector3(x=0.4), angular=Vector3(z=-1.0)))
    assert [requests.velocity(0.2).forward_m_s for _ in range(5)] == [0.4, 0.4, 0.4, 0.0, 0.0]
    requests.take_twist(Twist(linear=Vector3(x=0.2)))
    assert requests.velocity(9.0) == Velocity(forward_m_s=0.2)
    requests.take_twist(Twist(linear=Vector3(x=0.2)))
    requests.begin_room()
    assert requests.velocity(0.0) == Velocity()
