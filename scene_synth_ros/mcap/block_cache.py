"""Decompressed blocks of MCAP files, the last ones that were used."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock

from scene_synth_ros.mcap.message_places import read_block
from scene_synth_ros.mcap.stored_file import Span, StoredFile


class BlockCache:
    """Reads blocks and keeps the last ones; what is larger than all that may be kept is kept alone.

    Threads: any may read; two that ask for the same block at once may both decompress it.

    Args:
        most: bytes that are kept.
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

    def __reduce__(self) -> tuple[type[BlockCache], tuple[int]]:
        """Pickle without what is kept."""
        return BlockCache, (self._most,)
