"""What is left of a bag when the disk or the process fails."""

import errno
import io
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from bag_readers import count_in_stream, read_mcap, read_rosbags
from bag_samples import frame_messages, write_bag
from mcap.stream_reader import StreamReader

from scene_synth_ros.bags.bag_manifest import ManifestBuilder
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.mcap.file import McapFile


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

    monkeypatch.setattr("scene_synth_ros.bags.bag_file.open", opener, raising=False)
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


LIMITED = """
import resource, signal, sys
sys.path[:0] = {path!r}
from pathlib import Path
from bag_samples import write_bag
from scene_synth_ros.bags.bag_writer import BagWriteError
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
    output, errors = run_python(code).communicate(timeout=180)
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
from scene_synth_ros.bags.bag_writer import BagWriter
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
    rest, _ = process.communicate(timeout=180)
    last = int(rest.split("\n")[-2]) if rest.count("\n") else 60
    size = sum(len(data) + 31 for _, _, data in frame_messages(1))
    saved = count_in_stream(tmp_path / "bag" / "bag_0.mcap.active")
    assert saved * size / 4 > (last + 1) * size - 20_000 - 2 * size
    assert not (tmp_path / "bag" / "metadata.yaml").exists()


def open_resources():
    return {name for name in os.listdir("/proc/self/fd")}, {thread.name for thread in threading.enumerate()}


def fail(*_, **__):
    raise ZeroDivisionError("nobody foresaw this")


@pytest.mark.parametrize("method", ["add_metadata", "__init__"])
def test_a_bag_that_cannot_be_begun_leaves_nothing_open_and_no_folder(tmp_path, monkeypatch, method):
    before = open_resources()
    monkeypatch.setattr(McapFile, method, fail)
    with pytest.raises(ZeroDivisionError):
        BagWriter(tmp_path / "bag")
    assert open_resources() == before
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize("method", ["add_schema", "add_metadata"])
def test_a_file_that_cannot_be_begun_leaves_nothing_open_and_the_files_before_it_whole(tmp_path, monkeypatch, method):
    before = open_resources()
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic("/a", "std_msgs/msg/String")
    writer.write("/a", bytes(8), 1, 1)
    monkeypatch.setattr(McapFile, method, fail)
    with pytest.raises(ZeroDivisionError):
        writer.split(2)
    monkeypatch.undo()
    assert open_resources() == before
    assert sorted(os.listdir(tmp_path / "bag")) == ["bag_0.mcap", "metadata.yaml"]
    with pytest.raises(BagWriteError, match="nobody foresaw this; the bag is whole with 1 of 1 messages"):
        writer.write("/a", bytes(8), 2, 2)
    writer.close()
    assert [stamp for _, stamp, _ in read_rosbags(tmp_path / "bag")[0]] == [1]


def test_a_fault_in_the_thread_of_the_manifest_is_told_and_the_bag_goes_without_it(tmp_path, monkeypatch):
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic("/a", "std_msgs/msg/String")
    monkeypatch.setattr(ManifestBuilder, "add", fail)
    writer.write("/a", bytes(8), 1, 1)
    with pytest.raises(ZeroDivisionError, match="nobody foresaw this"):
        for _ in range(100):
            writer.write("/a", bytes(8), 2, 2)
            time.sleep(0.05)
    writer.close()
    with BagReader(tmp_path / "bag") as reader:
        assert reader.summary.finished and reader.summary.message_count >= 1
        assert not reader.manifests()
