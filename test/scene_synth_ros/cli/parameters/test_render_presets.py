"""The settings of the renderer that come with the program."""

import pytest

from renderer import RenderConfig
from scene_description import from_mapping
from scene_description.share import config_path
from scene_synth_ros.cli.commands.render_command import PRESETS, preset_settings


def test_every_file_is_offered() -> None:
    assert sorted(PRESETS) == sorted(path.stem for path in config_path("presets").glob("*.yaml"))


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_sets_fields_of_the_renderer(name: str) -> None:
    settings = preset_settings(name)
    config = from_mapping(RenderConfig, settings)
    assert {key: getattr(config, key) for key in settings} == settings


def test_a_number_of_samples_wins_over_the_presets() -> None:
    assert preset_settings("photo", 3) == preset_settings("photo") | {"samples_per_pixel": 3}


def test_presets_are_ordered_by_their_cost() -> None:
    integrators = [preset_settings(name)["integrator"] for name in PRESETS]
    assert integrators == sorted(integrators)  # cached, then path
    costs = [preset_settings(name)["samples_per_pixel"] * preset_settings(name)["max_depth"] for name in PRESETS]
    assert costs == sorted(costs)
    cached = [preset_settings(name) for name in PRESETS[: integrators.count("cached")]]
    rays = [settings["cache_rays"] / settings["cache_spacing_m"] ** 2 for settings in cached]
    assert rays == sorted(rays)
