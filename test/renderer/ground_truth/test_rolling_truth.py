"""Ground truth of a rolling shutter against rows tried one by one, each from the pose of its own time, and rays cast in float64."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import VIEW, furnished_room, pose

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.camera.cameras import project
from renderer.camera.shutter import pose_at
from renderer.ground_truth.motion import HIDDEN, OUTSIDE, VISIBLE
from scene_description.poses import rotation_from_quaternion

READOUT_S = 0.072
PLAIN = CameraConfig(width=160, height=120, row_time_s=READOUT_S / 120)
BENT = replace(PLAIN, model="brown_conrady", distortion=(-0.2, 0.03, 0.001, -0.002))
WIDE = replace(PLAIN, model="kannala_brandt", horizontal_fov_rad=2.4)
PATH = (
    VIEW,
    replace(pose((3.45, 0.47, 1.62), (1.35, 3.0, 0.9)), stamp_ns=100_000_000),
    replace(pose((3.5, 0.6, 1.6), (1.2, 3.1, 0.75)), stamp_ns=200_000_000),
)


def layers(camera, *names, view=PATH[1], path=PATH):
    with Renderer(furnished_room(), camera, RenderConfig(threads=2), 0) as renderer:
        return renderer.render(view, 0, names, path=path).layers


def poses_of_rows(camera, view):
    return [pose_at(PATH, view.stamp_ns + row * camera.row_time_s * 1e9) for row in range(camera.height)]


def places_row_by_row(camera, view, points):
    """Where a frame has points (n, 3): (u, v) (n, 2) and the camera's place then (n, 3), by projecting them from every row's pose.

    What falls outside the rows is where the first or the last one sees it.
    """
    poses = poses_of_rows(camera, view)
    seen = np.stack([project(camera, there, points)[:, :2] for there in poses])  # (rows, n, 2)
    eyes = np.array([there.position_m for there in poses])
    miss = seen[..., 1] - (np.arange(camera.height) + 0.5)[:, None]
    row = np.clip((miss > 0.0).sum(axis=0), 1, camera.height - 1)
    points_at = np.arange(len(points))
    before, after = miss[row - 1, points_at], miss[row, points_at]
    share = np.clip(before / (before - after), 0.0, 1.0)
    mixed = (1.0 - share)[:, None] * seen[row - 1, points_at] + share[:, None] * seen[row, points_at]
    return mixed, (1.0 - share)[:, None] * eyes[row - 1] + share[:, None] * eyes[row]


def is_hidden(points, eyes):
    """Whether a triangle of the room lies between points and eyes (n, 3), in float64."""
    mesh = furnished_room().mesh
    hidden = np.zeros(len(points), np.bool_)
    way = eyes - points
    for a, b, c in mesh.vertices.astype(np.float64)[mesh.faces]:
        across = np.cross(way, c - a)
        determinant = across @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ni,ni->n", points - a, across) / determinant
            q = np.cross(points - a, b - a)
            v, t = np.einsum("ni,ni->n", way, q) / determinant, q @ (c - a) / determinant
            hidden |= (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-4) & (t < 0.9999)
    return hidden


@pytest.mark.parametrize("camera", [PLAIN, BENT, WIDE], ids=lambda camera: camera.model)
@pytest.mark.parametrize(("name", "other"), [("", 2), ("_backward", 0)])
def test_flow_and_occlusion_are_those_of_the_rows_that_see_the_points(camera, name, other):
    seen = layers(camera, "position", f"flow{name}", f"occlusion{name}")
    points = seen["position"].reshape(-1, 3).astype(np.float64)
    places, eyes = places_row_by_row(camera, PATH[other], points)
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    expected = places - np.column_stack([u.ravel(), v.ravel()])
    told = seen[f"flow{name}"].reshape(-1, 2)
    size = (camera.width, camera.height)
    inside = ((places >= 0) & (places <= size)).all(axis=1)
    off = np.linalg.norm(told - expected, axis=1)
    assert inside.mean() > 0.4 and np.nanpercentile(off[inside], 99) <= 0.05
    state = seen[f"occlusion{name}"].ravel()
    right = np.where(inside, np.where(is_hidden(points, eyes), HIDDEN, VISIBLE), OUTSIDE)
    assert (right == HIDDEN).any() and (right == OUTSIDE).any()
    assert (state == right).mean() >= 0.999


@pytest.mark.parametrize("camera", [PLAIN, WIDE], ids=lambda camera: camera.model)
def test_normals_and_incidence_turn_by_the_pose_of_their_row(camera):
    names = ("normals", "normals_world", "shading_normals", "shading_normals_world", "incidence", "position", "instance")
    seen = layers(camera, *names)
    rows = poses_of_rows(camera, PATH[1])
    rotations = np.stack([rotation_from_quaternion(there.orientation) for there in rows])
    eyes = np.array([there.position_m for there in rows], np.float64)
    hit = np.isfinite(seen["incidence"])
    # Every surface of the room looks along an axis.
    np.testing.assert_allclose(np.abs(seen["normals_world"]).max(axis=-1)[hit], 1.0, atol=1e-6)
    for kind in ("normals", "shading_normals"):
        np.testing.assert_allclose(np.einsum("rij,rcj->rci", rotations, seen[kind]), seen[f"{kind}_world"], atol=2e-5)
    np.testing.assert_allclose(seen["shading_normals_world"][hit], seen["normals_world"][hit], atol=2e-5)
    way = eyes[:, None] - seen["position"]
    cosine = (way * seen["normals_world"]).sum(axis=-1) / np.linalg.norm(way, axis=-1)
    np.testing.assert_allclose(np.cos(seen["incidence"])[hit], cosine[hit], atol=1e-5)
