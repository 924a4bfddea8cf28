"""Reading bags: whole, of other writers, unfinished, cut anywhere, with flipped bytes."""

import tracemalloc
from contextlib import suppress

import pytest
from bag_samples import LATCHED, PERIOD_NS, START_NS, STORE, STREAM, TOPICS, frame_messages, write_bag
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.commands.inspect_command import render_report


def read(path, **options):
    with BagReader(path) as reader:
        messages = [(message.topic, message.log_ns, message.data) for message in reader.messages(**options)]
        return messages, reader.summary, reader.faults


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags") / "bag"
    return folder, write_bag(folder, frames=12, chunk_size=6000, custom_data={"seed": "7"})


def test_a_whole_bag_comes_back(bag):
    folder, written = bag
    messages, summary, faults = read(folder)
    assert messages == written and faults == []
    assert (summary.start_ns, summary.end_ns, summary.finished) == (START_NS, START_NS + 11 * PERIOD_NS, True)
    assert summary.message_count == len(written) and summary.custom_data == {"seed": "7"}
    for topic in summary.topics:
        assert (topic.type_name, (topic.qos[0])) == TOPICS[topic.name]
        assert topic.type_hash == STORE.hash_rihs01(topic.type_name)
    assert {topic.qos for topic in summary.topics} == {(STREAM,), (LATCHED,)}
    assert summary.metadata.message_count == len(written)


def test_topics_and_start_are_chosen(bag):
    folder, written = bag
    start = START_NS + 5 * PERIOD_NS
    messages, _, _ = read(folder, topics=["/synth/camera/depth/image_raw"], start_ns=start)
    assert messages == [message for message in written if message[0] == "/synth/camera/depth/image_raw" and message[1] >= start]
    assert len(messages) == 7


def test_a_single_file_reads_like_its_bag(bag):
    folder, written = bag
    messages, summary, faults = read(folder / "bag_0.mcap")
    assert messages == written and faults == [] and summary.metadata is None


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4])
@pytest.mark.parametrize("plain", [False, True])
def test_files_of_the_mcap_library(tmp_path, compression, plain):
    path = tmp_path / "theirs.mcap"
    writer = Writer(str(path), chunk_size=500, compression=compression, use_chunking=not plain, use_statistics=not plain)
    writer.start("ros2")
    schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
    channel = writer.register_channel("/a", "cdr", schema, {})
    times = [5, 3, 4, 9, 12, 10, 11]
    for time in times:
        writer.add_message(channel, time, bytes([time]) * 150, time)
    writer.finish()
    assert [log_ns for _, log_ns, _ in read(path, file_order=True)[0]] == times
    messages, summary, faults = read(path)
    assert sorted(messages) == [("/a", time, bytes([time]) * 150) for time in sorted(times)]
    assert (summary.start_ns, summary.end_ns, summary.topics[0].qos, faults) == (3, 12, (), [])


