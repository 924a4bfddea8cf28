"""Where the messages of an MCAP file stand, so that each can be read alone: by its index, or by reading through a file without one."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from scene_synth_ros.mcap.contents import MAGIC, ChannelInfo, McapContents
from scene_synth_ros.mcap.records import PREFIX_SIZE, RecordError, chunk_records, message_at, read_records, records_in
from scene_synth_ros.mcap.stored_file import Span, StoredFile

PLACE = np.dtype([("log_ns", "<i8"), ("block", "<i4"), ("offset", "<i4")])
"""A message: its log time, the number of its block in the file, and where it begins in the block's records (bytes)."""

_INDEX_HEAD = struct.Struct("<HI")
_ENTRY = np.dtype([("log_ns", "<u8"), ("offset", "<u8")])


class MessagePlaces(NamedTuple):
    """The messages of one file.

    Attributes:
        channels: by id.
        records: metadata records of the file, by name.
        blocks: where records stand that hold messages: chunks, or single messages outside of chunks.
        places: channel id -> array of ``PLACE``, as they stand in the file.
    """

    channels: Mapping[int, ChannelInfo]
    records: Mapping[str, Mapping[str, str]]
    blocks: tuple[Span, ...]
    places: Mapping[int, NDArray[np.void]]


def find_messages(file: StoredFile, report: Callable[[str], None]) -> MessagePlaces:
    """Find the messages of a file.

    Args:
        file: finished, unfinished or damaged.
        report: called with one line for everything that is wrong; what is sound is found all the same.

    Raises:
        McapReadError: it cannot be read, or is no MCAP file.
        OSError: it cannot be read.
    """
    with McapContents(file, report) as contents:  # type: ignore[arg-type]
        channels, records, chunks = contents.channels, contents.metadata, contents.chunks
        if chunks is None:
            blocks, found = _read_through(file, report)
            return MessagePlaces(channels, records, blocks, found)
    chunks = sorted(chunks, key=lambda chunk: chunk.chunk_start_offset)
    blocks = tuple(Span(chunk.chunk_start_offset, chunk.chunk_length) for chunk in chunks)
    indexes = file.read([Span(chunk.chunk_start_offset + chunk.chunk_length, chunk.message_index_length) for chunk in chunks])
    parts: dict[int, list[NDArray[np.void]]] = {}
    for number, (chunk, index) in enumerate(zip(chunks, indexes, strict=True)):
        try:
            entries = list(_index_entries(index)) if chunk.message_index_length else list(_walk(read_block(file, blocks[number])))
        except RecordError as error:
            report(f"{file.name}: at byte {chunk.chunk_start_offset}: {error}")
            continue
        for channel_id, rows in entries:
            parts.setdefault(channel_id, []).append(_placed(rows, number))
    return MessagePlaces(channels, records, blocks, {channel_id: np.concatenate(rows) for channel_id, rows in parts.items()})


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


def _index_entries(data: bytes) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Yield channel id and entries of the message index records behind a chunk."""
    for record in records_in(data):
        start, size = record.offset + PREFIX_SIZE + _INDEX_HEAD.size, record.length - _INDEX_HEAD.size
        if record.opcode != Opcode.MESSAGE_INDEX or size < 0 or size % _ENTRY.itemsize:
            raise RecordError("index damaged, expected the places of a chunk's messages")
        channel_id, told = _INDEX_HEAD.unpack_from(data, start - _INDEX_HEAD.size)
        if told != size:
            raise RecordError(f"index damaged, expected {size} bytes of places, got {told}")
        yield channel_id, np.frombuffer(data, _ENTRY, size // _ENTRY.itemsize, start)


def _walk(records: bytes) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Yield channel id and entries of the messages in a chunk without an index."""
    found: dict[int, list[tuple[int, int]]] = {}
    for record in records_in(records):
        if record.opcode == Opcode.MESSAGE:
            message = message_at(records, record.offset)
            found.setdefault(message.channel_id, []).append((message.log_ns, record.offset))
    for channel_id, entries in found.items():
        yield channel_id, np.array(entries, _ENTRY)


def _placed(entries: NDArray[np.void], block: int) -> NDArray[np.void]:
    places = np.empty(len(entries), PLACE)
    places["log_ns"], places["block"], places["offset"] = entries["log_ns"], block, entries["offset"]
    return places


def _read_through(file: StoredFile, report: Callable[[str], None]) -> tuple[tuple[Span, ...], dict[int, NDArray[np.void]]]:
    """Find blocks and places up to the end of the last whole record; what is damaged was reported when the file was opened."""
    blocks: list[Span] = []
    parts: dict[int, list[NDArray[np.void]]] = {}
    with file.open("rb") as stream:
        size = stream.seek(0, 2)
        try:
            for record in read_records(stream, len(MAGIC), size):
                if record.opcode == Opcode.DATA_END:
                    break
                if record.opcode not in (Opcode.CHUNK, Opcode.MESSAGE):
                    continue
                block = Span(record.offset, PREFIX_SIZE + len(record.body))
                try:
                    entries = list(_walk(read_block(file, block)))
                except RecordError:
                    continue
                for channel_id, rows in entries:
                    parts.setdefault(channel_id, []).append(_placed(rows, len(blocks)))
                blocks.append(block)
        except RecordError:
            pass
    return tuple(blocks), {channel_id: np.concatenate(rows) for channel_id, rows in parts.items()}
