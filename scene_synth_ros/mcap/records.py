"""Reads MCAP records strictly: nothing is believed that the file does not hold, and no size field can ask for much memory.

Format: https://mcap.dev/spec; the records are those of the ``mcap`` library.
"""

import struct
from collections.abc import Iterator, Mapping
from io import BytesIO
from types import MappingProxyType
from typing import BinaryIO, NamedTuple, TypeVar

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Schema
from numpy.typing import NDArray

from scene_description import SceneSynthError

try:  # that of ISA-L, ten times as fast: chunks have megabytes
    from isal.isal_zlib import crc32 as crc32
except ImportError:
    from zlib import crc32 as crc32

MAX_RECORD_SIZE = 2**30
MAX_CHUNK_SIZE = 2**26
"""Bytes that a chunk may hold beside its largest record: recorders write a chunk when it is larger than they were told to make it."""
PREFIX_SIZE = 9
PLACED = np.dtype([("log_ns", "<u8"), ("offset", "<u8"), ("channel_id", "<u2")])
"""A message of a chunk: its log time, where its record begins in the chunk's records (bytes), its channel."""

_PREFIX = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_PLACED = struct.Struct("<QQH")
_UNKNOWN_CONTENT_SIZE = 2**64 - 1

R = TypeVar("R", bound=McapRecord)


class RecordError(SceneSynthError):
    """Bytes that are no MCAP records; one line."""


class Record(NamedTuple):
    """A record as it stands in a file: ``offset`` of its opcode, ``body`` without opcode and length."""

    opcode: int
    offset: int
    body: bytes


class RawMessage(NamedTuple):
    """A message record; ``data`` is a view of what it was read from."""

    channel_id: int
    log_ns: int
    publish_ns: int
    data: memoryview


class OpenChunk(NamedTuple):
    """A chunk in memory: its records, one after the other; its messages, (messages,) of ``PLACED``; its schemas and channels in order."""

    records: bytes
    messages: NDArray[np.void]
    definitions: list[Schema | Channel]


def prefix_of(record: Record) -> bytes:
    """Return opcode and length of a record, as they stand before its body."""
    return _PREFIX.pack(record.opcode, len(record.body))


def read_prefix(file: BinaryIO, offset: int, end: int) -> tuple[int, int]:
    """Read opcode and body length (bytes) of the record at ``offset`` of a file that ends at ``end``.

    Raises:
        RecordError: the record does not end before ``end``.
    """
    if end - offset < PREFIX_SIZE:
        raise RecordError(f"the file ends within a record at byte {offset}")
    file.seek(offset)
    prefix = file.read(PREFIX_SIZE)
    if len(prefix) < PREFIX_SIZE:
        raise RecordError(f"the file ends within a record at byte {offset}")
    opcode, length = _PREFIX.unpack(prefix)
    if length > end - offset - PREFIX_SIZE:
        raise RecordError(f"record of {length} bytes at byte {offset} goes beyond the end at {end}")
    return opcode, length


def read_record(file: BinaryIO, offset: int, end: int) -> Record:
    """Read the record at ``offset`` of a file that ends at ``end``.

    Raises:
        RecordError: the record does not end before ``end``, or is larger than ``MAX_RECORD_SIZE``.
    """
    opcode, length = read_prefix(file, offset, end)
    return _read_body(file, opcode, offset, length)


def read_records(file: BinaryIO, start: int, end: int, most: Mapping[int, int] = MappingProxyType({})) -> Iterator[Record]:
    """Yield the records from ``start`` to ``end``.

    ``end``: of the last byte and one.
    ``most``: opcode -> largest body (bytes); larger records are passed over without being read.

    Raises:
        RecordError: at the first byte that is no whole record.
    """
    offset = start
    while offset < end:
        opcode, length = read_prefix(file, offset, end)
        if length <= most.get(opcode, length):
            yield _read_body(file, opcode, offset, length)
        offset += PREFIX_SIZE + length


def _read_body(file: BinaryIO, opcode: int, offset: int, length: int) -> Record:
    """Read the body of a record whose prefix was read."""
    if length > MAX_RECORD_SIZE:
        raise RecordError(f"record of {length} bytes at byte {offset}; at most {MAX_RECORD_SIZE} are read")
    file.seek(offset + PREFIX_SIZE)
    body = file.read(length)
    if len(body) < length:
        raise RecordError(f"the file ends within a record at byte {offset}")
    return Record(opcode, offset, body)


def decode(kind: type[R], body: bytes) -> R:
    """Decode the body of a record.

    Raises:
        RecordError: the body is no record of that kind.
    """
    try:
        return kind.read(ReadDataStream(BytesIO(body)))  # type: ignore[attr-defined, no-any-return]
    except (McapError, struct.error, ValueError, OverflowError) as error:
        raise RecordError(f"no {kind.__name__} record: {' '.join(str(error).split())[:100] or 'cut off'}") from None


def decode_definition(opcode: int, body: bytes) -> Schema | Channel:
    """Decode the body of a schema record, or of a channel record.

    Raises:
        RecordError: the body is none.
    """
    return decode(Schema, body) if opcode == Opcode.SCHEMA else decode(Channel, body)


