"""Points of a room from its depth images, each with the frames that see it: what structure from motion would find, without its errors.

Every cell of an image that shows no point yet gives one, at the depth of its middle pixel.  A point is seen by a later frame if it
projects into it and the depth there says that nothing stands before it.  Frames are taken one after the other, so memory holds the
points and no images.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description import CameraPose
from scene_description.products import matmul
from scene_synth_ros.convert.camera import Lens, camera_from_world, world_from_camera

CELL_PX = 16
"""Side of the cells."""
_NEAR_M, _SHARE = 0.005, 0.005
"""How far, in metres and as a share of the distance, a point may lie behind the depth of its pixel and still be the surface there."""


class Cells(NamedTuple):
    """The middle pixels of a lens's cells: column, row (n, 2) int, and the directions seen there (n, 3), optical frame, z = 1."""

    pixels: NDArray[np.int64]
    rays: NDArray[np.float64]


class Glimpse(NamedTuple):
    """What a frame adds: its lens and pose, depth (height, width) float32, and its cells' points (n, 3), map, colours (n, 3) uint8."""

    lens: Lens
    pose: CameraPose
    depth_m: NDArray[np.float32]
    pixels: NDArray[np.int64]
    points_m: NDArray[np.float64]
    colors: NDArray[np.uint8]


class Seen(NamedTuple):
    """What a frame sees: indices of points (n,), and their exact pixels (n, 2), pixel centres at integers."""

    points: NDArray[np.int64]
    pixels: NDArray[np.float64]


def cells_of(lens: Lens) -> Cells:
    """Return the cells of a lens; those whose middle sees nothing, or not ahead, are left out."""
    columns, rows = (np.arange(min(CELL_PX, size) // 2, size, CELL_PX) for size in (lens.width, lens.height))
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    rays = lens.directions(pixels.astype(np.float64))
    with np.errstate(invalid="ignore", divide="ignore"):
        ahead = rays[:, 2] > 1e-6
        rays = rays / rays[:, 2:]
    return Cells(pixels[ahead], rays[ahead])


def glimpse(lens: Lens, cells: Cells, pose: CameraPose, depth_m: NDArray[np.float32], color: NDArray[np.uint8]) -> Glimpse:
    """Return what a frame has to add, given its depth (height, width) float32 and colour (height, width, 3) uint8."""
    columns, rows = cells.pixels.T
    depth = depth_m[rows, columns].astype(np.float64)
    with np.errstate(invalid="ignore"):
        there = np.isfinite(depth) & (depth > 0.0)
    matrix = world_from_camera(pose)
    optical = cells.rays[there] * depth[there, None]
    points = matmul(optical, matrix[:3, :3].T) + matrix[:3, 3]
    return Glimpse(lens, pose, depth_m, cells.pixels[there], points, color[rows[there], columns[there]])


class SparsePoints:
    """The points of one room, and what each frame sees of them, in the order in which frames are added.

    Attributes:
        points_m: (n, 3) float64, map.
        colors: (n, 3) uint8.
        seen: of every frame.
    """

    def __init__(self) -> None:
        self.points_m: NDArray[np.float64] = np.zeros((0, 3))
        self.colors: NDArray[np.uint8] = np.zeros((0, 3), np.uint8)
        self.seen: list[Seen] = []

    def add(self, frame: Glimpse) -> None:
        """Take the next frame."""
        known = _visible(self.points_m, frame)
        width = -(-frame.lens.width // CELL_PX)
        shown = np.unique((known.pixels[:, 1] // CELL_PX).astype(np.int64) * width + (known.pixels[:, 0] // CELL_PX).astype(np.int64))
        cell = (frame.pixels[:, 1] // CELL_PX) * width + frame.pixels[:, 0] // CELL_PX
        fresh = ~np.isin(cell, shown)
        first = len(self.points_m)
        self.points_m = np.concatenate([self.points_m, frame.points_m[fresh]])
        self.colors = np.concatenate([self.colors, frame.colors[fresh]])
        numbers = np.concatenate([known.points, np.arange(first, len(self.points_m))])
        self.seen.append(Seen(numbers, np.concatenate([known.pixels, frame.pixels[fresh].astype(np.float64)])))


def _visible(points_m: NDArray[np.float64], frame: Glimpse) -> Seen:
    """Return which points a frame sees."""
    matrix = camera_from_world(frame.pose)
    optical = matmul(points_m, matrix[:3, :3].T) + matrix[:3, 3]
    numbers = np.flatnonzero(optical[:, 2] > 0.0)
    pixels = frame.lens.project(optical[numbers])
    height, width = frame.depth_m.shape
    with np.errstate(invalid="ignore"):
        inside = np.all((pixels > -0.5) & (pixels < (width - 0.5, height - 0.5)), axis=1)
    numbers, pixels = numbers[inside], pixels[inside]
    columns, rows = np.rint(pixels).astype(np.int64).T
    z, depth = optical[numbers, 2], frame.depth_m[rows, columns]
    with np.errstate(invalid="ignore"):
        surface = np.abs(depth - z) <= _NEAR_M + _SHARE * z
    return Seen(numbers[surface], pixels[surface])
