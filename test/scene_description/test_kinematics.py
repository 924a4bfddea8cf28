"""Motions: derivatives against differences, known answers on circles and lines, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

import scene_description.kinematics
from scene_description.kinematics import check_motion, gauss_nodes, kinematics, knot_places, mounted_kinematics, rotate
from scene_description.motion import Drive, Harmonic, Motion
from scene_description.strict import FieldError

H = 0.1


def wild_motion(tremor: bool = True) -> Motion:
    rng = np.random.default_rng(3)
    places = np.cumsum(rng.normal(0, 0.05, (30, 3)), axis=0)
    turns = np.array([0.0, 0.0, 0.0, 1.0]) + np.cumsum(rng.normal(0, 0.03, (30, 4)), axis=0)
    line = Harmonic(
        frequency_hz=8.0, shift_m=(1e-4, 2e-4, 3e-4), shift_phase_rad=(0.1, 1, 2), turn=(1e-3, 2e-3, 5e-4), turn_phase_rad=(3, 2, 1)
    )
    return Motion(
        kind="handheld",
        spacing_s=H,
        positions_m=tuple(map(tuple, places.tolist())),
        turns=tuple(map(tuple, turns.tolist())),
        tremor=(line,) if tremor else (),
        tremor_from_s=0.5,
    )


def wild_drive() -> Motion:
    rng = np.random.default_rng(4)
    drive = Drive(
        start_m=(1.0, 2.0),
        distances_m=tuple(np.cumsum(rng.normal(0.02, 0.03, 30)).tolist()),
        headings_rad=tuple(np.cumsum(rng.normal(0, 0.1, 30)).tolist()),
    )
    return Motion(kind="base", spacing_s=H, drive=drive)


@pytest.mark.parametrize("motion", [wild_motion(), wild_motion(tremor=False), wild_drive()], ids=["tremor", "smooth", "drive"])
def test_velocities_and_accelerations_are_those_of_the_path(motion: Motion) -> None:
    times, e = np.linspace(0.05, 2.4, 97), 1e-4
    before, at, after = (kinematics(motion, times + step) for step in (-e, 0.0, e))
    np.testing.assert_allclose((after.position_m - before.position_m) / (2 * e), at.velocity_m_s, atol=2e-6)
    np.testing.assert_allclose((after.velocity_m_s - before.velocity_m_s) / (2 * e), at.acceleration_m_s2, atol=2e-4)
    np.testing.assert_allclose((after.rate_rad_s - before.rate_rad_s) / (2 * e), at.rate_change_rad_s2, atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(at.quaternion, axis=1), 1.0, atol=1e-14)
    axes = np.eye(3)
    for axis in axes:  # d(R x)/dt = R (w x x)
        turned = [rotate(state.quaternion, np.tile(axis, (97, 1))) for state in (before, after)]
        expected = rotate(at.quaternion, np.cross(at.rate_rad_s, axis))
        np.testing.assert_allclose((turned[1] - turned[0]) / (2 * e), expected, atol=5e-6)


@pytest.mark.parametrize("motion", [wild_motion(), wild_drive()], ids=["tremor", "drive"])
def test_acceleration_and_two_derivatives_more_are_continuous_at_knots(motion: Motion) -> None:
    knot, e = 10 * H, 1e-4
    steps = kinematics(motion, knot + e * np.arange(-6, 7)).acceleration_m_s2
    left, right = np.diff(steps[:7], n=2, axis=0)[-1], np.diff(steps[6:], n=2, axis=0)[0]
    np.testing.assert_allclose(left, right, atol=0.03 * np.abs(left).max())  # both e^2 times a second derivative that does not jump


def test_a_frame_fixed_to_a_body_moves_as_rigid_bodies_do() -> None:
    motion, lever = wild_motion(), (0.1, -0.05, 0.2)
    turn = tuple((np.array([1.0, 2.0, -1.0, 3.0]) / np.sqrt(15.0)).tolist())
    times, e = np.linspace(0.1, 2.4, 31), 1e-4
    before, at, after = (mounted_kinematics(kinematics(motion, times + step), lever, turn) for step in (-e, 0.0, e))
    np.testing.assert_allclose((after.position_m - before.position_m) / (2 * e), at.velocity_m_s, atol=2e-6)
    np.testing.assert_allclose((after.velocity_m_s - before.velocity_m_s) / (2 * e), at.acceleration_m_s2, atol=5e-4)
    turned = [rotate(state.quaternion, np.tile([0.0, 1.0, 0.0], (31, 1))) for state in (before, after)]
    np.testing.assert_allclose((turned[1] - turned[0]) / (2 * e), rotate(at.quaternion, np.cross(at.rate_rad_s, [0, 1, 0])), atol=1e-5)


def test_a_base_that_turns_as_it_goes_describes_a_circle() -> None:
    """Linear control points are linear curves: 0.5 m/s and 1 rad/s are a circle of half a metre."""
    count = 80
    at = (np.arange(count) - 2.0) * H
    drive = Drive(start_m=(2.0, 1.0), distances_m=tuple((0.5 * at).tolist()), headings_rad=tuple((1.0 * at).tolist()))
    motion = Motion(kind="base", spacing_s=H, drive=drive)
    times = np.linspace(0.0, motion.duration_s, 301)
    found = kinematics(motion, times)
    np.testing.assert_allclose(found.position_m[:, 0], 2.0 + 0.5 * np.sin(times), atol=1e-13)
    np.testing.assert_allclose(found.position_m[:, 1], 1.5 - 0.5 * np.cos(times), atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(found.acceleration_m_s2, axis=1), 0.5, atol=1e-12)
    np.testing.assert_allclose(found.rate_rad_s, np.tile([0.0, 0.0, 1.0], (301, 1)), atol=1e-12)


def test_a_long_drive_is_integrated_once_however_often_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    at = np.arange(3000) * 0.02
    drive = Drive(start_m=(2.0, 1.0), distances_m=tuple((0.3 * at).tolist()), headings_rad=tuple((0.7 * at).tolist()))
    motion, integrated, travelled = Motion(kind="base", spacing_s=0.02, drive=drive), [], scene_description.kinematics._travelled

    def counted(controls: np.ndarray, begin: int, segment: np.ndarray, share: np.ndarray) -> np.ndarray:
        integrated.append(len(segment))
        return travelled(controls, begin, segment, share)

    monkeypatch.setattr(scene_description.kinematics, "_travelled", counted)
    places = [kinematics(motion, [k, k + 0.5]).position_m for k in (50.0, 10.0, 50.0)]
    assert sorted(integrated) == [2, 2, 2, len(at) - 5]
    np.testing.assert_array_equal(places[0], places[2])
    with pytest.raises(ValueError, match="read-only"):
        knot_places(drive)[0] = 0.0


def test_equal_control_points_are_rest_and_so_is_what_lies_beyond() -> None:
    motion = replace(wild_motion(), positions_m=((1.0, 2.0, 3.0),) * 30, turns=((0.0, 0.0, 0.6, 0.8),) * 30, tremor=())
    found = kinematics(motion, [-1.0, 0.0, 1.03, 2.5, 9.0])
    np.testing.assert_allclose(found.position_m, np.tile([1.0, 2.0, 3.0], (5, 1)), rtol=1e-15)
    for still in (found.velocity_m_s, found.acceleration_m_s2, found.rate_rad_s, found.rate_change_rad_s2):
        np.testing.assert_allclose(still, 0.0, atol=1e-11)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"turns": ((0.0, 0.0, 0.0, 1.0),) * 29}, "motion.turns: expected 30 control points, got 29"),
        ({"positions_m": (), "turns": ()}, "motion.positions_m: expected 6 control points or more, or a drive, got 0"),
        ({"drive": wild_drive().drive}, "motion.positions_m: expected none beside a drive, got 30"),
        ({"turns": ((0.0, 0.0, 0.0, 1.0),) * 9 + ((1.0, 0.0, 0.0, 0.0),) * 21}, r"motion.turns\[9\]: expected a quaternion near"),
        ({"camera_turn": (0.0, 0.0, 0.0, 0.5)}, "motion.camera_turn: expected a unit quaternion, got length 0.5"),
    ],
)
def test_a_motion_whose_parts_do_not_agree_is_refused(change: dict, line: str) -> None:
    with pytest.raises(FieldError, match=line):
        check_motion(replace(wild_motion(), **change))


@pytest.mark.parametrize("count", [5, 8])
def test_quadrature_is_that_of_gauss_and_legendre(count: int) -> None:
    nodes, weights = np.array(gauss_nodes(count)).T
    for power in range(2 * count):
        assert (weights * nodes**power).sum() == pytest.approx(0.0 if power % 2 else 2.0 / (power + 1), abs=2e-15)
