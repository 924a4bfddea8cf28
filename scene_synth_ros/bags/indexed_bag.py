"""A bag whose messages are read one by one, by topic and stamp, in any order: each reading opens the one chunk that holds the message.

The recorder of this package logs messages at their stamps, so that the index of its files tells where each stamp is.  Bags of others
are read through once, when a topic is asked for first.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_description import SceneSynthError
from scene_synth_ros.bags.run_info import RECORD_NAME
from scene_synth_ros.mcap.block_cache import BlockCache
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.mcap.message_places import PLACE, MessagePlaces, find_messages
from scene_synth_ros.mcap.records import RecordError, message_at
from scene_synth_ros.mcap.stored_file import StoredFile
from scene_synth_ros.messages.stamps import STAMP_READERS, stamp_ns


class MessageReadError(SceneSynthError):
    """A message that is not there or cannot be read: file, topic, stamp; one line."""


class _Found(NamedTuple):
    """The messages of a topic by stamp, equal ones in the order of the files."""

    stamps: NDArray[np.int64]
    files: NDArray[np.int32]
    places: NDArray[np.void]


_NOTHING = _Found(np.empty(0, np.int64), np.empty(0, np.int32), np.empty(0, PLACE))


class IndexedBag:
    """Messages of a bag by topic and stamp.  Holds no open file; memory: 28 bytes a message, and the cache's.

    Threads: any may read.

    Args:
        files: of the bag, in their order.
        cache: decompressed chunks are kept there.
        report: called with one line for everything that is wrong; what is sound can be read all the same.

    Attributes:
        types: topic -> type of its messages.

    Raises:
        McapReadError: no file can be read.
        OSError: a file cannot be read.
    """

    def __init__(self, files: Sequence[StoredFile], cache: BlockCache, report: Callable[[str], None]) -> None:
        self._cache, self._report = cache, report
        self._files: list[StoredFile] = []
        self._contents: list[MessagePlaces] = []
        refused: list[McapReadError] = []
        for file in files:
            try:
                contents = find_messages(file, report)
            except McapReadError as error:
                refused.append(error)
                continue
            self._files.append(file)
            self._contents.append(contents)
        if refused and not self._files:
            raise refused[0]
        for error in refused:
            report(str(error))
        self.types = {channel.topic: channel.type_name for contents in self._contents for channel in contents.channels.values()}
        self._by_stamp = all(RECORD_NAME in contents.records for contents in self._contents)
        self._topics: dict[str, _Found] = {}

    def stamps(self, topic: str) -> NDArray[np.int64]:
        """Return the stamps of a topic's messages, ascending, each once; log times of messages without a stamp."""
        return np.unique(self._found(topic).stamps)

    def __contains__(self, message: tuple[str, int]) -> bool:
        """Return whether a topic has a message of a stamp."""
        found = self._found(message[0])
        place = int(np.searchsorted(found.stamps, message[1]))
        return place < len(found.stamps) and int(found.stamps[place]) == message[1]

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

    def _message(self, found: _Found, number: int, topic: str, stamp: int) -> memoryview:
        file, place = int(found.files[number]), found.places[number]
        stored = self._files[file]
        try:
            records = self._cache.read(stored, self._contents[file].blocks[place["block"]])
            return message_at(records, int(place["offset"])).data
        except RecordError as error:
            raise MessageReadError(f"{stored}: topic {topic}, stamp {stamp} ns: {error}") from None

    def _found(self, topic: str) -> _Found:
        if topic not in self._topics:
            self.prepare([topic])
        return self._topics[topic]

    def prepare(self, topics: Collection[str]) -> None:
        """Find the messages of topics, those of bags that are read through together."""
        wanted = [topic for topic in topics if topic not in self._topics]
        log_times = {topic: self._logged(topic) for topic in wanted}
        self._topics |= log_times if self._by_stamp else self._stamped(log_times)

    def _logged(self, topic: str) -> _Found:
        """Return the messages of a topic by log time."""
        parts = [
            (file, contents.places[channel_id])
            for file, contents in enumerate(self._contents)
            for channel_id, channel in contents.channels.items()
            if channel.topic == topic and channel_id in contents.places
        ]
        if not parts:
            return _NOTHING
        places = np.concatenate([rows for _, rows in parts])
        files = np.repeat([file for file, _ in parts], [len(rows) for _, rows in parts]).astype(np.int32)
        return _sorted(places["log_ns"].astype(np.int64), files, places)

    def _stamped(self, logged: dict[str, _Found]) -> dict[str, _Found]:
        """Return the messages by the stamps that they hold; those that are damaged are left out and reported."""
        stamps = {topic: found.stamps.copy() for topic, found in logged.items()}
        sound = {topic: np.ones(len(found.stamps), bool) for topic, found in logged.items()}
        rows = [
            (int(found.files[number]), int(found.places[number]["block"]), topic, number)
            for topic, found in logged.items()
            if self.types.get(topic) in STAMP_READERS
            for number in range(len(found.stamps))
        ]
        for _, _, topic, number in sorted(rows):
            try:
                own = stamp_ns(self.types[topic], self._message(logged[topic], number, topic, int(logged[topic].stamps[number])))
            except MessageReadError as error:
                self._report(str(error))
                sound[topic][number] = False
                continue
            if own is not None:
                stamps[topic][number] = own
        return {
            topic: _sorted(stamps[topic][sound[topic]], found.files[sound[topic]], found.places[sound[topic]])
            for topic, found in logged.items()
        }


def _sorted(stamps: NDArray[np.int64], files: NDArray[np.int32], places: NDArray[np.void]) -> _Found:
    order = np.lexsort((places["offset"], places["block"], files, stamps))
    return _Found(stamps[order], files[order], places[order])
