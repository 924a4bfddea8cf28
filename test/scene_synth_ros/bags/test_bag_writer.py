"""Bags as independent readers see them."""

import io
import os

import numpy as np
import pytest
import yaml
from bag_readers import count_in_stream, read_mcap, read_rosbags
from bag_samples import START_NS, STORE, TOPICS, write_bag
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, IndexType, Writer
from rosbags.interfaces import QosDurability, QosReliability

from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.bags.qos_metadata import OfferedQos
from scene_synth_ros.mcap.file import McapFile
from scene_synth_ros.messages.message_definitions import message_definition


@pytest.mark.parametrize("version", [9, 5])
@pytest.mark.parametrize("compression", ["zstd", "none"])
def test_rosbags_reads_every_byte(tmp_path, version, compression):
    messages = write_bag(tmp_path / "bag", metadata_version=version, compression=compression, chunk_size=3000, custom_data={"seed": "7"})
    found, topics = read_rosbags(tmp_path / "bag")
    assert sorted(found) == sorted(messages)
    assert [stamp for _, stamp, _ in found] == sorted(stamp for _, stamp, _ in found)
    for name, (type_name, qos) in TOPICS.items():
        connection = topics[name]
        assert connection.msgtype == type_name
        assert connection.msgcount == sum(topic == name for topic, _, _ in messages)
        (offered,) = connection.ext.offered_qos_profiles
        assert (offered.depth, offered.reliability) == (qos.depth, QosReliability.RELIABLE)
        assert offered.durability == (QosDurability.TRANSIENT_LOCAL if qos.depth == 1 else QosDurability.VOLATILE)
        assert connection.digest == (STORE.hash_rihs01(type_name) if version == 9 else "")


def test_mcap_decodes_every_field(tmp_path):
    messages = write_bag(tmp_path / "bag", chunk_size=3000)
    header, summary, metadata, decoded = read_mcap(tmp_path / "bag" / "bag_0.mcap", log_time_order=False)
    assert header.profile == "ros2" and header.library.startswith("scene_synth_ros ")
    assert [(channel.topic, message.log_time, message.publish_time, message.data) for _, channel, message, _ in decoded] == [
        (topic, stamp, stamp, data) for topic, stamp, data in messages
    ]
    for (topic, _, data), (schema, channel, _, message) in zip(messages, decoded, strict=True):
        assert schema.encoding == "ros2msg" and channel.message_encoding == "cdr"
        expected = STORE.deserialize_cdr(data, schema.name)
        if schema.name == "sensor_msgs/msg/Image":
            assert (message.height, message.width, message.encoding, message.step) == (16, 16, expected.encoding, expected.step)
            assert bytes(message.data) == expected.data.tobytes()
            assert (message.header.stamp.sec, message.header.frame_id) == (expected.header.stamp.sec, "camera_optical_frame")
        elif schema.name == "std_msgs/msg/String":
            assert message.data == expected.data
        elif schema.name == "sensor_msgs/msg/CameraInfo":
            assert np.array_equal(message.p, expected.p) and message.distortion_model == "plumb_bob"
        else:
            assert topic == "/tf_static" and message.transforms[0].child_frame_id == "camera_optical_frame"
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 3
    assert all(len(index.message_index_offsets) for index in summary.chunk_indexes)
    assert {record.name for record in metadata} == {"rosbag2"} and len(metadata) == 2
    last = yaml.safe_load(metadata[-1].metadata["serialized_metadata"])
    assert last == yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


def test_metadata_of_version_9_has_rosbag2s_fields_in_order(tmp_path):
    messages = write_bag(tmp_path / "bag", frames=3, custom_data={"seed": "7"})
    info = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    topics = info.pop("topics_with_message_count")
    span = messages[-1][1] - START_NS
    assert list(info.items()) == [
        ("version", 9),
        ("storage_identifier", "mcap"),
        ("duration", {"nanoseconds": span}),
        ("starting_time", {"nanoseconds_since_epoch": START_NS}),
        ("message_count", len(messages)),
        ("compression_format", ""),
        ("compression_mode", ""),
        ("relative_file_paths", ["bag_0.mcap"]),
        (
            "files",
            [
                {
                    "path": "bag_0.mcap",
                    "starting_time": {"nanoseconds_since_epoch": START_NS},
                    "duration": {"nanoseconds": span},
                    "message_count": len(messages),
                }
            ],
        ),
        ("custom_data", {"seed": "7"}),
        ("ros_distro", "jazzy"),
    ]
    infinite = {"sec": 9223372036, "nsec": 854775807}
    assert topics[0] == {
        "topic_metadata": {
            "name": "/synth/scene",
            "type": "std_msgs/msg/String",
            "serialization_format": "cdr",
            "offered_qos_profiles": [
                {
                    "history": "keep_last",
                    "depth": 1,
                    "reliability": "reliable",
                    "durability": "transient_local",
                    "deadline": infinite,
                    "lifespan": infinite,
                    "liveliness": "automatic",
                    "liveliness_lease_duration": infinite,
                    "avoid_ros_namespace_conventions": False,
                }
            ],
            "type_description_hash": STORE.hash_rihs01("std_msgs/msg/String"),
        },
        "message_count": 1,
    }


