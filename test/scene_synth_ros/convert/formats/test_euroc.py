"""EuRoC folders, read by evo, PyYAML and OpenCV."""

import dataclasses

import cv2
import numpy as np
import pytest
import yaml
from convert_bag import BROWN, BROWN_K3, FISHEYE, PINHOLE, RATIONAL, convert_bag, export
from evo.tools import file_interface

from scene_synth_ros.convert.writer import ConvertError


def project(sensor, body_from_world, points):
    """Return the pixels of world points by a sensor.yaml."""
    mounted = np.array(sensor["T_BS"]["data"]).reshape(4, 4)
    seen = np.linalg.inv(mounted) @ body_from_world
    fu, fv, cu, cv = sensor["intrinsics"]
    turn, k, d = (
        cv2.Rodrigues(seen[:3, :3])[0],
        np.array([[fu, 0, cu], [0, fv, cv], [0, 0, 1.0]]),
        np.array(sensor["distortion_coefficients"]),
    )
    if sensor["distortion_model"] == "equidistant":
        return cv2.fisheye.projectPoints(points[:, None], turn, seen[:3, 3], k, d)[0][:, 0]
    assert sensor["distortion_model"] == "radial-tangential"
    return cv2.projectPoints(points, turn, seen[:3, 3], k, d)[0][:, 0]


@pytest.mark.parametrize(
    "cameras",
    [
        {"left": BROWN, "right": dataclasses.replace(FISHEYE, mount_m=(0.12, 0.01, 0.0), mount_rotation_rad=(0.0, 0.1, 0.02))},
        {"camera": PINHOLE},
    ],
)
def test_points_fall_on_their_pixels(tmp_path, cameras):
    bag = convert_bag(**cameras)
    assert export(bag, "euroc", tmp_path / "out") == ()
    for room in (0, 1):
        mav = tmp_path / "out" / f"room_{room:04d}" / "mav0"
        assert (mav.parent / "orb_slam3.yaml").read_text().startswith("%YAML:1.0")
        trajectory = file_interface.read_euroc_csv_trajectory(str(mav / "state_groundtruth_estimate0" / "data.csv"))
        for number, name in enumerate(cameras):
            sensor = yaml.safe_load((mav / f"cam{number}" / "sensor.yaml").read_text())
            rows = [line.split(",") for line in (mav / f"cam{number}" / "data.csv").read_text().splitlines()[1:]]
            assert sensor["resolution"] == [80, 60] and sensor["rate_hz"] == pytest.approx(30.0)
            truths = [truth for truth in bag.frames[name] if truth.room == room]
            for truth, body, (stamp, picture) in zip(truths, trajectory.poses_se3, rows, strict=True):
                assert int(stamp) == truth.pose.stamp_ns
                pixels, points = truth.points()
                ahead = (np.linalg.inv(body)[2, :3] @ points.T + np.linalg.inv(body)[2, 3]) > 0.05
                told = project(sensor, np.linalg.inv(body), points[ahead])
                assert ahead.sum() > 50 and np.abs(told - pixels[ahead]).max() < 0.01
                grey = cv2.imread(str(mav / f"cam{number}" / "data" / picture), cv2.IMREAD_UNCHANGED)
                expected = cv2.cvtColor(truth.layers["color"], cv2.COLOR_RGB2GRAY)
                assert grey.shape == (60, 80) and np.abs(grey.astype(int) - expected).max() <= 1


def test_velocities_are_those_of_the_positions(tmp_path):
    export(convert_bag(), "euroc", tmp_path / "out")
    rows = np.loadtxt(tmp_path / "out/room_0000/mav0/state_groundtruth_estimate0/data.csv", delimiter=",")
    expected = np.array([-0.1, 0.15, 0.05]) / 0.033333333
    np.testing.assert_allclose(rows[:, 8:11], np.tile(expected, (3, 1)), rtol=1e-6)
    assert not rows[:, 11:].any()


@pytest.mark.parametrize("camera", [BROWN_K3, RATIONAL])
def test_a_lens_with_too_many_coefficients_is_refused(tmp_path, camera):
    with pytest.raises(ConvertError, match=r"^euroc: camera /synth/camera: expected a lens of plumb_bob without k3, or equidistant"):
        export(convert_bag(rooms=1, frames=1, camera=camera), "euroc", tmp_path / "out")
