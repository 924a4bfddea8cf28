"""What is read of a file is bounded before it is read, and a file that cannot be opened leaves nothing open."""

import os
import struct
import tracemalloc
from pathlib import Path

import pytest
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, DataEnd, Footer, Header, McapRecord, Statistics

from scene_synth_ros.mcap.contents import MAGIC, MAX_ATTACHMENT_SIZE, McapContents, McapReadError

LARGE = MAX_ATTACHMENT_SIZE + 100 * 2**20


def encode(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def write_with_large_attachment(path: Path, indexed: bool) -> None:
    """Write an MCAP file without messages whose attachment is a hole of ``LARGE`` bytes, so that it takes no space on disk."""
    head = MAGIC + encode(Header("ros2", "test"))
    with path.open("wb") as file:
        file.write(head + struct.pack("<BQ", Opcode.ATTACHMENT, LARGE))
        file.seek(len(head) + 9 + LARGE)
        file.write(encode(DataEnd(0)))
        start = file.tell() if indexed else 0
        if indexed:
            file.write(encode(Statistics(1, 0, {}, 0, 0, 0, 0, 0, 0)))
            file.write(encode(AttachmentIndex(len(head), 9 + LARGE, 0, 0, LARGE, "large", "text/plain")))
        file.write(encode(Footer(start, 0, 0)) + MAGIC)


@pytest.mark.parametrize("indexed", [True, False])
def test_an_attachment_beyond_the_bound_is_not_read(tmp_path: Path, indexed: bool) -> None:
    path = tmp_path / "large.mcap"
    write_with_large_attachment(path, indexed)
    faults: list[str] = []
    tracemalloc.start()
    try:
        with McapContents(path, faults.append) as contents:
            assert (contents.attachments, contents.finished, faults) == ({}, True, [])
        assert tracemalloc.get_traced_memory()[1] < 20 * 2**20, "it must not be read before it is found too large"
    finally:
        tracemalloc.stop()


def open_files() -> set[str]:
    return {os.readlink(f"/proc/self/fd/{name}") for name in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{name}")}


@pytest.mark.parametrize("fault", [OSError(5, "Input/output error"), ZeroDivisionError("nobody foresaw this")])
def test_a_file_that_cannot_be_read_is_closed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + encode(Header("ros2", "test")))

    def read_summary(_: McapContents) -> bool:
        raise fault

    monkeypatch.setattr(McapContents, "_read_summary", read_summary)
    with pytest.raises((McapReadError, ZeroDivisionError)) as caught:
        McapContents(path, print)
    assert str(path) not in open_files(), caught
