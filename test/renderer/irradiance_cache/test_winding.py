"""Bodies that overlap themselves: the underside of a bowl that is deeper than its rim is high is seen from behind."""

import numpy as np
from box_room import Piece, box, scene

from renderer.irradiance_cache.charts import find_charts
from renderer.irradiance_cache.winding import seen_from_behind


def deep_bowl(depth):
    """A square slab, 1 m high, with a square bowl of 0.6 m in its top: one closed body whose bowl may reach through its underside."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    rings = [(0.5, 0.0), (0.5, 1.0), (0.3, 1.0), (0.3, 1.0 - depth)]
    points = np.concatenate([np.column_stack([half * square, np.full(4, z)]) for half, z in rings])
    faces = [(0, 2, 1), (0, 3, 2), (12, 13, 14), (12, 14, 15)]
    for ring in range(3):
        for i in range(4):
            a, b = 4 * ring + i, 4 * ring + (i + 1) % 4
            faces += [(a, b, b + 4), (a, b + 4, a + 4)]
    return Piece(points, np.array(faces))


def behind(piece):
    flat = scene(piece)
    charts = find_charts(flat.mesh, flat.face_part)
    assert charts.closed.all()
    return seen_from_behind(flat.mesh, charts, np.ones(len(charts.closed), np.bool_))


def test_nobody_sees_a_plain_body_from_behind():
    assert not behind(box((0, 0, 0), (1, 2, 3))).any() and not behind(deep_bowl(0.5)).any()


def test_the_underside_of_a_bowl_that_reaches_through_it_is_seen_from_behind():
    found = behind(deep_bowl(1.5))
    assert found[:2].all(), "the slab's underside, which the bowl's opening shows from above"
    assert not found[12:].all()
