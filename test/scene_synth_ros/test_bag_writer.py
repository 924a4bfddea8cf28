"""Bags as independent readers see them, and what is left when the disk or the process fails."""

import errno
import io
import os
import signal
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest
import yaml
from bag_samples import START_NS, STORE, TOPICS, frame_messages, write_bag
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import LIBRARY_IDENTIFIER, CompressionType, IndexType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability, QosReliability

from scene_synth_ros.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.mcap_file import McapFile
from scene_synth_ros.message_definitions import message_definition
from scene_synth_ros.qos_metadata import OfferedQos


def read_rosbags(folder):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with AnyReader([folder]) as reader:
            found = [(connection.topic, stamp, bytes(data)) for connection, stamp, data in reader.messages()]
            topics = {connection.topic: connection for connection in reader.connections}
            return found, topics


def read_mcap(path, **options):
    with warnings.catch_warnings(), path.open("rb") as file:
        warnings.simplefilter("error")
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return reader.get_header(), reader.get_summary(), list(reader.iter_metadata()), list(reader.iter_decoded_messages(**options))


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


class FailingFile(io.FileIO):
    """Takes ``room`` bytes, then refuses."""

    room = 10**9
    reason = errno.ENOSPC

    def write(self, data):
        if not self.room:
            raise OSError(self.reason, os.strerror(self.reason))
        taken = super().write(bytes(data[: self.room]))
        self.room -= taken
        return taken

    def truncate(self, size=None):
        self.room += max(self.tell() - size, 0)
        return super().truncate(size)


