"""Folders of VSLAM-LAB, read by pandas, PyYAML and OpenCV as its sources of January 2026 read them."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from convert_bag import BROWN_K3, FISHEYE, PINHOLE, RATIONAL, convert_bag, export
from imu_frame import CONFIG, SCENE, frame_of
from scipy.spatial.transform import Rotation

from scene_description import CameraPose
from scene_synth_ros.convert.camera import Lens
from scene_synth_ros.convert.formats import FORMATS
from scene_synth_ros.convert.formats.rig import RigCamera
from scene_synth_ros.convert.formats.vslam_lab import FormatWriter
from scene_synth_ros.convert.source import choose_cameras
from scene_synth_ros.convert.writer import ConvertError, Sequence

MOUNTED = {"mount_m": (0.12, 0.01, 0.0), "mount_rotation_rad": (0.0, 0.1, 0.02)}


def project(camera, camera_from_world, points):
    """Return the pixels of world points by an entry of calibration.yaml."""
    (fx, fy), (cx, cy) = camera["focal_length"], camera["principal_point"]
    turn, k = cv2.Rodrigues(camera_from_world[:3, :3])[0], np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    if camera.get("distortion_type") == "equid4":
        d = np.array(camera["distortion_coefficients"])
        return cv2.fisheye.projectPoints(points[:, None], turn, camera_from_world[:3, 3], k, d)[0][:, 0]
    assert camera.get("distortion_type", "radtan5") == "radtan5"
    return cv2.projectPoints(points, turn, camera_from_world[:3, 3], k, np.array(camera.get("distortion_coefficients", [])))[0][:, 0]


def matrix(row):
    """Return a pose of groundtruth.csv as a matrix (4, 4)."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat(row[["qx", "qy", "qz", "qw"]].to_numpy(float)).as_matrix()
    found[:3, 3] = row[["tx (m)", "ty (m)", "tz (m)"]].to_numpy(float)
    return found


@pytest.mark.parametrize(
    "cameras", [{"left": BROWN_K3, "right": dataclasses.replace(FISHEYE, **MOUNTED)}, {"camera": PINHOLE}], ids=["pair", "one"]
)
def test_points_fall_on_their_pixels(tmp_path, cameras):
    bag = convert_bag(**cameras)
    assert export(bag, "vslam-lab", tmp_path / "out") == ()
    for index in (0, 1):
        room = tmp_path / "out" / f"room_{index:04d}"
        frames, truth = pd.read_csv(room / "rgb.csv"), pd.read_csv(room / "groundtruth.csv")
        calibration = yaml.safe_load((room / "calibration.yaml").read_text())
        first = np.array(calibration["cameras"][0]["T_BS"]).reshape(4, 4)
        assert "imus" not in calibration and not (room / "imu_0.csv").exists()
        assert frames["ts_rgb_0 (ns)"].tolist() == truth["ts (ns)"].tolist()
        assert frames.columns.tolist()[-2:] == ["ts_depth_0 (ns)", "path_depth_0"]
        for number, name in enumerate(cameras):
            camera = calibration["cameras"][number]
            assert camera["cam_name"] == f"rgb_{number}" and camera["image_dimension"] == [80, 60] and camera["fps"] == pytest.approx(30.0)
            seen = np.linalg.inv(np.array(camera["T_BS"]).reshape(4, 4)) @ first
            truths = [one for one in bag.frames[name] if one.room == index]
            for one, (_, row), (_, pose) in zip(truths, frames.iterrows(), truth.iterrows(), strict=True):
                assert row[f"ts_rgb_{number} (ns)"] == one.pose.stamp_ns
                pixels, points = one.points()
                from_world = seen @ np.linalg.inv(matrix(pose))
                ahead = (from_world[2, :3] @ points.T + from_world[2, 3]) > 0.05
                assert ahead.sum() > 50
                assert np.abs(project(camera, from_world, points[ahead]) - pixels[ahead]).max() < 0.01
                picture = cv2.imread(str(room / row[f"path_rgb_{number}"]), cv2.IMREAD_UNCHANGED)
                np.testing.assert_array_equal(picture[..., ::-1], one.layers["color"])
                if number == 0:
                    assert camera["cam_type"] == "rgb+depth" and camera["depth_name"] == "depth_0"
                    depth = cv2.imread(str(room / row["path_depth_0"]), cv2.IMREAD_UNCHANGED) / camera["depth_factor"]
                    known = np.isfinite(one.layers["depth"])
                    np.testing.assert_allclose(depth[known], one.layers["depth"][known], atol=1.01e-4)
                    assert not depth[~known].any()


