"""A lidar in rooms whose distances are known: beams, times, motion, returns, losses, and the same bytes from the same seed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from box_room import box, quad, scene

from renderer.camera.config import CameraConfig
from renderer.lidar.lidar import Lidar, Sweep
from renderer.lidar.sweep_config import LidarConfig
from renderer.lidar.sweep_rays import sweep_rays
from renderer.path.config import RenderConfig
from renderer.renderer import Renderer
from scene_description import FieldError
from scene_description.motion import Drive, Motion

EXACT = LidarConfig(columns=200, noise_m=0.0, resolution_m=0.0, dark_range_m=0.0, mount_m=(0.0, 0.0, 1.0), range_min_m=0.0)
LOW, HIGH = np.array((-3.0, -2.0, 0.0)), np.array((5.0, 2.0, 2.5))
SHELL = box(tuple(LOW), tuple(HIGH), inside=True, object_id=0)


def driving(speed_m_s: float, turn_rad_s: float) -> Motion:
    """A base that starts at the origin along x."""
    times = (np.arange(40) - 2.0) * 0.05
    drive = Drive(start_m=(0.0, 0.0), distances_m=tuple((speed_m_s * times).tolist()), headings_rad=tuple((turn_rad_s * times).tolist()))
    return Motion(kind="base", spacing_s=0.05, drive=drive)


STILL = driving(0.0, 0.0)


def sweep_of(flat, config: LidarConfig = EXACT, motion: Motion = STILL, number: int = 0, key: int = 5) -> Sweep:
    with Renderer(flat, CameraConfig(width=4, height=4), RenderConfig(threads=1), key) as renderer:
        return Lidar(renderer.tree, flat, config, motion, key).sweep(number)


def box_distance(origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Distance to the walls of ``SHELL`` from within."""
    with np.errstate(divide="ignore"):
        return np.max(np.stack([(LOW - origins) / directions, (HIGH - origins) / directions]), axis=0).min(axis=1)


def test_a_spinning_lidar_has_its_table_of_beams_and_times() -> None:
    rays = sweep_rays(LidarConfig(), 3)
    assert rays.directions.shape == (1808 * 16, 3)
    np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=1), 1.0, rtol=1e-12)
    elevation = np.degrees(np.arcsin(rays.directions[:16, 2]))
    np.testing.assert_allclose(elevation, (-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15), atol=1e-9)
    assert rays.lines[:16].tolist() == [0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15]
    assert (np.diff(rays.times_s) > 0).all()
    assert rays.times_s[16] == pytest.approx(55.31e-6, abs=0.01e-6)
    assert rays.times_s[15] == pytest.approx(15 * 2.304e-6)
    np.testing.assert_allclose(rays.directions[0, :2] / math.cos(math.radians(15)), (-1.0, 0.0), atol=1e-9)
    assert rays.directions[16 * 452, 1] > 0.9, "a quarter of a turn later, clockwise: from the back over the left"
    assert sweep_rays(replace(LidarConfig(), clockwise=False), 0).directions[16 * 452, 1] < -0.9


def test_a_rosette_stays_in_its_cone_and_fills_it_sweep_by_sweep() -> None:
    config = LidarConfig(pattern="rosette", columns=10_000)
    seen = [sweep_rays(config, number) for number in range(3)]
    off = [np.arccos(rays.directions[:, 0]) for rays in seen]
    assert max(values.max() for values in off) == pytest.approx(0.336, abs=1e-3)
    np.testing.assert_allclose([rays.times_s[[0, -1]] for rays in seen], [(0.0, 0.09999)] * 3)

    def cells(directions: np.ndarray) -> set[tuple[int, int]]:
        return set(map(tuple, np.floor(directions[:, 1:] / 0.01).astype(int).tolist()))

    one, more = cells(seen[0].directions), set().union(*(cells(rays.directions) for rays in seen))
    assert len(more) > 1.3 * len(one)
    late = sweep_rays(config, 36_000)
    np.testing.assert_allclose(late.directions[0], sweep_rays(replace(config, rate_hz=10.0), 36_000).directions[0])
    assert late.directions[0, 1] == pytest.approx(math.sin(0.336), abs=1e-6), "an hour is a whole number of turns of both"


@pytest.mark.parametrize("pattern", ["spinning", "rosette"])
def test_each_ray_is_cast_at_its_own_time_from_a_body_that_drives_and_turns(pattern: str) -> None:
    config = replace(EXACT, pattern=pattern, columns=1600 if pattern == "rosette" else 100, mount_m=(0.1, 0.0, 1.0), firing_s=1e-5)
    speed, turn, number = 0.8, 1.5, 2
    sweep = sweep_of(scene(SHELL), config, driving(speed, turn), number)
    times = number / config.rate_hz + sweep.rays.times_s
    heading = turn * times
    place = speed / turn * np.column_stack([np.sin(heading), 1.0 - np.cos(heading)])
    ahead = np.column_stack([np.cos(heading), np.sin(heading)])
    x, y, z = sweep.rays.directions.T
    world = np.column_stack([x * ahead[:, 0] - y * ahead[:, 1], x * ahead[:, 1] + y * ahead[:, 0], z])
    expected = box_distance(np.column_stack([place + 0.1 * ahead, np.full(len(times), 1.0)]), world)
    np.testing.assert_allclose(sweep.ideal, expected, atol=2e-5)
    np.testing.assert_allclose(sweep.ranges[:, 0], expected, atol=2e-5)


