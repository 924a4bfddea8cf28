"""The sun's photons: all that comes in is counted, and goes where surfaces send it."""

import numpy as np
import pytest
from box_room import box, pierced, quad, scene
from cached_rooms import COARSE, solved
from sunny_window import LUX, MATT, PANE, SUNNY

from renderer.irradiance_cache.photons import SunLight, make_photons, share_flux, trace_photons

ENTERS = 0.8 * 0.6 * LUX
"""Lumens that come in by a pane of 1 m2."""


def room_of(*pieces, pane=PANE, hole=((-0.5, 1.0), (0.5, 2.0)), color=(0.5, 0.5, 0.5)):
    """A room of 4 x 3 x 2.5 m with a pane in the wall of greatest y, by which the sun shines on the floor."""
    shell = pierced(box((-2, -3, 0), (2, 0, 2.5), inside=True, object_id=0, color=color, **MATT), *hole)
    return scene(shell, pane, *pieces, sky=SUNNY)


def traced(flat):
    """What photons leave in it, the coarse nodes, and which part each of these lies on."""
    with solved(flat, is_solved=False) as cache:
        room, coarse, fine = cache._scene, cache.coarse, cache.atlas
        cache.geometry.link(room, cache._memory)
        photons = make_photons(room.surfaces, room.lights.infinite, np.uint32(5))
        first, bounced = np.zeros((2, len(coarse.face), 3), np.float32)
        left = SunLight(first, bounced, np.zeros((len(first), 2), np.float32), np.zeros(len(fine.face), np.bool_))
        trace_photons(room.lit, coarse, fine, cache.geometry.looks, photons, 0, len(photons.flux), room.scratch[0], left)
    return left, coarse, fine, flat.face_part[coarse.face]


@pytest.mark.parametrize("width_m", [0.0, 0.02])
def test_all_that_comes_in_is_left_however_narrow_what_it_falls_on(width_m):
    """Slats of 2 cm below the window take some of it; nodes lie 30 cm apart."""
    slats = [quad((-0.5, -0.05 - y, 0.9), (1, 0, 0), (0, 0, width_m), object_id=2, **MATT) for y in np.arange(0.0, 0.8, 0.05) if width_m]
    left, _, _, part = traced(room_of(*slats))
    np.testing.assert_allclose(left.first.sum(axis=0), ENTERS, rtol=5e-3)
    on_slats = left.first[part >= 2].sum() / left.first.sum()
    assert on_slats > 0.1 if width_m else on_slats == 0.0


@pytest.mark.parametrize("albedo", [0.5, 0.8])
def test_what_bounces_is_a_geometric_series(albedo):
    """By so small a pane next to nothing leaves, so that each bounce brings ``albedo`` times what the one before has."""
    pane = quad((-0.05, 0, 1.0), (0.1, 0, 0), (0, 0, 0.1), portal=True, transmission=0.8, ior=1.0, object_id=1)
    left, *_ = traced(room_of(pane=pane, hole=((-0.05, 1.0), (0.05, 1.1)), color=(albedo, albedo / 2, 0.0)))
    np.testing.assert_allclose(left.first.sum(axis=0), 0.01 * ENTERS, rtol=5e-3)
    ratio = left.bounced.sum(axis=0) / left.first.sum(axis=0)
    np.testing.assert_allclose(ratio, [albedo / (1 - albedo), albedo / 2 / (1 - albedo / 2), 0.0], rtol=0.02, atol=1e-6)


def test_a_mirror_on_the_floor_sends_the_sun_ahead_and_up():
    mirror = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0.9, 0.6, 0.3), metallic=1.0, roughness=0.02)
    left, coarse, _, part = traced(room_of(mirror, color=(0.0, 0.0, 0.0)))
    assert left.bounced.sum() == 0.0 and (left.first[part == 2] == 0.0).all()
    np.testing.assert_allclose(left.first.sum(axis=0), ENTERS * (0.9, 0.6, 0.3), rtol=0.01)
    # What enters at a height h is down after 0.75 h, and up again by 0.8 for each 0.6 m from there: at 2.5 m from y = -2.6 on.
    x, y, z = coarse.position[left.first[:, 1] > 0.0].T
    assert ((np.abs(y + 3.0) < 1e-3) | ((np.abs(z - 2.5) < 1e-3) & (y < -2.6 + 0.3))).all() and (np.abs(x) < 0.5 + 0.31).all()


def test_gloss_goes_forward():
    """A polished black floor, which scatters nothing, mirrors about 4 % of the sun, ahead and up."""
    floor = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0, 0, 0), roughness=0.2, ior=1.5)
    left, coarse, _, part = traced(room_of(floor, color=(0.0, 0.0, 0.0)))
    ahead = (coarse.position[:, 1] < -2.3) & (coarse.position[:, 2] > 1.0)
    schlick = 0.04 + 0.96 * (1.0 - 0.8) ** 5
    mirrored = left.first[part != 2, 1].sum()
    assert mirrored == pytest.approx(schlick * ENTERS[1], rel=0.03) and left.bounced.sum() == 0.0
    assert left.first[ahead, 1].sum() > 0.9 * mirrored


