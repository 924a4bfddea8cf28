"""Reads MCAP records strictly: nothing is believed that the file does not hold, and no size field can ask for much memory.

Format: https://mcap.dev/spec; the records are those of the ``mcap`` library.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from io import BytesIO
from types import MappingProxyType
from typing import BinaryIO, NamedTuple, TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Schema

from scene_description import SceneSynthError

try:  # that of ISA-L, ten times as fast: chunks have megabytes
    from isal.isal_zlib import crc32 as crc32
except ImportError:
    from zlib import crc32 as crc32

MAX_RECORD_SIZE = 2**30
PREFIX_SIZE = 9

_PREFIX = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
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
    """A message record."""

    channel_id: int
    log_ns: int
    publish_ns: int
    data: bytes


class PlacedRecord(NamedTuple):
    """Where a record stands: ``offset`` of its opcode, ``length`` of its body (bytes)."""

    opcode: int
    offset: int
    length: int


class PlacedMessage(NamedTuple):
    """A message record that was found by its place."""

    channel_id: int
    log_ns: int
    data: memoryview


class ChunkContent(NamedTuple):
    """What a chunk holds, in its order."""

    definitions: list[Schema | Channel]
    messages: list[RawMessage]


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

    Args:
        file: open for reading.
        start: offset of the first (bytes).
        end: of the last byte and one.
        most: opcode -> largest body (bytes); larger records are passed over without being read.

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


def open_chunk(body: bytes) -> ChunkContent:
    """Decompress, verify and take apart the body of a chunk record.

    Raises:
        RecordError: the chunk is damaged or compressed in an unknown way.
    """
    data = chunk_records(body)
    content = ChunkContent([], [])
    for record in records_in(data):
        take_record(content, record.opcode, data[record.offset + PREFIX_SIZE : record.offset + PREFIX_SIZE + record.length])
    return content


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


def records_in(data: bytes) -> Iterator[PlacedRecord]:
    """Yield where the records of a decompressed chunk stand.

    Raises:
        RecordError: at the first byte that is no whole record.
    """
    offset = 0
    while offset < len(data):
        if len(data) - offset < PREFIX_SIZE:
            raise RecordError("chunk: it ends within a record")
        opcode, length = _PREFIX.unpack_from(data, offset)
        if length > len(data) - offset - PREFIX_SIZE:
            raise RecordError("chunk: it ends within a record")
        yield PlacedRecord(opcode, offset, length)
        offset += PREFIX_SIZE + length


def message_at(data: bytes, offset: int) -> PlacedMessage:
    """Return the message record that begins at ``offset`` of decompressed records; its data are a view of them.

    Raises:
        RecordError: there is none.
    """
    if not 0 <= offset <= len(data) - PREFIX_SIZE:
        raise RecordError(f"no message at byte {offset} of a chunk of {len(data)} bytes")
    opcode, length = _PREFIX.unpack_from(data, offset)
    start = offset + PREFIX_SIZE
    if opcode != Opcode.MESSAGE or not _MESSAGE_HEAD.size <= length <= len(data) - start:
        raise RecordError(f"no message at byte {offset} of a chunk")
    channel_id, _, log_ns, _ = _MESSAGE_HEAD.unpack_from(data, start)
    return PlacedMessage(channel_id, log_ns, memoryview(data)[start + _MESSAGE_HEAD.size : start + length])


def take_record(content: ChunkContent, opcode: int, body: bytes) -> None:
    """Add a schema, channel or message record to ``content``; others are passed over.

    Raises:
        RecordError: the body is no such record.
    """
    if opcode == Opcode.MESSAGE:
        if len(body) < _MESSAGE_HEAD.size:
            raise RecordError("message: it is cut off")
        channel_id, _, log_ns, publish_ns = _MESSAGE_HEAD.unpack_from(body)
        content.messages.append(RawMessage(channel_id, log_ns, publish_ns, body[_MESSAGE_HEAD.size :]))
    elif opcode == Opcode.SCHEMA:
        content.definitions.append(decode(Schema, body))
    elif opcode == Opcode.CHANNEL:
        content.definitions.append(decode(Channel, body))


def _decompress(chunk: Chunk) -> bytes:
    size = chunk.uncompressed_size
    if size > MAX_RECORD_SIZE:
        raise RecordError(f"chunk of {size} bytes; at most {MAX_RECORD_SIZE} are read")
    try:
        if chunk.compression == "":
            return chunk.data
        if chunk.compression == "zstd":
            content_size = zstandard.get_frame_parameters(chunk.data).content_size
            if content_size not in (size, _UNKNOWN_CONTENT_SIZE):
                raise RecordError(f"chunk: expected {size} bytes, got {content_size}")
            return zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size) if size else b""
        if chunk.compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size))
    except (zstandard.ZstdError, RuntimeError, MemoryError, EOFError) as error:
        raise RecordError(f"chunk: {chunk.compression}: {' '.join(str(error).split())[:100]}") from None
    raise RecordError(f"chunk: expected compression zstd, lz4 or none, got {chunk.compression[:40]!r}")
