"""Where the messages of an MCAP file stand, so that each can be read alone: by its index, or by reading through a file without one."""

import struct
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator, Mapping
from threading import Lock
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from numpy.typing import NDArray

from scene_synth_ros.mcap.contents import MAGIC, ChannelInfo, McapContents
from scene_synth_ros.mcap.records import PREFIX_SIZE, RecordError, chunk_records, look_through, read_records
from scene_synth_ros.mcap.stored_file import Span, StoredFile

PLACE = np.dtype([("log_ns", "<i8"), ("block", "<i4"), ("offset", "<i4")])
"""A message: its log time, the number of its block in the file, and where it begins in the block's records (bytes)."""

Places = NDArray[np.void]
"""(messages,) of ``PLACE``, as they stand in the file."""

_INDEX_HEAD = struct.Struct("<HI")
_ENTRY = np.dtype([("log_ns", "<u8"), ("offset", "<u8")])


class FileIndex(NamedTuple):
    """What a file says of itself.

    Attributes:
        channels: by id.
        records: metadata records by name.
        chunks: None for a file without an index.
        start_ns: log time of its first message; None without messages.
    """

    channels: Mapping[int, ChannelInfo]
    records: Mapping[str, Mapping[str, str]]
    chunks: list[ChunkIndex] | None
    start_ns: int | None


class MessagePlaces(NamedTuple):
    """The messages of one file.

    Attributes:
        blocks: (blocks, 2) int64, first byte and length of the records that hold messages: chunks, or single messages outside of chunks.
        places: topic -> its messages.
    """

    blocks: NDArray[np.int64]
    places: Mapping[str, Places]


def read_index(file: StoredFile, report: Callable[[str], None]) -> FileIndex:
    """Read what a file says of itself.

    It may be finished, unfinished or damaged; ``report`` gets one line for everything that is wrong.

    Raises:
        McapReadError: it cannot be read, or is no MCAP file.
    """
    with McapContents(file, report) as contents:
        start_ns = contents.time_range_ns[0] if contents.time_range_ns else None
        return FileIndex(contents.channels, contents.metadata, contents.chunks, start_ns)


def find_messages(file: StoredFile, index: FileIndex, topics: Collection[str], report: Callable[[str], None]) -> MessagePlaces:
    """Find the messages of some topics.

    ``report`` gets one line for every part of the index that is damaged.

    Raises:
        OSError: the file cannot be read.
    """
    wanted = {channel_id: channel.topic for channel_id, channel in index.channels.items() if channel.topic in topics}
    parts: dict[str, list[Places]] = {}
    if index.chunks is None:
        blocks: list[Span] = []
        for block, messages in _read_through(file):
            _take(parts, wanted, _by_channel(messages), len(blocks))
            blocks.append(block)
    else:
        chunks = sorted(index.chunks, key=lambda chunk: chunk.chunk_start_offset)
        blocks = [Span(chunk.chunk_start_offset, chunk.chunk_length) for chunk in chunks]
        told = file.read(
            [Span(block.start + block.length, chunk.message_index_length) for block, chunk in zip(blocks, chunks, strict=True)]
        )
        for number, (chunk, data) in enumerate(zip(chunks, told, strict=True)):
            try:
                entries = _indexed(data, chunk, wanted) if chunk.message_index_length else _by_channel(_messages_in(file, blocks[number]))
                _take(parts, wanted, entries, number)
            except RecordError as error:
                report(f"{file.name}: at byte {chunk.chunk_start_offset}: {error}")
    places = {topic: np.concatenate(rows) for topic, rows in parts.items()}
    return MessagePlaces(np.array(blocks, np.int64).reshape(-1, 2), places)


