"""The contents of one MCAP file: by its index where it has a sound one, by reading through it where it is unfinished or damaged."""

import os
import struct
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, ChunkIndex, Footer, Header, Metadata, Schema, Statistics

from scene_description import SceneSynthError
from scene_synth_ros.mcap.records import (
    PREFIX_SIZE,
    OpenChunk,
    RawMessage,
    RecordError,
    crc32,
    decode,
    decode_definition,
    look_through,
    message_at,
    open_chunk,
    prefix_of,
    read_prefix,
    read_record,
    read_records,
)
from scene_synth_ros.mcap.stored_file import OpenableFile

MAX_ATTACHMENT_SIZE = 64 * 2**20
MAX_DEFINITIONS_SIZE = 64 * 2**20
"""Bytes of all schemas and channels of a file."""
MAGIC = b"\x89MCAP0\r\n"

_MOST = {int(Opcode.ATTACHMENT): MAX_ATTACHMENT_SIZE}
_INDEXED = {int(Opcode.METADATA_INDEX): Opcode.METADATA, int(Opcode.ATTACHMENT_INDEX): Opcode.ATTACHMENT}
"""Record of the index -> what it points to."""
_OFFSET = struct.Struct("<Q")
_FOOTER_SIZE = PREFIX_SIZE + 20
_CHUNK_TIMES = struct.Struct("<QQ")


class McapReadError(SceneSynthError):
    """A file that cannot be opened as MCAP; one line."""


class ChannelInfo(NamedTuple):
    """A channel with name and text of its schema."""

    topic: str
    type_name: str
    encoding: str
    metadata: dict[str, str]
    schema_text: str = ""


