"""What the views of a room show: how much of a picture its largest plane fills, and how many things are in it."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.sampled_rooms import camera_of
from renderer import FlatScene, RenderConfig, Renderer
from renderer.camera.cameras import pose_camera
from scene_description import CameraPose

SIZE = (64, 48)
LAYERS = ("depth", "normals", "instance")
LEAST_SHARE = 0.0005
"""Of a picture's pixels, from which a thing counts as seen."""
NEAR_M = 0.8

_ALIKE_COSINE, _ALIKE_M, _CANDIDATES = 0.995, 0.03, 4


class View(NamedTuple):
    """Of one view: shares of its largest plane and of what is nearer than 0.8 m, how many things, median depth in m."""

    plane: float
    near: float
    things: int
    depth_m: float


def judge_views(flat: FlatScene, path: tuple[CameraPose, ...]) -> list[View]:
    """Return what each pose of a path shows; primary rays only."""
    camera = camera_of(SIZE)
    with Renderer(flat, camera, RenderConfig(threads=1), 0) as renderer:
        return [_judge(renderer.render(pose, index, LAYERS).layers, pose_camera(camera, pose).focal_px) for index, pose in enumerate(path)]


def _judge(layers: dict[str, NDArray[Any]], focal_px: float) -> View:
    depth, normals = layers["depth"].astype(np.float64), layers["normals"].astype(np.float64)
    _, counts = np.unique(layers["instance"][layers["instance"] > 0], return_counts=True)
    return View(
        largest_plane(depth, normals, focal_px),
        float((depth < NEAR_M).mean()),
        int((counts >= LEAST_SHARE * depth.size).sum()),
        float(np.median(depth)),
    )


def largest_plane(depth: NDArray[np.float64], normals: NDArray[np.float64], focal_px: float) -> float:
    """Return the share of an image (h, w), metres along z, (h, w, 3), optical frame, whose points lie in one plane, the largest."""
    height, width = depth.shape
    rows, columns = np.indices(depth.shape)
    points = np.stack([(columns - 0.5 * (width - 1)) / focal_px, (rows - 0.5 * (height - 1)) / focal_px, np.ones(depth.shape)], axis=-1)
    hit = np.isfinite(depth) & normals.any(axis=2)
    points, directions = points[hit] * depth[hit][:, None], normals[hit]
    offsets = (points * directions).sum(axis=1)
    cells = np.column_stack([np.rint(directions * 8.0), np.rint(offsets * 10.0)]).astype(int)
    _, first, counts = np.unique(cells, axis=0, return_index=True, return_counts=True)
    most = 0
    for at in first[np.argsort(-counts)[:_CANDIDATES]]:
        same = (directions @ directions[at] > _ALIKE_COSINE) & (np.abs(offsets - offsets[at]) < _ALIKE_M)
        most = max(most, int(same.sum()))
    return most / depth.size
