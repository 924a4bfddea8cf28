"""LeRobot's datasets, read strictly by the published schema."""

import math

import numpy as np
import pytest
from convert_bag import BROWN, FISHEYE, convert_bag, export
from exported_camera import pixel_error
from lerobot_reader import LeRobotFolder

from scene_description.poses import world_from_optical
from scene_synth_ros.convert.formats import lerobot, lerobot_columns
from scene_synth_ros.convert.formats.lerobot_columns import (
    camera_twists,
    image_stats,
    rotation_vector,
    runs,
    thinned,
    together,
    vector_stats,
    whole_rate,
)
from scene_synth_ros.convert.writer import ConvertError


@pytest.mark.parametrize("camera", [BROWN, FISHEYE])
def test_paths_are_episodes_and_points_fall_on_their_pixels(tmp_path, camera):
    bag = convert_bag(camera=camera)
    assert export(bag, "lerobot", tmp_path / "out") == ()
    found = LeRobotFolder(tmp_path / "out")
    assert (found.info["fps"], found.tasks, found.info["splits"]) == (30, ["Look around the bedroom."], {"train": "0:2"})
    assert [(row["length"], row["room"], row["room_type"]) for row in found.episodes] == [(3, 0, "bedroom"), (3, 1, "bedroom")]
    assert [row["next.done"] for row in found.rows] == [False, False, True] * 2
    for row, truth in zip(found.rows, bag.frames["camera"], strict=True):
        np.testing.assert_array_equal(row["observation.images.color"], truth.layers["color"])
        np.testing.assert_array_equal(row["observation.images.depth"], truth.layers["depth"])
        assert row["observation.images.depth"].dtype == np.float32
        state = row["observation.state"]
        pose = world_from_optical(state[:3], np.array(state[3:]) / np.linalg.norm(state[3:]))
        assert row["stamp_ns"] == truth.pose.stamp_ns
        assert pixel_error(truth, row["camera.K"], row["camera.distortion_model"], row["camera.D"][:5], pose) < 0.01
    before, after = (np.array(row["observation.state"][:3]) for row in found.rows[:2])
    way = world_from_optical((0.0, 0.0, 0.0), bag.frames["camera"][0].pose.orientation)[:3, :3] @ found.rows[0]["action"][:3]
    np.testing.assert_allclose(before + way / 30.0, after, atol=1e-6)
    color = np.stack([truth.layers["color"] for truth in bag.frames["camera"]])
    np.testing.assert_allclose(np.ravel(found.stats["observation.images.color"]["mean"]), color.mean(axis=(0, 1, 2)) / 255.0)


def test_ids_are_asked_for_and_a_gap_ends_an_episode(tmp_path, monkeypatch):
    bag = convert_bag(rooms=1, frames=4)
    monkeypatch.setattr(lerobot_columns, "DATA_FILE_MB", 0)
    monkeypatch.setattr(lerobot, "_EPISODES", 1)
    export(bag, "lerobot", tmp_path / "out", layers=("color", "instance"), every=3)
    found = LeRobotFolder(tmp_path / "out")
    assert (found.info["fps"], [row["length"] for row in found.episodes]) == (10, [2])
    for row, truth in zip(found.rows, bag.frames["camera"][::3], strict=True):
        np.testing.assert_array_equal(row["observation.images.instance"], truth.layers["instance"])
    export(convert_bag(), "lerobot", tmp_path / "files")
    assert [row["data/file_index"] for row in LeRobotFolder(tmp_path / "files").episodes] == [0, 1]


def test_rates_and_runs():
    period = 33_333_333
    stamps = [0, period, 2 * period, 5 * period, 6 * period]
    assert whole_rate([stamps, [0]]) == 30
    assert runs(stamps, 30) == [slice(0, 3), slice(3, 5)]
    assert (whole_rate([[7], [9]]), runs([7], 1)) == (1, [slice(0, 1)])
    with pytest.raises(ConvertError, match=r"expected a whole number of frames a second, got 7.5; take every N-th"):
        whole_rate([[0, 133_333_333]])


def test_the_motion_of_a_camera_on_a_circle():
    turn, radius, fps = 0.2, 2.0, 5
    poses = np.tile(np.eye(4), (3, 1, 1))
    for number, pose in enumerate(poses):
        c, s = math.cos(turn * number), math.sin(turn * number)
        pose[:3, :3] = [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]
        pose[:3, 3] = (-radius * c, 0.0, radius * s)
    twists = camera_twists(poses, fps)
    chord = 2.0 * radius * math.sin(turn / 2.0) * fps
    expected = [chord * math.sin(turn / 2.0), 0.0, chord * math.cos(turn / 2.0), 0.0, turn * fps, 0.0]
    np.testing.assert_allclose(twists[:2], [expected, expected], atol=1e-12)
    assert not twists[2].any()
    np.testing.assert_array_equal(rotation_vector(np.eye(3)), np.zeros(3))


def test_statistics_together_are_those_of_all_values():
    rng = np.random.default_rng(1)
    parts = [rng.normal(size=(count, 3)) for count in (5, 9)]
    both = together([{"x": vector_stats(part)} for part in parts])["x"]
    whole = vector_stats(np.concatenate(parts))
    for name in ("min", "max", "mean", "std", "count"):
        np.testing.assert_allclose(both[name], whole[name])
    assert (both["q10"] <= whole["q10"]).all() and (both["q90"] >= whole["q90"]).all()
    depth = np.array([[1.0, np.inf], [np.nan, 3.0]], np.float32)
    stats = image_stats([thinned(depth)], 1.0)
    assert (stats["min"].item(), stats["max"].item(), stats["mean"].item(), stats["mean"].shape) == (1.0, 3.0, 2.0, (1, 1, 1))
    assert thinned(np.zeros((600, 300, 3))).shape == (150 * 75, 3)


def test_what_cannot_be_an_image_is_refused(tmp_path):
    bag = convert_bag(rooms=1, frames=1, layers=("normals",))
    with pytest.raises(ConvertError, match=r"--layers normals: lerobot has no images of several floating-point numbers a pixel"):
        export(bag, "lerobot", tmp_path / "out", layers=("color", "normals"))
