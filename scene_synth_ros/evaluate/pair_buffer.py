"""Pairs truth and estimates that arrive live, each in its own time, by equal stamps, with a bound on what waits."""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from typing import Generic, Literal, NamedTuple, TypeVar

Item = TypeVar("Item")
Side = Literal["truth", "estimate"]

_REMEMBERED = 8
"""How many windows of past stamps are known, by which late and repeated messages are told from foreign ones."""


class Pair(NamedTuple, Generic[Item]):
    """Truth and estimate of a stamp."""

    stamp_ns: int
    truth: Item
    estimate: Item


class PairBuffer(Generic[Item]):
    """What waits for its other half, of one task.

    Threads: one thread only.

    Args:
        window: how many stamps of each side may wait; of more, the one that came first is given up.

    Attributes:
        counts: what has become of the messages: ``paired``; ``missing``, truth that was given up; ``foreign``, estimates that were given
            up, whose stamp no truth has; ``late``, estimates whose truth had been given up; ``repeated``, of a stamp that was there before.
    """

    def __init__(self, window: int) -> None:
        self._window = window
        self._waiting: dict[Side, OrderedDict[int, Item]] = {"truth": OrderedDict(), "estimate": OrderedDict()}
        self._paired: deque[int] = deque(maxlen=_REMEMBERED * window)
        self._given_up: deque[int] = deque(maxlen=_REMEMBERED * window)
        self.counts: Counter[str] = Counter()

    @property
    def waiting(self) -> int:
        """How many messages wait."""
        return sum(map(len, self._waiting.values()))

    def add(self, side: Side, stamp_ns: int, item: Item) -> Pair[Item] | None:
        """Take a message; return the pair that it completes, if it does."""
        own, other = self._waiting[side], self._waiting["estimate" if side == "truth" else "truth"]
        if stamp_ns in own or stamp_ns in self._paired:
            self.counts["repeated"] += 1
            return None
        if stamp_ns in other:
            partner = other.pop(stamp_ns)
            self._paired.append(stamp_ns)
            self.counts["paired"] += 1
            return Pair(stamp_ns, item, partner) if side == "truth" else Pair(stamp_ns, partner, item)
        if side == "estimate" and stamp_ns in self._given_up:
            self.counts["late"] += 1
            return None
        own[stamp_ns] = item
        if len(own) > self._window:
            self._give_up(side)
        return None

    def finish(self) -> None:
        """Give up what still waits."""
        for side in ("truth", "estimate"):
            while self._waiting[side]:
                self._give_up(side)

    def _give_up(self, side: Side) -> None:
        stamp, _ = self._waiting[side].popitem(last=False)
        if side == "truth":
            self._given_up.append(stamp)
        self.counts["missing" if side == "truth" else "foreign"] += 1
