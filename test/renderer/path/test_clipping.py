"""Clipped strokes of light: the mean is that of the strokes, direct light stays as it is, one stroke cannot light a picture."""

import math

import numpy as np
import pytest
from box_room import box, hollow_sphere, pose, quad, scene

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.film.tone import Exposure, white_luminance
from renderer.path.film_sums import CLIPPED_REACH, share_clipped
from renderer.path.records import Film
from scene_description import from_mapping
from scene_synth_ros.cli.parameters.render_settings import PRESETS, preset_settings

ROOM = scene(
    box((0, 0, 0), (2, 2, 2), inside=True, color=(0.8, 0.8, 0.8)),
    quad((0.9, 0.9, 1.99), (0, 0.2, 0), (0.2, 0, 0), emission=(1000, 1000, 1000), color=(0, 0, 0)),
)
VIEW = pose((0.3, 0.3, 1.0), (1.5, 1.5, 0.2))
TRACED = [name for name in PRESETS if preset_settings(name)["integrator"] == "path"]
ALBEDO, RINGS, LAMP_M, LUMINANCE = 0.5, 32, 0.03, 1e5


def layers(flat, view, config, names, ev100=6.0):
    with Renderer(flat, CameraConfig(width=32, height=32, horizontal_fov_rad=1.0), config, 11) as renderer:
        return renderer.render(view, 0, names, exposure=Exposure(ev100)).layers


@pytest.mark.parametrize("preset", TRACED)
def test_presets_keep_the_light_of_an_integrating_sphere(preset):
    """A lamp lights a spot of the sphere and no more; what the spot sends back is even all over it: albedo flux / (area (1 - albedo)).

    The exposure is such that paths which meet the spot are strokes of many times white, as those that meet a patch of sun are.
    """
    lamp = quad((-LAMP_M / 2, -LAMP_M / 2, -0.7), (0, LAMP_M, 0), (LAMP_M, 0, 0), color=(0, 0, 0), emission=(LUMINANCE,) * 3)
    illuminance = ALBEDO * math.pi * LUMINANCE * LAMP_M**2 / (4.0 * math.pi * (1.0 - ALBEDO))
    expected = ALBEDO * illuminance / math.pi
    config = from_mapping(RenderConfig, preset_settings(preset, 400) | {"denoise": "none", "threads": 2}, "preset")
    ev100 = math.log2(3.0 * expected / white_luminance(0.0))
    image = layers(
        scene(hollow_sphere(RINGS, color=(ALBEDO,) * 3), lamp), pose((0.0, 0.0, 0.1), (0.1, 0.0, 0.9)), config, ("radiance",), ev100
    )["radiance"]
    assert image.mean(dtype=np.float64) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("preset", TRACED)
def test_presets_keep_the_light_of_a_shining_furnace(preset):
    """Walls that send 0.2 and reflect 0.8: the series 0.2 (1 + 0.8 + 0.64 + ...) is 1; its first three terms are 0.49."""
    furnace = scene(box((0, 0, 0), (2, 3, 1.5), inside=True, emission=(0.2,) * 3, color=(0.8,) * 3))
    config = from_mapping(RenderConfig, preset_settings(preset, 64) | {"denoise": "none", "threads": 2}, "preset")
    image = layers(furnace, pose((0.4, 0.5, 0.6), (1.5, 2.5, 1.0)), config, ("radiance",), 0.0)["radiance"]
    assert image.mean(dtype=np.float64) == pytest.approx(1.0, abs=0.02)


def test_clipping_moves_indirect_light_and_leaves_direct_light_alone():
    names = ("radiance", "direct")
    free, clipped = (layers(ROOM, VIEW, RenderConfig(samples_per_pixel=64, threads=2, clamp=clamp), names) for clamp in (0.0, 0.02))
    np.testing.assert_array_equal(clipped["direct"], free["direct"])
    assert not np.array_equal(clipped["radiance"], free["radiance"])
    assert clipped["radiance"].mean(dtype=np.float64) == pytest.approx(free["radiance"].mean(dtype=np.float64), rel=2e-3)
    spread = [np.abs(np.diff(image["radiance"] - image["direct"], axis=1)).mean() for image in (clipped, free)]
    assert spread[0] < 0.95 * spread[1]  # there is less noise


def test_a_limit_that_nothing_reaches_changes_no_byte():
    free, limited = (layers(ROOM, VIEW, RenderConfig(samples_per_pixel=4, threads=1, clamp=clamp), ("radiance",)) for clamp in (0.0, 1e6))
    np.testing.assert_array_equal(limited["radiance"], free["radiance"])


def test_one_stroke_cannot_light_a_picture():
    """Two mirrors show a lamp of 1000 cd/m2 in a part of the picture; clipped at 1, each of a sample's two strokes counts as 16."""
    first = quad((-1, 2, -1), (1, 0, 0), (0, 0, 2), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    second = quad((2, -1, -4), (-6, 0, 0), (0, 0, 8), color=(1, 1, 1), metallic=1.0, roughness=0.0)
    lamp = quad((-9, 9, -9), (18, 0, 0), (0, 0, 18), color=(0, 0, 0), emission=(1000.0,) * 3)
    config = RenderConfig(samples_per_pixel=16, threads=1, clamp=1.0 / white_luminance(0.0))
    image = layers(scene(first, second, lamp), pose((0, 0, 0), (0, 1, 0)), config, ("indirect",), 0.0)["indirect"]
    assert 0.1 < (image > 0).mean() < 0.9
    assert 2.0 < image.max() <= 2.0 * CLIPPED_REACH


def test_what_is_clipped_goes_to_indirect_light_in_proportion():
    light, direct, clipped = (np.zeros((1, 2, 3), np.float32) for _ in range(3))
    light[0, :, 0], direct[0, :, 0], clipped[0, 0, 0] = (3.0, 2.0), (1.0, 1.0), 1.5
    squares = light * light
    none = np.zeros((0, 0, 3), np.float32)
    share_clipped(Film(light, none, none, squares, direct, none, clipped))
    np.testing.assert_array_equal(light[0, :, 0], (4.0, 2.5))  # 1.5 over an indirect 3 is a half more of each
    np.testing.assert_array_equal(light[0, :, 1:], 0.0)
    np.testing.assert_allclose(squares, light * light, rtol=1e-6)