def test_refused_chunk_is_cut_off_and_later_chunks_still_have_their_schema(tmp_path):
    file = FailingFile(tmp_path / "a.mcap", "xb")
    mcap = McapFile(file, chunk_size=10**6, compression="none")
    mcap.add_channel("/a", mcap.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n"), {})
    start = mcap.size
    mcap.add_message(1, 5, 5, bytes(1000))
    file.room = 600
    with pytest.raises(OSError, match="No space left"):
        mcap.write_chunk()
    assert mcap.size == start == (tmp_path / "a.mcap").stat().st_size
    assert mcap.counts() == {1: 0} and mcap.time_range_ns() is None
    file.room = 10**9
    mcap.add_message(1, 7, 7, b"second")
    mcap.finish(dict)
    file.close()
    with (tmp_path / "a.mcap").open("rb") as whole:
        records = [type(record).__name__ for record in StreamReader(whole, validate_crcs=True).records]
    assert records[:5] == ["Header", "Schema", "Channel", "Message", "MessageIndex"]
    _, summary, _, _ = read_mcap(tmp_path / "a.mcap", topics=[])
    assert (summary.statistics.message_count, summary.statistics.message_start_time, summary.statistics.chunk_count) == (1, 7, 1)


def fail_after(monkeypatch, room, reason):
    opened = []

    def opener(name, _mode, buffering=-1, opener=None):
        if buffering:
            return open(name, _mode, buffering, opener=opener)
        opened.append(FailingFile(name, "xb", opener=opener))
        opened[0].room, opened[0].reason = room, reason
        return opened[0]

    monkeypatch.setattr("scene_synth_ros.bag_file.open", opener, raising=False)
    return opened


@pytest.mark.parametrize("reason", [errno.ENOSPC, errno.EDQUOT])
def test_full_disk_ends_a_whole_bag_and_says_what_is_saved(tmp_path, monkeypatch, reason):
    fail_after(monkeypatch, 40_000, reason)
    with pytest.raises(BagWriteError) as error:
        write_bag(tmp_path / "bag", frames=60, chunk_size=3000)
    monkeypatch.undo()
    found, _ = read_rosbags(tmp_path / "bag")
    text = str(error.value)
    assert text.startswith(f"cannot write {tmp_path}/bag/bag_0.mcap.active: {os.strerror(reason)}; the bag is whole with {len(found)} of ")
    assert "\n" not in text
    assert 0 < len(found) < 200
    expected = [message for index in range(60) for message in frame_messages(index)]
    assert found == sorted(expected[: len(found)], key=lambda message: message[1])
    assert sorted(os.listdir(tmp_path / "bag")) == ["bag_0.mcap", "metadata.yaml"]
    read_mcap(tmp_path / "bag" / "bag_0.mcap")


def test_failing_device_leaves_every_written_chunk(tmp_path, monkeypatch):
    fail_after(monkeypatch, 40_000, errno.EIO)
    with pytest.raises(BagWriteError, match="Input/output error; the file stays unfinished, readable up to its last chunk, with") as error:
        write_bag(tmp_path / "bag", frames=60, chunk_size=3000)
    saved = int(str(error.value).split(" with ")[1].split()[0])
    assert count_in_stream(tmp_path / "bag" / "bag_0.mcap.active") == saved > 0


def count_in_stream(path):
    count = 0
    with path.open("rb") as file:
        try:
            for record in StreamReader(file, validate_crcs=True).records:
                count += type(record).__name__ == "Message"
        except Exception as error:
            assert type(error).__name__ == "EndOfFile"
    return count


LIMITED = """
import resource, signal, sys
sys.path[:0] = {path!r}
from pathlib import Path
from bag_samples import write_bag
from scene_synth_ros.bag_writer import BagWriteError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))
try:
    write_bag(Path({folder!r}), frames=3000, size=64, chunk_size=100_000)
except BagWriteError as error:
    print(error)
"""


def run_python(code, **options):
    return subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def test_a_file_size_limit_of_the_system_ends_a_whole_bag(tmp_path):
    limit = 3_000_000
    code = LIMITED.format(path=[path for path in sys.path if path], limit=limit, folder=str(tmp_path / "bag"))
    output, errors = run_python(code).communicate(timeout=60)
    assert errors == ""
    found, _ = read_rosbags(tmp_path / "bag")
    assert output.startswith(f"cannot write {tmp_path}/bag/bag_0.mcap.active: File too large; the bag is whole with {len(found)} of ")
    size = (tmp_path / "bag" / "bag_0.mcap").stat().st_size
    assert limit - 300_000 < size <= limit


def test_a_removed_folder_is_noticed(tmp_path):
    writer = BagWriter(tmp_path / "bag", chunk_size=100)
    writer.add_topic("/a", "std_msgs/msg/String")
    writer.write("/a", bytes(200), 1, 1)
    for name in os.listdir(tmp_path / "bag"):
        os.unlink(tmp_path / "bag" / name)
    os.rmdir(tmp_path / "bag")
    with pytest.raises(BagWriteError, match="the file was removed while it was written; the file stays unfinished"):
        writer.write("/a", bytes(200), 2, 2)
    with pytest.raises(BagWriteError, match="the file was removed while it was written"):
        writer.write("/a", bytes(200), 2, 2)
    writer.close()


def test_a_moved_folder_is_finished_where_it_is(tmp_path):
    writer = BagWriter(tmp_path / "bag", chunk_size=100)
    writer.add_topic("/a", "std_msgs/msg/String")
    (tmp_path / "bag").rename(tmp_path / "moved")
    writer.write("/a", bytes(200), 1, 1)
    writer.close()
    assert [stamp for _, stamp, _ in read_rosbags(tmp_path / "moved")[0]] == [1]


KILLED = """
import sys, time
sys.path[:0] = {path!r}
from bag_samples import TOPICS, frame_messages
from scene_synth_ros.bag_writer import BagWriter
writer = BagWriter({folder!r}, chunk_size=20_000)
for topic, (type_name, qos) in TOPICS.items():
    writer.add_topic(topic, type_name, [qos])
for index in range(100_000):
    for topic, stamp, data in frame_messages(index):
        writer.write(topic, data, stamp, stamp)
    print(index, flush=True)
"""


def test_a_killed_process_loses_at_most_the_chunk_in_progress(tmp_path):
    process = run_python(KILLED.format(path=[path for path in sys.path if path], folder=str(tmp_path / "bag")))
    while int(process.stdout.readline()) < 60:
        pass
    process.send_signal(signal.SIGKILL)
    rest, _ = process.communicate(timeout=30)
    last = int(rest.split("\n")[-2]) if rest.count("\n") else 60
    size = sum(len(data) + 31 for _, _, data in frame_messages(1))
    saved = count_in_stream(tmp_path / "bag" / "bag_0.mcap.active")
    assert saved * size / 4 > (last + 1) * size - 20_000 - 2 * size
    assert not (tmp_path / "bag" / "metadata.yaml").exists()


def test_same_messages_same_bytes(tmp_path):
    write_bag(tmp_path / "one" / "bag")
    write_bag(tmp_path / "two" / "bag")
    for name in ("bag_0.mcap", "metadata.yaml"):
        assert (tmp_path / "one" / "bag" / name).read_bytes() == (tmp_path / "two" / "bag" / name).read_bytes()


def test_topics_may_be_added_while_another_thread_writes(tmp_path):
    with BagWriter(tmp_path / "bag", chunk_size=500) as writer:
        writer.add_topic("/first", "std_msgs/msg/String")
        other = threading.Thread(target=lambda: [writer.write("/first", bytes(90), number, number) for number in range(400)])
        other.start()
        for number in range(60):
            writer.add_topic(f"/{number}", "std_msgs/msg/String")
            writer.write(f"/{number}", bytes(50), number, number)
        other.join()
    assert count_in_stream(tmp_path / "bag" / "bag_0.mcap") == 460
    _, topics = read_rosbags(tmp_path / "bag")
    assert [topics[f"/{number}"].msgcount for number in range(60)] == [1] * 60 and topics["/first"].msgcount == 400
