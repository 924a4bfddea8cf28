"""Changes of the camera's path: known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from counterfactual_rooms import room, rules

from grammar.counterfactual import Change, ChangeError, InvalidChangeError, apply_change
from scene_description import SceneDescription
from scene_description.poses import rotation_from_quaternion

TOLD = 1e-11
"""Descriptions have 12 digits: so well are axes known whose parts are next to nothing."""


def change(factor: str, value: object) -> SceneDescription:
    return apply_change(room("bedroom"), Change(factor, {}, value), rules())


def positions(scene: SceneDescription) -> np.ndarray:
    return np.array([pose.position_m for pose in scene.camera_path])


def axes(scene: SceneDescription) -> np.ndarray:
    """Right, down and forward of every pose in the world, (n, 3, 3) with axes in columns."""
    return np.array([rotation_from_quaternion(pose.orientation) for pose in scene.camera_path])


def test_height_moves_the_whole_path_up_or_down() -> None:
    after, before = positions(change("camera_height_m", 1.0)), positions(room("bedroom"))
    assert after[:, 2].mean() == pytest.approx(1.0) and after[:, :2] == pytest.approx(before[:, :2])
    assert after[:, 2] - after[0, 2] == pytest.approx(before[:, 2] - before[0, 2])
    with pytest.raises(InvalidChangeError, match="camera_clear 5"):
        change("camera_height_m", 2.65)


def test_pitch_tilts_up_and_roll_turns_about_the_view() -> None:
    before = axes(room("bedroom"))
    tilted = axes(change("camera_pitch_deg", 10.0))
    rise = np.arcsin(tilted[:, 2, 2]) - np.arcsin(before[:, 2, 2])
    assert rise == pytest.approx(math.radians(10.0)) and tilted[:, :, 0] == pytest.approx(before[:, :, 0], abs=TOLD)
    rolled = axes(change("camera_roll_deg", 90.0))
    assert rolled[:, :, 2] == pytest.approx(before[:, :, 2], abs=TOLD)
    assert rolled[:, :, 0] == pytest.approx(before[:, :, 1], abs=TOLD)
    with pytest.raises(ChangeError, match="expected a tilt in"):
        change("camera_pitch_deg", 89.0) if before[:, 2, 2].max() > 0.0 else change("camera_pitch_deg", -89.0)


def test_the_same_path_is_driven_faster_or_slower_at_the_same_frame_rate() -> None:
    before = room("bedroom").camera_path
    fast = change("camera_speed", 2).camera_path
    assert [(p.position_m, p.orientation) for p in fast] == [(p.position_m, p.orientation) for p in before[::2]]
    assert [p.stamp_ns for p in fast] == [p.stamp_ns for p in before[:3]]
    slow = change("camera_speed", 0.5).camera_path
    assert [p.position_m for p in slow[::2]] == [p.position_m for p in before]
    assert [p.stamp_ns for p in slow] == [1_000 + k * 100_000_000 for k in range(9)]
    ends = np.array([before[1].position_m, before[2].position_m])
    assert np.linalg.norm(np.array(slow[3].position_m) - ends.mean(0)) < 0.2 * np.linalg.norm(ends[1] - ends[0])
    between = axes(change("camera_speed", 0.5))
    turn = [float(np.trace(between[k].T @ between[k + 1])) for k in (2, 3)]
    assert turn[0] == pytest.approx(turn[1], abs=1e-9)


def test_amplitude_scales_about_the_middle_pose_and_offset_goes_right() -> None:
    before, right = positions(room("bedroom")), axes(room("bedroom"))[:, :, 0]
    assert positions(change("camera_amplitude", 0.5)) == pytest.approx(0.5 * (before + before[2]))
    assert positions(change("camera_amplitude", 0)) == pytest.approx(np.repeat(before[2:3], 5, 0))
    assert positions(change("camera_offset_m", 0.06)) == pytest.approx(before + 0.06 * right)


def test_another_path_has_the_same_times_and_depends_on_its_seed_alone() -> None:
    before, first, second = room("bedroom"), change("camera_path", 1), change("camera_path", 2)
    assert [p.stamp_ns for p in first.camera_path] == [p.stamp_ns for p in before.camera_path]
    assert positions(first) != pytest.approx(positions(before)) and positions(first) != pytest.approx(positions(second))
    assert first == change("camera_path", 1)
