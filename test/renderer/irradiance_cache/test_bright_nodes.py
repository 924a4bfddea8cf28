"""Bright nodes that are sampled as lamps are, in the room and outside."""

import numpy as np
import pytest
from box_room import box, pierced, pose, quad, scene
from cached_rooms import COARSE, look_up, nodes_of, solved
from sunny_window import MATT, PANE, SUNNY

from renderer.bsdf import microfacet
from renderer.core.kernel import from_python
from renderer.irradiance_cache.bright_nodes import BRIGHT_RAYS, choose_bright
from renderer.irradiance_cache.cache_geometry import CacheConfig
from renderer.irradiance_cache.panes import NO_PANES
from renderer.path.light_nodes import Atlas

fresnel_thin_dielectric = from_python(microfacet.fresnel_thin_dielectric)

FLOOR = quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), color=(0.5, 0.5, 0.5), object_id=0)


def make_row(luminance, area):
    count = len(area)
    nothing = np.zeros((count, 3), np.float32)
    position = np.column_stack([np.arange(count), np.zeros((count, 2))]).astype(np.float32)
    up = np.tile(np.array([0, 0, 1], np.float32), (count, 1))
    empty = np.zeros(count, np.int32)
    atlas = Atlas(
        np.zeros((0, 4), np.int32),
        np.zeros((0, 6), np.float32),
        empty,
        nothing[:, :2],
        empty,
        position,
        up,
        empty,
        nothing[:, :2],
        np.asarray(area, np.float32),
    )
    return np.tile(np.asarray(luminance, np.float32)[:, None], (1, 3)), atlas


def choose(luminance, certain, atlas, least):
    return choose_bright(luminance, certain, atlas, least, 32, 0.3, np.full(len(luminance), -1, np.int32), NO_PANES)


def test_bright_nodes_are_those_beyond_a_least_luminance_and_keep_their_flux():
    luminance, atlas = make_row([1, 1, 1, 1, 1, 1, 1, 1, 1000, 3000], [1, 1, 1, 1, 1, 1, 1, 1, 0.1, 0.1])
    bright = choose(luminance, luminance, atlas, 98.0)
    assert bright.chosen.tolist() == [False] * 8 + [True] * 2
    np.testing.assert_allclose(bright.weight.sum(axis=0), 400.0, rtol=1e-5)
    assert (bright.point[:, 0] == 8).sum() == 8 and (bright.point[:, 0] == 9).sum() == 24
    assert len(choose(luminance[:8], luminance[:8], make_row(luminance[:8, 0], np.ones(8))[1], 2.0).point) == 0


def test_what_few_rays_bring_by_chance_makes_no_node_bright():
    luminance, atlas = make_row([1, 1, 1, 1, 1, 1, 1, 1, 1000, 3000], [1, 1, 1, 1, 1, 1, 1, 1, 0.1, 0.1])
    certain = luminance.copy()
    certain[8] = 0.0
    bright = choose(luminance, certain, atlas, 98.0)
    assert bright.chosen.tolist() == [False] * 9 + [True]
    np.testing.assert_allclose(bright.weight.sum(axis=0), 300.0, rtol=1e-5)


def test_what_bright_nodes_bring_is_what_rays_would_find():
    """A small bright patch under the ceiling: the floor gets its view factor, as of a lamp that nobody named."""
    patch = quad((-0.3, -0.3, 1.5), (0, 0.6, 0), (0.6, 0, 0), glow_cd_m2=5000.0, color=(1.0, 1.0, 1.0))
    flat = scene(FLOOR, patch, box((-3, -3, -1), (3, 3, 2), inside=True, object_id=0, color=(0.01, 0.01, 0.01), roughness=1.0))
    with solved(flat, COARSE) as cache:
        assert cache.source.bright.chosen.any() and len(cache.source.bright.point) % BRIGHT_RAYS == 0
        cache.fill(np.ones(len(cache.atlas.face), np.bool_))
    nodes = nodes_of(cache, 0, flat)
    middle = nodes[np.hypot(*cache.atlas.position[nodes, :2].T) < 0.2]
    x = 0.3 / 1.5
    factor = 4 / (2 * np.pi) * 2 * x / np.hypot(1, x) * np.arctan(x / np.hypot(1, x))
    np.testing.assert_allclose(cache.light.indirect[middle, 1], np.pi * 5000 * factor, rtol=0.08)


