"""Bags of several files: each stands alone, none loses a message, and the manifest tells of every change."""

import hashlib
import os
import struct
from pathlib import Path

import pytest
from bag_samples import TOPICS, frame_messages, write_bag
from rosbags.highlevel import AnyReader

from scene_synth_ros.bags.bag_file import DiskReserve
from scene_synth_ros.bags.bag_manifest import ManifestError, TopicDigest, read_manifest
from scene_synth_ros.bags.bag_metadata import read_metadata
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter

SPLITS = (4, 9)


@pytest.fixture
def split(tmp_path: Path) -> Path:
    with BagWriter(tmp_path / "bag", compression="lz4", chunk_size=2000) as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        writer.set_record("run", {"seed": "3"})
        writer.set_attachment("parameters.yaml", b"a: 1\n")
        for index in range(12):
            messages = frame_messages(index)
            if index in SPLITS:
                writer.split(messages[0][1], {"/tf_static"})
            for topic, stamp, data in messages:
                writer.write(topic, data, stamp, stamp)
    assert len(list((tmp_path / "bag").glob("*.mcap"))) == 3
    return tmp_path / "bag"


def test_each_file_begins_with_the_latched_messages_and_stands_alone(split: Path) -> None:
    assert sorted(os.listdir(split)) == ["bag_0.mcap", "bag_1.mcap", "bag_2.mcap", "metadata.yaml"]
    first = {topic: data for topic, _, data in frame_messages(0)}
    for number, start in ((1, 4), (2, 9)):
        with BagReader(split / f"bag_{number}.mcap") as reader:
            messages = list(reader.messages(file_order=True))
            stamp = frame_messages(start)[0][1]
            assert {topic.name for topic in reader.summary.topics} == set(TOPICS)
            assert [(m.topic, m.log_ns, m.data) for m in messages[:2]] == [
                (topic, stamp, first[topic]) for topic in ("/synth/scene", "/synth/camera/semantic/labels")
            ]
            assert "/tf_static" not in {message.topic for message in messages}
            assert reader.summary.records["run"] == {"seed": "3"}
            assert reader.summary.attachments["parameters.yaml"] == b"a: 1\n"
            assert not reader.faults


def test_metadata_lists_every_file_and_other_readers_agree(split: Path) -> None:
    metadata = read_metadata(split / "metadata.yaml")
    assert [file.name for file in metadata.files] == ["bag_0.mcap", "bag_1.mcap", "bag_2.mcap"]
    with AnyReader([split]) as reader:
        found = [(connection.topic, data) for connection, _, data in reader.messages() if "image" in connection.topic]
    expected = [(topic, data) for index in range(12) for topic, _, data in frame_messages(index) if "image" in topic]
    assert sorted(found) == sorted(expected)
    assert sum(file.message_count for file in metadata.files) == metadata.message_count


def test_the_manifest_is_the_hash_of_what_the_file_holds(split: Path) -> None:
    with BagReader(split) as reader:
        manifests = [read_manifest(data) for _, data in reader.manifests()]
        for manifest, (_, messages) in zip(manifests, reader.messages_by_file(), strict=True):
            held: dict[str, list[bytes]] = {}
            for message in messages:
                held.setdefault(message.topic, []).append(struct.pack("<QQ", message.log_ns, len(message.data)) + message.data)
            expected = {topic: TopicDigest(len(parts), hashlib.sha256(b"".join(parts)).hexdigest()) for topic, parts in held.items()}
            assert manifest == expected


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"[]",
        b'{"schema": "other", "topics": {}}',
        b'{"schema": "scene_synth/manifest/1", "topics": {"/a": 3}}',
        b'{"schema": "scene_synth/manifest/1", "topics": {"/a": {"messages": Infinity, "sha256": ""}}}',
    ],
)
def test_what_is_no_manifest_is_refused(data: bytes) -> None:
    with pytest.raises(ManifestError, match=r"manifest\.json"):
        read_manifest(data)


@pytest.mark.parametrize(("compression", "level"), [("zstd", 1), ("zstd", 9), ("lz4", 1), ("lz4", 22), ("none", 1)])
def test_every_compression_is_read_by_others(tmp_path: Path, compression: str, level: int) -> None:
    messages = write_bag(tmp_path / "bag", compression=compression, compression_level=level)
    with AnyReader([tmp_path / "bag"]) as reader:
        assert sorted(data for _, _, data in reader.messages()) == sorted(data for _, _, data in messages)


def test_a_reserve_has_no_name_and_ends_with_its_descriptor(tmp_path: Path) -> None:
    folder = os.open(tmp_path, os.O_RDONLY)
    reserve = DiskReserve(folder, "reserve", 100_000)
    reserve.grow(200_000)
    assert reserve.size == 200_000
    assert os.listdir(tmp_path) == []
    reserve.release()
    reserve.release()
    os.close(folder)
