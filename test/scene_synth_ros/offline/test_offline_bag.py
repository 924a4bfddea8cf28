"""Bags written without DDS: whole or not there, bytes that depend on nothing but the room and the parameters.

That they are what a recorded run holds is tested with that run, in ``test_main_job.py``.
"""

import gc
import weakref
from pathlib import Path

import pytest
from mcap.reader import make_reader
from sample_scene import sample_scene

from grammar.synthesize import FloorMap, SceneSynthesizer
from renderer.exposure import LightReading
from scene_description import SceneDescription
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.messages.frame_settings import settings_from_json
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import OfflineSettings, read_settings
from scene_synth_ros.render.room import RenderedRoom
from scene_synth_ros.suite.parameters import ParameterError
from scene_synth_ros.verify.bag_verify import verify_bag

TINY = ("camera.width:=32", "camera.height:=24", "render.samples_per_pixel:=1", "render.threads:=1")
ALL = ("scan.enabled:=true", "streams.annotations:=true", "streams.points:=true")


def settings_of(*own: str, nodes: tuple[str, ...] = (), overlay: tuple[Path, ...] = ()) -> OfflineSettings:
    words = (*(f"renderer_node.{word}" for word in (*TINY, *own)), *nodes)
    return read_settings(run_parameters(RunWords(record=Path("bag"), overlay=overlay, overrides=words)))


def floor_of(scene: SceneDescription) -> FloorMap:
    return SceneSynthesizer.from_config().floor_map(scene)


def written(folder: Path, settings: OfflineSettings, **told: object) -> Path:
    with OfflineBag(folder, settings, floor_of, **told) as bag:
        bag.add_room(sample_scene())
    return folder


def test_a_stereo_rig_with_everything_is_a_bag_without_faults_that_renders_again(tmp_path: Path) -> None:
    settings = settings_of(
        *ALL, nodes=("renderer_node_right.scan.enabled:=false", "recorder_node.images.color:=png"), overlay=(Path("stereo"),)
    )
    records = {"note": {"key": "value"}}
    bag = written(tmp_path / "bag", settings, records=records)
    assert not inspect_bag(bag).faults and verify_bag(bag).good
    with BagReader(bag) as reader:
        names = {topic.name for topic in reader.summary.topics}
        assert reader.summary.records["note"] == records["note"]
    assert {"/synth/left/color/image_raw/compressed", "/synth/right/points", "/synth/scan", "/synth/left/detections_2d", "/tf"} <= names
    again = written(tmp_path / "again" / "bag", settings, records=records)
    assert [file.read_bytes() for file in sorted(again.iterdir())] == [file.read_bytes() for file in sorted(bag.iterdir())]


def test_what_is_left_out_is_neither_recorded_nor_rendered(tmp_path: Path) -> None:
    bag = written(
        tmp_path / "bag",
        settings_of(nodes=('recorder_node.exclude:=["*/normals/*", "*/color/*", "/tf"]', "recorder_node.chunk_size:=1024")),
    )
    with BagReader(bag) as reader:
        names = {topic.name for topic in reader.summary.topics}
    assert not [name for name in names if "/normals/" in name or "/color/" in name]
    assert "/synth/camera/depth/image_raw" in names
    with next(bag.glob("*.mcap")).open("rb") as file:
        summary = make_reader(file).get_summary()
    images = [channel.id for channel in summary.channels.values() if channel.topic.endswith("/image_raw")]
    assert all(len(chunk.message_index_offsets.keys() & images) <= 1 for chunk in summary.chunk_indexes)


def test_an_exposure_that_is_held_is_that_of_every_frame(tmp_path: Path) -> None:
    settings = settings_of("render.exposure_compensation_ev:=1.0")
    with OfflineBag(tmp_path / "bag", settings, floor_of) as bag:
        bag.add_room(sample_scene(), {"renderer_node": LightReading(4.0, (0.33, 0.34))}.__getitem__)
    with BagReader(tmp_path / "bag") as reader:
        told = [bytes(message.data)[8:].rstrip(b"\0").decode() for message in reader.messages(["/synth/renderer_node/settings"])]
    assert {settings_from_json(text).exposure_ev100 for text in told} == {3.0}


def test_of_a_room_that_is_written_nothing_stays_in_memory(tmp_path: Path) -> None:
    """Without the collector of cycles, which would come when it likes."""
    rooms = []
    make = RenderedRoom.__init__

    def made(self: RenderedRoom, *values: object, **named: object) -> None:
        make(self, *values, **named)  # type: ignore[arg-type]
        rooms.append(weakref.ref(self))

    gc.collect()
    gc.disable()
    try:
        with pytest.MonkeyPatch.context() as patch, OfflineBag(tmp_path / "bag", settings_of(*ALL), floor_of) as bag:
            patch.setattr(RenderedRoom, "__init__", made)
            bag.add_room(sample_scene())
            assert [room() for room in rooms] == [None]
    finally:
        gc.enable()


def test_after_an_exception_nothing_is_left_and_a_bag_is_never_overwritten(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), OfflineBag(tmp_path / "bag", settings_of(), floor_of):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "bag").mkdir()
    with pytest.raises(BagWriteError, match="exists"):
        OfflineBag(tmp_path / "bag", settings_of(), floor_of)


def test_the_time_of_day_is_refused() -> None:
    with pytest.raises(ParameterError, match="grammar_node: parameter clock: expected simulated"):
        settings_of(nodes=("grammar_node.clock:=wall", "grammar_node.lock_step:=false"))
