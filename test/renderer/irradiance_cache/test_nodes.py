"""Smoothing over grids: what is even stays, neighbours that are shut in or within things do not count."""

import numpy as np
import pytest
from box_room import box, hollow_sphere, quad, scene

from renderer.irradiance_cache.atlas import build_atlas
from renderer.irradiance_cache.charts import find_charts
from renderer.irradiance_cache.nodes import REACH, ROW, find_neighbours, make_node_light, mixing_reach, share_noise, smooth_nodes, widen

SPACING = np.float32(0.1)


def sheet():
    """A sheet of 1 x 1 m seen from its front, with a box beside it."""
    flat = scene(quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), box((3, 3, 3), (3.5, 3.5, 3.5)))
    charts = find_charts(flat.mesh, flat.face_part)
    atlas = build_atlas(flat.mesh, flat.face_part, charts, np.ones(len(flat.face_part), np.bool_), float(SPACING))
    light = make_node_light(len(atlas.face))
    light.valid[:], light.open_m[:] = 1.0, 100.0
    return flat, atlas, light


def smoothed(atlas, light):
    rows = np.zeros((len(atlas.face), ROW), np.float32)
    smooth_nodes(find_neighbours(atlas), atlas.normal, atlas.position, SPACING, np.arange(len(atlas.face)), light, rows)
    return rows[:, :3]


def test_places_are_where_the_index_says():
    _, atlas, _ = sheet()
    _, _, place, grids, *_ = find_neighbours(atlas)
    assert (atlas.grid[place] == np.arange(len(place))).all() and len(grids) == 1 + 6
    assert (grids[:, 1] * grids[:, 2]).sum() == len(atlas.grid)


def test_even_light_stays_and_noise_becomes_less():
    _, atlas, light = sheet()
    light.indirect[:] = 3.0
    np.testing.assert_allclose(smoothed(atlas, light), 3.0, rtol=1e-6)
    light.indirect[:] += np.random.default_rng(1).normal(0, 1, light.indirect.shape).astype(np.float32)
    assert smoothed(atlas, light)[:121].std() < 0.25
    light.open_m[:] = 0.1
    np.testing.assert_array_equal(smoothed(atlas, light), light.indirect)


def test_shadows_in_the_light_of_the_sky_keep_their_edges_and_what_is_gathered_is_smoothed_on_both_sides():
    """The sky brings a half of the light on the right, none on the left; of what is gathered a tenth is noise."""
    _, atlas, light = sheet()
    right = atlas.position[:, 0] > 0.45
    noise = np.random.default_rng(1).normal(1.0, 0.1, (len(right), 1)).astype(np.float32)
    light.sky[:] = np.where(right, 3.0, 0.0)
    light.indirect[:] = 3.0 * noise + light.sky[:, None]
    smooth = smoothed(atlas, light)[:121, 0]
    for side, expected in ((right[:121], 6.0), (~right[:121], 3.0)):
        assert abs(smooth[side] - expected).max() < 0.3 and smooth[side].std() < 0.5 * 0.3
    light.sky[:] = 0.0
    assert abs(smoothed(atlas, light)[:121, 0][right[:121]] - 6.0).max() > 1.0


@pytest.mark.parametrize("field", ["open_m", "valid"])
def test_neighbours_in_corners_or_within_things_do_not_count(field):
    _, atlas, light = sheet()
    left = atlas.position[:, 0] < 0.45
    light.indirect[left] = 100.0
    getattr(light, field)[left] = 0.0
    assert smoothed(atlas, light)[~left].max() == 0.0


def test_light_stays_on_its_grid():
    flat, atlas, light = sheet()
    other = flat.face_part[atlas.face] == 1
    light.indirect[other] = 100.0
    smooth = smoothed(atlas, light)
    assert smooth[~other].max() == 0.0
    np.testing.assert_allclose(smooth[other], 100.0, rtol=1e-6)


@pytest.mark.parametrize(("open_m", "valid", "steps"), [(100.0, 1.0, REACH), (0.6, 0.5, 2), (0.01, 0.5, 1), (100.0, 0.0, 0)])
def test_who_smooths_needs_what_lies_within_reach(open_m, valid, steps):
    _, atlas, light = sheet()
    middle = np.argmin(np.linalg.norm(atlas.position - [0.5, 0.5, 0.0], axis=1), keepdims=True)
    light.open_m[middle], light.valid[middle] = open_m, valid
    wanted = np.zeros(len(atlas.face), np.bool_)
    widen(find_neighbours(atlas), mixing_reach(light, middle, SPACING), middle, wanted)
    apart = np.abs(atlas.position - atlas.position[middle]).max(axis=1)
    assert np.array_equal(wanted, apart < (steps + 0.5) * 0.1)


