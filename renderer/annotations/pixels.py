"""Kernels over pixels: which an object has, which it would cover if it were alone, and which points of the world are hidden."""

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.run_lengths import mask_of
from renderer.camera.camera_rays import CENTRE, TILE
from renderer.camera.cameras import PosedCamera, pose_camera
from renderer.camera.config import CameraConfig
from renderer.camera.shutter import aim_exposed_tile
from renderer.core import ray_packet as ray
from renderer.core.embree import EmbreeScene, SceneHandle, occluded16
from renderer.core.kernel import entry, kernel
from renderer.core.ray_packet import LANES, Packet, make_packet
from scene_description.types import CameraPose

COUNT, LEFT, TOP, RIGHT, BOTTOM = range(5)
"""Columns of a tally: how many pixels, their first and last column and row (first: the image's size, last: -1, where there are none)."""

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_SKIN_M = np.float32(0.005)


def empty_tally(rows: int, width: int, height: int) -> NDArray[np.int64]:
    """Return tallies (rows, 5) of no pixels."""
    return np.tile(np.array([0, width, height, -1, -1], np.int64), (rows, 1))


@kernel
def _add(tally: NDArray[np.int64], x: int, y: int) -> None:
    tally[COUNT] += 1
    tally[LEFT] = min(tally[LEFT], x)
    tally[TOP] = min(tally[TOP], y)
    tally[RIGHT] = max(tally[RIGHT], x)
    tally[BOTTOM] = max(tally[BOTTOM], y)


@entry
def tally_ids(instance: NDArray[np.uint16], tallies: NDArray[np.int64]) -> None:
    """Add every pixel of an instance image (height, width) to its id's row of ``tallies`` (ids, 5)."""
    height, width = instance.shape
    for y in range(height):
        for x in range(width):
            _add(tallies[instance[y, x]], x, y)


@entry
def tally_cover(
    tree: SceneHandle,
    camera: PosedCamera,
    packet: Packet,
    centre: NDArray[np.float32],
    instance: NDArray[np.uint16],
    key: int,
    tiles: NDArray[np.int64],
    tally: NDArray[np.int64],
) -> None:
    """Add the pixels that an object would cover if it were alone to ``tally`` (5,), by the primary rays of the frame.

    ``tree``: of the object alone; ``centre``: ``CENTRE``, as of ``trace_geometry``; ``instance``: (height, width), ids of the frame: pixels
    of the object's id ``key`` are covered without a ray; ``tiles``: (4,) first and last column, first and last row of those that it can
    touch.
    """
    real = packet.real
    for row in range(tiles[2] * TILE, (tiles[3] + 1) * TILE, TILE):
        for column in range(tiles[0] * TILE, (tiles[1] + 1) * TILE, TILE):
            missing = 0
            for y in range(row, min(row + TILE, camera.height)):
                for x in range(column, min(column + TILE, camera.width)):
                    missing += instance[y, x] != key
            if missing:
                aim_exposed_tile(camera, column, row, centre, packet)
                occluded16(packet.alive.ctypes.data, tree.address, real.ctypes.data, tree.coherent)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x < camera.width and y < camera.height and (instance[y, x] == key or (missing and real[ray.TFAR + k] < _ZERO)):
                    _add(tally, x, y)


@entry
def paint_cover(
    tree: SceneHandle, camera: PosedCamera, packet: Packet, centre: NDArray[np.float32], tiles: NDArray[np.int64], cover: NDArray[np.bool_]
) -> None:
    """Set in ``cover`` (height, width) the pixels that an object would cover if it were alone; arguments as of :func:`tally_cover`.

    No ray is cast where a whole tile is set already.
    """
    real = packet.real
    for row in range(tiles[2] * TILE, (tiles[3] + 1) * TILE, TILE):
        for column in range(tiles[0] * TILE, (tiles[1] + 1) * TILE, TILE):
            missing = 0
            for y in range(row, min(row + TILE, camera.height)):
                for x in range(column, min(column + TILE, camera.width)):
                    missing += not cover[y, x]
            if not missing:
                continue
            aim_exposed_tile(camera, column, row, centre, packet)
            occluded16(packet.alive.ctypes.data, tree.address, real.ctypes.data, tree.coherent)
            for k in range(LANES):
                x, y = column + (k & 3), row + (k >> 2)
                if x < camera.width and y < camera.height and real[ray.TFAR + k] < _ZERO:
                    cover[y, x] = True


@entry
def find_hidden(
    tree: SceneHandle, packet: Packet, origins: NDArray[np.float32], points: NDArray[np.float32], hidden: NDArray[np.bool_]
) -> None:
    """Say of points (n, 3) whether a surface lies between them and where they are seen from (n, 3), more than 5 mm before them."""
    real, alive = packet.real, packet.alive
    for first in range(0, len(points), LANES):
        for k in range(LANES):
            i = min(first + k, len(points) - 1)
            squared = _ZERO
            for axis in range(3):
                way = points[i, axis] - origins[i, axis]
                squared += way * way
                real[ray.ORG_X + LANES * axis + k] = origins[i, axis]
                real[ray.DIR_X + LANES * axis + k] = way
            alive[k] = -1 if first + k < len(points) else 0
            real[ray.TNEAR + k] = _ZERO
            real[ray.TFAR + k] = max(_ONE - _SKIN_M / max(np.sqrt(squared), _SKIN_M), _ZERO)
        occluded16(alive.ctypes.data, tree.address, real.ctypes.data, tree.incoherent)
        for k in range(min(LANES, len(points) - first)):
            hidden[first + k] = real[ray.TFAR + k] < _ZERO


def warm_up() -> None:
    """Compile every kernel of annotations, or load it from numba's cache, by one pixel that sees a triangle.

    Raises:
        RenderError: Embree is missing.
    """
    corners = np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], np.float32)
    pose = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=(0.0, 0.0, 0.0, 1.0))
    view, packet = pose_camera(CameraConfig(width=1, height=1), pose), make_packet()
    instance, tallies = np.zeros((1, 1), np.uint16), empty_tally(2, 1, 1)
    with EmbreeScene(corners, np.array([[0, 1, 2]], np.uint32)) as tree:
        tally_ids(instance, tallies)
        tally_cover(tree.handle, view, packet, CENTRE, instance, 1, np.zeros(4, np.int64), tallies[1])
        find_hidden(tree.handle, packet, corners, 2 * corners, np.zeros(3, np.bool_))
    mask_of(instance, 0, 0, 0)
