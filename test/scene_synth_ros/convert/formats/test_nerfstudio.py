"""nerfstudio's folders, read as its data conventions and its rays say (nerfstudio/cameras/cameras.py); nerfstudio itself is too large."""

import dataclasses
import json

import cv2
import numpy as np
import pytest
import trimesh
from convert_bag import BROWN_K3, FISHEYE, PANORAMA, PINHOLE, RATIONAL, convert_bag, export

from renderer.camera.cameras import project
from scene_synth_ros.convert.writer import ConvertError


def optical(row, points):
    """Return points in the camera frame of OpenCV; the transform's is OpenGL's."""
    seen = np.linalg.inv(np.array(row["transform_matrix"]) @ np.diag([1.0, -1.0, -1.0, 1.0]))
    return points @ seen[:3, :3].T + seen[:3, 3]


def places(meta, points):
    """Return where points of OpenCV's camera frame fall, the centre of the first pixel at (0.5, 0.5)."""
    k = np.array([[meta["fl_x"], 0, meta["cx"]], [0, meta["fl_y"], meta["cy"]], [0, 0, 1.0]])
    if meta["camera_model"] == "OPENCV_FISHEYE":
        told = np.array([meta[f"k{i}"] for i in range(1, 5)])
        return cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), k, told)[0][:, 0]
    assert meta["camera_model"] == "OPENCV"
    told = np.array([meta.get(name, 0.0) for name in ("k1", "k2", "p1", "p2", "k3")])
    return cv2.projectPoints(points, np.zeros(3), np.zeros(3), k, told)[0][:, 0]


@pytest.mark.parametrize("camera", [PINHOLE, BROWN_K3, FISHEYE])
def test_points_fall_on_their_pixels_and_depth_comes_back(tmp_path, camera):
    bag = convert_bag(camera=camera)
    assert export(bag, "nerfstudio", tmp_path / "out") == ()
    for room in (0, 1):
        folder = tmp_path / "out" / f"room_{room:04d}"
        meta = json.loads((folder / "transforms.json").read_text())
        truths = [truth for truth in bag.frames["camera"] if truth.room == room]
        for truth, row in zip(truths, meta["frames"], strict=True):
            pixels, points = truth.points()
            seen = optical(row, points)
            ahead = seen[:, 2] > 0.05
            assert ahead.sum() > 50 and np.abs(places(meta, seen[ahead]) - 0.5 - pixels[ahead]).max() < 0.01
            depth, true = cv2.imread(str(folder / row["depth_file_path"]), cv2.IMREAD_UNCHANGED) * 1e-3, truth.layers["depth"]
            there = np.isfinite(true) & (true > 0.001)
            np.testing.assert_allclose(depth[there], true[there], atol=5.1e-4)
            np.testing.assert_array_equal(cv2.imread(str(folder / row["file_path"]))[..., ::-1], truth.layers["color"])
        cloud = trimesh.load(folder / meta["ply_file_path"])
        assert len(cloud.vertices) > 15 and cloud.vertices[:, 2].min() > -0.01 and cloud.vertices[:, 2].max() < 2.61


def test_a_panorama_has_the_rays_of_nerfstudio(tmp_path):
    bag = convert_bag(rooms=1, frames=2, layers=(), camera=PANORAMA)
    export(bag, "nerfstudio", tmp_path / "out")
    meta = json.loads((tmp_path / "out/room_0000/transforms.json").read_text())
    assert meta["camera_model"] == "EQUIRECTANGULAR" and "ply_file_path" not in meta
    points = np.random.default_rng(1).uniform((0, 0, 0), (4, 3.5, 2.6), (200, 3))
    for truth, row in zip(bag.frames["camera"], meta["frames"], strict=True):
        u, v, _ = project(PANORAMA, truth.pose, points).T
        theta, phi = -np.pi * (u - meta["cx"]) / meta["fl_x"], np.pi * (0.5 + (v - meta["cy"]) / meta["fl_y"])
        rays = np.stack([-np.sin(theta) * np.sin(phi), np.cos(phi), -np.cos(theta) * np.sin(phi)], axis=1)
        matrix = np.array(row["transform_matrix"])
        ways = points - matrix[:3, 3]
        np.testing.assert_allclose(rays @ matrix[:3, :3].T, ways / np.linalg.norm(ways, axis=1, keepdims=True), atol=1e-6)
        assert "depth_file_path" not in row


def test_a_rational_lens_is_refused(tmp_path):
    with pytest.raises(ConvertError, match=r"^nerfstudio: camera /synth/camera: .*got rational .*choose --to colmap"):
        export(convert_bag(rooms=1, frames=1, camera=RATIONAL), "nerfstudio", tmp_path / "out")


def test_what_lies_beyond_the_circle_of_a_fisheye_is_masked(tmp_path):
    wide = dataclasses.replace(FISHEYE, horizontal_fov_rad=2.0 * np.pi, distortion=())
    bag = convert_bag(rooms=1, frames=1, camera=wide)
    export(bag, "nerfstudio", tmp_path / "out")
    (row,) = json.loads((tmp_path / "out/room_0000/transforms.json").read_text())["frames"]
    mask = cv2.imread(str(tmp_path / "out/room_0000" / row["mask_path"]), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(mask, 255 * ~np.isnan(bag.frames["camera"][0].layers["depth"]))
    assert 0.4 < (mask > 0).mean() < 0.99
