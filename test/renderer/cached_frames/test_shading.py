"""Frames of single matt or glossy surfaces with known answers."""

import numpy as np
import pytest
from box_room import DARK, box, pose, quad
from single_surfaces import seen


def test_a_matt_wall_shows_its_colour_times_illuminance():
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.8, 0.4, 0.2), roughness=1.0)
    lamp = quad((-0.5, 0, 0.5), (1, 0, 0), (0, 0, 1), emission=(100, 100, 100), color=(0, 0, 0))
    cached = seen(wall, lamp._replace(faces=lamp.faces[:, ::-1]))
    traced = seen(wall, lamp._replace(faces=lamp.faces[:, ::-1]), integrator="path", samples_per_pixel=64, threads=2)
    assert traced.mean() > 1.0
    np.testing.assert_allclose(cached.mean(axis=(0, 1)), traced.mean(axis=(0, 1)), rtol=0.02)


@pytest.mark.parametrize(("plate_y", "share"), [(1.0, 0.96**2), (3.0, 1.0), (None, 1.0)])
def test_a_wall_is_lit_through_clear_glass_wherever_it_stands(plate_y, share):
    """Shadow rays through glass go on; a board hides all of a second lamp, whether or not there is glass elsewhere."""
    wall = quad((-1, 2, -1), (2, 0, 0), (0, 0, 2), color=(0.8, 0.4, 0.2), roughness=1.0)
    lamp, hidden = (quad((x - 0.1, 0, 0.5), (0.2, 0, 0), (0, 0, 0.2), emission=(100,) * 3, color=(0, 0, 0)) for x in (0.0, 6.0))
    lamp, hidden = (piece._replace(faces=piece.faces[:, ::-1]) for piece in (lamp, hidden))
    board = quad((3, -1, -2), (0, 3, 0), (0, 0, 4), color=(0, 0, 0), roughness=1.0)
    glass = [box((-2, plate_y, -2), (2, plate_y + 0.01, 2), color=(1, 1, 1), transmission=1.0, ior=1.5, roughness=0.0)] if plate_y else []
    bare, lit = (seen(wall, lamp, board, *more, view=pose((0, 1.5, 0), (0, 2, 0))) for more in ((), (hidden, *glass)))
    assert bare.mean() > 0.1 and lit.mean() == pytest.approx(share * bare.mean(), rel=0.03)


def test_a_floor_in_the_sun_is_lit_by_lambert():
    way, lux, versine = np.array([0.0, 0.6, 0.8]), np.array([90e3, 80e3, 60e3]), 1.0 - np.cos(np.radians(0.533 / 2))
    sky = DARK._replace(sun=np.array([*way, versine, *(lux / (2 * np.pi * versine))], np.float32))
    floor = quad((-2, -2, 0), (4, 0, 0), (0, 4, 0), color=(0.8, 0.4, 0.2), roughness=1.0)
    pane = quad((-2, 1.5, 0.2), (4, 0, 0), (0, 0, 1), portal=True, transmission=0.9)
    view = pose((0.1, 1.0, 1.5), (0.0, 1.0, 0.0))
    cached = seen(floor, pane, view=view, sky=sky)
    traced = seen(floor, pane, view=view, sky=sky, integrator="path", samples_per_pixel=64, threads=2)
    assert traced.mean() > 1e3 and cached.std(axis=(0, 1)).max() < 0.01 * cached.mean(), "the disc's own shades are no noise"
    np.testing.assert_allclose(cached.mean(axis=(0, 1)), traced.mean(axis=(0, 1)), rtol=0.02)


@pytest.mark.parametrize("roughness", [0.59, 0.61])
def test_dark_leather_mirrors_alike_on_both_sides_of_the_roughness_that_counts_as_matt(roughness):
    """A textured roughness may cross it from pixel to pixel; what is seen of it must not."""
    floor = quad((-3, 0, 0), (6, 0, 0), (0, 6, 0), color=(0.02, 0.02, 0.02), roughness=roughness, ior=1.5)
    ahead = quad((-6, 6, 0), (12, 0, 0), (0, 0, 4), glow_cd_m2=2.0, color=(1, 1, 1))
    behind = quad((6, -1, 0), (-12, 0, 0), (0, 0, 4), glow_cd_m2=100.0, color=(1, 1, 1))
    view = pose((0, 0, 1.2), (0, 2.4, 0))
    traced = seen(floor, ahead, behind, view=view, integrator="path", samples_per_pixel=256, threads=2).mean()
    assert traced > 0.1 and seen(floor, ahead, behind, view=view).mean() == pytest.approx(traced, rel=0.12)
