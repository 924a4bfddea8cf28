"""Depth, normals and ids against analytic rooms."""

import numpy as np
import pytest
from box_room import VIEW, box, furnished_room, pose, quad, scene

from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import bearings, unproject
from scene_description.poses import rotation_from_quaternion

ROOM_LOW, ROOM_HIGH = np.array([0.0, 0.0, 0.0]), np.array([4.0, 5.0, 2.6])


def geometry(flat, camera, view):
    with Renderer(flat, camera, RenderConfig(threads=2), 0) as renderer:
        return renderer.render(view, 0, GEOMETRIC_LAYERS).layers


def pixel_rays(camera, view):
    """Origin (3,) and directions (h, w, 3) with optical z = 1, float64."""
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    points = unproject(camera, view, np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)]))
    return np.array(view.position_m), (points - view.position_m).reshape(camera.height, camera.width, 3)


def exit_depth(origin, directions, low, high):
    """Where rays from inside leave a box, and the inward normal there."""
    with np.errstate(divide="ignore"):
        steps = np.where(directions > 0, (high - origin) / directions, (low - origin) / directions)
    axis = steps.argmin(axis=-1)
    normal = -np.sign(np.take_along_axis(directions, axis[..., None], -1)) * np.eye(3)[axis]
    return steps.min(axis=-1), normal


VIEWS = [VIEW, pose((2.0, 2.5, 1.3), (0.1, 0.2, 2.5)), pose((0.5, 4.5, 2.0), (3.5, 0.5, 0.1))]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("size", [(640, 480), (203, 151)])
def test_a_box_room_is_exact_at_every_pixel(view, size):
    camera = CameraConfig(width=size[0], height=size[1])
    layers = geometry(scene(box(ROOM_LOW, ROOM_HIGH, inside=True, label=7, object_id=300)), camera, view)
    origin, directions = pixel_rays(camera, view)
    depth, normal = exit_depth(origin, directions, ROOM_LOW, ROOM_HIGH)
    assert np.abs(layers["depth"] - depth).max() < 1e-4
    optical_from_world = rotation_from_quaternion(view.orientation).T
    cosine = (layers["normals"] * (normal @ optical_from_world.T)).sum(axis=-1)
    edge = np.abs(np.sort(np.abs(directions * depth[..., None] + origin - np.where(directions > 0, ROOM_HIGH, ROOM_LOW)), axis=-1)[..., 1])
    assert cosine[edge > 1e-5].min() > 1 - 1e-6
    assert (layers["semantic"] == 7).all() and (layers["instance"] == 300).all()


@pytest.mark.parametrize(
    "camera",
    [
        CameraConfig(width=203, height=151),
        CameraConfig(model="brown_conrady", width=203, height=151, distortion=(-0.2, 0.03, 0.001, -0.002)),
        CameraConfig(model="kannala_brandt", width=203, height=203, horizontal_fov_rad=3.6, distortion=(0.02, -0.01)),
        CameraConfig(model="equirectangular", width=256, height=128),
    ],
    ids=lambda camera: camera.model,
)
@pytest.mark.parametrize("view", VIEWS)
def test_every_lens_measures_a_box_room(view, camera):
    layers = geometry(scene(box(ROOM_LOW, ROOM_HIGH, inside=True, label=7, object_id=300)), camera, view)
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    optical = bearings(camera, np.column_stack([u.ravel(), v.ravel()])).reshape(camera.height, camera.width, 3)
    optical /= np.linalg.norm(optical, axis=-1, keepdims=True)
    seen = np.isfinite(optical[..., 0])
    rotation = rotation_from_quaternion(view.orientation)
    distance, _ = exit_depth(np.array(view.position_m), optical[seen] @ rotation.T, ROOM_LOW, ROOM_HIGH)
    assert np.abs(layers["range"][seen] - distance).max() < 2e-4
    assert np.abs(layers["depth"][seen] - distance * optical[seen][:, 2]).max() < 2e-4
    assert np.isnan(layers["range"][~seen]).all() and (layers["instance"] == np.where(seen, 300, 0)).all()


