"""An MCAP file that grows chunk by chunk and whose index never speaks of bytes that are not on disk.

The records are those of the ``mcap`` library; its ``Writer`` is not used because a write that fails leaves its statistics and its chunk
in a state from which the file cannot be finished.  Here a chunk is counted and indexed only once it is written, is synced while the next is
collected, and is cut off again if either fails.  Format: https://mcap.dev/spec.
"""

import contextlib
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import RawIOBase

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC

from scene_synth_ros.mcap.records import crc32
from scene_synth_ros.mcap.synced_file import SyncedFile
from scene_synth_ros.mcap.written_chunks import WrittenChunks

MAX_TIME_NS = 2**63 - 1
MAX_LEVEL = 22
_LZ4_MAX_LEVEL = 12

_MEDIA_TYPES = {"json": "application/json", "yaml": "application/yaml", "txt": "text/plain"}
_MESSAGE_PREFIX = struct.Struct("<BQHIQQ")
_MESSAGE_FIXED_SIZE = 22
_CHUNK_PREFIX = struct.Struct("<BQQQQI")
_CHUNK_FIXED_SIZE = 40
_MESSAGE_INDEX_FIXED_SIZE = 6
_FOOTER_PREFIX = struct.Struct("<BQQQ")
_FOOTER_FIXED_SIZE = 20


@dataclass(slots=True)
class _OpenChunk:
    """The chunk in progress: encoded records in a buffer that later chunks take over, message index, log time range.

    ``index``: channel id -> log time and offset of its messages, one after the other.
    """

    buffer: bytearray
    size: int = 0
    index: dict[int, list[int]] = field(default_factory=dict)
    message_count: int = 0
    start_ns: int = MAX_TIME_NS
    end_ns: int = 0

    @property
    def records(self) -> memoryview:
        return memoryview(self.buffer)[: self.size]

    def put(self, data: bytes) -> None:
        end = self.size + len(data)
        self.buffer += bytes(max(0, end - len(self.buffer)))
        with memoryview(self.buffer) as view:
            view[self.size : end] = data
        self.size = end


COMPRESSORS: Mapping[str, Callable[[int], Callable[[memoryview], bytes]]] = {
    "zstd": lambda level: zstandard.ZstdCompressor(level=level).compress,
    "lz4": lambda level: lambda data: bytes(lz4.frame.compress(data, compression_level=min(level, _LZ4_MAX_LEVEL))),
    "none": lambda level: bytes,
}
"""Compression -> level -> function; ``none`` has no levels."""

COMPRESSIONS = tuple(COMPRESSORS)


