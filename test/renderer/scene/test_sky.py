"""What stands outside is drawn for light that a window lets in, once, and for nothing else."""

from dataclasses import replace

import pytest
from sample_scene import sample_scene

from renderer import GEOMETRIC_LAYERS, CameraConfig, RenderConfig, Renderer
from renderer.scene import sky
from renderer.scene.flatten import flatten
from scene_description.types import Surroundings

TINY = CameraConfig(width=16, height=12)
QUICK = RenderConfig(samples_per_pixel=1, threads=1)


def suburban():
    scene = sample_scene()
    return replace(scene, environment=replace(scene.environment, surroundings=Surroundings(setting="suburb", seed=4)))


@pytest.fixture
def drawn(monkeypatch):
    """Return a list that grows by one whenever surroundings are drawn."""
    calls = []
    draw = sky.surroundings_map
    monkeypatch.setattr(sky, "surroundings_map", lambda *arguments: calls.append(1) or draw(*arguments))
    sky._surroundings_table.cache_clear()
    return calls


def test_basic_ground_truth_draws_nothing_and_colour_of_two_renderers_draws_once(drawn):
    scene = suburban()
    flat = flatten(scene)
    assert flat.outside == scene.environment
    with Renderer(flat, TINY, QUICK, 1) as renderer, Renderer(flat, TINY, QUICK, 1, like=renderer) as second:
        basic = renderer.render(scene.camera_path[0], 0, GEOMETRIC_LAYERS)
        assert not drawn and basic.rays == 16 * 12
        one, two = (each.render(scene.camera_path[0], 0, ("color",)) for each in (renderer, second))
        assert len(drawn) == 1 and one.radiance.tobytes() == two.radiance.tobytes() and one.rays > 0
    assert sky.sky_of(flat).table.tobytes() != flat.sky.table.tobytes() and len(drawn) == 1


def test_a_room_without_windows_has_nothing_outside(drawn):
    scene = suburban()
    doors = tuple(opening for opening in scene.room.openings if opening.category != "window")
    assert len(doors) < len(scene.room.openings)
    flat = flatten(replace(scene, room=replace(scene.room, openings=doors)))
    assert flat.outside is None and sky.sky_of(flat) is flat.sky and not drawn