def test_only_the_first_camera_needs_depth():
    recorded = {"left": ("color", "depth"), "right": ("color",), "third": ("depth",)}
    found, left_out = choose_cameras("vslam-lab", FORMATS["vslam-lab"], recorded, ("depth",), "bag")
    assert {camera: chosen.roles for camera, chosen in found.items()} == {
        "left": {"picture": "color", "depth": "depth"},
        "right": {"picture": "color"},
    }
    assert len(left_out) == 1 and left_out[0].startswith("camera third is left out: bag: vslam-lab needs color")


def test_readings_and_the_noise_of_the_device_are_told(tmp_path):
    sequence = Sequence(folder="room_0000", name="room_0000", room=0, camera="camera", place=0, cameras=1, frames=(0, 1))
    writer = FormatWriter("vslam-lab")
    source = SimpleNamespace(name="bag", roles={"picture": "color"}, data={"camera": ()}, frame=lambda _, number: frame_of(number))
    writer.begin(tmp_path, source)
    state = RigCamera(tmp_path, tmp_path / "rgb_0", sequence, Lens("pinhole", 80, 60, 70.0, 70.0, 40.0, 30.0, ()), list(SCENE.camera_path))
    writer.end_sequence(state)
    told = yaml.safe_load((tmp_path / "calibration.yaml").read_text())
    device, camera = told["imus"][0], told["cameras"][0]
    assert (device["sigma_g_c"], device["sigma_aw_c"], device["fps"]) == (1.7e-4, 3e-4, 200.0)
    assert (device["a_max"], device["g_max"], device["g"]) == (CONFIG.accel_range_m_s2, CONFIG.gyro_range_rad_s, 9.80665)
    assert device["T_BS"] == np.eye(4).ravel().tolist()
    read = pd.read_csv(tmp_path / "imu_0.csv")
    still = read["ts (ns)"] < SCENE.camera_path[0].stamp_ns + 10_000_000
    assert len(read) > 10 and read["ts (ns)"].is_monotonic_increasing and read["ts (ns)"][0] == SCENE.camera_path[0].stamp_ns + 2_000_000
    assert still.any() and np.linalg.norm(read.iloc[0, 4:7].to_numpy(float)) == pytest.approx(9.8, abs=3.0)
    mounted = np.array(camera["T_BS"]).reshape(4, 4)
    pose = pd.read_csv(tmp_path / "groundtruth.csv").iloc[0]
    np.testing.assert_allclose(matrix(pose), frame_of(0).matrix, atol=1e-9)
    np.testing.assert_allclose(mounted[:3, :3] @ mounted[:3, :3].T, np.eye(3), atol=1e-9)


def test_frames_are_those_that_all_cameras_have(tmp_path):
    writer = FormatWriter("vslam-lab")
    frame = SimpleNamespace(settings=None, has_scene=False)
    writer.begin(tmp_path, SimpleNamespace(name="bag", roles={}, data={"a": (), "b": ()}, frame=lambda _, number: frame))
    for place, stamps in enumerate(((10, 20, 30, 40), (20, 30, 50))):
        sequence = Sequence(folder="room", name="room", room=0, camera="ab"[place], place=place, cameras=2, frames=())
        poses = [CameraPose(stamp_ns=stamp, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0)) for stamp in stamps]
        lens = Lens("pinhole", 80, 60, 70.0, 70.0, 40.0, 30.0, ())
        writer.end_sequence(RigCamera(tmp_path, tmp_path / f"rgb_{place}", sequence, lens, poses))
    frames = pd.read_csv(tmp_path / "rgb.csv")
    assert frames["ts_rgb_0 (ns)"].tolist() == frames["ts_rgb_1 (ns)"].tolist() == [20, 30]
    assert frames["path_rgb_1"][1] == "rgb_1/0000000000000000030.png"


def test_a_lens_without_a_name_is_refused(tmp_path):
    with pytest.raises(
        ConvertError, match=r"^vslam-lab: camera /synth/camera: expected a lens pinhole, plumb_bob or equidistant, got rational"
    ):
        export(convert_bag(rooms=1, frames=1, camera=RATIONAL), "vslam-lab", tmp_path / "out")
