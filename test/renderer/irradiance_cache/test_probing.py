"""Where things stand between neighbouring nodes, and which of these a hit beside them reads."""

import numpy as np
import pytest
from box_room import box, quad, scene
from cached_rooms import solved

from renderer.core.kernel import from_python
from renderer.irradiance_cache.cache_geometry import CacheConfig
from renderer.path import light_nodes as nd

find_nodes = from_python(nd.find_nodes)

FLOOR = quad((0, 0, 0), (2, 0, 0), (0, 1, 0), object_id=0)
SPACING = CacheConfig(spacing_m=0.1, coarse_spacing_m=0.25)


def cuts_of(*others):
    """The floor's cuts as (rows, columns, 2), the atlas, and where the grid's columns lie along x."""
    with solved(scene(FLOOR, *others), SPACING) as cache:
        atlas = cache.atlas
    offset, width, height = atlas.cells[0, :3]
    places = slice(offset, offset + width * height)
    return atlas.cuts[places].reshape(height, width, 2), atlas, atlas.position[atlas.grid[places], 0].reshape(height, width)[0]


def test_a_bare_floor_is_not_cut():
    assert np.isnan(cuts_of()[0]).all()
    assert np.isnan(cuts_of(box((0, 0, 0.5), (2, 1, 0.6)))[0]).all(), "a table top above it"


@pytest.mark.parametrize("thickness", [0.0, 0.002, 0.03])
def test_a_board_cuts_the_ways_across_it_at_its_middle(thickness):
    board = box((0.93, -0.1, 0), (0.93 + thickness, 1.1, 0.5)) if thickness else quad((0.93, -0.1, 0), (0, 1.2, 0), (0, 0, 0.5))
    cuts, _, x = cuts_of(board)
    order = np.argsort(x)
    before, after = order[np.searchsorted(x[order], 0.93) - 1], order[np.searchsorted(x[order], 0.93)]
    column = min(before, after)
    assert np.isnan(np.delete(cuts[..., 0], column, axis=1)).all() and np.isnan(cuts[..., 1]).all()
    met = x[column] + cuts[:, column, 0] * (x[column + 1] - x[column])
    np.testing.assert_allclose(met, 0.93 + 0.5 * thickness, atol=1e-3)


def test_a_hit_reads_the_nodes_of_its_own_side():
    _, atlas, _ = cuts_of(box((0.93, -0.1, 0), (0.935, 1.1, 0.5)))
    nodes, weights = np.zeros(4, np.int32), np.zeros(4, np.float32)
    for x in np.linspace(0.005, 1.995, 200):
        if 0.929 < x < 0.936:
            continue
        # A point of the floor's first triangle, (0, 0), (2, 0), (2, 1), at y = x / 4.
        v = 0.25 * x
        count = find_nodes(atlas, 0, np.float32(0.5 * x - v), np.float32(v), True, nodes, weights)
        assert weights[:count].sum() == pytest.approx(1.0, abs=1e-5)
        assert ((atlas.position[nodes[:count], 0] > 0.93) == (x > 0.93)).all()
