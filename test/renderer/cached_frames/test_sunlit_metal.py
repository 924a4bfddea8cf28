"""The sun on metal that metal shows: two brushed plates, of which one lies in the sun and the other mirrors it to the camera."""

import math

import numpy as np
import pytest
from box_room import DARK, box, pierced, pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig, RenderConfig, Renderer

VERSINE = 1.0 - math.cos(math.radians(0.533 / 2))
CAMERA = CameraConfig(width=32, height=24, horizontal_fov_rad=0.2)


def sunny(tilt: float):
    """A dark room with a pane in the wall y = 4, at 45 degrees below the sun, whose light falls on y from 2.1 to 2.5 of the floor."""
    way = np.array([0.0, 1.0, 1.0]) / math.sqrt(2.0)
    sky = DARK._replace(sun=np.array([*way, VERSINE, *(50_000.0 / (2.0 * math.pi * VERSINE),) * 3], np.float32))
    walls = pierced(box((0, 0, 0), (4, 4, 3), inside=True, color=(0.02,) * 3, roughness=1.0), (1.799, 1.499), (2.201, 1.915))
    pane = quad((1.8, 3.99, 1.5), (0.4, 0, 0), (0, 0, 0.4), portal=True, transmission=1.0)
    metal = {"color": (0.6, 0.5, 0.4), "metallic": 1.0, "roughness": 0.4}
    lit = quad((1.5, 2.0, 0.02), (1.0, 0, 0), (0, 0.6, 0.6 * math.tan(tilt)), object_id=2, **metal)
    shown = quad((2.5, 1.0, 0.8), (-1.0, 0, 0), (0, 0, 1.0), object_id=3, **metal)
    return scene(walls, pane, lit, shown, sky=sky)


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_metal_shows_the_sun_on_other_metal(tilt: float) -> None:
    """The lit plate sends the beam to the other, which sends it to the camera: nothing else is bright."""
    flat, view = sunny(tilt), pose((2.0, 2.2, 2.5), (2.0, 1.0, 1.3))
    cached = look_up(flat, view, camera=CAMERA, layers=("radiance", "instance"))
    with Renderer(flat, CAMERA, RenderConfig(samples_per_pixel=256, max_depth=6, threads=2), 5) as renderer:
        traced = renderer.render(view, 0, ("radiance",)).radiance
    seen = cached.layers["instance"] == 3
    assert seen.mean() > 0.9 and traced[seen].mean() > 50.0
    np.testing.assert_allclose(cached.radiance[seen].mean(axis=0), traced[seen].mean(axis=0), rtol=0.15)
