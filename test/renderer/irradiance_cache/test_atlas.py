"""The atlas: where nodes lie, what part they serve, and what is looked up between them."""

import numpy as np
import pytest
from box_room import Piece, box, hollow_sphere, quad, scene

from renderer.core.kernel import from_python
from renderer.irradiance_cache import atlas as at
from renderer.irradiance_cache.charts import DEGENERATE, find_charts
from renderer.irradiance_cache.footprints import measure_nodes
from renderer.path import light_nodes as nd

find_nodes, has_back = from_python(nd.find_nodes), from_python(nd.has_back)

TURNED = np.linalg.qr(np.array([[2.0, 1, 0], [0.3, 1, 1], [1, 0, 2]]))[0]
RIM = [quad((0, 0, 0), (3, 0, 0), (0, 0.3, 0)), quad((0, 0.3, 0), (0.3, 0, 0), (0, 2, 0)), quad((2.7, 0.3, 0), (0.3, 0, 0), (0, 2, 0))]


def built(*pieces, spacing=0.1, one_sided=None):
    flat = scene(*pieces)
    charts = find_charts(flat.mesh, flat.face_part)
    one_sided = charts.closed if one_sided is None else np.array(one_sided)
    return flat, charts, measured(flat, charts, one_sided, spacing)


def measured(flat, charts, one_sided, spacing):
    atlas = at.build_atlas(flat.mesh, flat.face_part, charts, one_sided, spacing)
    measure_nodes(atlas, flat.mesh, charts.area, np.zeros(len(charts.area), np.bool_), np.uint32(0))
    return atlas


def smooth_sphere(rings):
    """A ball that is shaded smoothly."""
    flat = scene(hollow_sphere(rings))
    normals = -flat.mesh.vertices / np.maximum(np.linalg.norm(flat.mesh.vertices, axis=1, keepdims=True), 1e-6)
    return flat._replace(mesh=flat.mesh._replace(normals=normals.astype(np.float32)))


def around(atlas, face, u, v, front=True):
    nodes, weights = np.zeros(4, np.int32), np.zeros(4, np.float32)
    count = find_nodes(atlas, face, np.float32(u), np.float32(v), front, nodes, weights)
    return nodes[:count], weights[:count].astype(float)


def points(flat, count=300, seed=1):
    """Points on the triangles of a scene: triangle, weights of its second and third corner, place."""
    rng = np.random.default_rng(seed)
    face = rng.integers(0, len(flat.face_part), count)
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    corners = flat.mesh.vertices.astype(float)[flat.mesh.faces[face]]
    return face, u, v, np.einsum("nc,ncx->nx", np.column_stack([1 - u - v, u, v]), corners)


U_SHAPE = Piece(
    np.concatenate([piece.vertices for piece in RIM]) @ TURNED.T, np.concatenate([piece.faces + 4 * i for i, piece in enumerate(RIM)])
)
"""Three strips, turned in space; the two arms share no edge with the first, so each strip is a chart of its own."""
SLIVERS = Piece(
    np.array([(0, 0, 0), (2, 0, 0), (2, 0.01, 0), (0, 0.01, 0), (1, 1.5, 0)]) @ TURNED.T, np.array([(0, 1, 2), (0, 2, 3), (3, 2, 4)])
)
SHAPES = {"box": box((0, 0, 0), (1, 2, 0.03)), "u": U_SHAPE, "slivers": SLIVERS, "facets": hollow_sphere(6)}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("spacing", [0.03, 0.1, 0.5])
def test_nodes_lie_on_their_triangles_and_serve_their_own_part(shape, spacing):
    other = box((5, 5, 5), (6, 6, 6))
    flat, charts, atlas = built(SHAPES[shape], other, spacing=spacing)
    u, v = atlas.weight.T.astype(float)
    assert (u > -1e-6).all() and (v > -1e-6).all() and (u + v < 1 + 1e-6).all()
    corners = flat.mesh.vertices.astype(float)[flat.mesh.faces[atlas.face]]
    np.testing.assert_allclose(atlas.position, np.einsum("nc,ncx->nx", np.column_stack([1 - u - v, u, v]), corners), atol=1e-5)
    for face, s, t, _ in zip(*points(flat), strict=True):
        if charts.face_chart[face] == DEGENERATE:
            continue
        nodes, weights = around(atlas, face, s, t)
        assert weights.sum() == pytest.approx(1.0, abs=2e-5) and (weights >= 0).all()
        assert (flat.face_part[atlas.face[nodes]] == flat.face_part[face]).all()
        assert charts.face_chart[face] < 0 or (charts.face_chart[atlas.face[nodes]] == charts.face_chart[face]).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_shares_of_the_surface_sum_to_its_area(shape):
    _, charts, atlas = built(SHAPES[shape])
    backs = np.isin(np.arange(len(atlas.face)), atlas.back)
    assert atlas.area[~backs].sum() == pytest.approx(charts.area.sum(), rel=1e-5)
    assert np.array_equal(atlas.area[backs], atlas.area[atlas.back >= 0])


