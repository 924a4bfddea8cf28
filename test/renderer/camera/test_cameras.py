"""The pinhole: known pixels, round trips, conventions."""

import math

import numpy as np
import pytest
from box_room import pose

from renderer.camera.cameras import intrinsics, pose_camera, project, unproject
from renderer.camera.config import CameraConfig
from renderer.core.errors import RenderError
from scene_description.types import CameraPose

CAMERA = CameraConfig(width=640, height=480, horizontal_fov_rad=math.pi / 2)


def test_known_pixels():
    view = pose((0, 0, 0), (1, 0, 0))
    points = np.array([[2.0, 0, 0], [2, 2, 0], [2, -2, 0], [2, 0, 1], [-1, 0, 0]])
    expected = [[320, 240, 2], [0, 240, 2], [640, 240, 2], [320, 80, 2], [np.nan, np.nan, -1]]
    np.testing.assert_allclose(project(CAMERA, view, points), expected, atol=1e-9)


def test_project_undoes_unproject():
    rng = np.random.default_rng(1)
    pixels = np.column_stack([rng.uniform(-100, 800, 500), rng.uniform(-100, 600, 500), rng.uniform(0.01, 50, 500)])
    for _ in range(5):
        view = pose(tuple(rng.normal(size=3)), tuple(rng.normal(size=3)))
        np.testing.assert_allclose(project(CAMERA, view, unproject(CAMERA, view, pixels)), pixels, rtol=1e-9, atol=1e-9)


def test_camera_info_counts_from_pixel_centres():
    k = intrinsics(CAMERA)
    assert k == pytest.approx((320, 320, 319.5, 239.5))
    u, v, depth = project(CAMERA, pose((0, 0, 0), (1, 0, 0)), np.array([[3.0, -1.2, 0.7]]))[0]
    assert (u - 0.5, v - 0.5) == pytest.approx((k.fx * 1.2 / depth + k.cx, k.fy * -0.7 / depth + k.cy))


def test_kernels_get_the_same_pose():
    view = pose((1, 2, 3), (4, 0, 1))
    camera = pose_camera(CAMERA, view)
    point = unproject(CAMERA, view, np.array([[100.5, 50.5, 2.0]]))[0]
    optical = np.array([(100.5 - 320) / camera.focal_px, (50.5 - 240) / camera.focal_px, 1.0]) * 2.0
    np.testing.assert_allclose(camera.rotation @ optical + camera.position, point, atol=1e-6)


@pytest.mark.parametrize(
    ("position", "orientation", "message"),
    [
        ((math.nan, 0, 0), (0, 0, 0, 1), "expected finite"),
        ((0, 0, 0), (0, 0, 0, 1.01), "expected a unit quaternion, got length 1.01"),
        ((0, 0, 0), (0, 0, 0, 0), "expected a unit quaternion, got length 0"),
    ],
)
def test_faulty_poses_are_refused(position, orientation, message):
    with pytest.raises(RenderError, match=message):
        pose_camera(CAMERA, CameraPose(stamp_ns=0, position_m=position, orientation=orientation))