def test_a_sheet_passes_its_share_on():
    """A net behind the window, in a black room: what it lets through falls on the room, what it sends back on the window's wall."""
    net = quad((-1, -0.3, 0.2), (2, 0, 0), (0, 0, 2.2), object_id=2, color=(0.6, 0.6, 0.6), diffuse_transmission=0.75, **MATT)
    left, coarse, _, part = traced(room_of(net, color=(0.0, 0.0, 0.0)))
    np.testing.assert_allclose(left.first[part == 2].sum(axis=0), ENTERS, rtol=0.01)
    room = (part == 0) & (coarse.position[:, 1] < -0.3)
    np.testing.assert_allclose(left.bounced[room].sum(axis=0), 0.6 * 0.75 * ENTERS, rtol=0.02)


def test_fine_nodes_around_the_suns_patch_are_known():
    flat = room_of()
    left, _, fine, _ = traced(flat)
    x, y, z = fine.position.T
    # The patch on the floor: the pane's shadow along the sun's direction, at most a node's step wider.
    inside = (np.abs(x) < 0.5 - 0.01) & (y < -0.75 - 0.01) & (y > -1.5 + 0.01) & (z < 1e-3)
    near = (np.abs(x) < 0.7 + 0.01) & (y < -0.75 + 0.21) & (y > -1.5 - 0.21) & (z < 1e-3)
    assert left.sunlit[inside].all() and not left.sunlit[~near].any()


def test_flux_is_shared_by_neighbours_that_face_alike():
    with solved(room_of(), is_solved=False) as cache:
        coarse = cache.coarse
    nodes = np.arange(len(coarse.face))
    floor, facing = np.flatnonzero(coarse.normal[:, 2] > 0.5), coarse.normal[:, 2] > 0.5
    # Every third has one that stands in for it, its neighbour.
    lumen, other = np.zeros((len(nodes), 3), np.float32), nodes.astype(np.int32)
    lumen[floor], other[floor[:-1:3]] = [1.0, 2.0, 0.0], floor[1::3][: len(floor[:-1:3])]
    lux = share_flux(coarse, other, lumen, 50.0 * coarse.area, COARSE.coarse_spacing_m)
    assert (lux[~facing] == 0.0).all() and (lux[facing, 0] > 0.0).any()
    np.testing.assert_allclose((lux[other] * coarse.area[:, None]).sum(axis=0), lumen.sum(axis=0), rtol=1e-5)


def test_flux_falls_on_as_much_of_what_a_node_stands_for_as_photons_meet():
    with solved(room_of(), is_solved=False) as cache:
        coarse = cache.coarse
    nodes = np.arange(len(coarse.face), dtype=np.int32)
    small, large, hidden = np.argsort(coarse.area)[[0, -1, -2]]
    area, other = coarse.area.copy(), nodes.copy()
    area[small], other[large], other[hidden] = 1e-3 * area[large], small, small
    # 100 lux on what is seen: nearly all of it on the large one's surface, nothing on the hidden one's.
    hits = np.where(nodes == hidden, np.float32(0.0), 1e6 * area).astype(np.float32)
    lumen = np.repeat((1e-4 * hits)[:, None], 3, axis=1).astype(np.float32)
    lux = share_flux(coarse._replace(area=area), other, lumen, hits, COARSE.coarse_spacing_m)
    np.testing.assert_allclose(lux[other[nodes != hidden]], 100.0, rtol=1e-4)


def test_nodes_that_many_photons_meet_keep_what_they_have():
    """Else a strip of sun on the edge of a slat would shine on all of it."""
    with solved(room_of(), is_solved=False) as cache:
        coarse = cache.coarse
    nodes = np.arange(len(coarse.face), dtype=np.int32)
    lumen = (nodes[:, None] % 7 + np.zeros(3)).astype(np.float32)
    lux = share_flux(coarse, nodes, lumen, np.full(len(nodes), 8.0, np.float32), COARSE.coarse_spacing_m)
    np.testing.assert_allclose(lux, lumen / np.maximum(coarse.area[:, None], 1e-6), rtol=1e-5)


def test_what_clear_glass_does_not_let_through_its_front_sends_back():
    """A dark glass on the floor of a black room: what its front reflects falls on the room, but for some that leaves by the pane."""
    glass = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0.36, 0.36, 0.36), transmission=1.0, roughness=0.1, ior=1.5)
    flat = room_of(glass, color=(0.0, 0.0, 0.0))
    left, _, _, part = traced(flat)
    with solved(flat, is_solved=False) as cache:
        cache.geometry.link(cache._scene, cache._memory)
        albedo = cache.geometry.looks.albedo[part == 2]
    on_glass = left.first[part == 2] + left.bounced[part == 2]
    assert left.bounced[part == 0].sum() == pytest.approx((albedo * on_glass).sum(), rel=0.1)
