"""Lens models: known pixels, round trips, and rays that end where the models say."""

import math

import numpy as np
import pytest
from box_room import pose

from renderer.camera import camera_rays
from renderer.camera.cameras import bearing_table, bearings, pose_camera, project, unproject
from renderer.camera.config import CameraConfig
from renderer.core.errors import RenderError
from renderer.core.kernel import from_python
from renderer.core.ray_packet import DIR_X, DIR_Y, DIR_Z, LANES, make_packet
from scene_description.strict import FieldError

aim_tile = from_python(camera_rays.aim_tile)

ORIGIN = pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
LENS_CAMERAS = {
    "pinhole off centre": CameraConfig(focal_x_px=500.0, focal_y_px=520.0, principal_x_px=300.0, principal_y_px=250.0),
    "brown_conrady": CameraConfig(model="brown_conrady", focal_x_px=500.0, distortion=(-0.28, 0.07, 0.0005, -0.0003, 0.001)),
    "rational": CameraConfig(model="rational", focal_x_px=504.0, distortion=(6.1, 3.9, -4e-5, -8e-6, 0.2, 6.4, 5.8, 1.1)),
    "kannala_brandt": CameraConfig(model="kannala_brandt", horizontal_fov_rad=3.4, distortion=(-0.01, 0.02, -0.005, 0.0004)),
    "equirectangular": CameraConfig(model="equirectangular", width=400, height=200),
}


@pytest.fixture(params=list(LENS_CAMERAS))
def camera(request: pytest.FixtureRequest) -> CameraConfig:
    return LENS_CAMERAS[request.param]


def test_project_undoes_bearings(camera: CameraConfig) -> None:
    rng = np.random.default_rng(1)
    pixels = rng.uniform((0.01, 0.01), (camera.width - 0.01, camera.height - 0.01), (2000, 2))
    seen = bearings(camera, pixels)
    assert np.isfinite(seen).all()
    world = np.column_stack([seen[:, 2], -seen[:, 0], -seen[:, 1]]) * rng.uniform(0.1, 30.0, (2000, 1))  # optical axes at ORIGIN
    np.testing.assert_allclose(project(camera, ORIGIN, world)[:, :2], pixels, atol=1e-6)


def test_rays_within_a_pixel_go_where_the_lens_says(camera: CameraConfig) -> None:
    posed, packet, rng = pose_camera(camera, ORIGIN), make_packet(), np.random.default_rng(2)
    for column, row in ((0, 0), (camera.width // 2, camera.height // 2), (camera.width - 5, camera.height // 3)):
        for jitter, bound in ((np.zeros(32, np.float32), 1e-3), (rng.uniform(-0.5, 0.5, 32).astype(np.float32), 1e-2)):
            aim_tile(posed, column, row, jitter, packet)
            world = np.column_stack([packet.real[first : first + LANES] for first in (DIR_X, DIR_Y, DIR_Z)]).astype(np.float64)
            lanes = np.arange(LANES)
            wanted = np.column_stack([column + (lanes & 3), row + (lanes >> 2)]) + 0.5 + jitter.reshape(2, LANES).T
            near_pole = camera.model == "equirectangular" and row == 0
            assert near_pole or np.abs(project(camera, ORIGIN, world)[:, :2] - wanted).max() < bound


def test_brown_conrady_is_the_formula_of_camera_calibration() -> None:
    k1, k2, p1, p2, k3 = -0.28, 0.07, 0.0005, -0.0003, 0.001
    x, y = 0.3, -0.2
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    wanted = (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)
    u, v, depth = project(LENS_CAMERAS["brown_conrady"], ORIGIN, np.array([[2.0, -2.0 * x, -2.0 * y]]))[0]
    assert ((u - 320.0) / 500.0, (v - 240.0) / 500.0, depth) == pytest.approx((*wanted, 2.0))


def test_an_ideal_fisheye_puts_equal_angles_at_equal_distances() -> None:
    camera = CameraConfig(model="kannala_brandt", width=600, height=600, horizontal_fov_rad=math.pi)
    angle = np.radians([0.0, 30.0, 60.0, 90.0])
    points = np.column_stack([np.cos(angle), -np.sin(angle), np.zeros(4)])
    np.testing.assert_allclose(project(camera, ORIGIN, points)[:, 0], [300.0, 400.0, 500.0, 600.0], atol=1e-9)


def test_a_panorama_sees_all_around() -> None:
    camera = LENS_CAMERAS["equirectangular"]
    points = np.array([[1.0, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, 1], [-1, -1e-9, 0]])
    expected = [[200, 100], [300, 100], [100, 100], [200, 0], [400, 100]]
    np.testing.assert_allclose(project(camera, ORIGIN, points)[:, :2], expected, atol=1e-5)


def test_unproject_undoes_project_where_depth_says_where() -> None:
    for name in ("pinhole off centre", "brown_conrady", "rational"):
        pixels = np.column_stack([np.linspace(5, 630, 50), np.linspace(470, 9, 50), np.linspace(0.3, 9.0, 50)])
        points = unproject(LENS_CAMERAS[name], ORIGIN, pixels)
        np.testing.assert_allclose(project(LENS_CAMERAS[name], ORIGIN, points), pixels, atol=1e-6)


def test_a_fisheye_sees_nothing_beyond_its_circle() -> None:
    camera = CameraConfig(model="kannala_brandt", width=200, height=200, horizontal_fov_rad=2.0 * math.pi)
    table = bearing_table(camera)
    assert np.isnan(table[1, 1]).all()
    assert np.isfinite(table[100, 100]).all()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"model": "brown_conrady", "distortion": (0.1,) * 6}, "distortion: expected at most 5 coefficients"),
        ({"model": "pinhole", "distortion": (0.1,)}, "distortion: expected at most 0 coefficients"),
        ({"model": "rational", "horizontal_fov_rad": 3.1}, "horizontal_fov_rad: expected at most 3"),
        ({"model": "orthographic"}, "model: expected one of pinhole"),
    ],
)
def test_impossible_lenses_are_refused(fields: dict[str, object], message: str) -> None:
    with pytest.raises(FieldError, match=message):
        CameraConfig(**fields)


def test_a_distortion_that_folds_over_is_refused_with_the_pixel() -> None:
    with pytest.raises(RenderError, match=r"camera.distortion: expected coefficients that map .* fold over at pixel \(0, 0\)"):
        bearing_table(CameraConfig(model="brown_conrady", horizontal_fov_rad=1.6, distortion=(-0.6,)))
