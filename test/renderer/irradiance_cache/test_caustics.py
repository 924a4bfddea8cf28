"""Caustics: what gloss mirrors of lamps and sky reaches the surfaces that it is mirrored to, all of it."""

import numpy as np
import pytest
from box_room import DARK, box, pierced, pose, quad, scene
from cached_rooms import look_up, solved
from sunny_window import MATT, PANE

from renderer import CameraConfig
from renderer.irradiance_cache.caustics import emit_photons, make_caustics, trace_caustics
from renderer.scene.flat_scene import Sky

SKY = Sky(*(np.full(3, 1000, np.float32) for _ in range(3)))
BLACK = {"color": (0.0, 0.0, 0.0), **MATT}
KEY = np.uint32(7)


def left_by(flat, of_sky):
    """The photons of a scene, what they leave, the coarse nodes, the part of each, and what they do with light."""
    with solved(flat, is_solved=False) as cache:
        room, coarse = cache._scene, cache.coarse
        cache.geometry.link(room, cache._memory)
        photons = emit_photons(room.surfaces, room.lights, of_sky, KEY)
        left = make_caustics(len(coarse.face))
        trace_caustics(room.lit, coarse, photons, of_sky, 0, len(photons.flux), room.scratch[0], left)
    return photons, left, coarse, flat.face_part[coarse.face], cache.geometry.looks


def room_of(*pieces, color=(0.0, 0.0, 0.0)):
    """A room of 4 x 3 x 2.5 m with a pane in the wall of greatest y, under an even sky."""
    shell = pierced(box((-2, -3, 0), (2, 0, 2.5), inside=True, object_id=0, color=color, **MATT), (-0.5, 1.0), (0.5, 2.0))
    return scene(shell, PANE, *pieces, sky=SKY)


def test_panes_send_all_of_the_even_sky():
    """Its illuminance behind 1 m2 of such glass is 0.8 pi L."""
    photons, *_ = left_by(room_of(), True)
    np.testing.assert_allclose(photons.flux.sum(axis=0), 0.8 * np.pi * 1000, rtol=2e-3)
    assert (photons.directions[:, 1] <= 0.0).all() and len(emit_photons_of_none().flux) == 0


def emit_photons_of_none():
    with solved(room_of(), is_solved=False) as cache:
        return emit_photons(cache._scene.surfaces, cache._scene.lights, False, KEY)


@pytest.mark.parametrize(("metallic", "coat"), [(1.0, 0.0), (0.7, 0.0), (0.0, 0.0), (0.0, 1.0)])
def test_a_lamp_in_a_box_of_gloss_leaves_what_that_mirrors(metallic, coat):
    """From a small matt lamp above a wide floor its light falls evenly on all slopes: what is mirrored is the hemisphere's mean."""
    lamp = quad((-0.025, -0.025, 0.31), (0, 0.05, 0), (0.05, 0, 0), emission=(100.0, 50.0, 25.0), object_id=2, color=(0, 0, 0), **MATT)
    gloss = {"color": (0.8, 0.8, 0.8) if metallic else (0, 0, 0), "roughness": 0.3, "ior": 1.5, "metallic": metallic}
    floor = quad((-4, -4, 0.01), (8, 0, 0), (0, 8, 0), object_id=3, clearcoat=coat, clearcoat_roughness=0.1, **gloss)
    shell = box((-4, -4, 0), (4, 4, 2.5), inside=True, object_id=0, **BLACK)
    photons, left, _, part, looks = left_by(scene(shell, lamp, floor, sky=DARK), False)
    np.testing.assert_allclose(photons.flux.sum(axis=0), 0.0025 * np.pi * np.array([100.0, 50.0, 25.0]), rtol=2e-3)
    mirrored = (looks.albedo - looks.matt)[part == 2].mean(axis=0)
    assert mirrored[0] > 0.5 if metallic else 0.05 < mirrored[0] < 0.2
    np.testing.assert_allclose(left.lumen.sum(axis=0), mirrored * photons.flux.sum(axis=0), rtol=0.02)
    assert (left.lumen[part == 2] == 0.0).all() or left.lumen[part == 2].sum() < 1e-3 * left.lumen.sum()


def test_matt_and_what_is_rough_send_none_on():
    for roughness in (0.6, 1.0):
        floor = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0.5, 0.5, 0.5), roughness=roughness, ior=1.5)
        assert left_by(room_of(floor), True)[1].lumen.sum() == 0.0


def test_the_back_of_an_open_sheet_of_metal_mirrors_too():
    front = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0.9, 0.9, 0.9), roughness=0.2, metallic=1.0)
    back = quad((-2, -3, 0.01), (0, 3, 0), (4, 0, 0), object_id=2, color=(0.9, 0.9, 0.9), roughness=0.2, metallic=1.0)
    by_front, by_back = (left_by(room_of(piece), True)[1].lumen.sum() for piece in (front, back))
    assert by_front > 0.15 * 3 * 0.8 * np.pi * 1000 and by_back == pytest.approx(by_front, rel=0.02)


def test_a_ceiling_sees_what_a_polished_floor_mirrors_of_the_window():
    """Black walls, a floor of lacquer that scatters nothing: all light on the grey ceiling comes by way of the floor."""
    floor = quad((-2, -3, 0.01), (4, 0, 0), (0, 3, 0), object_id=2, color=(0, 0, 0), roughness=0.25, ior=1.5)
    ceiling = quad((-2, -3, 2.49), (0, 3, 0), (4, 0, 0), object_id=3, color=(0.5, 0.5, 0.5), **MATT)
    # The window's own is kept off by a shelf before it.
    shelf = box((-2, -1.2, 1.95), (2, -0.01, 2.0), object_id=4, **BLACK)
    flat, view = room_of(floor, ceiling, shelf), pose((0, -0.9, 1.2), (0, -2.6, 2.5))
    camera = CameraConfig(width=32, height=24, horizontal_fov_rad=0.8)
    cached = look_up(flat, view, camera=camera).radiance[..., 1]
    traced = look_up(flat, view, camera=camera, integrator="path", samples_per_pixel=512, threads=2).radiance[..., 1]
    assert traced.mean() > 1.0 and cached.mean() == pytest.approx(traced.mean(), rel=0.06)
    blocks = [image.reshape(4, 6, 4, 8).mean(axis=(1, 3)) for image in (cached, traced)]
    assert np.abs(blocks[0] - blocks[1]).mean() < 0.12 * blocks[1].mean()
