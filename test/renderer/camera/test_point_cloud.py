"""Points of views against the mesh that was seen, by trimesh; every lens, at rest and with a rolling shutter."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
import trimesh
from box_room import VIEW, furnished_room

from renderer import CameraConfig, RenderConfig, Renderer, RenderError
from renderer.camera.cloud_fields import cloud_fields
from renderer.camera.point_cloud import cloud_points
from scene_description import CameraPose
from scene_description.poses import look_at, world_from_optical

LENSES = {
    "plain": CameraConfig(width=64, height=48),
    "off_centre": CameraConfig(width=64, height=48, principal_x_px=20.0, focal_y_px=60.0),
    "brown_conrady": CameraConfig(width=64, height=48, model="brown_conrady", distortion=(-0.2, 0.03, 0.001, -0.002, 0.0)),
    "fisheye": CameraConfig(width=64, height=64, model="kannala_brandt", horizontal_fov_rad=3.6),
    "panorama": CameraConfig(width=64, height=32, model="equirectangular"),
}


def seen(camera: CameraConfig, pose: CameraPose, path=()):
    flat = furnished_room()
    with Renderer(flat, camera, RenderConfig(threads=2), 0) as renderer:
        return flat, renderer.render(pose, 0, ("depth", "range", "semantic", "instance"), path=path).layers


def to_mesh_m(flat, pose: CameraPose, points: np.ndarray, count: int = 400) -> np.ndarray:
    """Distances of some points of the optical frame to the mesh, in metres; NaN points are left out."""
    hits = points[np.isfinite(points[:, 0])]
    some = hits[np.random.default_rng(1).permutation(len(hits))[:count]].astype(np.float64)
    matrix = world_from_optical(pose.position_m, pose.orientation)
    mesh = trimesh.Trimesh(flat.mesh.vertices, flat.mesh.faces, process=False)
    return trimesh.proximity.closest_point_naive(mesh, some @ matrix[:3, :3].T + matrix[:3, 3])[1]


def xyz(cloud: np.ndarray) -> np.ndarray:
    return cloud.view(np.float32)[..., :3].reshape(-1, 3)


@pytest.mark.parametrize("lens", LENSES)
def test_points_of_every_lens_lie_on_the_mesh(lens: str) -> None:
    camera = LENSES[lens]
    flat, images = seen(camera, VIEW)
    points = xyz(cloud_points(camera, VIEW, (), images["range"], along_ray=True))
    assert to_mesh_m(flat, VIEW, points).max() < 1e-5
    np.testing.assert_array_equal(np.isfinite(points[:, 0]), np.isfinite(images["range"]).ravel())
    if lens != "panorama":
        np.testing.assert_allclose(xyz(cloud_points(camera, VIEW, (), images["depth"], along_ray=False)), points, atol=2e-5)


def rolling() -> tuple[CameraPose, ...]:
    """A walk of 1.5 m/s that turns by 2 rad/s."""
    poses = []
    for i in range(4):
        place, angle = (3.0 - 0.15 * i, 0.6 + 0.05 * i, 1.5), 2.2 + 0.2 * i
        target = (place[0] + math.cos(angle), place[1] + math.sin(angle), 1.2)
        poses.append(CameraPose(stamp_ns=i * 100_000_000, position_m=place, orientation=look_at(place, target)))
    return tuple(poses)


@pytest.mark.parametrize("lens", ["plain", "fisheye"])
def test_a_rolling_shutter_leaves_the_points_on_the_mesh(lens: str) -> None:
    settings = LENSES[lens]
    camera = CameraConfig(**{name: getattr(settings, name) for name in ("model", "width", "height", "horizontal_fov_rad")}, row_time_s=1e-3)
    path = rolling()
    flat, images = seen(camera, path[1], path)
    points = xyz(cloud_points(camera, path[1], path, images["range"], along_ray=True))
    assert to_mesh_m(flat, path[1], points).max() < 1e-4
    if lens == "plain":
        from_depth = xyz(cloud_points(camera, path[1], path, images["depth"], along_ray=False))
        np.testing.assert_allclose(from_depth, points, atol=1e-4)
    unaware = xyz(cloud_points(camera, path[1], (), images["range"], along_ray=True))
    assert np.median(to_mesh_m(flat, path[1], unaware)) > 0.005


def test_colour_and_ids_are_packed_as_pcl_reads_them_and_no_hit_is_nan() -> None:
    camera = CameraConfig(width=3, height=2)
    distance = np.array([[1.0, np.inf, np.nan], [0.0, 2.0, 3.0]], np.float32)
    color = np.zeros((2, 3, 3), np.uint8)
    color[1, 1] = (1, 2, 3)
    label, instance = np.full((2, 3), 7, np.uint8), np.full((2, 3), 40_000, np.uint16)
    cloud = cloud_points(camera, VIEW, (), distance, along_ray=False, color=color, label=label, instance=instance)
    assert cloud_fields(color=True, label=True, instance=True) == (12, 16, 18, 20)
    assert cloud_fields(color=False, label=True, instance=False) == (-1, 12, -1, 16)
    assert cloud.shape == (2, 3, 20)
    x, y, z, blue, green, red, none, ids, objects = struct.unpack("<fff4BHH", cloud[1, 1].tobytes())
    assert (x, z, red, green, blue, none, ids, objects) == (0.0, 2.0, 1, 2, 3, 0, 7, 40_000)
    assert y == pytest.approx(2.0 * 0.5 / camera.focal_length_px)
    assert np.isnan(xyz(cloud)).all(axis=1).tolist() == [False, True, True, True, False, False]
    with pytest.raises(RenderError, match="point cloud: color: expected an image of 3 x 2 pixels, got shape"):
        cloud_points(camera, VIEW, (), distance, along_ray=False, color=color[:1])