@pytest.mark.parametrize("compression", ["zstd", "none"])
def test_file_equals_that_of_the_mcap_librarys_writer(tmp_path, compression):
    kinds = {"zstd": CompressionType.ZSTD, "none": CompressionType.NONE}
    text = message_definition("sensor_msgs/msg/Image").text.encode()
    stream = io.BytesIO()
    theirs = Writer(stream, chunk_size=2000, compression=kinds[compression], index_types=~IndexType.ATTACHMENT)
    theirs.start("ros2", f"scene_synth_ros {LIBRARY_IDENTIFIER}")
    path = tmp_path / "ours.mcap"
    with path.open("xb", buffering=0) as file:
        ours = McapFile(file, chunk_size=2000, compression=compression, level=3)
        for writer in (theirs, ours):
            writer.add_metadata("rosbag2", {"a": "b"})
        theirs.register_schema("sensor_msgs/msg/Image", "ros2msg", text)
        ours.add_schema("sensor_msgs/msg/Image", "ros2msg", text)
        for number in range(2):
            theirs.register_channel(f"/{number}", "cdr", 1, {"offered_qos_profiles": "", "topic_type_hash": "x"})
            ours.add_channel(f"/{number}", 1, {"offered_qos_profiles": "", "topic_type_hash": "x"})
        rng = np.random.default_rng(1)
        for number in range(40):
            data = rng.bytes(int(rng.integers(0, 900)))
            theirs.add_message(1 + number % 2, 1000 + number, data, 900 + number)
            ours.add_message(1 + number % 2, 1000 + number, 900 + number, data)
        theirs.flush()
        theirs.add_metadata("rosbag2", {"c": "d"})
        theirs.finish()
        ours.finish(lambda: {"rosbag2": {"c": "d"}})
    assert path.read_bytes() == stream.getvalue()


def test_a_bag_without_messages_is_whole(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/a", "std_msgs/msg/String")
    found, topics = read_rosbags(tmp_path / "bag")
    assert found == [] and topics["/a"].msgcount == 0
    assert sorted(os.listdir(tmp_path / "bag")) == ["bag_0.mcap", "metadata.yaml"]


def test_existing_folder_and_file_are_refused_and_kept(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("kept")
    for path in (tmp_path / "folder", tmp_path / "file"):
        with pytest.raises(BagWriteError) as error:
            BagWriter(path)
        assert str(error.value) == f"{path} exists; choose another name or remove it"
    assert os.listdir(tmp_path / "folder") == [] and (tmp_path / "file").read_text() == "kept"
    with pytest.raises(BagWriteError, match="file exists; choose another name or remove it"):
        BagWriter(tmp_path / "file" / "bag")


def test_misuse_is_refused(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic("/a", "std_msgs/msg/String")
    writer.add_topic("/a", "std_msgs/msg/String")
    with pytest.raises(ValueError, match="topic /a: expected type std_msgs/msg/String as before, got sensor_msgs/msg/Image"):
        writer.add_topic("/a", "sensor_msgs/msg/Image")
    with pytest.raises(ValueError, match="topic /b: expected a topic that was added before"):
        writer.write("/b", b"", 1, 1)
    with pytest.raises(ValueError, match="expected times from 0"):
        writer.write("/a", b"", -1, 1)
    writer.write("/a", memoryview(b"\0\1\0\0\1\0\0\0\0"), 1, 1)
    assert writer.counts == {"/a": 1}
    writer.close()
    writer.close()
    assert writer.counts == {"/a": 1}
    with pytest.raises(BagWriteError, match="is closed"):
        writer.write("/a", b"", 1, 1)
    with pytest.raises(ValueError, match="metadata_version: expected one of"):
        BagWriter(tmp_path / "c", metadata_version=8)
    assert not (tmp_path / "c").exists()


def test_rclpy_profiles_are_taken(tmp_path):
    from rclpy.qos import QoSProfile, QoSReliabilityPolicy

    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/a", "std_msgs/msg/String", [QoSProfile(depth=3, reliability=QoSReliabilityPolicy.BEST_EFFORT)])
        writer.add_topic("/b", "std_msgs/msg/String", [OfferedQos(depth=3, reliability="best_effort")])
    _, topics = read_rosbags(tmp_path / "bag")
    assert topics["/a"].ext == topics["/b"].ext


def test_same_messages_same_bytes(tmp_path):
    write_bag(tmp_path / "one" / "bag")
    write_bag(tmp_path / "two" / "bag")
    for name in ("bag_0.mcap", "metadata.yaml"):
        assert (tmp_path / "one" / "bag" / name).read_bytes() == (tmp_path / "two" / "bag" / name).read_bytes()


def test_topics_may_be_added_between_messages(tmp_path):
    with BagWriter(tmp_path / "bag", chunk_size=500) as writer:
        writer.add_topic("/first", "std_msgs/msg/String")
        for number in range(60):
            writer.write("/first", bytes(90), number, number)
            writer.add_topic(f"/{number}", "std_msgs/msg/String")
            writer.write(f"/{number}", bytes(50), number, number)
    assert count_in_stream(tmp_path / "bag" / "bag_0.mcap") == 120
    _, topics = read_rosbags(tmp_path / "bag")
    assert [topics[f"/{number}"].msgcount for number in range(60)] == [1] * 60 and topics["/first"].msgcount == 60