def test_a_bag_of_rosbags(tmp_path):
    with RosbagsWriter(tmp_path / "bag", version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/a", "std_msgs/msg/String", typestore=STORE)
        for number in range(20):
            writer.write(connection, 1000 + number, bytes([0, 1, 0, 0, 1, 0, 0, 0, number]))
    messages, summary, faults = read(tmp_path / "bag")
    assert [(log_ns, data[-1]) for _, log_ns, data in messages] == [(1000 + number, number) for number in range(20)]
    assert faults == [] and summary.metadata.version == 8


def test_split_bags_are_read_in_the_order_of_the_metadata(tmp_path):
    first, second = write_bag(tmp_path / "a", frames=2), [message for i in (2, 3) for message in frame_messages(i)]
    with BagWriter(tmp_path / "b") as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        for topic, stamp_ns, data in second:
            writer.write(topic, data, stamp_ns, stamp_ns)
    (tmp_path / "b" / "b_0.mcap").rename(tmp_path / "a" / "a_1.mcap")
    messages, summary, faults = read(tmp_path / "a")
    assert messages == first + second and summary.message_count == len(messages)
    assert faults == ["metadata.yaml: file a_1.mcap is not mentioned"]


def test_an_unfinished_file_is_read_up_to_its_last_chunk(bag, tmp_path):
    folder, written = bag
    data = (folder / "bag_0.mcap").read_bytes()
    chunk_ends = []
    with BagReader(folder) as reader:
        chunk_ends = sorted(index.chunk_start_offset + index.chunk_length for index in reader._contents[0]._chunks)
    (tmp_path / "cut_0.mcap.active").write_bytes(data[: chunk_ends[1] + 20])
    messages, summary, faults = read(tmp_path)
    assert 0 < len(messages) < len(written) and messages == written[: len(messages)]
    assert summary.message_count == len(messages) and not summary.finished
    assert faults[:2] == ["metadata.yaml is missing", "cut_0.mcap.active: unfinished, its recorder was not closed"]
    assert any("has no footer" in fault for fault in faults) and any("nothing after that is read" in fault for fault in faults)


def test_a_damaged_chunk_is_passed_over(bag, tmp_path):
    folder, written = bag
    data = bytearray((folder / "bag_0.mcap").read_bytes())
    with BagReader(folder) as reader:
        offset = reader._contents[0]._chunks[1].chunk_start_offset
    data[offset + 200] ^= 0xFF
    (tmp_path / "a.mcap").write_bytes(data)
    messages, summary, faults = read(tmp_path / "a.mcap")
    assert 0 < len(messages) < len(written) == summary.message_count
    assert set(messages) < set(written)
    assert len(faults) == 1 and f"at byte {offset}: chunk" in faults[0]


@pytest.mark.parametrize(
    ("name", "content", "complaint"),
    [
        ("missing.mcap", None, "not found; give the folder of a bag or an .mcap file"),
        ("empty.mcap", b"", "the file is empty"),
        ("text.mcap", b"hello world", "no MCAP file, its first bytes are not MCAP's"),
        ("magic.mcap", b"\x89MCAP0\r\n", "no MCAP file: the file ends within a record at byte 8"),
        ("huge.mcap", b"\x89MCAP0\r\n\x01" + b"\xff" * 8, "record of 18446744073709551615 bytes at byte 8 goes beyond the end"),
        ("folder", "folder", "the folder holds no .mcap file"),
        ("sqlite", "sqlite", "expected MCAP storage, got 'sqlite3'; convert the bag with ros2 bag convert"),
    ],
)
def test_what_is_no_bag_is_refused_in_one_line(tmp_path, name, content, complaint):
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        path.mkdir()
        if content == "sqlite":
            (path / "metadata.yaml").write_text(
                "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths: [a.db3]\n"
                "  topics_with_message_count: []\n  starting_time: {nanoseconds_since_epoch: 0}\n  duration: {nanoseconds: 0}\n"
                "  message_count: 0\n  files: []\n"
            )
    with pytest.raises(BagReadError) as error:
        BagReader(path)
    assert str(error.value).startswith(str(path)) and complaint in str(error.value) and "\n" not in str(error.value)


NO_METADATA = ["", "[]", "rosbag2_bagfile_information: 5", "a: [", "rosbag2_bagfile_information: {version: x}", "\xff\x00"]


@pytest.mark.parametrize("text", NO_METADATA)
def test_a_metadata_file_of_nonsense_is_a_fault(bag, tmp_path, text):
    folder, written = bag
    (tmp_path / "bag_0.mcap").write_bytes((folder / "bag_0.mcap").read_bytes())
    (tmp_path / "metadata.yaml").write_bytes(text.encode("latin-1"))
    messages, _, faults = read(tmp_path)
    assert messages == written
    assert len(faults) == 1 and faults[0].startswith(f"{tmp_path}/metadata.yaml: ") and "\n" not in faults[0]


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    files = {}
    for compression in ("zstd", "none"):
        messages = write_bag(folder / compression, frames=3, size=4, chunk_size=2000, compression=compression)
        files[compression] = (folder / compression / f"{compression}_0.mcap").read_bytes()
    return folder / "victim.mcap", files, set(messages)


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(["zstd", "none"]),
    st.floats(0.0, 1.0),
    st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(1, 255)), max_size=3),
)
def test_any_damage_gives_faults_and_only_messages_that_were_written(small, compression, kept, flips):
    path, files, written = small
    data = bytearray(files[compression])
    data = data[: round(len(data) * kept)] if kept < 0.9 else data
    for place, mask in flips:
        if data:
            data[int(place * (len(data) - 1))] ^= mask
    path.write_bytes(data)
    try:
        messages, _, faults = read(path)
        text = render_report(inspect_bag(path))
    except BagReadError as error:
        assert "\n" not in str(error)
        return
    assert "Traceback" not in text
    if bytes(data) != files[compression] and set(messages) != written:
        assert faults
    if not flips:
        assert set(messages) <= written


def test_sizes_in_a_damaged_file_ask_for_no_memory(small):
    path, files, _ = small
    whole = files["none"]
    path.write_bytes(whole)
    with BagReader(path) as reader:
        starts = [index.chunk_start_offset for index in reader._contents[0]._chunks]
    places = {start + offset for start in starts[:4] for offset in range(1, 60, 4)} | set(range(len(whole) - 2500, len(whole) - 8, 61))
    tracemalloc.start()
    for place in sorted(places):
        path.write_bytes(whole[:place] + b"\xff\xff\xff\xff\xff\xff\xff\x7f" + whole[place + 8 :])
        tracemalloc.reset_peak()
        before, _ = tracemalloc.get_traced_memory()  # with what the faults of other places still hold
        with suppress(BagReadError):
            read(path)
        _, peak = tracemalloc.get_traced_memory()
        assert peak - before < 2_000_000
    tracemalloc.stop()
