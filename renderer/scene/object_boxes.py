"""Boxes of objects as affine maps: where a point lies in the box of what it belongs to, from (0, 0, 0) to (1, 1, 1).

These are the normalised object coordinates (NOCS) of Wang et al., "Normalized Object Coordinate Space for Category-Level 6D Object Pose and
Size Estimation" (CVPR 2019), but each axis is scaled by itself: x from the object's back to its front, y from its right to its left, z up.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.core.arrays import Array
from renderer.geometry.mesh import Mesh
from renderer.scene.room_shell import wall_frame
from scene_description import Opening, Room, SceneObject
from scene_description.products import matmul

THINNEST_M = 0.0005
"""Least size of a box about an opening: a pane may be flat."""


def object_box(thing: SceneObject) -> NDArray[np.float32]:
    """Return the map (3, 4) from the world to an object's box."""
    cosine, sine = math.cos(thing.yaw_rad), math.sin(thing.yaw_rad)
    axes = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    size = np.asarray(thing.size_m)
    return _map(axes, matmul(axes, np.asarray(thing.position_m)) - size * (0.5, 0.5, 0.0), size)


class OpeningExtent(NamedTuple):
    """The tightest box about a door or window, whose x axis points into the room.

    axes: (3, 3), unit vectors of the world, row by row; low, size: (3,), metres along them, no size less than ``THINNEST_M``.
    """

    axes: Array
    low: Array
    size: Array


def opening_extent(room: Room, opening: Opening, points: Array) -> OpeningExtent:
    """Return the box about the vertices (n, 3) of an opening: its description tells width and height only."""
    _, along, inward, _ = wall_frame(np.asarray(room.polygon_m, np.float64), opening.wall)
    axes = np.array([[inward[0], inward[1], 0.0], [-along[0], -along[1], 0.0], [0.0, 0.0, 1.0]])
    places = matmul(points, axes.T)
    low, high = places.min(axis=0), places.max(axis=0)
    thin = high - low < THINNEST_M
    low = np.where(thin, 0.5 * (low + high - THINNEST_M), low)
    return OpeningExtent(axes, low, np.where(thin, THINNEST_M, high - low))


def opening_box(room: Room, opening: Opening, meshes: Sequence[Mesh]) -> NDArray[np.float32]:
    """Return the map (3, 4) from the world to the box about a door or window."""
    return _map(*opening_extent(room, opening, np.concatenate([mesh.vertices for mesh in meshes]).astype(np.float64)))


def room_box(room: Room) -> NDArray[np.float32]:
    """Return the map (3, 4) from the world to the box about the inner faces of a room."""
    polygon = np.asarray(room.polygon_m, np.float64)
    low = np.array([*polygon.min(axis=0), 0.0])
    return _map(np.eye(3), low, np.array([*polygon.max(axis=0), room.height_m]) - low)


def _map(axes: NDArray[np.float64], low: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.column_stack([axes / size[:, None], -low / size]).astype(np.float32)
