"""Reads messages of a bag in the order of stamps that somebody asks for, with only those in memory that came before they were asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.evaluate.errors import EvaluateError
from scene_synth_ros.messages.stamps import stamp_ns

MAX_HELD = 2**30
"""Bytes of messages that may wait until their stamp is asked for: some hundred frames of 640x480."""


class StampGatherer:
    """An open bag whose messages are taken by their stamps.

    Args:
        path: of the bag.
        wanted: topic -> stamps that will be asked for; all are in the bag.

    Raises:
        BagReadError: the bag cannot be read at all.
    """

    def __init__(self, path: Path, wanted: Mapping[str, Collection[int]]) -> None:
        self._reader = BagReader(path)
        self._wanted = {topic: set(stamps) for topic, stamps in wanted.items()}
        self._messages = self._reader.messages(self._wanted)
        self._held: dict[tuple[str, int], bytes] = {}
        self._size = 0

    def close(self) -> None:
        """Close the bag."""
        self._reader.close()

    def take(self, topics: Collection[str], stamp: int) -> dict[str, bytes]:
        """Return topic -> message of a stamp, of those topics that have it: the first message where several have the same stamp.

        Raises:
            EvaluateError: more than ``MAX_HELD`` bytes came before what is asked for.
        """
        needed = {(topic, stamp) for topic in topics if stamp in self._wanted.get(topic, ())}
        while needed - self._held.keys() and self._read_one():
            pass
        found = {}
        for key in needed & self._held.keys():
            found[key[0]] = self._held.pop(key)
            self._size -= len(found[key[0]])
        for topic, _ in needed:
            self._wanted[topic].discard(stamp)
        return found

    def _read_one(self) -> bool:
        message = next(self._messages, None)
        if message is None:
            return False
        stamp = stamp_ns(message.type_name, message.data)
        key = (message.topic, -1 if stamp is None else stamp)
        if key[1] in self._wanted[message.topic] and key not in self._held:
            self._held[key] = message.data
            self._size += len(message.data)
            if self._size > MAX_HELD:
                advice = "record truth and estimates in one run, or sort the bag by stamps"
                raise EvaluateError(f"{self._reader.path}: {self._size / 2**20:.0f} MB of messages came before their turn; {advice}")
        return True
