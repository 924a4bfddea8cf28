"""Boxes of openings as affine maps."""

import numpy as np
from sample_scene import sample_scene

from renderer.geometry.mesh import Mesh
from renderer.scene.object_boxes import THINNEST_M, opening_box, opening_extent
from renderer.scene.room_shell import wall_frame


def test_a_flat_pane_lies_in_the_middle_of_a_thin_box():
    room = sample_scene().room
    opening = room.openings[0]
    start, along, inward, _ = wall_frame(np.asarray(room.polygon_m), opening.wall)
    corners = np.array([[*(start + s * along), z] for s, z in ((0.2, 0.5), (1.0, 0.5), (1.0, 1.7), (0.2, 1.7))])
    axes, low, size = opening_extent(room, opening, corners)
    np.testing.assert_allclose(axes[0, :2], inward)
    np.testing.assert_allclose(size, (THINNEST_M, 0.8, 1.2), atol=1e-12)
    np.testing.assert_allclose((low + 0.5 * size) @ axes, corners.mean(axis=0), atol=1e-12)
    mesh = Mesh(corners.astype(np.float32), *[None] * (len(Mesh._fields) - 1))
    box = opening_box(room, opening, [mesh])
    np.testing.assert_allclose(corners @ box[:, :3].T + box[:, 3], [(0.5, 1, 0), (0.5, 0, 0), (0.5, 0, 1), (0.5, 1, 1)], atol=1e-3)
