"""Motion blur and rolling shutter: streaks and skews of known length, ground truth by row, poses between poses."""

import math

import numpy as np
import pytest
from box_room import box, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.camera.rig import mounted_path
from renderer.camera.shutter import motion_during, pose_at
from scene_description import CameraPose
from scene_description.kinematics import camera_kinematics
from scene_description.motion import Motion
from scene_description.poses import look_at, multiply_quaternions, quaternion_from_yaw

SIZE, FOV, DEPTH = 64, 0.4, 2.0
SPEED = 0.8
LAYERS = ("color", "depth", "normals", "instance")


def sideways(count=5, step_ns=100_000_000):
    """A camera that looks along +x and goes along +y at ``SPEED``."""
    seconds = step_ns * 1e-9
    return [
        CameraPose(stamp_ns=i * step_ns, position_m=(0.0, SPEED * i * seconds, 0.0), orientation=look_at((0, 0, 0), (1, 0, 0)))
        for i in range(count)
    ]


def turning(rate=0.5, count=5):
    """A camera that turns about the vertical."""
    ahead = look_at((0, 0, 0), (1, 0, 0))
    return [
        CameraPose(
            stamp_ns=i * 100_000_000,
            position_m=(0.0, 0.0, 0.0),
            orientation=multiply_quaternions(quaternion_from_yaw(rate * 0.1 * i), ahead),
        )
        for i in range(count)
    ]


def picture(flat, view, path, samples=128, layers=("color",), **camera):
    config = RenderConfig(samples_per_pixel=samples, max_depth=1, threads=2)
    with Renderer(flat, CameraConfig(width=SIZE, height=SIZE, horizontal_fov_rad=FOV, **camera), config, 3) as renderer:
        return renderer.render(view, 0, layers, path=path)


def camera_of(**settings):
    return CameraConfig(width=SIZE, height=SIZE, horizontal_fov_rad=FOV, **settings)


def test_a_moving_camera_draws_a_streak_of_the_right_length_about_the_stamp():
    path = sideways()
    view = path[2]
    half = 0.01
    x, y = DEPTH, view.position_m[1]
    spot = scene(quad((x, y - half, -half), (0, 0, 2 * half), (0, 2 * half, 0), emission=(1e5, 1e5, 1e5), color=(0, 0, 0)))
    shutter = 0.1
    length = camera_of().focal_length_px * SPEED * shutter / DEPTH
    seen = picture(spot, view, path, samples=512, shutter_s=shutter).radiance[..., 0].astype(np.float64)
    u = np.arange(SIZE) + 0.5
    columns = seen.sum(axis=0)
    middle = np.average(u, weights=columns)
    spread = math.sqrt(np.average((u - middle) ** 2, weights=columns))
    assert length > 5
    side = camera_of().focal_length_px * 2 * half / DEPTH
    assert spread == pytest.approx(math.sqrt((length**2 + side**2 + 1.0) / 12.0), rel=0.03)  # an even streak, the lamp, a pixel
    assert middle == pytest.approx(SIZE / 2, abs=0.3)
    assert (seen.sum(axis=1) > 0).sum() <= 4


def test_ground_truth_of_a_global_shutter_is_that_of_the_stamp():
    room = scene(box((-3, -3, -1.5), (4, 3, 1.5), inside=True, object_id=0), box((1.6, -0.2, -0.3), (1.9, 0.4, 0.3), object_id=7))
    path = sideways()
    still, moving = (picture(room, path[1], path, 2, LAYERS, shutter_s=shutter) for shutter in (0.0, 0.05))
    for name in LAYERS[1:]:
        assert np.array_equal(still.layers[name], moving.layers[name])


@pytest.mark.parametrize("path", [sideways(), turning()])
def test_a_rolling_shutter_shows_each_row_from_its_own_pose(path):
    """Rows of a rolling frame are the rows of pictures taken where the camera is when they are exposed."""
    room = scene(box((-3, -3, -1.5), (4, 3, 1.5), inside=True, object_id=0), box((1.6, -0.2, -0.3), (1.9, 0.4, 0.3), object_id=7))
    row_time = 0.001
    view = path[1]
    rolling = picture(room, view, path, 1, LAYERS, row_time_s=row_time)
    for row in (0, 17, 40, 63):
        there = pose_at(path, view.stamp_ns + row * row_time * 1e9)
        still = picture(room, there, (), 1, LAYERS)
        assert np.array_equal(rolling.layers["instance"][row], still.layers["instance"][row])
        for name in ("depth", "normals"):
            np.testing.assert_allclose(rolling.layers[name][row], still.layers[name][row], rtol=2e-4, atol=2e-4)


