"""Footprints of nodes: which of them see from a place that is drawn, and where that lies."""

import numpy as np
import pytest
from box_room import quad, scene

from renderer.irradiance_cache.atlas import build_atlas
from renderer.irradiance_cache.charts import find_charts
from renderer.irradiance_cache.footprints import changes_within, measure_nodes

SPACING_M, WIDTH_M = 0.1, 0.03
SLATS = [quad((0.0, 0.0, 0.05 * i), (40.0, 0.0, 0.0), (0.0, WIDTH_M, 0.0)) for i in range(5)]
TABLE = quad((0.0, 1.0, 0.0), (2.0, 0.0, 0.0), (0.0, 2.0, 0.0))


def laid(flat, near=False, key=1):
    """An atlas of two-sided triangles before and after its places are drawn."""
    charts = find_charts(flat.mesh, flat.face_part)
    count = len(flat.face_part)
    before, after = (build_atlas(flat.mesh, flat.face_part, charts, np.zeros(count, np.bool_), SPACING_M) for _ in range(2))
    measure_nodes(after, flat.mesh, charts.area, changes_within(after, np.full(count, near)), np.uint32(key))
    return before, after, charts


def test_places_on_narrow_things_are_even_from_rim_to_rim():
    """A row of nodes amid each slat sees from everywhere on it: places have the mean, and the spread, of its width."""
    _, atlas, charts = laid(scene(*SLATS))
    across, along = atlas.position[:, 1] / WIDTH_M, atlas.position[:, 0]
    assert len(across) > 3000 and atlas.area.sum() == pytest.approx(2 * charts.area.sum(), rel=1e-5)
    assert np.average(across, weights=atlas.area) == pytest.approx(0.5, abs=0.02)
    assert np.average((across - 0.5) ** 2, weights=atlas.area) == pytest.approx(1 / 12, rel=0.05)
    # Light that changes along them keeps its mean, too.
    assert np.average(np.cos(3.0 * along), weights=atlas.area) == pytest.approx(np.sin(120.0) / 120.0, abs=0.02)


def test_a_place_lies_on_its_triangle_and_looks_as_it_does_from_both_sides():
    flat = scene(*SLATS)
    before, atlas, _ = laid(flat)
    corners = flat.mesh.vertices.astype(float)[flat.mesh.faces[atlas.face]]
    shares = np.column_stack([1.0 - atlas.weight.sum(axis=1), atlas.weight])
    np.testing.assert_allclose(np.einsum("nc,ncx->nx", shares, corners), atlas.position, atol=1e-5)
    np.testing.assert_allclose(atlas.normal, before.normal, atol=1e-6)
    fronts = np.flatnonzero(atlas.back >= 0)
    assert len(fronts) and np.array_equal(atlas.position[atlas.back[fronts]], atlas.position[fronts])
    # Within its footprint: between the nodes beside it.
    assert np.abs(atlas.position - before.position)[:, 0].max() <= SPACING_M


def test_nodes_of_wide_regions_stay_where_they_are_unless_narrow_shadows_are_near():
    still, moved = laid(scene(TABLE)), laid(scene(TABLE), near=True)
    assert np.array_equal(still[1].position, still[0].position) and (still[1].area > 0.0).all()
    assert (np.abs(moved[1].position - moved[0].position).max(axis=1) > 0.0).mean() > 0.99
    np.testing.assert_allclose(moved[1].area, still[1].area, rtol=0.2)


def test_places_depend_on_the_key_alone():
    flat = scene(*SLATS)
    first, again, other = (laid(flat, key=key)[1].position for key in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
