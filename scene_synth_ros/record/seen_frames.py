"""Which messages of which frames have been recorded: a room that is done again must not be in the bag twice."""

from __future__ import annotations

from collections import deque

ROOMS_KEPT = 17


class SeenFrames:
    """Remembers topics and stamps of the rooms that may still be done again; a word a frame."""

    def __init__(self) -> None:
        self._bits: dict[str, int] = {}
        self._seen: dict[int, int] = {}
        self._starts: deque[int] = deque(maxlen=ROOMS_KEPT)
        self.repeats = 0

    def is_new(self, topic: str, stamp_ns: int) -> bool:
        """Return whether a message of this topic and stamp comes for the first time, and remember it."""
        bit = self._bits.setdefault(topic, 1 << len(self._bits))
        mask = self._seen.get(stamp_ns, 0)
        if mask & bit:
            self.repeats += 1
            return False
        self._seen[stamp_ns] = mask | bit
        return True

    def begin_room(self, start_ns: int) -> None:
        """Forget what is older than the last rooms."""
        self._starts.append(start_ns)
        if len(self._starts) == ROOMS_KEPT:
            oldest = self._starts[0]
            self._seen = {stamp: mask for stamp, mask in self._seen.items() if stamp >= oldest}
