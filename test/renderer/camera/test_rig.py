"""Rigs: where cameras sit, disparity of a stereo pair, noise of their own."""

import math

import numpy as np
import pytest
from box_room import VIEW, box, furnished_room, pose, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.camera.rig import mounted, mounted_path, stereo_shift_m
from scene_description.poses import rotation_from_quaternion

BASE = 0.1
LEFT = CameraConfig(width=64, height=48)
RIGHT = CameraConfig(width=64, height=48, mount_m=(BASE, 0.0, 0.0))


def render(camera, flat, view, layers=("depth", "instance")):
    with Renderer(flat, camera, RenderConfig(samples_per_pixel=1, max_depth=3, threads=1), 5) as renderer:
        return renderer.render(mounted(camera, view), 0, layers)


def test_the_right_camera_sits_to_the_right():
    ahead = pose((1.0, 2.0, 1.5), (2.0, 2.0, 1.5))  # along +x, so right is -y
    there = mounted(RIGHT, ahead)
    assert there.position_m == pytest.approx((1.0, 2.0 - BASE, 1.5)) and there.orientation == ahead.orientation
    assert mounted(LEFT, ahead) is ahead
    assert [item.stamp_ns for item in mounted_path(RIGHT, [ahead])] == [ahead.stamp_ns]


def test_a_turned_camera_looks_aside():
    side = CameraConfig(mount_rotation_rad=(0.0, 0.5 * math.pi, 0.0), mount_m=(0.0, -0.2, 0.0))  # to the right, a little above
    there = mounted(side, pose((0.0, 0.0, 1.0), (1.0, 0.0, 1.0)))
    assert rotation_from_quaternion(there.orientation)[:, 2] == pytest.approx((0.0, -1.0, 0.0), abs=1e-12)
    assert there.position_m == pytest.approx((0.0, 0.0, 1.2))
    assert stereo_shift_m(side) == (0.0, 0.0) and stereo_shift_m(RIGHT) == (BASE, 0.0)


def test_disparity_is_focal_length_times_base_over_depth():
    depth = 2.0
    block = box((depth, -0.3, 0.5), (depth + 0.5, 0.3, 1.5), object_id=7)
    room = scene(box((-3, -3, 0), (5, 3, 2.5), inside=True, object_id=0), block)
    view = pose((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))
    middles = [np.nonzero(render(camera, room, view).layers["instance"][24] == 7)[0].mean() for camera in (LEFT, RIGHT)]
    assert middles[0] - middles[1] == pytest.approx(LEFT.focal_length_px * BASE / depth, abs=0.6)


def test_cameras_of_a_rig_have_noise_of_their_own():
    turned = CameraConfig(width=64, height=48, mount_rotation_rad=(0.0, 0.0, 1e-9))
    first, second = (render(camera, furnished_room(), VIEW, ("color", "depth")) for camera in (LEFT, turned))
    assert np.allclose(first.layers["depth"], second.layers["depth"], atol=1e-4)
    assert (first.radiance != second.radiance).any(axis=2).mean() > 0.5
