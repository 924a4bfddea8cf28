"""The window panes of a scene, and which side of them things are on."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.scene.flat_scene import FlatScene

_NEAR_M = 0.35
"""What lies no farther from a pane along all axes is near it, as its frame and the window's recess are."""


class Panes(NamedTuple):
    """The p window panes of a scene, float32: lengths in metres, world.

    part: (p,) int32; middle, inward: (p, 3), and the unit normal into the room; low, high: (p, 3), corners of the box of what is near.
    """

    part: NDArray[np.int32]
    middle: NDArray[np.float32]
    inward: NDArray[np.float32]
    low: NDArray[np.float32]
    high: NDArray[np.float32]


NO_PANES = Panes(np.zeros(0, np.int32), *(np.zeros((0, 3), np.float32) for _ in range(4)))


def find_panes(flat: FlatScene) -> Panes:
    """Return the panes of a scene."""
    part = np.intersect1d(np.flatnonzero(flat.parts.portal), flat.face_part)
    middle, inward, low, high = np.zeros((4, len(part), 3))
    for i in range(len(part)):
        corners = flat.mesh.vertices[flat.mesh.faces[flat.face_part == part[i]]].astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
        middle[i], inward[i] = corners.mean(axis=(0, 1)), cross / max(np.sqrt((cross * cross).sum()), 1e-12)
        low[i], high[i] = corners.min(axis=(0, 1)) - _NEAR_M, corners.max(axis=(0, 1)) + _NEAR_M
    return Panes(part.astype(np.int32), *(field.astype(np.float32) for field in (middle, inward, low, high)))


def before_panes(panes: Panes, position: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return how far positions (n, 3) lie before the pane that is near, metres, less than 0 behind it; NaN where none is near."""
    before = np.full(len(position), np.nan)
    for _, middle, inward, low, high in zip(*panes, strict=True):
        near = ((position > low) & (position < high)).all(axis=1)
        before[near] = ((position[near] - middle) * inward).sum(axis=1)
    return before
