"""A room's geometry is made when somebody wants a layer of it, once."""

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from sample_scene import sample_scene

from renderer import CameraConfig, DepthSensorConfig, RenderConfig, SensorConfig
from renderer.film.frame import Frame
from scene_description import CameraPose, SceneSynthError
from scene_synth_ros.render import room as room_module
from scene_synth_ros.render.room import RenderedRoom, RoomSettings

POSE = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 1.0), orientation=(0.0, 0.0, 0.0, 1.0))
SETTINGS = RoomSettings(
    camera=CameraConfig(),
    render=RenderConfig(),
    sensor=SensorConfig(),
    depth_sensor=DepthSensorConfig(),
    semantic_classes="nyu40",
    annotation_masks=False,
    catalog_dir=None,
)


class Counting:
    """Stands in for a renderer or an annotator, and counts how often one was made and what it was asked for."""

    def __init__(self) -> None:
        self.made, self.asked = 0, []

    def __call__(self, *_: object, **__: object) -> "Counting":
        self.made += 1
        return self

    def __enter__(self) -> "Counting":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def render(self, pose: CameraPose, frame_index: int, layers: tuple[str, ...], **how: object) -> Frame:
        self.asked.append((frame_index, layers, how))
        return Frame({}, None, samples=7)


@pytest.fixture
def renderers(monkeypatch: pytest.MonkeyPatch) -> Counting:
    monkeypatch.setattr(room_module, "Renderer", counting := Counting())
    return counting


@pytest.fixture
def annotators(monkeypatch: pytest.MonkeyPatch) -> Counting:
    monkeypatch.setattr(room_module, "Annotator", counting := Counting())
    return counting


def test_nothing_is_made_until_a_layer_is_wanted_and_then_once(renderers: Counting) -> None:
    room = RenderedRoom(sample_scene(), SETTINGS)
    assert room.render(POSE, 0, ()) == Frame({}, None) and renderers.made == 0
    for index in (1, 2):
        assert room.render(POSE, index, ("depth",), path=()).samples == 7
    assert renderers.made == 1 and renderers.asked == [(1, ("depth",), {"path": ()}), (2, ("depth",), {"path": ()})]


def test_an_annotator_is_made_when_annotations_are_wanted_and_then_once(renderers: Counting, annotators: Counting) -> None:
    room = RenderedRoom(sample_scene(), SETTINGS)
    room.render(POSE, 0, ("depth",))
    assert annotators.made == 0
    for index in (1, 2):
        room.render(POSE, index, ("annotations", "depth"))
    assert annotators.made == 1 and renderers.asked[1:] == [(index, ("depth",), {"annotator": annotators}) for index in (1, 2)]


def test_geometry_is_that_of_the_room_before_if_it_is_the_same_scene_and_made_of_the_same() -> None:
    before = RenderedRoom(sample_scene(), SETTINGS)
    before.make()
    other = replace(SETTINGS, sensor=SensorConfig(read_noise_e=3.0), camera=CameraConfig(width=32, height=24))
    with closing(before), closing(RenderedRoom(sample_scene(), other, before)) as room:
        room.make()
        assert room.flat is before.flat and room.renderer.tree == before.renderer.tree
        assert RenderedRoom(sample_scene(), replace(SETTINGS, semantic_classes="coco"), before).flat is not before.flat
        assert RenderedRoom(replace(sample_scene(), seed=9), SETTINGS, before).flat is not before.flat


def test_a_room_that_cannot_be_made_says_so_when_it_is_prepared(monkeypatch: pytest.MonkeyPatch) -> None:
    def flatten(_scene: object, _catalog_dir: Path | None) -> None:
        raise SceneSynthError("no such model")

    monkeypatch.setattr(room_module, "flatten", flatten)
    with pytest.raises(SceneSynthError, match="no such model"):
        RenderedRoom(sample_scene(), SETTINGS).make()