def test_the_noise_has_the_sigma_that_is_asked_for_and_its_own_seed() -> None:
    config = replace(EXACT, columns=1000, noise_m=0.02, dropout_share=0.1)
    flat = scene(SHELL)
    one, same, other, next_one = (sweep_of(flat, config, STILL, *place) for place in ((0, 5), (0, 5), (0, 6), (1, 5)))
    assert one.ranges.tobytes() == same.ranges.tobytes()
    errors = [sweep.ranges[:, 0] - sweep.ideal for sweep in (one, other, next_one)]
    there = [np.isfinite(values) for values in errors]
    assert [values.mean() for values in there] == pytest.approx([0.9] * 3, abs=0.01)
    assert np.std(errors[0][there[0]]) == pytest.approx(0.02, rel=0.03)
    for error, known in zip(errors[1:], there[1:], strict=True):
        both = there[0] & known
        assert abs(np.corrcoef(errors[0][both], error[both])[0, 1]) < 0.03


PANE = quad((2, -2, 0), (0, 4, 0), (0, 0, 2.5), portal=True, transmission=0.9, roughness=0.03, ior=1.5, object_id=9)


def ahead_of(sweep: Sweep) -> int:
    return int(np.argmax(sweep.rays.directions[:, 0]))


def test_glass_has_a_return_of_its_own_head_on_and_the_wall_behind_is_the_other() -> None:
    level = replace(EXACT, elevations_rad=(0.0,), returns="dual")
    sweep = sweep_of(scene(SHELL, PANE), level)
    beam = ahead_of(sweep)
    assert sorted(sweep.ranges[beam].tolist()) == pytest.approx([2.0, 5.0], abs=1e-5)
    assert sweep.ideal[beam] == pytest.approx(2.0, abs=1e-5)
    x, y, _ = sweep.rays.directions.T
    aslant = (x > 0) & (np.abs(y / x) > 0.2) & (np.abs(y / x) < 0.35)
    np.testing.assert_allclose(sweep.ranges[aslant, 0] * x[aslant], 5.0, atol=1e-4)
    assert np.isinf(sweep.ranges[aslant, 1]).all(), "glass sends nothing back aslant"
    np.testing.assert_allclose(sweep.ideal[aslant] * x[aslant], 2.0, atol=1e-4)
    last = sweep_of(scene(SHELL, PANE), replace(level, returns="last"))
    assert last.ranges[beam, 0] == pytest.approx(5.0, abs=1e-5)


def test_a_beam_on_an_edge_has_two_returns_that_a_pulse_tells_apart_and_one_that_it_does_not() -> None:
    near = box((2.0, -2.0, 0.0), (2.2, 0.0, 2.5), object_id=3)
    wide = replace(EXACT, elevations_rad=(0.0,), divergence_rad=0.02, returns="dual", separation_m=1.0)
    sweep = sweep_of(scene(SHELL, near), wide)
    ranges = sweep.ranges[ahead_of(sweep)]
    assert ranges == pytest.approx((2.0, 5.0), abs=2e-3), "the near one is the stronger"
    merged = sweep_of(scene(SHELL, near), replace(wide, separation_m=5.0))
    assert 2.0 < merged.ranges[ahead_of(merged), 0] < 3.5 and np.isinf(merged.ranges[ahead_of(merged), 1])


def test_black_is_lost_and_mirrors_show_what_is_mirrored() -> None:
    black = box(tuple(LOW), tuple(HIGH), inside=True, color=(0.01, 0.01, 0.01), roughness=0.9)
    config = replace(EXACT, dark_range_m=8.0, elevations_rad=(0.0,))
    dark, light = (sweep_of(scene(piece), config) for piece in (black, SHELL))
    assert np.isinf(dark.ranges).mean() > 0.5 and not np.isinf(light.ranges).any()
    assert np.isfinite(dark.ideal).all()
    mirror = quad((2, -2, 0), (0, 4, 0), (0, 0, 2.5), color=(0.95, 0.95, 0.95), metallic=1.0, roughness=0.02, object_id=9)
    sweep = sweep_of(scene(SHELL, mirror), replace(config, dark_range_m=0.0))
    x, y, _ = sweep.rays.directions.T
    aslant = (x > 0) & (np.abs(y / x) > 0.18) & (np.abs(y / x) < 0.25)
    np.testing.assert_allclose(sweep.ranges[aslant, 0] * x[aslant], 7.0, atol=1e-4)


def test_what_does_not_go_together_is_refused() -> None:
    for values, where in (
        ({"azimuths_rad": (0.0, 0.1)}, "azimuths_rad"),
        ({"columns": 50_000}, "columns"),
        ({"firing_s": 1e-3}, "firing_s"),
        ({"range_min_m": 200.0}, "range_max_m"),
    ):
        with pytest.raises(FieldError, match=where):
            replace(EXACT, **values)