def test_a_vertical_edge_leans_by_speed_times_row_time():
    path = sideways()
    room = scene(box((DEPTH, path[1].position_m[1], -2), (DEPTH + 0.5, 3, 2), object_id=7))
    row_time = 0.002
    rolling = picture(room, path[1], path, 1, LAYERS, row_time_s=row_time)
    edges = (rolling.layers["instance"] == 7).sum(axis=1)  # the box lies to the left of its edge, which moves right as the camera goes left
    lean = camera_of().focal_length_px * SPEED * row_time / DEPTH
    slope = np.polyfit(np.arange(SIZE), edges, 1)[0]
    assert abs(slope) == pytest.approx(lean, rel=0.03)
    color = (picture(room, path[1], path, 64, ("color", "instance"), row_time_s=row_time).layers["instance"] == 7).sum(axis=1)
    assert np.array_equal(color, edges)


def test_poses_between_poses_are_on_the_way_and_ends_go_on():
    path = turning()
    between = pose_at(path, 150_000_000)
    expected = multiply_quaternions(quaternion_from_yaw(0.075), path[0].orientation)
    assert abs(float(np.dot(between.orientation, expected))) == pytest.approx(1.0, abs=1e-12)
    before, after = pose_at(sideways(), -50_000_000), pose_at(sideways(), 450_000_000)
    assert before.position_m[1] == pytest.approx(-0.05 * SPEED) and after.position_m[1] == pytest.approx(0.45 * SPEED)
    for pose_on_path in path:
        assert abs(float(np.dot(pose_at(path, pose_on_path.stamp_ns).orientation, pose_on_path.orientation))) == pytest.approx(1.0)


def test_cameras_at_rest_have_no_motion():
    path = sideways()
    assert motion_during(camera_of(), path[1], path) is None
    assert motion_during(camera_of(shutter_s=0.1), path[1], path[1:2]) is None
    assert motion_during(camera_of(shutter_s=0.1), pose((0, 0, 0), (1, 0.5, 0)), path) is None
    assert motion_during(camera_of(shutter_s=0.1), path[1], path) is not None


def test_a_camera_on_a_body_is_where_the_body_is_between_frames():
    """A body that gains speed, 2 m/s2 along y: 10 Hz frames, rows read out for 60 ms; a camera 0.1 m right of the path's frame."""
    step, count = 0.1, 20
    places = tuple((0.0, (step * (k - 2)) ** 2, 0.0) for k in range(count))
    carrier = Motion(kind="file", spacing_s=step, positions_m=places, turns=((0.0, 0.0, 0.0, 1.0),) * count)
    stamps = [10**9 + k * 100_000_000 for k in range(8)]
    rigs = camera_kinematics(carrier, (np.array(stamps) - stamps[0]) * 1e-9)
    path = [
        CameraPose(stamp_ns=stamp, position_m=tuple(place), orientation=tuple(turn))
        for stamp, place, turn in zip(stamps, rigs.position_m.tolist(), rigs.quaternion.tolist(), strict=True)
    ]
    camera = camera_of(row_time_s=0.06 / (SIZE - 1), mount_m=(0.1, 0.0, 0.0))
    carried = mounted_path(camera, path, carrier)
    assert list(carried) == list(mounted_path(camera, path))
    knots = motion_during(camera, carried[3], carried).knots
    times = np.linspace(0.0, 0.06, len(knots))
    since = 0.3 + times
    np.testing.assert_allclose(knots[:, 10] - knots[0, 10], since**2 - 0.3**2, atol=1e-6)
    np.testing.assert_allclose(knots[:, 9:12:2], 0.0, atol=1e-6)
    assert carried[3].position_m[1] == pytest.approx(knots[0, 10], abs=1e-6)
    straight = motion_during(camera, carried[3], list(carried)).knots
    assert np.abs(straight[:, 10] - knots[:, 10]).max() == pytest.approx(0.05**2, rel=0.01)  # a t (T - t) / 2
    assert isinstance(mounted_path(camera_of(), path, carrier), tuple)
