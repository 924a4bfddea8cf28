"""The gallery: models on their stage, pictures in a grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from grammar.learning.category_map import FURNITURE, THING
from grammar.synthesize import SceneSynthesizer
from renderer import RenderConfig, Renderer
from renderer.scene.flatten import flatten
from scene_description import SceneSynthError, scene_from_json, scene_to_json
from scene_synth_ros.cli.commands.gallery_command import MODEL_CAMERA, _most_telling, _shown
from scene_synth_ros.cli.pictures.gallery import MODEL_ID, studio_scene, typical_examples
from scene_synth_ros.cli.pictures.picture_grid import Tile, write_grid


@pytest.fixture(scope="module")
def synthesizer() -> SceneSynthesizer:
    return SceneSynthesizer.from_config()


def test_every_category_but_openings_and_what_has_no_name_has_an_example(synthesizer: SceneSynthesizer) -> None:
    without = {"door", "garage_door", "window", FURNITURE, THING}
    assert set(synthesizer.appearance.categories) - set(typical_examples(synthesizer.grammars, synthesizer.small_things)) == without


@pytest.mark.parametrize("category", ["sofa", "mug", "picture", "ceiling_lamp", "rug"])
def test_a_model_fills_its_picture_and_touches_no_border(synthesizer: SceneSynthesizer, category: str) -> None:
    example = typical_examples(synthesizer.grammars, synthesizer.small_things)[category]
    style = next(iter(synthesizer.appearance.categories[category].styles))
    scene = studio_scene(synthesizer, category, example, style, 1)
    assert scene_from_json(scene_to_json(scene)) == scene
    with Renderer(flatten(scene), MODEL_CAMERA, RenderConfig(samples_per_pixel=1, threads=1), 0) as renderer:
        shown = renderer.render(scene.camera_path[0], 0, ("instance",)).layers["instance"] == MODEL_ID
    border = np.concatenate([shown[0], shown[-1], shown[:, 0], shown[:, -1]])
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    assert not border.any()
    assert max(np.ptp(rows), np.ptp(columns)) > 0.6 * MODEL_CAMERA.width


def test_a_grid_holds_its_pictures_row_by_row(tmp_path: Path) -> None:
    colors = [(250, 10, 10), (10, 250, 10), (10, 10, 250)]
    tiles = [Tile(f"tile {k}", np.full((20, 30, 3), color, np.uint8)) for k, color in enumerate(colors)]
    write_grid(tiles, 2, tmp_path / "grid.png")
    sheet = np.asarray(Image.open(tmp_path / "grid.png"))
    places = [tuple(np.argwhere((sheet == color).all(axis=2)).min(axis=0)) for color in colors]
    assert places[0][0] == places[1][0] < places[2][0]
    assert places[0][1] == places[2][1] < places[1][1]
    with pytest.raises(SceneSynthError, match="at least one picture"):
        write_grid([], 2, tmp_path / "none.png")


def test_views_are_those_that_show_most_and_then_what_was_not_seen_yet() -> None:
    shown = [frozenset({1}), frozenset({1, 2, 3}), frozenset({1, 2}), frozenset({4, 5}), frozenset({1, 2, 3})]
    assert _most_telling(shown, 2) == [1, 3]
    assert _most_telling(shown[:1], 2) == [0]
    path = [frozenset({1, 2}), frozenset({1, 2, 3}), frozenset({4}), *[frozenset({1})] * 6]
    assert _most_telling(path, 2) == [1, 4]  # frame 2 adds more but lies too near
    picture = np.zeros((20, 20), np.uint16)
    picture[:2, :2], picture[5, 5] = 7, 9  # the 9 is too small
    assert _shown(picture) == {7}
