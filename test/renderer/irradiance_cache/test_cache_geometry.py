"""Nodes and links shared by rooms whose lights alone differ: the bytes of a cache of their own, and not shared where they must not be."""

from dataclasses import replace

import numpy as np
import pytest
from box_room import VIEW, box, pierced, pose, quad, scene
from cached_rooms import CACHED, COARSE, SMALL, filled, solved

from renderer import RenderCancelled, Renderer, Sky
from renderer.irradiance_cache.cache_geometry import CacheConfig

DAY = Sky(np.array([2500, 3500, 6000], np.float32), np.array([6000, 6500, 7500], np.float32), np.array([900, 850, 700], np.float32))
SUNNY = DAY._replace(ground=np.zeros(3, np.float32), sun=np.array([0.0, 0.6, 0.8, 1e-4, 1e6, 9e5, 8e5], np.float32))
LAMP = (9000.0, 7000.0, 4500.0)


def room(lamp=LAMP, sky=DAY, *, wall=0.7, screen=0.0):
    """A room with a window, a ledge outside it, a lamp, two mirrors that face each other and a screen."""
    return scene(
        pierced(box((0, 0, 0), (4, 5, 2.6), inside=True, object_id=0, color=(wall, 0.7, 0.7)), (1.2, 0.9), (2.8, 2.1)),
        quad((1.2, 5, 0.9), (1.6, 0, 0), (0, 0, 1.2), object_id=1, portal=True, transmission=0.8),
        box((0.5, 5.3, 0.3), (3.5, 5.9, 1.2), object_id=2),
        box((1.9, 1.4, 2.2), (2.1, 1.6, 2.3), object_id=3, emission=lamp),
        box((0.02, 1.0, 0.3), (0.05, 3.0, 2.2), object_id=4, metallic=1.0, roughness=0.05),
        box((3.8, 1.0, 0.5), (3.9, 2.0, 1.2), object_id=5, glow_cd_m2=screen),
        box((3.95, 2.1, 0.3), (3.98, 4.8, 2.2), object_id=6, metallic=1.0, roughness=0.05),
        sky=sky,
    )


def bytes_of(cache):
    return [array.tobytes() for array in (cache.luminance, cache.even, cache.rows, *cache.light)]


@pytest.mark.parametrize("other", [room(lamp=(100.0, 9000.0, 0.5)), room(sky=SUNNY), room((5.0, 4.0, 0.0), SUNNY)])
def test_other_lights_on_the_same_nodes_are_the_bytes_of_a_fresh_cache(other):
    with solved(room()) as before:
        assert len(before.geometry.sightings.node_part), "some rays must see the lamp by both mirrors"
    with solved(other, geometry=before.geometry) as cache:
        assert cache.geometry is before.geometry
        cache.fill(np.ones(len(cache.atlas.face), np.bool_))
    assert bytes_of(cache) == bytes_of(filled(other))
    assert not np.array_equal(cache.luminance, before.luminance)


@pytest.mark.parametrize("other", [room(lamp=(0, 0, 0)), room(wall=0.6), room(screen=50.0)])
def test_what_rays_or_surfaces_do_otherwise_is_not_shared(other):
    with solved(room()) as before:
        pass
    with solved(other, geometry=before.geometry) as cache:
        assert cache.geometry is not before.geometry
    for key, config in ((6, COARSE), (5, replace(COARSE, spacing_m=0.21))):
        with solved(room(), config, key=key, geometry=before.geometry) as cache:
            assert cache.geometry is not before.geometry


@pytest.mark.parametrize("is_closed", [False, True])
def test_renderers_of_other_lights_share_trees_and_nodes(is_closed):
    views, layers = (VIEW, pose((0.8, 4.2, 1.4), (3.0, 1.0, 0.4))), ("radiance", "color_sensed", "depth")
    with Renderer(room(), SMALL, CACHED, 5) as before:
        before.render(VIEW, 0, layers)
        if is_closed:
            before.close()
        with Renderer(room(sky=SUNNY), SMALL, CACHED, 5, like=before) as renderer:
            before.close()
            assert (renderer.tree == before.tree) is not is_closed
            shared = [renderer.render(view, 0, layers).layers for view in views]
            assert renderer._light.geometry is before._light.geometry
    with Renderer(room(sky=SUNNY), SMALL, CACHED, 5) as renderer:
        alone = [renderer.render(view, 0, layers).layers for view in views]
    for ours, theirs in zip(shared, alone, strict=True):
        assert {name: image.tobytes() for name, image in ours.items()} == {name: image.tobytes() for name, image in theirs.items()}