def open_chunk(body: bytes) -> OpenChunk:
    """Decompress, verify and look through the body of a chunk record.

    Raises:
        RecordError: the chunk is damaged, compressed in an unknown way, or larger than its messages ask for.
    """
    return look_through(chunk_records(body), len(body))


def look_through(records: bytes, most: int) -> OpenChunk:
    """Find the messages, schemas and channels among records.

    Args:
        records: one after the other.
        most: how many there may be, the bytes that they have in the file: each is different, so none can be stored in less than one.

    Raises:
        RecordError: they are damaged, or more.
    """
    messages, definitions, message = bytearray(), list[Schema | Channel](), int(Opcode.MESSAGE)
    offset, number, end = 0, 0, len(records)
    while offset < end:
        if number == most:
            raise RecordError(f"chunk: expected at most {most} records in {most} bytes of the file, got more")
        start = offset + PREFIX_SIZE
        opcode, length = _PREFIX.unpack_from(records, offset) if start <= end else (0, end)
        if length > end - start:
            raise RecordError("chunk: it ends within a record")
        if opcode == message:
            if length < _MESSAGE_HEAD.size:
                raise RecordError("message: it is cut off")
            channel_id, _, log_ns, _ = _MESSAGE_HEAD.unpack_from(records, start)
            messages += _PLACED.pack(log_ns, offset, channel_id)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            definitions.append(decode_definition(opcode, records[start : start + length]))
        offset, number = start + length, number + 1
    return OpenChunk(records, np.frombuffer(messages, PLACED), definitions)


def chunk_records(body: bytes) -> bytes:
    """Decompress and verify the body of a chunk record; return the records in it as bytes.

    Raises:
        RecordError: the chunk is damaged or compressed in an unknown way.
    """
    chunk = decode(Chunk, body)
    data = _decompress(chunk)
    if len(data) != chunk.uncompressed_size:
        raise RecordError(f"chunk: expected {chunk.uncompressed_size} bytes, got {len(data)}")
    if chunk.uncompressed_crc and crc32(data) != chunk.uncompressed_crc:
        raise RecordError("chunk: its checksum does not match")
    return data


def message_at(data: bytes, offset: int) -> RawMessage:
    """Return the message record that begins at ``offset`` of decompressed records.

    Raises:
        RecordError: there is none.
    """
    if not 0 <= offset <= len(data) - PREFIX_SIZE:
        raise RecordError(f"no message at byte {offset} of a chunk of {len(data)} bytes")
    opcode, length = _PREFIX.unpack_from(data, offset)
    start = offset + PREFIX_SIZE
    if opcode != Opcode.MESSAGE or not _MESSAGE_HEAD.size <= length <= len(data) - start:
        raise RecordError(f"no message at byte {offset} of a chunk")
    channel_id, _, log_ns, publish_ns = _MESSAGE_HEAD.unpack_from(data, start)
    return RawMessage(channel_id, log_ns, publish_ns, memoryview(data)[start + _MESSAGE_HEAD.size : start + length])


def _decompress(chunk: Chunk) -> bytes:
    size, data = chunk.uncompressed_size, chunk.data
    if size > MAX_RECORD_SIZE:
        raise RecordError(f"chunk of {size} bytes; at most {MAX_RECORD_SIZE} are read")
    try:
        if chunk.compression == "":
            return data
        if chunk.compression == "zstd":
            content_size = zstandard.get_frame_parameters(data).content_size
            if content_size not in (size, _UNKNOWN_CONTENT_SIZE):
                raise RecordError(f"chunk: expected {size} bytes, got {content_size}")
            _refuse_bomb(zstandard.ZstdDecompressor().stream_reader(data), size)
            return zstandard.ZstdDecompressor().decompress(data, max_output_size=size) if size else b""
        if chunk.compression == "lz4":
            _refuse_bomb(lz4.frame.LZ4FrameFile(BytesIO(data)), size)
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size))
    except (zstandard.ZstdError, RuntimeError, MemoryError, EOFError) as error:
        raise RecordError(f"chunk: {chunk.compression}: {' '.join(str(error).split())[:100]}") from None
    raise RecordError(f"chunk: expected compression zstd, lz4 or none, got {chunk.compression[:40]!r}")


def _refuse_bomb(records: BinaryIO, size: int) -> None:
    """Refuse a compressed chunk of ``size`` bytes that is larger than its largest record and ``MAX_CHUNK_SIZE``, without holding it.

    Raises:
        RecordError: it is.
    """
    offset = largest = 0
    while size > MAX_CHUNK_SIZE + largest and size - offset >= PREFIX_SIZE:
        records.seek(offset)
        prefix = records.read(PREFIX_SIZE)
        if len(prefix) < PREFIX_SIZE:
            break
        length = PREFIX_SIZE + int(_PREFIX.unpack(prefix)[1])
        largest, offset = max(largest, min(length, size - offset)), offset + length
    if size > MAX_CHUNK_SIZE + largest:
        raise RecordError(f"chunk of {size} bytes whose largest record has {largest}; at most {MAX_CHUNK_SIZE} beside that are read")
