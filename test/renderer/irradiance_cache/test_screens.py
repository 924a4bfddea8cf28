"""Lights that most places see in part."""

import numpy as np
import pytest
from box_room import hollow_sphere, pose, quad, scene
from cached_rooms import look_up

from renderer import CameraConfig
from renderer.irradiance_cache import cache as cache_module
from renderer.scene.flat_scene import Sky

SKY, CAMERA, VIEW = (
    Sky(*np.full((3, 3), 1000.0, np.float32)),
    CameraConfig(width=48, height=36, horizontal_fov_rad=1.2),
    pose((0, 0.3, 0), (0, -1, -0.4)),
)
DOME = hollow_sphere(16, 4, color=(0.2, 0.2, 0.2), roughness=1.0)
PANE = quad((-0.45, -0.45, 0.7), (0, 0.9, 0), (0.9, 0, 0), portal=True, transmission=0.9)
SLATS = [quad((-0.75, y, 0.6), (1.5, 0, 0), (0, 0.03, 0.03), color=(0, 0, 0), roughness=1.0) for y in np.arange(-0.75, 0.75, 0.045)]


@pytest.mark.parametrize(("before", "expected"), [(SLATS, True), ([], False)], ids=["slats", "nothing"])
def test_a_pane_behind_slats_is_screened(before, expected, monkeypatch):
    answers, find = [], cache_module.find_screened
    monkeypatch.setattr(cache_module, "find_screened", lambda *of: answers.append(find(*of)) or answers[-1])
    look_up(scene(DOME, PANE, *before, sky=SKY), VIEW, camera=CAMERA)
    assert [answer.tolist() for answer in answers] == [[expected]]


def test_light_through_slats_leaves_no_blotches_on_what_is_curved():
    """Beside paths, which have noise of 4 % here; with 32 points on the pane it was 7.4 %."""
    pane = quad((-0.75, -0.75, 0.72), (0, 1.5, 0), (1.5, 0, 0), portal=True, transmission=0.9)
    flat = scene(DOME, pane, *SLATS, sky=SKY)
    cached, traced = (
        look_up(flat, VIEW, camera=CAMERA, **settings).radiance[..., 1]
        for settings in ({}, {"integrator": "path", "samples_per_pixel": 512, "threads": 2})
    )
    assert cached.mean() == pytest.approx(traced.mean(), rel=0.02) and np.std(cached / traced) < 0.055