def ball(sides):
    """A ball of a metre that is seen from within, or from both sides, with nodes on no grid."""
    split = hollow_sphere(32)
    vertices, shared = np.unique(np.round(split.vertices, 9), axis=0, return_inverse=True)
    flat = scene(split._replace(vertices=vertices, faces=shared[split.faces]))
    one_sided = np.full(len(flat.face_part), sides == "front")
    atlas = build_atlas(flat.mesh, flat.face_part, find_charts(flat.mesh, flat.face_part), one_sided, float(SPACING))
    light = make_node_light(len(atlas.face))
    light.valid[:], light.open_m[:] = 1.0, 100.0
    return atlas, light


@pytest.mark.parametrize("sides", ["front", "both"])
def test_noise_becomes_less_on_bent_surfaces_and_stays_on_its_side(sides):
    atlas, light = ball(sides)
    assert (atlas.back >= 0).any() == (sides == "both") and (find_neighbours(atlas).place < 0).all()
    outside = (atlas.normal * atlas.position).sum(axis=1) > 0.0
    light.indirect[:] = np.where(outside, 3.0, 30.0)[:, None]
    expected = light.indirect[:, 0].copy()
    np.testing.assert_allclose(smoothed(atlas, light)[:, 0], expected, rtol=1e-5)
    light.indirect[:] *= np.random.default_rng(1).normal(1.0, 0.2, (len(expected), 1)).astype(np.float32)
    noise = smoothed(atlas, light)[:, 0] / expected
    assert noise.std() < 0.4 * 0.2 and noise.mean() == pytest.approx(1.0, abs=0.02)
    light.open_m[:] = 0.01
    np.testing.assert_allclose(smoothed(atlas, light), light.indirect, rtol=1e-6)


def test_both_sides_of_a_flat_sheet_are_smoothed_each_for_itself():
    flat = scene(quad((0, 0, 0), (1, 0, 0), (0, 1, 0)))
    charts = find_charts(flat.mesh, flat.face_part)
    atlas = build_atlas(flat.mesh, flat.face_part, charts, np.zeros(len(flat.face_part), np.bool_), float(SPACING))
    light = make_node_light(len(atlas.face))
    light.valid[:], light.open_m[:] = 1.0, 100.0
    expected = np.where(atlas.normal[:, 2] > 0.0, 3.0, 30.0)
    light.indirect[:] = (expected * np.random.default_rng(1).normal(1.0, 0.2, len(expected)))[:, None]
    noise = smoothed(atlas, light)[:, 0] / expected
    assert noise.std() < 0.2 * 0.2 and noise.mean() == pytest.approx(1.0, abs=0.03)


def close(atlas, light):
    light.open_m[:] = 0.1
    rows = np.zeros((len(atlas.face), ROW), np.float32)
    share_noise(atlas, find_neighbours(atlas), SPACING, np.arange(len(atlas.face)), light, rows)
    return rows[:, 0]


def test_noise_of_nodes_close_to_others_becomes_less_and_edges_of_shadows_stay():
    _, atlas, light = sheet()
    left = atlas.position[:, 0] < 0.45
    light.indirect[:] = np.where(left, 2.0, 3.0)[:, None]
    np.testing.assert_allclose(close(atlas, light), np.where(left, 2.0, 3.0), rtol=1e-6)
    light.indirect[:] *= np.random.default_rng(1).normal(1.0, 0.05, (len(left), 1)).astype(np.float32)
    noise = close(atlas, light) / np.where(left, 2.0, 3.0)
    assert noise[:121].std() < 0.5 * 0.05 and noise[:121].mean() == pytest.approx(1.0, abs=0.01)


def test_nodes_close_to_others_share_nothing_through_what_stands_between():
    _, atlas, light = sheet()
    light.indirect[:121:2] = 2.2
    light.indirect[1:121:2] = 2.0
    shared = close(atlas, light)[:121]
    assert 2.0 < shared.min() and shared.max() < 2.2
    atlas.cuts[:] = 0.5
    np.testing.assert_array_equal(close(atlas, light), light.indirect[:, 0])


def test_what_one_node_close_to_others_meets_by_chance_leaves_no_spot():
    """One of them is five times as bright as all others, as by one of its rays; of two that are, neither is by chance."""
    _, atlas, light = sheet()
    lone = int(np.hypot(*(atlas.position[:121, :2] - 0.5).T).argmin())
    light.indirect[:] = 2.0
    light.indirect[lone] = 10.0
    lit = close(atlas, light)[:121]
    assert 2.0 < lit[lone] < 2.5 and np.delete(lit, lone).max() < 2.01
    beside = np.flatnonzero(np.isclose(np.linalg.norm(atlas.position[:121] - atlas.position[lone], axis=1), 0.1, atol=0.02))[:2]
    light.indirect[beside] = 10.0
    assert close(atlas, light)[lone] == pytest.approx(10.0)


def test_nodes_in_the_open_are_left_as_they_are():
    _, atlas, light = sheet()
    light.open_m[:] = 0.29
    rows = np.ones((len(atlas.face), ROW), np.float32)
    share_noise(atlas, find_neighbours(atlas), SPACING, np.arange(len(atlas.face)), light, rows)
    assert (rows == 1.0).all()