def test_nodes_of_a_rectangle_have_equal_shares_but_for_its_rim():
    wall = scene(quad((0, 0, 0), (2.13, 0, 0), (0, 0, 1.57)))
    charts = find_charts(wall.mesh, wall.face_part)
    atlas = measured(wall, charts, np.ones(2, np.bool_), 0.1)
    inner = (np.abs(atlas.position[:, 0] - 1.065) < 0.9) & (np.abs(atlas.position[:, 2] - 0.785) < 0.6)
    np.testing.assert_allclose(atlas.area[inner], atlas.area[inner].mean(), rtol=0.04)


def test_nodes_lie_as_close_as_is_asked_for_each_triangle():
    flat = scene(quad((0, 0, 0), (2, 0, 0), (0, 0, 1)), quad((0, 1, 0), (2, 0, 0), (0, 0, 1)))
    charts = find_charts(flat.mesh, flat.face_part)
    atlas = at.build_atlas(flat.mesh, flat.face_part, charts, np.ones(4, np.bool_), np.where(flat.face_part == 0, 0.1, 0.05))
    coarse, fine = np.bincount(flat.face_part[atlas.face])
    assert fine == pytest.approx(4 * coarse, rel=0.1)


def test_what_is_linear_over_a_rectangle_is_looked_up_exactly_but_for_its_rim():
    piece = quad((0, 0, 0), (1.3, 0, 0), (0, 0.7, 0))
    flat, _, atlas = built(piece._replace(vertices=piece.vertices @ TURNED.T))
    slope = np.array([2.0, -1.0, 0.5])
    value = atlas.position.astype(float) @ slope
    for face, u, v, place in zip(*points(flat), strict=True):
        nodes, weights = around(atlas, face, u, v)
        x, y, _ = place @ TURNED
        rim = min(x, y, 1.3 - x, 0.7 - y) < 0.25 * 0.1
        assert weights @ value[nodes] == pytest.approx(place @ slope, abs=0.25 * 0.1 * np.abs(slope).sum() if rim else 2e-5)


def test_nodes_are_as_far_apart_as_asked():
    _, _, atlas = built(quad((0, 0, 0), (1.0, 0, 0), (0, 0.5, 0)), spacing=0.1)
    front = atlas.back >= 0
    assert front.sum() == 11 * 6
    xs = np.unique(atlas.position[front, 0].round(4))
    np.testing.assert_allclose(np.diff(xs), (1.0 - 2 * 0.25 * 0.1) / 10, atol=1e-4)


def test_only_what_is_seen_from_behind_has_nodes_there():
    flat, _, atlas = built(quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), box((2, 0, 0), (3, 1, 1)))
    seen = np.flatnonzero(atlas.back >= 0)
    assert (flat.face_part[atlas.face[seen]] == 0).all() and len(seen) == (flat.face_part[atlas.face] == 0).sum() / 2
    np.testing.assert_array_equal(atlas.normal[atlas.back[seen]], -atlas.normal[seen])
    np.testing.assert_array_equal(atlas.position[atlas.back[seen]], atlas.position[seen])
    assert [bool(has_back(atlas, face)) for face in (0, 1, 2, 13)] == [True, True, False, False]
    nodes, weights = around(atlas, 0, 0.3, 0.2, front=False)
    assert weights.sum() == pytest.approx(1.0) and set(nodes) <= set(atlas.back[seen])
    assert len(around(atlas, 2, 0.3, 0.2, front=False)[0]) == 0


def test_curved_surfaces_are_looked_up_at_their_corners():
    flat = smooth_sphere(32)
    charts = find_charts(flat.mesh, flat.face_part)
    atlas = measured(flat, charts, np.ones(len(flat.face_part), np.bool_), 0.07)
    face, u, v, place = points(flat)
    sound = charts.area[face] > 1e-6
    for f, s, t, p in zip(face[sound], u[sound], v[sound], place[sound], strict=True):
        nodes, weights = around(atlas, f, s, t)
        np.testing.assert_allclose(weights, [1 - s - t, s, t], atol=1e-6)
        np.testing.assert_allclose(weights @ atlas.normal[nodes], -p, atol=0.05)
    assert atlas.area.sum() == pytest.approx(charts.area.sum(), rel=1e-5)
    np.testing.assert_allclose(np.linalg.norm(atlas.normal, axis=1), 1.0, atol=1e-6)