@pytest.mark.parametrize("size", [0.2, 0.6])
def test_what_the_sun_lights_outside_is_sampled_by_the_window(size):
    """A plate in the sun before the window of a black room lights the ceiling as paths find it, within 3 %."""
    shell = pierced(box((-2, -3, 0), (2, 0, 2.5), inside=True, object_id=0, color=(0.0, 0.0, 0.0), **MATT), (-0.5, 1.0), (0.5, 2.0))
    plate = quad((-0.5 * size, 0.3, 1.0), (size, 0, 0), (0, size, 0), object_id=2, color=(0.6, 0.6, 0.6), **MATT)
    ceiling = quad((-2, 0, 2.49), (4, 0, 0), (0, -3, 0), object_id=3, color=(0.5, 0.5, 0.5), **MATT)
    flat, view = scene(shell, PANE._replace(ior=1.5), plate, ceiling, sky=SUNNY), pose((0.0, -1.5, 0.5), (0.0, -1.0, 2.5))
    with solved(flat, CacheConfig()) as cache:
        outside = cache.source.outside
        assert (flat.face_part[cache.coarse.face[outside.chosen]] == 2).all() and outside.chosen.any()
    known = look_up(flat, view, cache_spacing_m=0.1).radiance
    traced = look_up(flat, view, integrator="path", samples_per_pixel=2048).radiance
    assert known.mean() == pytest.approx(traced.mean(), rel=0.03)


MIRROR = {"metallic": 1.0, "roughness": 0.02, "color": (0.8, 0.8, 0.8)}
GLASS = {"portal": True, "transmission": 0.8, "ior": 1.5}


def mirrored_patch(shows):
    """A black room with a grey floor, behind a patch that glows toward a mirror or a pane, and the lux that its image sends to places."""
    patch = quad((0.0, -0.3, 0.8), (0, 0.6, 0), (0, 0, 0.6), glow_cd_m2=50000.0, color=(1.0, 1.0, 1.0), object_id=2)
    behind = quad((-0.02, -0.4, 0.7), (0, 0.8, 0), (0, 0, 0.8), color=(0.0, 0.0, 0.0), object_id=5, **MATT)
    shown = quad((1.0, -1.5, 0.1), (0, 0, 2.2), (0, 3.0, 0), object_id=3, **shows)
    black = box((-2, -2, -0.5), (2, 2, 2.5), inside=True, object_id=0, color=(0.0, 0.0, 0.0), **MATT)
    floor = quad((-1.0, -0.5, 0), (0.9, 0, 0), (0, 1, 0), color=(0.5, 0.5, 0.5), object_id=4, **MATT)
    middles = 0.6 * (np.arange(12) + 0.5) / 12
    image = np.stack([np.full((12, 12), 2.0), *np.meshgrid(middles - 0.3, middles + 0.8)], axis=-1).reshape(-1, 3)

    def lux(place, mirrors):
        away = image - place
        squared = (away * away).sum(axis=1)
        across = away[:, 0] / np.sqrt(squared)
        share = np.array([mirrors(np.float32(cosine)) for cosine in across])
        return 50000.0 * (0.6 / 12) ** 2 * (share * across * away[:, 2] / squared**1.5).sum()

    return scene(floor, black, patch, behind, shown), lux


def test_bright_nodes_that_a_pane_shows_light_by_it():
    flat, lux = mirrored_patch(GLASS)
    with solved(flat, CacheConfig(spacing_m=0.1, coarse_spacing_m=0.3, coarse_rays=1024, gather_rays=4096)) as cache:
        assert cache.source.bright.chosen.any()
        cache.fill(np.ones(len(cache.atlas.face), np.bool_))
    nodes = nodes_of(cache, 0, flat)
    expected = [lux(place, lambda cosine: fresnel_thin_dielectric(cosine, 1.5)) for place in cache.atlas.position[nodes]]
    # Some 190 rays of all that are sent find the patch.
    assert cache.light.indirect[nodes, 1].mean() == pytest.approx(np.mean(expected), rel=0.15)


def test_bright_nodes_that_a_mirror_shows_light_coarse_nodes_by_it():
    flat, lux = mirrored_patch(MIRROR)
    with solved(flat, CacheConfig(spacing_m=0.2, coarse_spacing_m=0.1, coarse_rays=512)) as cache:
        assert cache.source.bright.chosen.any()
    nodes = np.flatnonzero((flat.face_part[cache.coarse.face] == 0) & (cache.coarse.normal[:, 2] > 0.5))
    expected = [0.5 * lux(place, lambda _: 0.8) for place in cache.coarse.position[nodes]]
    assert np.pi * cache.luminance[nodes, 1].mean() == pytest.approx(np.mean(expected), rel=0.06)
