"""Which side of a window pane things are on, and that no node serves both."""

import numpy as np
import pytest
from box_room import box, pierced, quad, scene
from cached_rooms import solved
from sunny_window import MATT, PANE

from renderer.core.kernel import from_python
from renderer.irradiance_cache.cache_geometry import CacheConfig
from renderer.irradiance_cache.panes import before_panes, find_panes
from renderer.path import light_nodes as nd

find_nodes = from_python(nd.find_nodes)


def test_places_before_and_behind_a_pane_are_told_apart():
    panes = find_panes(scene(quad((5, 5, 5), (1, 0, 0), (0, 1, 0)), PANE))
    assert panes.part.tolist() == [1]
    np.testing.assert_allclose(panes.inward, [[0, -1, 0]], atol=1e-6)
    place = np.array([(0, -0.1, 1.5), (0.4, 0.2, 1.2), (0, -0.5, 1.5), (0, 0.1, 4)])
    np.testing.assert_allclose(before_panes(panes, place), [0.1, -0.2, np.nan, np.nan], atol=1e-6)
    assert np.isnan(before_panes(panes, place)).tolist() == [False, False, True, True]


@pytest.mark.parametrize("depth_m", [0.028, 0.3])
@pytest.mark.parametrize("bent", [False, True])
def test_the_flank_of_a_window_frame_has_nodes_on_both_sides_of_the_pane(depth_m, bent):
    """A glazing bar that the pane crosses, flat or shaded smoothly: what is looked up before the pane lies before it."""
    shell = pierced(box((-2, -3, 0), (2, 0, 2.5), inside=True, object_id=0, **MATT), (-0.5, 1.0), (0.5, 2.0))
    bar = box((-0.02, -0.4 * depth_m, 1.0), (0.02, 0.6 * depth_m, 2.0), object_id=2, **MATT)
    flat = scene(shell, PANE, bar)
    if bent:
        normals, of_bar = flat.mesh.normals.copy(), np.unique(flat.mesh.faces[flat.face_part == 2])
        normals[of_bar] += (0.3, 0.0, 0.0)
        normals[of_bar] /= np.linalg.norm(normals[of_bar], axis=1, keepdims=True)
        flat = flat._replace(mesh=flat.mesh._replace(normals=normals.astype(np.float32)))
    with solved(flat, CacheConfig(), is_solved=False) as cache:
        cache.geometry.link(cache._scene, cache._memory)
        nodes, weights = np.zeros(4, np.int32), np.zeros(4, np.float32)
        for face in np.flatnonzero(flat.face_part == 2):
            corners = flat.mesh.vertices[flat.mesh.faces[face]].astype(float)
            if np.ptp(corners[:, 1]) < 0.9 * depth_m or np.ptp(corners[:, 2]) < 0.9:
                continue
            for u, v in np.random.default_rng(1).dirichlet(np.ones(3), 50)[:, 1:]:
                y = (corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]))[1]
                count = find_nodes(cache.coarse, face, np.float32(u), np.float32(v), True, nodes, weights)
                assert (weights[:count] @ cache.coarse.position[nodes[:count], 1] < 0) == (y < 0) or abs(y) < 0.05 * depth_m
