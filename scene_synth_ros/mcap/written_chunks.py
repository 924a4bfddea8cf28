"""What the summary of an MCAP file needs of its chunks, packed because a long bag has many."""

import struct
from collections.abc import Mapping
from typing import NamedTuple

_COUNT = struct.Struct("<HI")
_PLACE = struct.Struct("<QQQIH")


class _Place(NamedTuple):
    """Where a chunk on disk begins, its log time range, and how long its parts of :class:`WrittenChunks` are."""

    offset: int
    start_ns: int
    end_ns: int
    index_size: int
    counts_size: int


class WrittenChunks:
    """What the summary needs of the chunks on disk, packed because a long bag has many: some 300 bytes each."""

    def __init__(self) -> None:
        self._index_records, self._counts, self._places = bytearray(), bytearray(), bytearray()

    def __len__(self) -> int:
        return len(self._places) // _PLACE.size

    @property
    def index_records(self) -> bytes:
        """All chunk index records, one after the other."""
        return bytes(self._index_records)

    @property
    def index_size(self) -> int:
        """Bytes of the chunk index records."""
        return len(self._index_records)

    @property
    def last_offset(self) -> int:
        """Where the last chunk begins; -1 if there is none."""
        return self._last().offset if self._places else -1

    def _last(self) -> _Place:
        return _Place(*_PLACE.unpack_from(self._places, len(self._places) - _PLACE.size))

    def time_range_ns(self) -> tuple[int, int] | None:
        """Return first and last log time; None without chunks."""
        places = [_Place(*fields) for fields in _PLACE.iter_unpack(self._places)]
        return (min(place.start_ns for place in places), max(place.end_ns for place in places)) if places else None

    def add(self, offset: int, start_ns: int, end_ns: int, index_record: bytes, counts: Mapping[int, int]) -> None:
        """Take the next chunk; ``counts`` are its messages by channel."""
        packed = b"".join(_COUNT.pack(channel_id, count) for channel_id, count in counts.items())
        self._index_records += index_record
        self._counts += packed
        self._places += _PLACE.pack(offset, start_ns, end_ns, len(index_record), len(packed))

    def drop_last(self) -> tuple[int, dict[int, int]]:
        """Forget the last chunk; return its offset and messages by channel.

        Raises:
            LookupError: there is none.
        """
        if not self._places:
            raise LookupError("no chunk is left")
        place = self._last()
        counts = dict(_COUNT.iter_unpack(self._counts[len(self._counts) - place.counts_size :]))
        del self._counts[len(self._counts) - place.counts_size :]
        del self._index_records[len(self._index_records) - place.index_size :]
        del self._places[len(self._places) - _PLACE.size :]
        return place.offset, counts
