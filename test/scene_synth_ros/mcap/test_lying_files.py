"""Files whose index lies, and files that are small where they lie and large in memory, cost no more than what is kept of them."""

import io
import struct
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, McapRecord, Metadata, MetadataIndex, Schema, Statistics
from room_bag import write_room_bag

from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.indexed_bag import open_bag
from scene_synth_ros.mcap.contents import MAGIC, MAX_DEFINITIONS_SIZE, McapContents
from scene_synth_ros.mcap.records import MAX_CHUNK_SIZE
from scene_synth_ros.mcap.stored_file import LocalFile, Span

MEGABYTE = 2**20
HUGE = (0, 1, 2**31, 2**63 - 1, 2**63, 2**64 - 1)
COLOR = "/synth/camera/color/image_raw"
EMPTY = struct.pack("<BQHIQQ", Opcode.MESSAGE, 22, 1, 0, 0, 0)
"""A message without data."""


def encode(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    bag = write_room_bag(tmp_path_factory.mktemp("room") / "bag", rooms=1, size=(8, 8), chunk_size=3000, layers=("color", "depth"))
    return next(bag.path.glob("*.mcap")).read_bytes()


def summary_of(file: bytes) -> tuple[int, list[McapRecord]]:
    """Return where the summary of a file begins, and its records."""
    kinds = {Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel, Opcode.CHUNK_INDEX: ChunkIndex, Opcode.STATISTICS: Statistics}
    end = len(file) - len(MAGIC) - 29
    (start,) = struct.unpack_from("<Q", file, end + 9)
    records, at = [], start
    while at < end:
        opcode, length = struct.unpack_from("<BQ", file, at)
        if opcode in kinds:
            records.append(kinds[opcode].read(ReadDataStream(io.BytesIO(file[at + 9 : at + 9 + length]))))
        at += 9 + length
    return start, records


def with_summary(file: bytes, change: Callable[[McapRecord], McapRecord | list[McapRecord]]) -> bytes:
    """Return a file with a record of its summary changed or repeated; nothing has a checksum."""
    start, records = summary_of(file)
    changed = [change(record) for record in records]
    flat = [record for item in changed for record in (item if isinstance(item, list) else [item])]
    return file[:start] + b"".join(map(encode, flat)) + encode(Footer(start, 0, 0)) + MAGIC


def unfinished(*records: McapRecord) -> bytes:
    """Return a file without an index."""
    return MAGIC + b"".join(map(encode, (Header("ros2", "test"), *records)))


def chunk(records: bytes, compression: str) -> Chunk:
    packed = zstandard.compress(records, 19) if compression == "zstd" else lz4.frame.compress(records)
    return Chunk(
        compression=compression, data=packed, message_start_time=0, message_end_time=0, uncompressed_crc=0, uncompressed_size=len(records)
    )


def peak_of(run: Callable[[], object]) -> int:
    """Return how many bytes a call has at most beside what there was."""
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("field", ["chunk_start_offset", "chunk_length", "message_index_length", "message_index_offsets"])
@pytest.mark.parametrize("value", HUGE)
def test_an_index_that_lies_costs_neither_memory_nor_other_messages(room: bytes, tmp_path: Path, field: str, value: int) -> None:
    path, faults = tmp_path / "a.mcap", list[str]()
    first = next(record for record in summary_of(room)[1] if isinstance(record, ChunkIndex))
    lie = replace(first, **{field: dict.fromkeys(first.message_index_offsets, value) if "offsets" in field else value})
    path.write_bytes(with_summary(room, lambda record: lie if record == first else record))

    def read() -> None:
        bag = open_bag(path, faults.append)
        found.extend(message for topic in bag.types for message in bag.messages(topic))

    found: list[object] = []
    assert peak_of(read) < 3 * MEGABYTE
    (total,) = (record.message_count for record in summary_of(room)[1] if isinstance(record, Statistics))
    assert len(found) == total or (faults and len(found) >= 0.6 * total)
    assert all("\n" not in fault and "a.mcap" in fault for fault in faults)


def test_pieces_that_no_file_has_are_short(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"0123456789")
    asked = [Span(8, 2**63), Span(2**64, 5), Span(10, 1), Span(3, 4), Span(0, 2**64 - 1)]
    assert LocalFile(tmp_path / "a").read(asked) == [b"89", b"", b"", b"3456", b"0123456789"]


def test_an_index_that_names_a_chunk_many_times_is_not_used(room: bytes, tmp_path: Path) -> None:
    path, faults = tmp_path / "a.mcap", list[str]()
    chunks = sum(isinstance(record, ChunkIndex) for record in summary_of(room)[1])

    def repeat(record: McapRecord) -> McapRecord | list[McapRecord]:
        if isinstance(record, Statistics):
            return replace(record, chunk_count=1000 * chunks)
        return [record] * 1000 if isinstance(record, ChunkIndex) else record

    path.write_bytes(with_summary(room, repeat))
    bag = open_bag(path, faults.append)
    assert len(faults) == 1 and "index damaged, no chunk can begin at byte" in faults[0]
    assert len(list(bag.messages(COLOR))) == 3


def test_a_record_that_the_index_names_many_times_is_not_read_many_times(tmp_path: Path) -> None:
    head = MAGIC + encode(Header("ros2", "test"))
    record = encode(Metadata("large", {"text": "x" * MEGABYTE}))
    data = head + record + encode(DataEnd(0))
    index = encode(MetadataIndex(len(head), len(record), "large")) * 1000
    statistics = encode(Statistics(0, 0, {}, 0, 0, 0, 0, 1, 0))
    path, faults, read = tmp_path / "a.mcap", list[str](), 0
    path.write_bytes(data + statistics + index + encode(Footer(len(data), 0, 0)) + MAGIC)

    class Counted(io.FileIO):
        def readinto(self, buffer: object) -> int:
            nonlocal read
            size = super().readinto(buffer)  # type: ignore[arg-type]
            read += size
            return size

        def readall(self) -> bytes:
            nonlocal read
            data = super().readall()
            read += len(data)
            return data

    class Opened:
        name = "a.mcap"

        def open(self, mode: str) -> io.BufferedReader:
            return io.BufferedReader(Counted(path))

    with McapContents(Opened(), faults.append) as contents:
        assert contents.metadata["large"]["text"] == "x" * MEGABYTE
    assert read < 5 * path.stat().st_size and "index damaged, no metadata record at byte" in faults[0]


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_of_nothing_but_messages_without_data_is_passed_over(tmp_path: Path, compression: str) -> None:
    path = tmp_path / "a.mcap"
    many = chunk(EMPTY * (4 * MEGABYTE // len(EMPTY)), compression)
    path.write_bytes(
        unfinished(Schema(1, b"", "std_msgs/msg/Empty", "ros2msg"), Channel(1, "/a", "cdr", {}, 1), many, chunk(EMPTY, compression))
    )
    assert path.stat().st_size < 50_000

    def read() -> None:
        report = inspect_bag(path)
        assert report.message_count == 1 and any("expected at most" in fault and "records" in fault for fault in report.faults)
        with pytest.raises(LookupError):
            next(open_bag(path).messages("/a"))
            raise LookupError

    assert peak_of(read) < 20 * MEGABYTE


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_is_as_large_as_its_largest_message_asks_for(tmp_path: Path, compression: str) -> None:
    def messages(sizes: list[int]) -> bytes:
        return b"".join(
            struct.pack("<BQHIQQ", Opcode.MESSAGE, 22 + size, 1, 0, number, 0) + bytes(size) for number, size in enumerate(sizes)
        )

    path = tmp_path / "a.mcap"
    start = Schema(1, b"", "a/msg/A", "ros2msg"), Channel(1, "/a", "cdr", {}, 1)
    path.write_bytes(unfinished(*start, chunk(messages([MAX_CHUNK_SIZE]), compression)))
    assert inspect_bag(path).message_count == 1
    path.write_bytes(unfinished(*start, chunk(messages([10 * MEGABYTE] * 8), compression)))
    told: list[str] = []
    assert peak_of(lambda: told.extend(inspect_bag(path).faults)) < 5 * MEGABYTE
    assert "whose largest record has" in told[1]


def test_messages_are_read_one_by_one(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    size, count = 2 * MEGABYTE, 24
    records = b"".join(struct.pack("<BQHIQQ", Opcode.MESSAGE, 22 + size, 1, 0, number, 0) + bytes(size) for number in range(count))
    path.write_bytes(unfinished(Schema(1, b"", "a/msg/A", "ros2msg"), Channel(1, "/a", "cdr", {}, 1), chunk(records, "zstd")))

    def read() -> None:
        with BagReader(path) as reader:
            assert sum(len(message.data) for message in reader.messages()) == size * count

    assert peak_of(read) < size * count + 4 * size


def test_definitions_are_bounded(tmp_path: Path) -> None:
    path, faults = tmp_path / "a.mcap", list[str]()
    schemas = [chunk(encode(Schema(number, bytes(16 * MEGABYTE), "a/msg/A", "ros2msg")), "zstd") for number in range(1, 7)]
    path.write_bytes(unfinished(*schemas))

    def read() -> None:
        with McapContents(path, faults.append):
            pass

    assert peak_of(read) < 2.5 * MAX_DEFINITIONS_SIZE
    assert faults[1:] == [f"a.mcap: its schemas and channels are larger than {MAX_DEFINITIONS_SIZE} bytes; nothing after that is read"]
