"""Sun patches: they lie where the beams fall, the light of rooms that live by them has known answers, and rare paths are found."""

import math

import numpy as np
import pytest
from box_room import DARK, box, hollow_sphere, pierced, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.core.embree import EmbreeScene
from renderer.path import light_tables
from renderer.path.lights import build_lights
from renderer.path.sun_patches import MOST_PATCHES, find_sun_patches

VERSINE = 1.0 - math.cos(math.radians(0.533 / 2))
LUX = 50_000.0


def sun(direction):
    """A dark sky with a sun of LUX in this direction."""
    way = np.array(direction, float) / np.linalg.norm(direction)
    return DARK._replace(sun=np.array([*way, VERSINE, *(LUX / (2.0 * math.pi * VERSINE),) * 3], np.float32))


def patches_of(flat):
    with EmbreeScene(flat.mesh.vertices, flat.mesh.faces, panes=flat.parts.portal[flat.face_part]) as tree:
        return find_sun_patches(flat, build_lights(flat).infinite, tree.handle)


def radiance(flat, view, samples, frame=0, **settings):
    config = RenderConfig(samples_per_pixel=samples, threads=2, **settings)
    with Renderer(flat, CameraConfig(width=32, height=24, horizontal_fov_rad=1.0), config, 5) as renderer:
        return renderer.render(view, frame, ("radiance",)).layers["radiance"].astype(np.float64)


def sunny_room(floor=0.8, direction=(0.0, 1.0, 1.0), outside=()):
    """A room of 4 x 4 x 3 m with a pane of 0.4 x 0.4 m in the wall y = 4, whose light falls on the floor; ``floor``: its roughness.

    ``outside``: pieces that stand there.
    """
    walls = pierced(box((0, 0, 0), (4, 4, 3), inside=True, color=(0.7, 0.7, 0.7), roughness=1.0), (1.799, 1.499), (2.201, 1.915))
    ground = quad((0, 0, 0.01), (4, 0, 0), (0, 4, 0), color=(0.5, 0.5, 0.5), roughness=floor, ior=1.5)
    pane = quad((1.8, 3.99, 1.5), (0.4, 0, 0), (0, 0, 0.4), portal=True, transmission=1.0)
    return scene(walls, ground, pane, *outside, sky=sun(direction))


def test_patches_lie_where_beams_fall():
    """At 45 degrees the pane from 1.5 to 1.9 m shines on y from 2.1 to 2.5 of the floor."""
    patches = patches_of(sunny_room())
    assert 1 < len(patches) <= MOST_PATCHES
    low, high = patches[:, :2] - patches[:, 3:4], patches[:, :2] + patches[:, 3:4]
    assert low.min(axis=0) == pytest.approx((1.8, 2.1), abs=0.12) and high.max(axis=0) == pytest.approx((2.2, 2.5), abs=0.12)
    np.testing.assert_allclose(patches[:, 2], 0.01, atol=1e-3)
    np.testing.assert_allclose(patches[:, 4:7], [[0.0, 0.0, 1.0]] * len(patches), atol=1e-6)


def test_what_stands_outside_keeps_beams_out():
    """A board 0.11 m before the pane, from 1.81 m on, leaves the beams below 1.7 m of the pane, which fall on y from 2.3 to 2.5."""
    patches = patches_of(sunny_room(outside=(quad((1.0, 4.1, 1.81), (2.0, 0, 0), (0, 0, 1.0)),)))
    assert 2.3 < patches[:, 1].min() < patches[:, 1].max() < 2.5
    assert patches_of(sunny_room())[:, 1].min() < 2.2


@pytest.mark.parametrize("direction", [(0.0, -1.0, 1.0), (1.0, 0.0, 0.2)])
def test_a_sun_behind_the_walls_has_none(direction):
    assert patches_of(sunny_room(direction=direction)).shape == (0, 11)


@pytest.mark.parametrize(("side", "noise"), [(0.06, 0.02), (0.004, 0.15)])
def test_a_sunbeam_in_an_integrating_sphere_lights_it_evenly(side, noise):
    """What a patch of 36 cm2 sends back is even all over the sphere: albedo flux / (area (1 - albedo)); the sun's hole is 0.2 % of it.

    So is what a beam of 0.16 cm2 does: its penumbra is wider than itself, and its cone narrower than a cosine near to 1 can tell.
    """
    albedo = 0.6
    pane = quad((-side / 2, -side / 2, 0.8), (0, side, 0), (side, 0, 0), portal=True, transmission=1.0)
    flat = scene(hollow_sphere(32, first=1, color=(albedo,) * 3), pane, sky=sun((0, 0, 1)))
    image = radiance(flat, pose((0, 0, 0), (1.0, 0.3, 0.1)), 400, max_depth=32)
    flux = LUX * side * side
    expected = albedo / math.pi * albedo * flux / (4.0 * math.pi * (1.0 - albedo))
    assert image.mean() == pytest.approx(expected, rel=noise)


@pytest.mark.parametrize("floor", [0.8, 0.3])
def test_what_only_luck_has_found_is_found_on_purpose(monkeypatch, floor):
    """A matt and a glossy floor in the sun, seen by way of the walls: the same mean as without patches, from samples that spread less."""
    flat, view = sunny_room(floor), pose((2.0, 3.5, 1.5), (1.0, 0.2, 2.2))
    guided = np.array([radiance(flat, view, 64, frame, max_depth=5) for frame in range(4)])
    monkeypatch.setattr(light_tables, "find_sun_patches", lambda *scene: np.zeros((0, 11), np.float32))
    plain = np.array([radiance(flat, view, 256, frame, max_depth=5) for frame in range(4)])
    assert guided.mean() == pytest.approx(plain.mean(), rel=0.03)
    assert guided.var(axis=0).mean() < plain.var(axis=0).mean()  # of a quarter of the samples
