"""Charts of shapes whose flat regions are known; bodies that overlap themselves, whose bowl is seen from behind through the underside."""

import numpy as np
import pytest
from box_room import Piece, box, quad, scene

from renderer.geometry.mesh import Mesh
from renderer.irradiance_cache.charts import CURVED, DEGENERATE, find_charts, seen_from_behind

L_SHAPE = Piece(
    np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0), (0, 1, 0)], float),
    np.array([(0, 1, 2), (0, 2, 6), (6, 3, 4), (6, 4, 5)]),
)
"""Area 4; the triangles (0, 2, 6) and (6, 3, 4) share no edge, as that from 6 to 2 runs on beyond 3."""


def charts_of(*pieces):
    flat = scene(*pieces)
    return find_charts(flat.mesh, flat.face_part)


def tube(sides, *, smooth):
    """A mantle of radius 1 and height 1 between two caps; its vertices are split as those of all pieces are."""
    turn = np.linspace(0, 2 * np.pi, sides + 1)[:-1]
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    following = np.roll(ring, -1, axis=0)
    vertices, normals = [], []
    for a, b in zip(ring, following, strict=True):
        vertices += [(*a, 0), (*b, 0), (*b, 1), (*a, 0), (*b, 1), (*a, 1)]
        flat = (a + b) / np.linalg.norm(a + b)
        normals += [(*(a if smooth else flat), 0), *[(*(b if smooth else flat), 0)] * 2, *[(*(a if smooth else flat), 0)]]
        normals += [(*(b if smooth else flat), 0), (*(a if smooth else flat), 0)]
    for a, b in zip(ring, following, strict=True):
        vertices += [(0, 0, 1), (*a, 1), (*b, 1), (0, 0, 0), (*b, 0), (*a, 0)]
        normals += [(0, 0, 1)] * 3 + [(0, 0, -1)] * 3
    count = len(vertices)
    mesh = Mesh(
        np.array(vertices, np.float32),
        np.array(normals, np.float32),
        np.arange(count, dtype=np.uint32).reshape(-1, 3),
        np.zeros((count, 2), np.float32),
    )
    return mesh, find_charts(mesh, np.zeros(count // 3, np.int32))


def test_a_box_has_six_charts_and_is_closed():
    charts = charts_of(box((0, 0, 0), (1, 2, 3)))
    assert len(charts.normal) == 6 and charts.closed.all()
    assert sorted(np.bincount(charts.face_chart)) == [2] * 6
    np.testing.assert_allclose(np.sort(np.bincount(charts.face_chart, charts.area)), [2, 2, 3, 3, 6, 6], rtol=1e-6)


def test_frames_are_right_handed_and_keep_lengths():
    flat = scene(box((0, 0, 0), (1, 2, 3)), L_SHAPE)
    charts = find_charts(flat.mesh, flat.face_part)
    frames = np.stack([charts.along, charts.across, charts.normal], axis=1)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (8, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    corners = flat.mesh.vertices.astype(float)[flat.mesh.faces]
    np.testing.assert_allclose(
        np.linalg.norm(charts.at - np.roll(charts.at, 1, axis=1), axis=2),
        np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2),
        rtol=1e-6,
    )
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("mi,mi->m", facing, charts.normal[charts.face_chart]) > 0).all()


def test_charts_lie_along_their_outline_not_along_diagonals():
    charts = charts_of(quad((0, 0, 0), (1, 0, 0), (0, 2, 0)))
    np.testing.assert_allclose(np.abs(charts.along), [(0, 1, 0)], atol=1e-12)


def test_an_l_shape_is_joined_where_whole_edges_meet():
    charts = charts_of(L_SHAPE)
    assert charts.face_chart.tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(np.bincount(charts.face_chart, charts.area), [2, 2])


def test_smooth_mantles_are_on_no_chart_and_facets_are_one_each():
    _, charts = tube(12, smooth=True)
    assert (charts.face_chart[:24] == CURVED).all() and len(charts.normal) == 2 and charts.closed.all()
    assert set(charts.face_chart[24::2]) != set(charts.face_chart[25::2]), "the caps are two charts"
    _, charts = tube(12, smooth=False)
    assert len(charts.normal) == 12 + 2 and (charts.face_chart >= 0).all() and charts.closed.all()


def test_parts_share_no_chart_and_open_ones_are_told():
    floor = [quad((x, 0, 0), (1, 0, 0), (0, 1, 0)) for x in (0, 1)]
    charts = charts_of(*floor, box((0, 0, 1), (1, 1, 2)))
    assert charts.face_chart[:4].tolist() in ([0, 0, 1, 1], [1, 1, 0, 0])
    assert charts.closed.tolist() == [False] * 4 + [True] * 12
    lidless = box((0, 0, 0), (1, 1, 1))
    assert charts_of(lidless._replace(faces=lidless.faces[:-2])).closed.tolist() == [False] * 10


@pytest.mark.parametrize(("degrees", "count"), [(0.1, 1), (0.5, 2)])
def test_a_fold_parts_charts(degrees, count):
    rise = np.tan(np.radians(degrees))
    folded = Piece(
        np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, rise), (2, 1, rise)]),
        np.array([(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)]),
    )
    assert len(charts_of(folded).normal) == count


def test_vertices_closer_than_a_tenth_of_a_millimetre_are_one():
    def with_gap(gap):
        left, right = quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), quad((1 + gap, 0, 0), (1, 0, 0), (0, 1, 0))
        return Piece(np.concatenate([left.vertices, right.vertices]), np.concatenate([left.faces, right.faces + 4]))

    assert len(charts_of(with_gap(2e-5)).normal) == 1
    assert len(charts_of(with_gap(2e-3)).normal) == 2


def test_triangles_without_area_are_told():
    line = Piece(np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)], float), np.array([(0, 1, 2), (0, 2, 3)]))
    assert charts_of(line).face_chart.tolist() == [DEGENERATE, 0]


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
