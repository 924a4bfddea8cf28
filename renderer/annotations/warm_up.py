"""Loads the kernels of annotations before the first frame wants them."""

from __future__ import annotations

import numpy as np

from renderer.annotations.pixels import empty_tally, find_hidden, tally_cover, tally_ids
from renderer.annotations.run_lengths import mask_of
from renderer.camera.camera_rays import CENTRE
from renderer.camera.cameras import pose_camera
from renderer.camera.config import CameraConfig
from renderer.core.embree import EmbreeScene, make_packet
from scene_description.types import CameraPose


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
