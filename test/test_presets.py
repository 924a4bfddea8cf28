"""Presets: the same bytes before denoising, whatever the threads and the pieces that an image is cut into."""

import pytest
from box_room import VIEW, furnished_room

from renderer import CameraConfig, RenderConfig, Renderer
from scene_description import from_mapping
from scene_synth_ros.cli.commands.render_command import PRESETS, preset_settings


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_give_the_same_bytes_whatever_the_threads_and_pieces(preset):
    settings = preset_settings(preset, 4) | {"denoise": "none"}
    images = set()
    for threads, pieces in ((1, 65536), (2, 65536), (2, 256), (3, 700)):
        config = from_mapping(RenderConfig, settings | {"threads": threads}, "preset")
        with Renderer(furnished_room(), CameraConfig(width=70, height=45), config, 3, paths_per_piece=pieces) as renderer:
            images.add(renderer.render(VIEW, 0, ("color",)).radiance.tobytes())
    assert len(images) == 1
