"""BOP datasets, read as the documentation of the format says; the BOP toolkit is not on PyPI.

What it says: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md.  s p_i = K [R_m2c, t_m2c] p_m, millimetres,
matrices row by row, depth in millimetres after ``depth_scale``, masks <image>_<annotation>.png.
"""

import json

import cv2
import numpy as np
import pytest
import trimesh
from convert_bag import BROWN, PINHOLE, ConvertBag, convert_bag, export
from scipy.spatial.distance import pdist

from renderer.camera.cameras import project
from renderer.scene.flatten import flatten
from scene_synth_ros.convert.writer import ConvertError


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> tuple[ConvertBag, object]:
    bag, out = convert_bag(), tmp_path_factory.mktemp("bop") / "out"
    assert export(bag, "bop", out) == ()
    return bag, out


def rows(out, scene, name):
    return {int(key): row for key, row in json.loads((out / f"train_pbr/{scene:06d}/{name}.json").read_text()).items()}


def place(k, rotation, shift, points):
    """Return the pixels of points."""
    seen = points @ np.array(rotation).reshape(3, 3).T + np.array(shift)
    told = seen @ np.array(k).reshape(3, 3).T
    return told[:, :2] / told[:, 2:]


def test_points_of_the_world_fall_on_their_pixels_and_depth_comes_back(exported):
    bag, out = exported
    for room in (0, 1):
        cameras = rows(out, room, "scene_camera")
        for (number, camera), truth in zip(cameras.items(), [it for it in bag.frames["camera"] if it.room == room], strict=True):
            pixels, points = truth.points()
            told = place(camera["cam_K"], camera["cam_R_w2c"], camera["cam_t_w2c"], 1000.0 * points)
            assert np.abs(told - pixels).max() < 0.01
            stored = cv2.imread(str(out / f"train_pbr/{room:06d}/depth/{number:06d}.png"), cv2.IMREAD_UNCHANGED)
            true = truth.layers["depth"]
            assert camera["depth_scale"] == 0.1 and stored.dtype == np.uint16
            np.testing.assert_allclose(stored[np.isfinite(true)] * 1e-4, true[np.isfinite(true)], atol=5.1e-5)
            assert (stored[~np.isfinite(true)] == 0).all()


def test_models_at_their_poses_are_the_objects(exported):
    bag, out = exported
    flat = flatten(bag.scenes[0])
    infos = json.loads((out / "models/models_info.json").read_text())
    assert {int(key): row["name"] for key, row in infos.items()} == {
        1: "door", 2: "window", 3: "bed", 4: "nightstand", 5: "table_lamp", 6: "ceiling_lamp"
    }  # fmt: skip
    for room in (0, 1):
        cameras, truth_rows = rows(out, room, "scene_camera"), rows(out, room, "scene_gt")
        for (number, told), truth in zip(truth_rows.items(), [it for it in bag.frames["camera"] if it.room == room], strict=True):
            assert [row["obj_id"] for row in told] == [key for key in np.unique(truth.layers["instance"]) if key]
            for row in told:
                mesh = trimesh.load(out / f"models/obj_{row['obj_id']:06d}.ply", process=False)
                own = flat.face_part[:, None] == np.flatnonzero(flat.parts.object_id == row["obj_id"])
                vertices = flat.mesh.vertices[np.unique(flat.mesh.faces[own.any(axis=1)])].astype(np.float64)
                places = project(PINHOLE, truth.pose, vertices)
                ahead = places[:, 2] > 0.3
                seen = place(cameras[number]["cam_K"], row["cam_R_m2c"], row["cam_t_m2c"], np.asarray(mesh.vertices))
                assert ahead.any() and np.abs(seen[ahead] + 0.5 - places[ahead, :2]).max() < 0.01


def test_models_are_centred_upright_and_have_their_size(exported):
    bag, out = exported
    for number, row in json.loads((out / "models/models_info.json").read_text()).items():
        mesh = trimesh.load(out / f"models/obj_{int(number):06d}.ply", process=False)
        np.testing.assert_allclose(mesh.bounds.sum(axis=0), 0.0, atol=0.01)
        np.testing.assert_allclose(
            [[row[f"min_{axis}"] for axis in "xyz"], [-row[f"min_{axis}"] for axis in "xyz"]], mesh.bounds, atol=0.01
        )
        np.testing.assert_allclose([row[f"size_{axis}"] for axis in "xyz"], np.ptp(mesh.bounds, axis=0), atol=0.01)
        assert row["diameter"] == pytest.approx(pdist(mesh.vertices[:: max(len(mesh.vertices) // 500, 1)]).max(), rel=0.02)
        np.testing.assert_allclose(np.linalg.norm(mesh.vertex_normals, axis=1), 1.0, atol=1e-4)
    frame = trimesh.load(out / "models/obj_000006.ply", process=False).visual.vertex_colors[:, :3]
    colors = {
        tuple(round(255 * (1.055 * item ** (1 / 2.4) - 0.055)) for item in material.base_color) for material in bag.scenes[0].materials
    }
    assert {tuple(map(int, color)) for color in frame} < colors
    bed = json.loads((out / "models/models_info.json").read_text())["3"]
    size = np.multiply(bag.scenes[0].objects[0].size_m, 1000.0)
    np.testing.assert_allclose([bed[f"size_{axis}"] for axis in "xyz"], size, rtol=0.01)


def test_masks_and_what_is_told_of_them_agree_with_the_pixels(exported):
    bag, out = exported
    for room in (0, 1):
        infos = rows(out, room, "scene_gt_info")
        for (number, told), truth in zip(infos.items(), [it for it in bag.frames["camera"] if it.room == room], strict=True):
            instance = truth.layers["instance"]
            keys = [key for key in np.unique(instance) if key]
            for index, (key, row) in enumerate(zip(keys, told, strict=True)):
                name = f"train_pbr/{room:06d}/{{}}/{number:06d}_{index:06d}.png"
                whole, visible = (cv2.imread(str(out / name.format(kind)), cv2.IMREAD_UNCHANGED) for kind in ("mask", "mask_visib"))
                np.testing.assert_array_equal(visible, 255 * (instance == key))
                assert set(np.unique(whole)) <= {0, 255} and (whole[visible > 0] == 255).all()
                assert row["px_count_visib"] == (visible > 0).sum() and row["px_count_all"] >= (whole > 0).sum()
                assert row["px_count_valid"] == ((whole > 0) & np.isfinite(truth.layers["depth"])).sum()
                assert row["visib_fract"] == row["px_count_visib"] / row["px_count_all"]
                ys, xs = np.nonzero(visible)
                assert row["bbox_visib"] == [xs.min(), ys.min(), np.ptp(xs), np.ptp(ys)]
                x, y, width, height = row["bbox_obj"]
                ys, xs = np.nonzero(whole)
                assert x <= xs.min() and y <= ys.min() and x + width >= xs.max() and y + height >= ys.max()


def test_a_lens_with_distortion_is_refused(tmp_path):
    with pytest.raises(ConvertError, match=r"^bop: camera /synth/camera: expected a lens without distortion, got brown_conrady"):
        export(convert_bag(camera=BROWN), "bop", tmp_path / "out")
