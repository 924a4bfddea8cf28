"""Silhouettes of boxes: the pixels whose centres lie in the projected box, beyond the image's border too, whatever stands before it."""

import numpy as np
import pytest
from box_room import pose
from box_scene import crate, crates_scene
from scipy.spatial import ConvexHull

from renderer.annotations.object_meshes import ObjectMeshes
from renderer.annotations.silhouettes import Silhouettes
from renderer.annotations.things import corners_m, things_of
from renderer.camera.cameras import project
from renderer.camera.config import CameraConfig
from scene_description.label_standards import label_standard

CAMERAS = (
    CameraConfig(width=160, height=120, focal_x_px=100.0),
    CameraConfig(width=160, height=120, focal_x_px=100.0, focal_y_px=104.0, principal_x_px=70.3, principal_y_px=64.8),
)
NOTHING = np.zeros((120, 160), np.uint16)
"""An instance image without objects: every pixel of a silhouette comes from a ray."""


def in_hull(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """How far points (n, 2) lie outside the convex hull of corners, pixels; negative inside."""
    hull = ConvexHull(corners)
    return (points @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1)


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_box_covers_its_projection(camera):
    boxes = [crate(2, (0.0, 0.5, 0.0), (0.5, 0.5, 1.5), 0.3), crate(7, (-1.0, 1.8, 0.0), (1.0, 1.0, 1.0))]
    scene, flat = crates_scene(boxes)
    view, meshes = pose((-3.0, 0.0, 1.0), (0.0, 0.0, 1.0)), ObjectMeshes(flat)
    found = Silhouettes(meshes, camera).of_frame(view, NOTHING, [2, 7])
    things = things_of(scene, meshes, label_standard("nyu40"))
    xs, ys = np.meshgrid(np.arange(-160, 320), np.arange(-120, 240))
    centres = np.stack([xs.ravel(), ys.ravel()], axis=1) + 0.5
    for key, told in found.items():
        outside = in_hull(centres, project(camera, view, corners_m(things[key].box))[:, :2]).reshape(xs.shape)
        assert (outside < -0.01).sum() <= told.pixels <= (outside < 0.01).sum()
        cut = outside[120:240, 160:320]
        clear = np.abs(cut) > 0.01
        np.testing.assert_array_equal(told.inside[clear], cut[clear] < 0.0)
        rows, columns = np.nonzero(outside < 0.0)
        edges = [columns.min() - 160, rows.min() - 120, columns.max() - 160, rows.max() - 120]
        np.testing.assert_allclose([told.left, told.top, told.right, told.bottom], edges, atol=1)
    assert found[7].left < 0 or found[7].right >= 160
    meshes.close()


def test_what_is_behind_the_camera_has_none():
    _, flat = crates_scene([crate(2, (0.0, 0.0, 0.0), (0.5, 0.5, 1.0))])
    meshes = ObjectMeshes(flat)
    assert Silhouettes(meshes, CAMERAS[0]).of_frame(pose((-3.0, 0.0, 1.0), (-4.0, 0.0, 1.0)), NOTHING, [2]) == {2: None}
    meshes.close()


def test_pixels_of_an_object_are_in_its_silhouette_without_a_ray():
    _, flat = crates_scene([crate(2, (0.0, 0.0, 0.0), (0.5, 0.5, 1.0))])
    meshes, view = ObjectMeshes(flat), pose((-3.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    instance = NOTHING.copy()
    instance[3:9, 10:12] = 2
    alone, told = (Silhouettes(meshes, CAMERAS[0]).of_frame(view, image, [2])[2] for image in (NOTHING, instance))
    np.testing.assert_array_equal(told.inside, alone.inside | (instance == 2))
    assert told.pixels == alone.pixels + 12 and (told.left, told.top) == (10, 3)
    meshes.close()