def test_renderers_of_one_scene_share_what_is_known_of_its_light():
    flat, wide = room(), replace(SMALL, width=40)
    with Renderer(flat, wide, CACHED, 5) as alone:
        expected = alone.render(VIEW, 1, ("color_sensed", "radiance")).layers
    with Renderer(flat, SMALL, CACHED, 5) as before:
        before.render(VIEW, 0, ("color",))
        with Renderer(flat, wide, CACHED, 5, like=before) as after, Renderer(flat, SMALL, CACHED, 6, like=before) as otherwise:
            assert before.prepare(VIEW) == 0 and otherwise.prepare(VIEW) > 100
            before.close()
            assert after.prepare(VIEW) < 100, "more than what the wider view shows at its sides was not known"
            got = after.render(VIEW, 1, ("color_sensed", "radiance")).layers
    assert {name: image.tobytes() for name, image in got.items()} == {name: image.tobytes() for name, image in expected.items()}


def test_solving_that_is_cancelled_again_and_again_comes_to_the_same():
    whole = filled(room())
    asked = 0

    def now_and_then() -> bool:
        nonlocal asked
        asked += 1
        return asked % 3 == 0

    with solved(room(), is_solved=False) as cache:
        for _ in range(1000):
            try:
                cache.solve(now_and_then)
                break
            except RenderCancelled:
                continue
        assert asked > 6
        cache.fill(np.ones(len(cache.atlas.face), np.bool_))
    assert bytes_of(cache) == bytes_of(whole)


def test_only_what_is_seen_of_a_block_shines_and_mirrors_do_not():
    """Half of a block is within a wall; what a mirror shows is found by the rays that it sends on."""
    wall = box((0, 0, 0), (4, 1, 3), color=(0.5, 0.5, 0.5))
    block = box((1.5, 0.5, 1), (2.5, 1.5, 2), color=(0.5, 0.5, 0.5))
    mirror = quad((0, 4, 0), (0, 0, 3), (4, 0, 0), color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.0)
    flat = scene(box((-1, 0, -1), (5, 5, 4), inside=True, object_id=0), wall, block, mirror)
    with solved(flat, CacheConfig(spacing_m=0.2, coarse_spacing_m=0.1)) as cache:
        geometry = cache.geometry
    area = np.bincount(flat.face_part[geometry.coarse.face], geometry.shining_area, 4)
    assert area[2] == pytest.approx(3.0, rel=0.15) and area[3] == 0.0


def test_the_outer_side_of_a_room_s_shell_has_no_nodes():
    """Nobody looks there; a floor in the open, above which there is nothing, keeps those of both its sides."""
    outer, inner = box((-0.2, -0.2, -0.2), (4.2, 3.2, 2.7), object_id=0), box((0, 0, 0), (4, 3, 2.5), inside=True, object_id=0)
    faces = np.concatenate([outer.faces, inner.faces + len(outer.vertices)])
    shell = outer._replace(vertices=np.concatenate([outer.vertices, inner.vertices]), faces=faces)
    with solved(scene(shell, box((1, 1, 0), (2, 2, 1)))) as cache:
        for atlas in (cache.coarse, cache.atlas):
            assert len(atlas.position) and atlas.position.min() > -0.01 and (atlas.position.max(axis=0) < (4.01, 3.01, 2.51)).all()
    with solved(scene(box((0, 0, -0.2), (4, 3, 0), object_id=0))) as cache:
        assert {tuple(normal) for normal in cache.atlas.normal[:, 2:].round().tolist()} == {(-1.0,), (0.0,), (1.0,)}
