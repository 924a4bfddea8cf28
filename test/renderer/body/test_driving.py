"""A base that is driven: within its limits, never into anything, and the same curve whether it is read in parts or as a whole."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.body.config import ImuConfig, WheelsConfig
from renderer.body.driving import SPACING_S, BaseDriver, DriveLimits, whole_motion
from renderer.body.imu import ImuReader, read_imu
from renderer.body.obstacles import Obstacles
from renderer.body.wheels import WheelReader
from renderer.geometry.mesh import Mesh
from scene_description.kinematics import kinematics
from scene_description.motion import Drive, Motion

LIMITS = DriveLimits(0.5, 0.8, 4.0, 1.5, 3.0, 15.0, 0.2)
NOTHING = Obstacles.of(np.zeros((0, 5, 2)))
SECOND_NS = 10**9


def standing(x: float = 0.0, y: float = 0.0, heading: float = 0.0) -> Motion:
    drive = Drive(start_m=(x, y), distances_m=(0.0,) * 6, headings_rad=(heading,) * 6)
    return Motion(kind="base", spacing_s=0.05, drive=drive, camera_m=(0.1, 0.0, 0.5))


def wall(ax: float, ay: float, bx: float, by: float) -> list[tuple[float, float]]:
    return [(ax, ay), *[(bx, by)] * 4]


def whole(driver: BaseDriver, motion: Motion) -> Motion:
    return whole_motion(motion, driver.distances_m, driver.headings_rad)


def test_it_reaches_what_is_asked_within_its_limits_and_rests_when_nothing_is() -> None:
    motion = standing()
    driver = BaseDriver(motion, LIMITS, NOTHING)
    driver.drive(3.0, 9.0, 0.5)
    driver.drive(6.0, 0.0, 0.0)
    driver.drive(8.0, -0.3, -1.0)
    times = np.arange(0.0, 8.0, 0.001)
    at = kinematics(whole(driver, motion), times)
    speed = np.hypot(*at.velocity_m_s[:, :2].T)
    along = (at.acceleration_m_s2 * at.velocity_m_s).sum(axis=1) / np.maximum(speed, 1e-9)
    assert speed.max() == pytest.approx(LIMITS.max_speed_m_s, abs=1e-9)
    assert np.abs(along).max() <= LIMITS.acceleration_m_s2 + 1e-9
    jerks = np.diff(driver.distances_m, 3) / SPACING_S**3
    assert LIMITS.jerk_m_s3 * 0.99 < np.abs(jerks).max() <= LIMITS.jerk_m_s3 * (1.0 + 1e-6)
    turning = at.rate_rad_s[:, 2]
    assert turning[2500] == pytest.approx(0.5, abs=1e-9)
    assert np.abs(at.rate_change_rad_s2).max() <= LIMITS.turn_acceleration_rad_s2 + 1e-9
    assert speed[5500] < 1e-9 and abs(turning[5500]) < 1e-9
    assert (speed[7900], turning[7900]) == pytest.approx((0.3, -1.0), abs=1e-9)


def test_it_stops_at_a_wall_turns_there_and_comes_away() -> None:
    motion, obstacles = standing(), Obstacles.of(np.array([wall(1.0, -3.0, 1.0, 3.0)]))
    driver = BaseDriver(motion, LIMITS, obstacles)
    driver.drive(8.0, 0.5, 0.0)
    at = kinematics(whole(driver, motion), np.arange(0.0, 8.0, 0.01))
    assert 0.79 < at.position_m[-1, 0] <= at.position_m[:, 0].max() <= 0.8
    assert np.abs(at.velocity_m_s[-1]).max() < 1e-9
    driver.drive(11.0, 0.5, 1.0)
    driver.drive(14.0, 0.2, 0.0)
    at = kinematics(whole(driver, motion), np.arange(8.0, 14.0, 0.01))
    assert at.rate_rad_s[200, 2] == pytest.approx(1.0, abs=1e-6)
    assert at.position_m[:, 0].max() <= 0.8 and np.hypot(*at.velocity_m_s[-1, :2]) == pytest.approx(0.2, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 4), min_size=1, max_size=6),
    st.lists(st.tuples(st.one_of(st.floats(-2.0, 2.0), st.just(float("nan"))), st.floats(-9.0, 9.0)), min_size=1, max_size=8),
)
def test_no_velocity_brings_its_footprint_into_anything(walls: list[tuple[float, ...]], asked: list[tuple[float, float]]) -> None:
    obstacles = Obstacles.of(np.array([wall(*ends) for ends in walls]))
    motion = standing()
    begin_m = float(obstacles.clearance_m(np.zeros((1, 2)))[0])
    driver = BaseDriver(motion, LIMITS, obstacles)
    for speed, turn in asked:
        driver.drive(driver.known_s + 0.7, speed, turn)
    places = kinematics(whole(driver, motion), np.arange(0.0, driver.known_s, 0.005)).position_m[:, :2]
    assert obstacles.clearance_m(places).min() >= min(LIMITS.radius_m, begin_m) - 1e-4


def test_what_is_known_in_parts_is_what_the_whole_says_to_the_last_bit() -> None:
    motion, imu, wheels = standing(0.3, -0.2, 0.7), ImuConfig(rate_hz=190.0), WheelsConfig(rate_hz=47.0)
    driver = BaseDriver(motion, LIMITS, NOTHING)
    device, rolling = ImuReader(imu, 5, 3), WheelReader(wheels, 5, 3)
    read, rolled, seen, before_s = [], [], [], 0.0
    for frame in range(60):
        now_s = frame / 15.0
        driver.drive(now_s + 0.1, 0.4 if frame % 20 < 12 else -0.1, 0.9 if frame % 14 < 5 else -0.5)
        known = driver.motion_since(before_s - 0.2)
        end_ns = 5 + round(now_s * SECOND_NS)
        read.append(device.read(known, end_ns))
        rolled.append(rolling.read(known, end_ns))
        seen.append(kinematics(known, [now_s, now_s + 0.05]))
        before_s = now_s
    after = whole(driver, motion)
    assert known.drive is not None and known.drive.first_knot > 150
    for parts, all_of_it in ((read, read_imu(after, imu, 5, end_ns, 3)), (rolled, WheelReader(wheels, 5, 3).read(after, end_ns))):
        for name, values in all_of_it._asdict().items():
            assert np.concatenate([getattr(part, name) for part in parts]).tobytes() == values.tobytes(), name
    for frame, at in enumerate(seen):
        again = kinematics(after, [frame / 15.0, frame / 15.0 + 0.05])
        assert all(a.tobytes() == b.tobytes() for a, b in zip(at, again, strict=True))


def test_triangles_count_between_two_heights_alone() -> None:
    corners = [(0, 0, 0), (4, 0, 0), (0, 0, 4), (9, 9, 5), (9, 8, 5), (8, 9, 5), (2, 3, 0.5), (3, 3, 0.5), (2, 4, 0.5)]
    vertices = np.array(corners, np.float32)
    mesh = Mesh(vertices, np.zeros_like(vertices), np.arange(9, dtype=np.uint32).reshape(3, 3))
    square = np.array([(-1.0, -1.0), (6.0, -1.0), (6.0, 6.0), (-1.0, 6.0)])
    found = Obstacles.between(mesh, square, 0.2, 1.0)
    assert len(found.corners_m) == 2 + 4
    slanted = found.corners_m[0][np.argsort(found.corners_m[0][:, 0])]
    assert (slanted[0, 0], slanted[-1, 0]) == pytest.approx((0.0, 3.8))
    places = np.array([(2.2, 3.2), (2.2, 2.5), (5.0, 0.0), (3.9, 0.0), (-0.5, 3.0)])
    assert found.clearance_m(places) == pytest.approx([0.0, 0.5, 1.0, 0.1, 0.5])
    assert found.near((2.5, 5.4), 1.5).clearance_m(np.array([(2.5, 5.4)]))[0] == pytest.approx(0.6)