class McapFile:
    """The bytes of a file: chunks that are on disk or cut off, and an index that speaks of nothing else.

    Args:
        file: unbuffered, positioned at its start; stays open.
        chunk_size: a chunk is written when its uncompressed records exceed this many bytes.
        compression: ``zstd``, ``lz4`` or ``none``.
        level: 1 to 22 for zstd; lz4 has 12 of its own and takes higher ones as 12.
        profile: MCAP profile.

    Raises:
        OSError: from every method that writes; the file then ends after its last whole chunk and can still be finished.
    """

    def __init__(self, file: RawIOBase, *, chunk_size: int, compression: str = "zstd", level: int = 1, profile: str = "ros2") -> None:
        self._file = SyncedFile(file)
        self._chunk_size = chunk_size
        self._compression = "" if compression == "none" else compression
        self._compress = COMPRESSORS[compression](level)
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks = WrittenChunks()
        self._metadata_indexes: list[MetadataIndex] = []
        self._attached: list[tuple[AttachmentIndex, bytes]] = []
        self._definitions: list[bytes] = []
        self._unsynced: list[bytes] = []
        self._counts: dict[int, int] = {}
        self._open = _OpenChunk(bytearray(chunk_size))
        self._append(MCAP0_MAGIC + _encode(Header(profile, f"scene_synth_ros {LIBRARY_IDENTIFIER}")))

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._file.size

    @property
    def tail_size(self) -> int:
        """About how many bytes ``finish`` will take, metadata records excepted."""
        definitions = sum(len(schema.data) for schema in self._schemas) + 1024 * (len(self._schemas) + len(self._channels))
        return definitions + 4096 + self._chunks.index_size

    @property
    def waiting_messages(self) -> int:
        """Messages of the chunk that is not yet written."""
        return self._open.message_count

    def counts(self) -> dict[int, int]:
        """Return channel id -> messages in written chunks."""
        return dict(self._counts)

    def time_range_ns(self) -> tuple[int, int] | None:
        """Return first and last log time in written chunks; None without messages."""
        return self._chunks.time_range_ns()

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Add a schema; return its id."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, name=name, encoding=encoding, data=data))
        self._define(_encode(self._schemas[-1]))
        return len(self._schemas)

    def add_channel(self, topic: str, schema_id: int, metadata: Mapping[str, str]) -> int:
        """Add a channel of CDR messages; return its id."""
        channel_id = len(self._channels) + 1
        self._channels.append(Channel(id=channel_id, topic=topic, message_encoding="cdr", metadata=dict(metadata), schema_id=schema_id))
        self._counts[channel_id] = 0
        self._define(_encode(self._channels[-1]))
        return channel_id

    def add_message(self, channel_id: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Add a message to the chunk, which is written when it is full."""
        chunk = self._open
        chunk.index.setdefault(channel_id, []).extend((log_ns, chunk.size))
        chunk.message_count += 1
        chunk.start_ns = min(chunk.start_ns, log_ns)
        chunk.end_ns = max(chunk.end_ns, log_ns)
        chunk.put(_MESSAGE_PREFIX.pack(Opcode.MESSAGE, _MESSAGE_FIXED_SIZE + len(data), channel_id, 0, log_ns, publish_ns))
        chunk.put(data)
        if chunk.size > self._chunk_size:
            self.write_chunk()

    def write_chunk(self) -> None:
        """Write the chunk in progress with its message index and begin to sync it; one without messages stays in memory.

        Raises:
            OSError: the chunk was not written, or the one before could not be synced; their messages are dropped.
        """
        chunk = self._open
        if not chunk.message_count:
            return
        self._open = _OpenChunk(chunk.buffer)
        index_record, pieces = self._encode_chunk(chunk)
        offset, counts = self._file.size, {channel_id: len(entries) // 2 for channel_id, entries in chunk.index.items()}
        try:
            self._append(*pieces)
        except OSError:
            for definition in self._definitions:
                self._open.put(definition)
            raise
        self._unsynced, self._definitions = self._definitions, []
        self._chunks.add(offset, chunk.start_ns, chunk.end_ns, index_record, counts)
        for channel_id, count in counts.items():
            self._counts[channel_id] += count

    def _encode_chunk(self, chunk: _OpenChunk) -> tuple[bytes, tuple[bytes | bytearray, ...]]:
        """Return the index record of a chunk and its bytes in pieces, message indexes included, for the end of the file."""
        compressed, compression = self._compress(chunk.records), self._compression.encode()
        length = _CHUNK_FIXED_SIZE + len(compression) + len(compressed)
        head = b"".join(
            (
                _CHUNK_PREFIX.pack(Opcode.CHUNK, length, chunk.start_ns, chunk.end_ns, chunk.size, crc32(chunk.records)),
                struct.pack("<I", len(compression)) + compression,
                struct.pack("<Q", len(compressed)),
            )
        )
        start = self._file.size
        offsets, indexes = {}, bytearray()
        for channel_id, entries in chunk.index.items():
            offsets[channel_id] = start + len(head) + len(compressed) + len(indexes)
            size = 8 * len(entries)
            indexes += struct.pack(
                f"<BQHI{len(entries)}Q", Opcode.MESSAGE_INDEX, _MESSAGE_INDEX_FIXED_SIZE + size, channel_id, size, *entries
            )
        index = ChunkIndex(
            chunk_length=len(head) + len(compressed),
            chunk_start_offset=start,
            compression=self._compression,
            compressed_size=len(compressed),
            message_end_time=chunk.end_ns,
            message_index_length=len(indexes),
            message_index_offsets=offsets,
            message_start_time=chunk.start_ns,
            uncompressed_size=chunk.size,
        )
        return _encode(index), (head, compressed, indexes)

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write the chunk in progress, then a metadata record."""
        self.write_chunk()
        start = self._file.size
        record = _encode(Metadata(name=name, metadata=dict(data)))
        self._append(record)
        self._metadata_indexes.append(MetadataIndex(offset=start, length=len(record), name=name))

    def add_attachment(self, name: str, content: bytes) -> None:
        """Write the chunk in progress, then an attachment; what it is is told by the end of its name."""
        self.write_chunk()
        record, index = self._attachment(name, content, self._file.size)
        self._append(record)
        self._attached.append((index, content))

    def _attachment(self, name: str, content: bytes, offset: int) -> tuple[bytes, AttachmentIndex]:
        """Return the record of an attachment, and what the index says of it at a place in the file."""
        media = _MEDIA_TYPES.get(name.rpartition(".")[2], "application/octet-stream")
        time_ns = (self.time_range_ns() or (0, 0))[1]
        record = _encode(Attachment(create_time=time_ns, log_time=time_ns, name=name, media_type=media, data=content))
        index = AttachmentIndex(
            offset=offset,
            length=len(record),
            log_time=time_ns,
            create_time=time_ns,
            data_size=len(content),
            name=name,
            media_type=media,
        )
        return record, index

    def drop_last_chunk(self) -> int:
        """Give up the last written chunk and all that follows it; return how many messages it had.

        Raises:
            LookupError: no chunk is left.
        """
        with contextlib.suppress(OSError):
            self.sync()
        offset, count = self._forget_last_chunk()
        self._file.cut(offset)
        self._metadata_indexes = [entry for entry in self._metadata_indexes if entry.offset < self._file.size]
        self._attached = [(entry, content) for entry, content in self._attached if entry.offset < self._file.size]
        return count

    def _forget_last_chunk(self) -> tuple[int, int]:
        """Count and index the last chunk no more; return its offset and how many messages it had."""
        offset, counts = self._chunks.drop_last()
        for channel_id, count in counts.items():
            self._counts[channel_id] -= count
        return offset, sum(counts.values())

    def finish(
        self, metadata: Callable[[], Mapping[str, Mapping[str, str]]], attachments: Callable[[], Mapping[str, bytes]] = dict
    ) -> None:
        """Write the chunk in progress, attachments, metadata records, summary and footer.

        Args:
            metadata: returns record name -> record, called when the last chunk is on disk.
            attachments: returns file name -> content, called before ``metadata``; those that are in the file already are not repeated.

        Raises:
            OSError: the file ends after its last whole chunk; ``finish`` may be called again.
        """
        self.write_chunk()
        start = self._file.size
        indexes = list(self._metadata_indexes)
        tail, attached = bytearray(), [index for index, _ in self._attached]
        there = {index.name: content for index, content in self._attached}
        for name, content in attachments().items():
            if there.get(name) != content:
                record, index = self._attachment(name, content, start + len(tail))
                attached.append(index)
                tail += record
        for name, data in metadata().items():
            record = _encode(Metadata(name=name, metadata=dict(data)))
            indexes.append(MetadataIndex(offset=start + len(tail), length=len(record), name=name))
            tail += record
        tail += _encode(DataEnd(0))
        tail += self._summary(start + len(tail), indexes, attached)
        self._append(bytes(tail + MCAP0_MAGIC))
        self.sync()

    def _summary(self, start: int, metadata_indexes: list[MetadataIndex], attached: list[AttachmentIndex]) -> bytes:
        """Return the summary section and footer for a file whose data section ends at ``start``."""
        groups: tuple[tuple[Opcode, list[bytes]], ...] = (
            (Opcode.SCHEMA, [_encode(schema) for schema in self._schemas]),
            (Opcode.CHANNEL, [_encode(channel) for channel in self._channels]),
            (Opcode.STATISTICS, [_encode(self._statistics(len(metadata_indexes), len(attached)))]),
            (Opcode.CHUNK_INDEX, [self._chunks.index_records] if len(self._chunks) else []),
            (Opcode.ATTACHMENT_INDEX, [_encode(index) for index in attached]),
            (Opcode.METADATA_INDEX, [_encode(index) for index in metadata_indexes]),
        )
        summary, offsets = bytearray(), bytearray()
        for opcode, records in groups:
            if records:
                encoded = b"".join(records)
                offsets += _encode(SummaryOffset(group_opcode=opcode, group_start=start + len(summary), group_length=len(encoded)))
                summary += encoded
        offset_start = start + len(summary)
        summary += offsets
        crc = crc32(_FOOTER_PREFIX.pack(Opcode.FOOTER, _FOOTER_FIXED_SIZE, start, offset_start), crc32(summary))
        return bytes(summary) + _encode(Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc))

    def _statistics(self, metadata_count: int, attachment_count: int) -> Statistics:
        counts = {channel_id: count for channel_id, count in self._counts.items() if count}
        start_ns, end_ns = self.time_range_ns() or (0, 0)
        return Statistics(
            attachment_count=attachment_count,
            channel_count=len(self._channels),
            channel_message_counts=counts,
            chunk_count=len(self._chunks),
            message_count=sum(counts.values()),
            metadata_count=metadata_count,
            message_start_time=start_ns,
            message_end_time=end_ns,
            schema_count=len(self._schemas),
        )

    def _define(self, record: bytes) -> None:
        """Put a schema or channel into the chunk in progress, and again into the next one should this one not reach the disk."""
        self._definitions.append(record)
        self._open.put(record)

    def _append(self, *pieces: bytes | bytearray) -> None:
        """Write at the end of the file while nothing before waits for the disk, or leave the file as it was.

        Raises:
            OSError: this could not be written, or what was written before it could not be synced and is cut off.
        """
        self.sync()
        self._file.append(*pieces)

    def sync(self) -> None:
        """Wait until everything written is on disk.

        Raises:
            OSError: what was written last is cut off.
        """
        try:
            self._file.sync()
        except OSError:
            while self._chunks.last_offset >= self._file.size:
                self._forget_last_chunk()
            self._metadata_indexes = [entry for entry in self._metadata_indexes if entry.offset < self._file.size]
            self._definitions = [*self._unsynced, *self._definitions]
            raise
        finally:
            self._unsynced = []

    def close(self) -> None:
        """Wait for the disk; the file stays open.  Harmless when repeated."""
        self._file.close()


def _encode(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
