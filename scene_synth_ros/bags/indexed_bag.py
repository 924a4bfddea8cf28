"""A bag whose messages are read one by one, by topic and stamp, in any order: each reading opens the one chunk that holds the message.

The recorder of this package logs messages at their stamps, so that the index of its files tells where each stamp is; only the beginnings
of later files are read, where latched messages are repeated.  Bags of others are read through, when a topic is asked for first.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from threading import RLock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description import SceneSynthError
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.run_info import RECORD_NAME
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.mcap.message_places import PLACE, BlockCache, FileIndex, Places, find_messages, read_index
from scene_synth_ros.mcap.records import RecordError, message_at
from scene_synth_ros.mcap.stored_file import LocalFile, Span, StoredFile
from scene_synth_ros.messages.image_reader import ReadImage, read_image, told_size
from scene_synth_ros.messages.stamps import STAMP_READERS, stamp_ns
from scene_synth_ros.messages.streams import INFO, STRING_TYPE, parse


class MessageReadError(SceneSynthError):
    """A message that is not there or cannot be read: file, topic, stamp; one line."""


class _Found(NamedTuple):
    """The messages of a topic by stamp, equal ones in the order of the files."""

    stamps: NDArray[np.int64]
    files: NDArray[np.int32]
    places: Places


_NOTHING = _Found(np.empty(0, np.int64), np.empty(0, np.int32), np.empty(0, PLACE))


CACHE_SIZE = 64 * 2**20
"""Bytes of decompressed chunks that are kept."""


def open_bag(path: Path, report: Callable[[str], None] = lambda line: None) -> "IndexedBag":
    """Return the bag at a path, a folder or one of its files.

    Raises:
        BagReadError: there is nothing to read, with the reason.
        OSError: it cannot be read.
    """
    with BagReader(path) as reader:
        for fault in reader.faults:
            report(fault)
        return open_files(reader, report)


def open_files(reader: BagReader, report: Callable[[str], None]) -> "IndexedBag":
    """Return the files that a reader has, of one bag or of several shards; ``report`` is not told again what the reader knows.

    Raises:
        OSError: a file cannot be read.
    """
    files, faults = [LocalFile(file) for file in reader.summary.files], tuple(reader.faults)
    return IndexedBag(files, BlockCache(CACHE_SIZE), lambda line: None if line in faults else report(line))


class IndexedBag:
    """Messages of a bag by topic and stamp.  Holds no open file; memory: 28 bytes for each message of the topics that were asked for.

    Threads: any may read.

    Args:
        files: of the bag, in their order.
        cache: decompressed chunks are kept there.
        report: called with one line for everything that is wrong; what is sound can be read all the same.
        wanted: returns the topics that will be asked for, of topic -> type; others are found when they are.

    Attributes:
        types: topic -> type of its messages.
        unstamped: topic -> how many of its messages are left out because their stamps cannot be read; they are counted when the topic is
            asked for first.

    Raises:
        McapReadError: no file can be read.
        OSError: a file cannot be read.
    """

    def __init__(
        self,
        files: Sequence[StoredFile],
        cache: BlockCache,
        report: Callable[[str], None],
        wanted: Callable[[Mapping[str, str]], Collection[str]] = lambda types: (),
    ) -> None:
        self._cache, self._report, self._lock = cache, report, RLock()
        self._topics: dict[str, _Found] = {}
        self.unstamped: Counter[str] = Counter()
        indexes: dict[StoredFile, FileIndex] = {}
        refused: list[McapReadError] = []
        for file in files:
            try:
                indexes[file] = read_index(file, report)
            except McapReadError as error:
                refused.append(error)
        if refused and not indexes:
            raise refused[0]
        for refusal in refused:
            report(str(refusal))
        self._files = tuple(indexes)
        self.types = {channel.topic: channel.type_name for index in indexes.values() for channel in index.channels.values()}
        self._by_stamp = all(RECORD_NAME in index.records for index in indexes.values())
        self._find(wanted(self.types), list(indexes.values()))

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Return the stamps of a topic's messages, ascending, each once; log times of types that have none, and of texts without one."""
        return np.unique(self._found(topic).stamps)

    def __contains__(self, message: tuple[str, int]) -> bool:
        """Return whether a topic has a message of a stamp."""
        found = self._found(message[0])
        place = int(np.searchsorted(found.stamps, message[1]))
        return place < len(found.stamps) and int(found.stamps[place]) == message[1]

    def messages(self, topic: str, wanted: Collection[int] | None = None) -> Iterator[tuple[int, memoryview]]:
        """Yield stamp and message of a topic by stamp, equal ones as files have them; damaged ones are reported and left out.

        ``wanted``: stamps of those that are asked for, None for all.
        """
        found = self._found(topic)
        for number, stamp in enumerate(found.stamps):
            if wanted is not None and int(stamp) not in wanted:
                continue
            try:
                yield int(stamp), self._message(found, number, topic, int(stamp))
            except MessageReadError as error:
                self._report(str(error))

    def counts(self, topic: str) -> dict[int, int]:
        """Return the stamps of a topic's messages, ascending, each with how many messages have it."""
        stamps, counts = np.unique(self._found(topic).stamps, return_counts=True)
        return dict(zip(stamps.tolist(), counts.tolist(), strict=True))

    def read_all(self, topics: Collection[str], stamp: int) -> dict[str, memoryview]:
        """Return topic -> message of a stamp, of those topics that have it; damaged ones are reported and passed over.

        Raises:
            OSError: a file cannot be read.
        """
        found = {}
        for topic in topics:
            if (topic, stamp) in self:
                try:
                    found[topic] = self.read(topic, stamp)
                except MessageReadError as error:
                    self._report(str(error))
        return found

    def read(self, topic: str, stamp: int) -> memoryview:
        """Return the serialised message of a topic with a stamp, the first where several have the same.

        Raises:
            MessageReadError: there is none, or it is damaged.
            OSError: the file cannot be read.
        """
        found, kind = self._found(topic), self.types.get(topic, "")
        first, last = (int(place) for place in np.searchsorted(found.stamps, [stamp, stamp + 1]))
        for number in range(first, last):
            data = self._message(found, number, topic, stamp)
            own = stamp_ns(kind, data) if kind in STAMP_READERS else None
            if own is None or own == stamp or not self._by_stamp:
                return data
        raise MessageReadError(f"{', '.join(map(str, self._files))}: topic {topic}: expected a message of stamp {stamp} ns, got none")

    def image(self, topic: str, stamp: int) -> ReadImage:
        """Return the image of a topic and a stamp; its size is that in the camera info of its stream and stamp, where there is one.

        Raises:
            MessageReadError, OSError: as :meth:`read`.
            CodecError: it cannot be read, or has another size.
        """
        kind = self.types.get(topic, "")
        stream = parse(topic, kind)
        info = stream.beside(INFO).topic if stream is not None else ""
        try:
            size = told_size(self.read(info, stamp)) if info in self.types and (info, stamp) in self else None
        except MessageReadError:
            size = None
        return read_image(kind, self.read(topic, stamp), topic, size)

    def _message(self, found: _Found, number: int, topic: str, stamp: int) -> memoryview:
        file, place = int(found.files[number]), found.places[number]
        stored = self._files[file]
        try:
            start, length = self._blocks[file][place["block"]]
            records = self._cache.read(stored, Span(int(start), int(length)))
            return message_at(records, int(place["offset"])).data
        except RecordError as error:
            raise MessageReadError(f"{stored}: topic {topic}, stamp {stamp} ns: {error}") from None

    def prepare(self, topics: Collection[str]) -> None:
        """Find the messages of topics, all that were not found before in one reading.

        Raises:
            McapReadError: a file cannot be read any more.
            OSError: likewise.
        """
        with self._lock:
            missing = [topic for topic in topics if topic not in self._topics]
            if missing:
                self._find(missing, [read_index(file, lambda line: None) for file in self._files])

    def _found(self, topic: str) -> _Found:
        self.prepare([topic])
        return self._topics[topic]

    def _find(self, topics: Collection[str], indexes: Sequence[FileIndex]) -> None:
        files = [find_messages(file, index, topics, self._report) for file, index in zip(self._files, indexes, strict=True)]
        self._blocks = [found.blocks for found in files]
        logged = {topic: _joined([found.places.get(topic, _NOTHING.places) for found in files]) for topic in topics}
        begins = np.array([-1 if index.start_ns is None else index.start_ns for index in indexes])
        self._topics |= self._stamped(logged, begins)

    def _stamped(self, logged: Mapping[str, _Found], begins: NDArray[np.int64]) -> dict[str, _Found]:
        """Return the messages by the stamps that they hold, reading those whose log times may be others, chunk by chunk.

        What is damaged or has no stamp is left out.  ``begins``: first log time of each file.
        """
        stamps = {topic: found.stamps.copy() for topic, found in logged.items()}
        sound = {topic: np.ones(len(found.stamps), bool) for topic, found in logged.items()}
        doubtful = [
            (int(found.files[number]), int(found.places[number]["block"]), topic, int(number))
            for topic, found in logged.items()
            if self.types.get(topic) in STAMP_READERS
            for number in np.flatnonzero((found.files > 0) & (found.stamps == begins[found.files]) | (not self._by_stamp))
        ]
        for _, _, topic, number in sorted(doubtful):
            try:
                own = stamp_ns(self.types[topic], self._message(logged[topic], number, topic, int(stamps[topic][number])))
            except MessageReadError as error:
                self._report(str(error))
                sound[topic][number] = False
                continue
            if own is not None:
                stamps[topic][number] = own
            elif self.types[topic] != STRING_TYPE:
                sound[topic][number] = False
                self.unstamped[topic] += 1
        return {
            topic: _sorted(stamps[topic][sound[topic]], found.files[sound[topic]], found.places[sound[topic]])
            for topic, found in logged.items()
        }


def _joined(of_files: Sequence[Places]) -> _Found:
    """Return the messages of a topic by log time."""
    places = np.concatenate(of_files)
    files = np.repeat(np.arange(len(of_files), dtype=np.int32), [len(rows) for rows in of_files])
    return _sorted(places["log_ns"].astype(np.int64), files, places)


def _sorted(stamps: NDArray[np.int64], files: NDArray[np.int32], places: Places) -> _Found:
    order = np.lexsort((places["offset"], places["block"], files, stamps))
    return _Found(stamps[order], files[order], places[order])