def test_light_within_a_large_triangle_of_a_curved_surface_is_looked_up_there():
    """A ball of eight rings, whose triangles are much longer than the steps between nodes."""
    flat = smooth_sphere(8)
    charts = find_charts(flat.mesh, flat.face_part)
    atlas = measured(flat, charts, np.ones(len(flat.face_part), np.bool_), 0.05)
    face, u, v, place = points(flat)
    sound = charts.area[face] > 1e-3
    assert (atlas.cells[face[sound], 3] == nd.STRIP).all()
    for f, s, t, p in zip(face[sound], u[sound], v[sound], place[sound], strict=True):
        nodes, weights = around(atlas, f, s, t)
        assert weights.sum() == pytest.approx(1.0, abs=1e-5) and (weights >= 0).all()
        assert np.linalg.norm(weights @ atlas.position[nodes].astype(float) - p) < 0.05
    assert atlas.area.sum() == pytest.approx(charts.area.sum(), rel=1e-5)
    # Where two triangles meet, both read the same.
    first, second = 66, 66 + len(flat.face_part) // 2
    assert (flat.mesh.vertices[flat.mesh.faces[first, 1:]] == flat.mesh.vertices[flat.mesh.faces[second][[0, 2]]]).all()
    for t in np.linspace(0.05, 0.95, 19):
        one, other = around(atlas, first, 1 - t, t), around(atlas, second, 0.0, t)
        here, there = (weights @ atlas.normal[nodes] for nodes, weights in (one, other))
        np.testing.assert_allclose(here, there, atol=0.05)


def slat():
    """A slat along y, 1.5 m long, 25 mm wide and bent, of four strips that are shaded smoothly."""
    turn = np.linspace(-0.6, 0.6, 5)
    profile = np.column_stack([np.sin(turn), np.zeros(5), np.cos(turn)])
    rows = 0.022 * profile[:, None] + np.array([(0, -0.75, 0), (0, 0.75, 0)])
    corners = np.concatenate([[rows[i, 0], rows[i + 1, 0], rows[i + 1, 1], rows[i, 1]] for i in range(4)])
    flat = scene(
        Piece(corners, np.array([[(4 * i, 4 * i + 1, 4 * i + 2), (4 * i, 4 * i + 2, 4 * i + 3)] for i in range(4)]).reshape(-1, 3))
    )
    normals = flat.mesh.vertices * (1, 0, 1)
    return flat._replace(mesh=flat.mesh._replace(normals=(normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)))


@pytest.mark.parametrize("spacing", [0.03, 0.1])
def test_light_that_changes_along_a_slat_is_looked_up_where_it_changes(spacing):
    flat = slat()
    charts = find_charts(flat.mesh, flat.face_part)
    atlas = measured(flat, charts, np.ones(len(flat.face_part), np.bool_), spacing)
    for face, u, v, place in zip(*points(flat), strict=True):
        nodes, weights = around(atlas, face, u, v)
        assert weights.sum() == pytest.approx(1.0, abs=1e-5)
        assert np.abs(weights @ atlas.position[nodes].astype(float) - place).max() < spacing
        assert weights @ atlas.normal[nodes] @ (place * (1, 0, 1)) > 0.85 * 0.022
    assert atlas.area.sum() == pytest.approx(charts.area.sum(), rel=1e-5)
    fifths = np.histogram(atlas.position[:, 1], 5, (-0.75, 0.75), weights=atlas.area)[0] / atlas.area.sum()
    np.testing.assert_allclose(fifths, 0.2, atol=0.1)


def test_a_valid_node_a_few_steps_away_stands_in_for_a_node_in_the_dark():
    _, _, atlas = built(quad((0, 0, 0), (2.0, 0, 0), (0, 0.01, 0)), spacing=0.1, one_sided=[True, True])
    order = np.argsort(atlas.position[:, 0])[:, None]
    assert len(order) == 21
    valid = np.ones(order.size, np.bool_)
    valid[order[4:14]] = False
    other = at.stand_in(atlas.cells, atlas.grid, valid, 3)
    assert (other[valid] == np.flatnonzero(valid)).all()
    # Three on either side are near enough, whatever the order of nodes; those between them are not.
    for near, by in ((order[4:7], order[3]), (order[11:14], order[14])):
        assert np.isin(other[near], by).all()
    assert (other[order[7:11]] == order[7:11]).all()
    assert (at.stand_in(atlas.cells, atlas.grid, np.zeros_like(valid), 3) == np.arange(order.size)).all()
