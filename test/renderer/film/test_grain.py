"""Grain of pictures: its deviation, what it leaves alone, and that it belongs to frame and pixel."""

import numpy as np
import pytest
from box_room import VIEW, furnished_room

from renderer import CameraConfig, RenderConfig, Renderer
from renderer.film.grain import add_grain

LUMA = np.array([0.299, 0.587, 0.114])


def grained(code, deviation=3.0, key=7):
    return add_grain(np.full((200, 300, 3), code, np.uint8), deviation, np.uint32(key)).astype(float)


def test_luma_has_the_deviation_and_most_of_it_is_shared_by_the_channels():
    noise = grained(128) - 128.0
    own = 0.5**2 * (LUMA**2).sum()
    assert (noise @ LUMA).std() == pytest.approx(3.0 * np.sqrt(1.0 + own), rel=0.03)
    assert abs(noise.mean()) < 0.1 and 0.5 < (noise[..., 0] - noise[..., 1]).std() / noise[..., 0].std() < 0.75
    rows = noise[..., 1]
    assert abs(np.corrcoef(rows[:, :-1].ravel(), rows[:, 1:].ravel())[0, 1]) < 0.02, "white"


def test_what_is_black_or_saturated_has_none():
    assert (grained(0) == 0).all() and (grained(255) == 255).all()


def test_frames_differ_and_threads_and_calls_do_not():
    assert np.array_equal(grained(90), grained(90)) and not np.array_equal(grained(90), grained(90, key=8))
    pictures = []
    for threads in (1, 2):
        config = RenderConfig(samples_per_pixel=2, threads=threads, grain=2.0)
        with Renderer(furnished_room(), CameraConfig(width=48, height=36), config, 5) as renderer:
            pictures.append(renderer.render(VIEW, 0, ("color", "color_noisy", "color_sensed")).layers)
    assert np.array_equal(pictures[0]["color"], pictures[1]["color"])
    assert np.array_equal(pictures[0]["color"], pictures[0]["color_sensed"]), "an ideal sensor reads the picture"
    assert not np.array_equal(pictures[0]["color"], pictures[0]["color_noisy"]), "without grain"
