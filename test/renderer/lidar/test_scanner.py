"""Scans of rooms whose distances are known, at rest and in motion; noise, glass, mirrors, black, limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from box_room import box, pose, quad, scene

from renderer.camera.config import CameraConfig
from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import Scanner, beam_directions, scan_stamp_ns, scans_of_path
from renderer.path.config import RenderConfig
from renderer.renderer import Renderer
from scene_description import FieldError
from scene_description.poses import look_at
from scene_description.types import CameraPose

EXACT = ScanConfig(noise_m=0.0, resolution_m=0.0, dark_range_m=0.0, height_m=1.0, beams=360, angle_max_rad=math.pi * (1.0 - 2.0 / 360))
SHELL = box((-3, -2, 0), (5, 2, 2.5), inside=True, object_id=0)
AHEAD = pose((0.0, 0.0, 1.5), (1.0, 0.0, 1.5))


def moving(velocity: tuple[float, float, float], count: int = 11, period_s: float = 0.1) -> tuple[CameraPose, ...]:
    """A path that looks along x, from the origin, 1.5 m high."""
    places = [(velocity[0] * i * period_s, velocity[1] * i * period_s, 1.5 + velocity[2] * i * period_s) for i in range(count)]
    ahead = look_at((0.0, 0.0, 1.5), (1.0, 0.0, 1.5))
    return tuple(
        CameraPose(stamp_ns=10**18 + round(i * period_s * 1e9), position_m=place, orientation=ahead) for i, place in enumerate(places)
    )


def scans_of(flat, config=EXACT, path=(AHEAD,), key=5):
    with Renderer(flat, CameraConfig(width=4, height=4), RenderConfig(threads=1), key) as renderer:
        return list(Scanner(renderer.tree, flat, config, key).along(path))


def wall_distance(angles: np.ndarray, x: float = 0.0) -> np.ndarray:
    """Distance from (x, 0) to the walls of ``SHELL``, by the angle to the x axis."""
    cosine, sine = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        return np.minimum(np.where(cosine > 0, (5 - x) / cosine, (-3 - x) / cosine), 2 / np.abs(sine))


def beam_angles(config: ScanConfig) -> np.ndarray:
    return config.angle_min_rad + np.arange(config.beams) * config.angle_increment_rad


def test_a_box_room_has_its_analytic_distances() -> None:
    (scan,) = scans_of(scene(SHELL))
    expected = wall_distance(beam_angles(EXACT))
    np.testing.assert_allclose(scan.ideal, expected, rtol=1e-6)
    np.testing.assert_allclose(scan.ranges, expected, rtol=1e-6)
    ahead = np.argmin(np.abs(beam_angles(EXACT)))
    assert scan.intensities[ahead] == pytest.approx(0.5 + 0.0, abs=0.01)  # a matt surface of reflectance 0.5, head-on
    assert scan.poses[0].position_m == pytest.approx((0.0, 0.0, 1.0))
    assert scan.poses[0].orientation == pytest.approx((0.0, 0.0, 0.0, 1.0))


def test_the_beams_of_a_moving_scanner_leave_at_their_own_times() -> None:
    """A scanner that drives at 2 m/s sees the wall ahead nearer with every beam."""
    path, config = moving((2.0, 0.0, 0.0)), replace(EXACT, rate_hz=5.0)
    scans = scans_of(scene(SHELL), config, path)
    assert [scan.stamp_ns - path[0].stamp_ns for scan in scans] == [0, 200_000_000, 400_000_000, 600_000_000, 800_000_000]
    times = np.arange(360) / 360 / 5.0
    assert config.time_increment_s == pytest.approx(1 / 1800)
    for scan in scans:
        x = 2.0 * (0.2 * scan.number + times)
        np.testing.assert_allclose(scan.ideal, wall_distance(beam_angles(config), x), rtol=2e-6)
        assert scan.poses[-1].stamp_ns - scan.stamp_ns == round(1e9 * config.sweep_s)
        assert len(scan.poses) == 3  # of the path's own poses one lies between
        assert scan.poses[-1].position_m[0] == pytest.approx(x[-1])


def test_a_level_scanner_stays_level_and_at_its_height_while_the_camera_nods_and_climbs() -> None:
    up = tuple(replace(item, orientation=look_at((0, 0, 0), (1.0, 1.0, -1.5))) for item in moving((0.0, 0.0, 1.0)))
    scan = scans_of(scene(SHELL), replace(EXACT, rate_hz=1.0), up)[0]
    np.testing.assert_allclose(scan.ideal, wall_distance(beam_angles(EXACT) + math.pi / 4), rtol=1e-5)
    assert {pose.position_m for pose in scan.poses} == {(0.0, 0.0, 1.0)}


def test_a_rigid_scanner_follows_the_camera_and_its_mount_says_where_it_is() -> None:
    config = replace(EXACT, level=False, mount_m=(0.5, 0.0, -0.25), mount_rotation_rad=(0.0, 0.0, math.pi / 2))
    (scan,) = scans_of(scene(SHELL), config)
    assert scan.poses[0].position_m == pytest.approx((0.5, 0.0, 1.25))
    np.testing.assert_allclose(scan.ideal, wall_distance(beam_angles(config) + math.pi / 2, 0.5), rtol=1e-5)
    pitched = replace(EXACT, level=False, mount_rotation_rad=(0.0, math.pi / 6, 0.0))  # nose down, so that it sees the floor
    ahead = np.argmin(np.abs(beam_angles(EXACT)))
    assert scans_of(scene(SHELL), pitched)[0].ideal[ahead] == pytest.approx(1.5 / math.sin(math.pi / 6), rel=1e-4)


@pytest.mark.parametrize(("noise_m", "share"), [(0.02, 0.0), (0.0, 0.01), (0.01, 0.005)])
def test_the_noise_has_the_sigma_that_is_asked_for(noise_m: float, share: float) -> None:
    round_room = scene(box((-400, -400, 0), (400, 400, 2.5), inside=True), quad((3, -300, 0), (0, 600, 0), (0, 0, 2)))
    config = replace(EXACT, noise_m=noise_m, noise_share=share, beams=20_000, angle_min_rad=-0.2, angle_max_rad=0.2)
    (scan,) = scans_of(round_room, config)
    z = (scan.ranges - scan.ideal) / np.hypot(noise_m, share * scan.ideal)
    assert np.std(z) == pytest.approx(1.0, rel=0.02)
    assert abs(np.mean(z)) < 0.03
    assert abs(np.corrcoef(z[1:], z[:-1])[0, 1]) < 0.03


def test_noise_is_that_of_scene_scan_and_beam_alone() -> None:
    config = replace(EXACT, noise_m=0.01)
    flat, path = scene(SHELL), (AHEAD,)
    first, again, other = (scans_of(flat, config, path, key)[0].ranges for key in (5, 5, 6))
    assert first.tobytes() == again.tobytes()
    assert np.std(first - other) > 0.01
    scans = scans_of(flat, config, moving((0.0, 0.0, 0.0)))
    errors = [scan.ranges - scan.ideal for scan in scans]
    assert abs(np.corrcoef(errors[0], errors[1])[0, 1]) < 0.2
    with Renderer(flat, CameraConfig(width=4, height=4), RenderConfig(threads=2), 5) as renderer:
        alone = Scanner(renderer.tree, flat, config, 5).scan(3, scans[3].stamp_ns, moving((0.0, 0.0, 0.0)))
    assert alone.ranges.tobytes() == scans[3].ranges.tobytes()


def test_beams_go_through_panes_and_leave_mirrors() -> None:
    pane = quad((2, -2, 0), (0, 4, 0), (0, 0, 2.5), portal=True, transmission=0.9, roughness=0.03, ior=1.5, object_id=9)
    (scan,) = scans_of(scene(SHELL, pane))
    angles = beam_angles(EXACT)
    aslant = (np.abs(angles) > math.radians(10)) & (np.abs(angles) < math.radians(40))
    np.testing.assert_allclose(scan.ideal[aslant], 2 / np.cos(angles[aslant]), rtol=1e-5)
    np.testing.assert_allclose(scan.ranges[aslant], wall_distance(angles)[aslant], rtol=1e-5)
    assert scan.ranges[np.argmin(np.abs(angles))] == pytest.approx(2.0)  # head-on it sends its own echo
    mirror = quad((2, -2, 0), (0, 4, 0), (0, 0, 2.5), color=(0.95, 0.95, 0.95), metallic=1.0, roughness=0.02, object_id=9)
    (scan,) = scans_of(scene(SHELL, mirror))
    behind = (np.abs(angles) > math.radians(10)) & (np.abs(angles) < math.radians(15))  # the wall x = -3 seems to be at x = 7
    np.testing.assert_allclose(scan.ranges[behind], 7 / np.cos(angles[behind]), rtol=1e-5)


def test_black_is_lost_at_grazing_angles_and_glossy_black_sooner_than_matt_white() -> None:
    black = box((-3, -2, 0), (5, 2, 2.5), inside=True, color=(0.03, 0.03, 0.03), roughness=0.9)
    config = replace(EXACT, dark_range_m=6.0)
    (scan,) = scans_of(scene(black), config)
    angles = beam_angles(config)
    distance = wall_distance(angles)
    cosine = np.where(np.abs(np.abs(np.sin(angles)) * distance - 2) < 1e-9, np.abs(np.sin(angles)), np.abs(np.cos(angles)))
    seen = np.isfinite(scan.ranges)
    matt = 0.03 * cosine / distance**2
    assert seen[matt > 0.1 / 36].all()
    assert not seen[cosine < 0.5].any()
    assert np.isposinf(scan.ranges[~seen]).all()
    assert np.isfinite(scan.ideal).all()
    white = scans_of(scene(SHELL), config)[0]
    assert np.isfinite(white.ranges).all()


def test_what_is_too_near_or_too_far_is_infinite_and_steps_are_whole() -> None:
    config = replace(EXACT, range_min_m=2.5, range_max_m=4.0, resolution_m=0.05)
    (scan,) = scans_of(scene(SHELL), config)
    expected = wall_distance(beam_angles(config))
    assert np.isneginf(scan.ideal[expected < 2.49]).all()
    assert np.isposinf(scan.ideal[expected > 4.01]).all()
    read = scan.ranges[np.isfinite(scan.ranges)]
    np.testing.assert_allclose(read / 0.05, np.round(read / 0.05), atol=1e-4)
    assert (scan.intensities[~np.isfinite(scan.ranges)] == 0).all()
    (nothing,) = scans_of(scene(quad((3, -1, -5), (0, 2, 0), (0, 0, 1))), EXACT)
    assert np.isposinf(nothing.ranges).all()
    assert np.isposinf(nothing.ideal).all()


def test_a_beam_that_opens_mixes_what_it_meets_at_an_edge() -> None:
    edge = quad((2, 0, 0), (0, -2, 0), (0, 0, 2.5))  # the half y < 0 of the way ahead
    config = replace(EXACT, divergence_rad=0.02, beams=401, angle_min_rad=-0.1, angle_max_rad=0.1)
    (scan,) = scans_of(scene(SHELL, edge), config)
    angles = beam_angles(config)
    inside = np.abs(angles) < 0.007
    between = (scan.ranges > 2.1) & (scan.ranges < 4.8)
    assert between[inside].mean() > 0.5
    assert not between[np.abs(angles) > 0.009].any()
    assert beam_directions(config).shape == (401, 8, 3)
    spread = np.arccos(np.clip(beam_directions(config)[:, :1] @ beam_directions(config)[0].T, -1, 1))[0, 0]
    assert np.mean(spread**2) == pytest.approx(0.01**2 / 2, rel=1e-3)


def test_scans_lie_within_the_path() -> None:
    path = moving((0.0, 0.0, 0.0))  # one second
    assert scans_of_path(replace(EXACT, rate_hz=10.0), path) == range(10)
    assert scans_of_path(replace(EXACT, rate_hz=0.5), path) == range(1)
    assert scan_stamp_ns(replace(EXACT, rate_hz=7.0), 10**18, 3) == 10**18 + 428_571_429


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"angle_min_rad": 1.0, "angle_max_rad": 0.5}, "angle_max_rad: expected more than angle_min_rad, by a turn at most, got 1 to 0.5"),
        ({"angle_min_rad": -4.0, "angle_max_rad": 4.0}, "angle_max_rad: expected more than angle_min_rad, by a turn at most, got -4 to 4"),
        ({"range_min_m": 5.0, "range_max_m": 4.0}, "range_max_m: expected more than range_min_m = 5, got 4"),
    ],
)
def test_settings_that_contradict_each_other_are_refused(changes, line) -> None:
    with pytest.raises(FieldError) as refusal:
        ScanConfig(**changes)
    assert str(refusal.value) == line