def test_normals_follow_from_depth_on_planes():
    camera = CameraConfig(width=320, height=240)
    layers = geometry(furnished_room(), camera, VIEW)
    _, directions = pixel_rays(camera, VIEW)
    optical = directions @ rotation_from_quaternion(VIEW.orientation) * layers["depth"][..., None]
    across, down = optical[1:-1, 2:] - optical[1:-1, :-2], optical[2:, 1:-1] - optical[:-2, 1:-1]
    from_depth = np.cross(down, across)
    from_depth /= np.linalg.norm(from_depth, axis=-1, keepdims=True)
    normals = layers["normals"]
    same = np.ones(from_depth.shape[:2], bool)
    for y in range(3):
        for x in range(3):
            neighbour = normals[y : y + from_depth.shape[0], x : x + from_depth.shape[1]]
            same &= (np.abs(neighbour - normals[1:-1, 1:-1]).max(axis=-1) < 1e-5) & (
                layers["instance"][y : y + same.shape[0], x : x + same.shape[1]] == layers["instance"][1:-1, 1:-1]
            )
    angle = np.degrees(np.arccos(np.clip((from_depth * normals[1:-1, 1:-1]).sum(axis=-1), -1, 1)))
    assert same.mean() > 0.9
    assert np.median(angle[same]) < 0.1 and angle[same].max() < 1.0
    assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 1e-5
    assert ((normals * optical).sum(axis=-1) <= 0).all()


def test_ids_are_those_of_the_nearest_piece():
    camera = CameraConfig(width=321, height=242)
    corners = [(1.03, -0.217, 0.013), (2.11, 0.337, 0.119), (2.97, -0.191, -0.407)]
    pieces = [box(c, np.add(c, (0.31, 0.53, 0.27)), object_id=1000 * i + 1, label=i + 1) for i, c in enumerate(corners)]
    view = pose((0, 0, 0), (1, 0, 0))
    layers = geometry(scene(*pieces), camera, view)
    origin, directions = pixel_rays(camera, view)
    nearest = np.full(directions.shape[:2], np.inf)
    label, identity = np.zeros(nearest.shape, int), np.zeros(nearest.shape, int)
    for piece in pieces:
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = (piece.vertices.min(0) - origin) / directions, (piece.vertices.max(0) - origin) / directions
        enter, leave = np.minimum(one, two).max(-1), np.maximum(one, two).min(-1)
        hit = (enter <= leave) & (enter > 0) & (enter < nearest)
        nearest[hit], label[hit], identity[hit] = enter[hit], piece.label, piece.object_id
    assert np.array_equal(layers["semantic"], label)
    assert np.array_equal(layers["instance"], identity)
    assert len(np.unique(identity)) == 4
    miss = identity == 0
    assert np.isposinf(layers["depth"][miss]).all() and (layers["normals"][miss] == 0).all()
    np.testing.assert_allclose(layers["depth"][~miss], nearest[~miss], atol=1e-4)


def test_both_sides_of_a_sheet_look_towards_the_camera():
    sheet = quad((0, -1, -1), (0, 2, 0), (0, 0, 2))
    for x in (-2.0, 2.0):
        layers = geometry(scene(sheet), CameraConfig(width=9, height=5, horizontal_fov_rad=0.5), pose((x, 0, 0), (0, 0, 0)))
        np.testing.assert_allclose(layers["normals"], np.broadcast_to([0, 0, -1], (5, 9, 3)), atol=1e-6)
        np.testing.assert_allclose(layers["depth"], 2.0, atol=1e-6)


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (5, 7), (4, 4), (17, 1)])
def test_any_size_is_a_crop_of_the_same_rays(size):
    camera = CameraConfig(width=size[0], height=size[1])
    layers = geometry(scene(box(ROOM_LOW, ROOM_HIGH, inside=True)), camera, VIEW)
    depth, _ = exit_depth(*pixel_rays(camera, VIEW), ROOM_LOW, ROOM_HIGH)
    assert layers["depth"].shape == (size[1], size[0])
    assert np.abs(layers["depth"] - depth).max() < 1e-4