class McapContents:
    """One open MCAP file; of its messages one chunk at a time is in memory, of the rest what its index, metadata and attachments hold.

    Args:
        path: the file; its text is its whole path.
        report: called with one line for everything that is wrong; reading goes on with what is sound.

    Attributes:
        channels: by id; those without a known schema have an empty type name.
        counts: messages by channel id, of the statistics or, without an index, as found.
        time_range_ns: first and last log time; None without messages.
        finished: whether the file ends as it should.
        metadata: metadata records by name, the last of each.
        attachments: attached files by name; those larger than ``MAX_ATTACHMENT_SIZE`` are not read.

    Raises:
        McapReadError: the file cannot be read or is no MCAP file.
    """

    def __init__(self, path: OpenableFile, report: Callable[[str], None]) -> None:
        self.path = path
        self.channels: dict[int, ChannelInfo] = {}
        self.counts: dict[int, int] = {}
        self.time_range_ns: tuple[int, int] | None = None
        self.finished = False
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self._report = report
        self._schemas: dict[int, tuple[str, str]] = {}
        self._room_for_definitions = MAX_DEFINITIONS_SIZE
        self._chunks: list[ChunkIndex] | None = None
        with ExitStack() as undo:
            try:
                self._file = undo.enter_context(path.open("rb"))
                self._size = self._file.seek(0, os.SEEK_END)
                self._file.seek(0)
                self._open()
            except OSError as error:
                raise McapReadError(f"{path}: {error.strerror or error}") from None
            undo.pop_all()

    def __enter__(self) -> "McapContents":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def chunks(self) -> list[ChunkIndex] | None:
        """Where the index says that chunks stand; None for a file without an index that can be used."""
        return self._chunks

    @property
    def size(self) -> int:
        """Bytes of the file when it was opened."""
        return self._size

    def _open(self) -> None:
        magic = self._file.read(len(MAGIC))
        if magic != MAGIC:
            raise McapReadError(f"{self.path}: " + ("the file is empty" if not magic else "no MCAP file, its first bytes are not MCAP's"))
        try:
            header = read_record(self._file, len(MAGIC), self._size)
            if header.opcode != Opcode.HEADER:
                raise RecordError("it does not begin with a header record")
            decode(Header, header.body)
        except RecordError as error:
            raise McapReadError(f"{self.path}: no MCAP file: {error}") from None
        self._data_start = len(MAGIC) + PREFIX_SIZE + len(header.body)
        try:
            indexed = self._read_summary()
        except RecordError as error:
            self._report(f"{self.path.name}: {error}; read without its index")
            indexed = False
        if not indexed:
            self._scan()

    def _read_summary(self) -> bool:
        """Read the summary section; return False if there is none with chunk indexes and statistics."""
        end = self._size - len(MAGIC)
        footer_start = end - _FOOTER_SIZE
        self._file.seek(max(end, 0))
        if footer_start < self._data_start or self._file.read() != MAGIC:
            raise RecordError("unfinished or truncated, it has no footer")
        record = read_record(self._file, footer_start, end)
        if record.opcode != Opcode.FOOTER:
            raise RecordError("damaged, its last record is no footer")
        footer = decode(Footer, record.body)
        self.finished = True
        if footer.summary_start == 0:
            return False
        if not self._data_start <= footer.summary_start <= footer_start:
            raise RecordError(f"index damaged, it is said to begin at byte {footer.summary_start}")
        if footer.summary_crc:
            self._verify_summary(footer, end)
        return self._take_summary(footer.summary_start, footer_start)

    def _verify_summary(self, footer: Footer, end: int) -> None:
        crc, left = 0, end - 4 - footer.summary_start
        self._file.seek(footer.summary_start)
        while left > 0 and (block := self._file.read(min(left, 2**20))):
            crc = crc32(block, crc)
            left -= len(block)
        if crc != footer.summary_crc:
            raise RecordError("index damaged, its checksum does not match")

    def _take_summary(self, start: int, end: int) -> bool:
        definitions, chunks, statistics = list[Schema | Channel](), list[ChunkIndex](), None
        left = self._size
        for record in read_records(self._file, start, end):
            if record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                definitions.append(decode_definition(record.opcode, record.body))
            elif record.opcode == Opcode.CHUNK_INDEX:
                chunks.append(decode(ChunkIndex, record.body))
            elif record.opcode == Opcode.STATISTICS:
                statistics = decode(Statistics, record.body)
            elif record.opcode in _INDEXED:
                left -= self._take_indexed(_INDEXED[record.opcode], record.body, left)
        if statistics is None or len(chunks) != statistics.chunk_count or (statistics.message_count and not chunks):
            return False
        self._verify_places(chunks, start)
        self._define(definitions)
        self._chunks = chunks
        self.counts = dict.fromkeys(self.channels, 0)
        for channel_id, count in statistics.channel_message_counts.items():
            self.counts[channel_id] = count
        if statistics.message_count:
            self.time_range_ns = (statistics.message_start_time, statistics.message_end_time)
        return True

    def _verify_places(self, chunks: Sequence[ChunkIndex], end: int) -> None:
        """Refuse an index whose chunks, with what the index says of each, do not lie one after the other before ``end``."""
        free = self._data_start
        for chunk in sorted(chunks, key=lambda chunk: chunk.chunk_start_offset):
            if chunk.chunk_start_offset < free:
                raise RecordError(f"index damaged, no chunk can begin at byte {chunk.chunk_start_offset}")
            free = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
        if free > end:
            raise RecordError(f"index damaged, a chunk is said to end at byte {free}, beyond {end}")

    def _take_indexed(self, opcode: Opcode, index: bytes, left: int) -> int:
        """Take the metadata record or attachment that an index record points to; return its bytes, at most ``left``.

        All that the index points to is no larger than the file, however often it points to the same.
        """
        if len(index) < _OFFSET.size:
            raise RecordError(f"index damaged, the place of a {opcode.name.lower()} record is cut off")
        (offset,) = _OFFSET.unpack_from(index)
        found, length = read_prefix(self._file, offset, self._size)
        if found != opcode or length > left:
            raise RecordError(f"index damaged, no {opcode.name.lower()} record at byte {offset}")
        if length <= _MOST.get(opcode, length):
            self._take_extra(opcode, read_record(self._file, offset, self._size).body)
        return length

    def _take_extra(self, opcode: int, body: bytes) -> None:
        """Take a metadata record or an attachment."""
        if opcode == Opcode.METADATA:
            metadata = decode(Metadata, body)
            self.metadata[metadata.name] = metadata.metadata
        else:
            attachment = decode(Attachment, body)
            self.attachments[attachment.name] = attachment.data

    def _define(self, definitions: Iterable[Schema | Channel]) -> None:
        """Take over schemas and channels; the first definition of an id holds.

        Raises:
            RecordError: they are larger than ``MAX_DEFINITIONS_SIZE``.
        """
        for definition in definitions:
            if isinstance(definition, Schema):
                if definition.id not in self._schemas:
                    self._schemas[definition.id] = definition.name, definition.data.decode(errors="replace")
                    self._room_for_definitions -= len(definition.name) + len(definition.data)
            elif definition.id not in self.channels:
                self.channels[definition.id] = self._channel_info(definition)
                texts = definition.topic, definition.message_encoding, *definition.metadata.keys(), *definition.metadata.values()
                self._room_for_definitions -= sum(map(len, texts))
            if self._room_for_definitions < 0:
                raise RecordError(f"its schemas and channels are larger than {MAX_DEFINITIONS_SIZE} bytes")

    def _channel_info(self, channel: Channel) -> ChannelInfo:
        if channel.schema_id not in self._schemas:
            self._report(f"{self.path.name}: topic {channel.topic[:100]} has no schema")
        name, text = self._schemas.get(channel.schema_id, ("", ""))
        return ChannelInfo(channel.topic, name, channel.message_encoding, channel.metadata, text)

    def _scan(self) -> None:
        """Find out by reading through the file what its index does not say."""
        self.channels, self._schemas, self._room_for_definitions = {}, {}, MAX_DEFINITIONS_SIZE
        counts: Counter[int] = Counter()
        times: list[int] = []
        for chunk in self._read_through(first=True):
            if len(chunk.messages):
                ids, found = np.unique(chunk.messages["channel_id"], return_counts=True)
                counts.update(dict(zip(ids.tolist(), found.tolist(), strict=True)))
                ends = [*times, int(chunk.messages["log_ns"].min()), int(chunk.messages["log_ns"].max())]
                times = [min(ends), max(ends)]
        self.counts = {**dict.fromkeys(self.channels, 0), **counts}
        self.time_range_ns = (times[0], times[1]) if times else None

    def messages(self, start_ns: int = 0, *, file_order: bool = False) -> Iterator[RawMessage]:
        """Yield the messages with log times from ``start_ns``.

        They come in the order of their chunks' first log times and, within a chunk, of their log times; or as they stand in the file.
        Damaged chunks are reported and passed over, and so are messages of unknown channels.
        """
        chunks = self._read_through(start_ns) if self._chunks is None else self._read_indexed(start_ns, file_order)
        unknown = 0
        for chunk in chunks:
            found = chunk.messages if file_order else chunk.messages[np.argsort(chunk.messages["log_ns"], kind="stable")]
            known = np.isin(found["channel_id"], list(self.channels))
            unknown += len(known) - int(known.sum())
            for offset in found["offset"][known & (found["log_ns"] >= start_ns)].tolist():
                yield message_at(chunk.records, offset)
            del chunk
        if unknown:
            self._report(f"{self.path.name}: {unknown} messages of channels that are not defined")

    def _read_indexed(self, start_ns: int, file_order: bool) -> Iterator[OpenChunk]:
        def order(index: ChunkIndex) -> tuple[int, int]:
            return (0 if file_order else index.message_start_time, index.chunk_start_offset)

        for index in sorted(self._chunks or [], key=order):
            if index.message_end_time < start_ns:
                continue
            offset = index.chunk_start_offset
            try:
                record = read_record(self._file, offset, self._size)
                if record.opcode != Opcode.CHUNK or PREFIX_SIZE + len(record.body) != index.chunk_length:
                    raise RecordError("the index says that a chunk begins here")
                yield open_chunk(record.body)
            except RecordError as error:
                self._report(f"{self.path.name}: at byte {offset}: {error}")

    def _read_through(self, start_ns: int = 0, *, first: bool = False) -> Iterator[OpenChunk]:
        """Yield what the file holds, chunk by chunk, up to its end or to the last whole record.

        ``first``: take over what is no message, and report what is damaged.
        """
        report = self._report if first else lambda _: None
        try:
            for record in read_records(self._file, self._data_start, self._size, _MOST):
                if record.opcode == Opcode.DATA_END:
                    return
                is_chunk = record.opcode == Opcode.CHUNK
                if is_chunk and len(record.body) >= _CHUNK_TIMES.size and _CHUNK_TIMES.unpack_from(record.body)[1] < start_ns:
                    continue
                try:
                    if record.opcode in _INDEXED.values():
                        if first:
                            self._take_extra(record.opcode, record.body)
                        continue
                    chunk = open_chunk(record.body) if is_chunk else look_through(prefix_of(record) + record.body, 1)
                except RecordError as error:
                    report(f"{self.path.name}: at byte {record.offset}: {error}")
                    continue
                self._define(chunk.definitions)
                yield chunk
        except RecordError as error:
            report(f"{self.path.name}: {error}; nothing after that is read")
        except OSError as error:
            report(f"{self.path.name}: {error.strerror or error}; nothing after that is read")
