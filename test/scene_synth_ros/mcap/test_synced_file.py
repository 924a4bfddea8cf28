"""A file that is synced beside its writing: what the disk refuses late is cut off like what it refuses at once."""

import errno
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.mcap.synced_file import SyncedFile


@pytest.fixture
def fail_sync(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Let the n-th sync from now on fail, and no other."""

    def arrange(number: int) -> None:
        left = [number]
        real = os.fdatasync

        def fdatasync(file: int) -> None:
            left[0] -= 1
            if left[0] == 0:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            real(file)

        monkeypatch.setattr("scene_synth_ros.mcap.synced_file.os.fdatasync", fdatasync)

    return arrange


def test_an_append_that_cannot_be_synced_is_cut_off_and_told_with_the_next(tmp_path: Path, fail_sync: Callable[[int], None]) -> None:
    with (tmp_path / "file").open("xb", buffering=0) as raw:
        file = SyncedFile(raw)
        file.append(b"first")
        fail_sync(1)
        file.append(b"second")
        with pytest.raises(OSError, match="Input/output error"):
            file.append(b"third")
        assert file.size == 5
        file.append(b"fourth")
        file.sync()
        file.close()
    assert (tmp_path / "file").read_bytes() == b"firstfourth"


def test_a_chunk_that_cannot_be_synced_ends_a_whole_bag_without_it(tmp_path: Path, fail_sync: Callable[[int], None]) -> None:
    written = 0
    with pytest.raises(BagWriteError, match=r"Input/output error; the bag is whole with \d+ of \d+ messages") as error:
        with BagWriter(tmp_path / "bag", chunk_size=1000, compression="none") as writer:
            writer.add_topic("/a", "std_msgs/msg/String")
            fail_sync(3)
            for written in range(100):
                writer.write("/a", bytes(500), written, written)
    assert written == 7, "two chunks of two messages are whole; the third fails, which the fourth hears"
    assert "with 4 of 8 messages" in str(error.value)
    assert not inspect_bag(tmp_path / "bag").faults
    with BagReader(tmp_path / "bag") as reader:
        assert [message.log_ns for message in reader.messages()] == [0, 1, 2, 3]