def read_block(file: StoredFile, block: Span) -> bytes:
    """Return the decompressed and verified records of a block.

    Raises:
        RecordError: it is damaged.
        OSError: the file cannot be read.
    """
    (data,) = file.read([block])
    if len(data) < block.length:
        raise RecordError(f"the file ends within a record at byte {block.start}")
    opcode, length = data[0], int.from_bytes(data[1:PREFIX_SIZE], "little")
    if opcode not in (Opcode.CHUNK, Opcode.MESSAGE) or length != block.length - PREFIX_SIZE:
        raise RecordError("the index says that a chunk begins here")
    return chunk_records(data[PREFIX_SIZE:]) if opcode == Opcode.CHUNK else data


def _take(parts: dict[str, list[Places]], wanted: Mapping[int, str], entries: Iterator[tuple[int, NDArray[np.void]]], block: int) -> None:
    for channel_id, rows in entries:
        if channel_id in wanted:
            places = np.empty(len(rows), PLACE)
            places["log_ns"], places["block"], places["offset"] = rows["log_ns"], block, rows["offset"]
            parts.setdefault(wanted[channel_id], []).append(places)


def _indexed(data: bytes, chunk: ChunkIndex, wanted: Mapping[int, str]) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Yield channel id and entries of the message index records behind a chunk, those that are wanted; they share no bytes."""
    left = len(data)
    for told, offset in chunk.message_index_offsets.items():
        if told not in wanted:
            continue
        start = offset - chunk.chunk_start_offset - chunk.chunk_length + PREFIX_SIZE
        if not PREFIX_SIZE <= start <= len(data) - _INDEX_HEAD.size:
            raise RecordError(f"index damaged, no places of messages at byte {offset}")
        channel_id, size = _INDEX_HEAD.unpack_from(data, start)
        start += _INDEX_HEAD.size
        left -= size
        if channel_id != told or left < 0 or size > len(data) - start or size % _ENTRY.itemsize:
            raise RecordError(f"index damaged, no places of messages at byte {offset}")
        yield channel_id, np.frombuffer(data, _ENTRY, size // _ENTRY.itemsize, start)


def _messages_in(file: StoredFile, block: Span) -> NDArray[np.void]:
    return look_through(read_block(file, block), block.length).messages


def _by_channel(messages: NDArray[np.void]) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Yield channel id and entries of the messages in a block without an index."""
    for channel_id in np.unique(messages["channel_id"]):
        yield int(channel_id), messages[messages["channel_id"] == channel_id]


def _read_through(file: StoredFile) -> Iterator[tuple[Span, NDArray[np.void]]]:
    """Yield blocks with their messages up to the last whole record; what is damaged was told when the index was read."""
    with file.open("rb") as stream:
        size = stream.seek(0, 2)
        try:
            for record in read_records(stream, len(MAGIC), size):
                if record.opcode == Opcode.DATA_END:
                    return
                if record.opcode in (Opcode.CHUNK, Opcode.MESSAGE):
                    block = Span(record.offset, PREFIX_SIZE + len(record.body))
                    try:
                        messages = _messages_in(file, block)
                    except RecordError:
                        continue
                    yield block, messages
        except RecordError:
            return


class BlockCache:
    """Reads blocks and keeps the last ones; what is larger than all that may be kept is kept alone.

    Threads: any may read; two that ask for the same block at once may both decompress it.

    ``most``: bytes that are kept.
    """

    def __init__(self, most: int) -> None:
        self._most, self._size = most, 0
        self._kept: OrderedDict[tuple[str, Span], bytes] = OrderedDict()
        self._lock = Lock()

    def read(self, file: StoredFile, block: Span) -> bytes:
        """Return the records of a block.

        Raises:
            RecordError: it is damaged.
            OSError: the file cannot be read.
        """
        key = (str(file), block)
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key]
        records = read_block(file, block)
        with self._lock:
            if key not in self._kept:
                self._kept[key] = records
                self._size += len(records)
            while self._size > self._most and len(self._kept) > 1:
                self._size -= len(self._kept.popitem(last=False)[1])
        return records

    def __reduce__(self) -> "tuple[type[BlockCache], tuple[int]]":
        """Pickle without what is kept."""
        return BlockCache, (self._most,)
