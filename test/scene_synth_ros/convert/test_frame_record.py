"""What goes with frames is left out where it was not recorded, and with a word where it is damaged."""

import json
from pathlib import Path

import pytest
from dataset_bags import OURS
from room_bag import write_room_bag

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.convert.formats import FORMATS, writer_of
from scene_synth_ros.convert.source import Choice, open_source
from scene_synth_ros.convert.writer import convert
from scene_synth_ros.dataset import open_dataset
from scene_synth_ros.messages.cdr import CdrWriter

FORMATS_OF_ANYTHING = ("frames", "webdataset", "hdf5")


def changed(folder: Path, topic: str, text: str | None, which: int = 0) -> Path:
    """Write a bag of two rooms in which a text is another (None: a chunk of its own that is damaged)."""
    whole = write_room_bag(folder / "whole", layers=("color", "semantic"), records=OURS)
    count = 0
    with BagReader(whole.path) as reader, BagWriter(folder / "bag", chunk_size=1) as writer:
        writer.set_record("scene_synth", OURS["scene_synth"])
        for message in reader.messages():
            data = message.data
            if message.topic == topic:
                if count == which:
                    packed = CdrWriter()
                    packed.text(text if text is not None else "MARK" * 100)
                    data = packed.message()
                count += 1
            writer.add_topic(message.topic, message.type_name)
            writer.write(message.topic, data, message.log_ns, message.publish_ns)
    return folder / "bag"


def notes_of(bag: Path, name: str, out: Path) -> tuple[str, ...]:
    out.mkdir()
    return convert(out, open_source(str(bag), name, FORMATS[name], Choice()), writer_of(name))


@pytest.mark.parametrize("name", FORMATS_OF_ANYTHING)
def test_damaged_labels_are_said(name: str, tmp_path: Path) -> None:
    bag = changed(tmp_path, "/synth/camera/semantic/labels", '{"stamp_ns": 1000000000, "labels": {"one": 1}}')
    (note,) = notes_of(bag, name, tmp_path / "out")
    assert "frame 0 (room 0, stamp 1000000000 ns), labels of semantic: expected JSON with 'labels'" in note
    assert note.endswith("; its labels are left out")


@pytest.mark.parametrize("name", FORMATS_OF_ANYTHING)
def test_a_damaged_scene_is_said(name: str, tmp_path: Path) -> None:
    bag = changed(tmp_path, "/synth/scene", '{"camera_path": [{"stamp_ns": 1600000000}], "id": "x", "index": 1}', 1)
    (note,) = notes_of(bag, name, tmp_path / "out")
    assert "frame 3 (room 1, stamp 1600000000 ns): scene description: " in note and note.endswith("; its description is left out")


def test_a_scene_that_is_no_json_is_a_room_of_unknown_type_and_is_said(tmp_path: Path) -> None:
    data = open_dataset(changed(tmp_path, "/synth/scene", '{"camera_path": [{"stamp_ns": 1600000000}]}', 1), layers=("color",))
    assert [room.room_type for room in data.rooms] == [data.rooms[0].room_type, "unknown"]
    assert data.notes == [f"{tmp_path}/bag: room 1: expected a scene description in JSON, got other text; the type of the room is unknown"]


@pytest.mark.parametrize("topic", ["/synth/scene", "/synth/camera/semantic/labels"])
def test_a_message_whose_chunk_is_damaged_is_said(topic: str, tmp_path: Path) -> None:
    bag = changed(tmp_path, topic, None)
    file = next(bag.glob("*.mcap"))
    with BagReader(file) as reader:
        contents = reader._contents[0]
        stamp = next(message.log_ns for message in reader.messages([topic]))
        chunks = [chunk for chunk in contents.chunks or [] if chunk.message_start_time <= stamp <= chunk.message_end_time]
        channel = next(number for number, row in contents.channels.items() if row.topic == topic)
    chunk = next(chunk for chunk in chunks if channel in chunk.message_index_offsets)
    octets = bytearray(file.read_bytes())
    octets[chunk.chunk_start_offset + chunk.chunk_length - 10] ^= 0xFF
    file.write_bytes(octets)
    notes = notes_of(bag, "frames", tmp_path / "out")
    assert [note for note in notes if f"topic {topic}, stamp 1000000000 ns: chunk: " in note], notes


def test_what_was_not_recorded_is_not_missed(tmp_path: Path) -> None:
    bag = write_room_bag(tmp_path / "whole", rooms=1, layers=("color", "semantic"), records=OURS)
    with BagReader(bag.path) as reader, BagWriter(tmp_path / "bag") as writer:
        for message in reader.messages():
            if not message.topic.endswith(("labels", "scene")):
                writer.add_topic(message.topic, message.type_name)
                writer.write(message.topic, message.data, message.log_ns, message.publish_ns)
    assert notes_of(tmp_path / "bag", "frames", tmp_path / "out") == ()
    assert json.loads((tmp_path / "out" / "room_0000" / "labels.json").read_text()) == {}
    assert not (tmp_path / "out" / "room_0000" / "scene.json").exists()
