"""Poses at many times: the camera's own interpolation is the reference."""

from __future__ import annotations

import numpy as np

from renderer.camera.shutter import pose_at
from renderer.lidar.mount import along_path
from scene_description.poses import look_at, rotation_from_quaternion
from scene_description.types import CameraPose


def test_between_and_beyond_poses_it_is_where_the_camera_is() -> None:
    rng = np.random.default_rng(3)
    start_ns = 1_700_000_000_000_000_000
    path = []
    for i in range(6):
        place = tuple(rng.normal(size=3))
        path.append(
            CameraPose(stamp_ns=start_ns + i * 100_000_000, position_m=place, orientation=look_at(place, tuple(rng.normal(size=3))))
        )
    path[3] = CameraPose(stamp_ns=path[3].stamp_ns, position_m=path[2].position_m, orientation=path[2].orientation)  # it stands still
    times = np.linspace(-0.05, 0.58, 40)
    found = along_path(path, start_ns, times)
    for time, place, rotation in zip(times, *found, strict=True):
        expected = pose_at(path, start_ns + time * 1e9)
        np.testing.assert_allclose(place, expected.position_m, atol=1e-5)  # a float of nanoseconds since 1970 has steps of 256 ns
        np.testing.assert_allclose(rotation, rotation_from_quaternion(expected.orientation), atol=1e-5)


def test_a_path_of_one_pose_rests_there() -> None:
    pose = CameraPose(stamp_ns=5, position_m=(1.0, 2.0, 3.0), orientation=look_at((0, 0, 0), (0, 1, 0)))
    found = along_path([pose], 0, np.array([0.0, 1.0]))
    assert found.position_m.tolist() == [[1, 2, 3], [1, 2, 3]]
