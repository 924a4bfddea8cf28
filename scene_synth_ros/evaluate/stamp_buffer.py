"""What waits while an algorithm is judged live: messages for the others of their stamp, and frames for the thread that measures."""

import queue
import threading
from collections import Counter, OrderedDict
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Generic, TypeVar

Item = TypeVar("Item")

_REMEMBERED = 8
"""How many windows of past stamps are known, by which late messages are told from early ones."""


@dataclass(frozen=True, slots=True)
class Gathered(Generic[Item]):
    """What has come with a stamp: name -> item; whole, or what had come when it was given up."""

    stamp_ns: int
    items: dict[str, Item]


class StampBuffer(Generic[Item]):
    """What waits for the other messages of its stamp.

    Threads: one thread only.

    A stamp is whole when each of ``names`` has brought it; of more than ``window`` stamps the one that came first is given up.

    Attributes:
        counts: what was left out: ``repeated``, messages of a name that its stamp has brought before; ``late``, other messages of a stamp
            that was given up before.
    """

    def __init__(self, names: Collection[str], window: int) -> None:
        self._names, self._window = frozenset(names), window
        self._waiting: OrderedDict[int, dict[str, Item]] = OrderedDict()
        self._past: OrderedDict[int, set[str]] = OrderedDict()
        self.counts: Counter[str] = Counter()

    @property
    def waiting(self) -> int:
        """How many stamps wait."""
        return len(self._waiting)

    def add(self, name: str, stamp_ns: int, item: Item) -> Gathered[Item] | None:
        """Take a message; return the stamp that it makes whole, or that is given up for it."""
        if stamp_ns in self._past:
            self.counts["repeated" if name in self._past[stamp_ns] else "late"] += 1
            self._past[stamp_ns].add(name)
            return None
        items = self._waiting.setdefault(stamp_ns, {})
        if name in items:
            self.counts["repeated"] += 1
            return None
        items[name] = item
        if items.keys() == self._names:
            return self._release(stamp_ns)
        return self._release(next(iter(self._waiting))) if len(self._waiting) > self._window else None

    def finish(self) -> list[Gathered[Item]]:
        """Give up what still waits, by stamps."""
        return [self._release(stamp) for stamp in sorted(self._waiting)]

    def _release(self, stamp_ns: int) -> Gathered[Item]:
        items = self._waiting.pop(stamp_ns)
        self._past[stamp_ns] = set(items)
        if len(self._past) > _REMEMBERED * self._window:
            self._past.popitem(last=False)
        return Gathered(stamp_ns, items)


class MeasuringThread(Generic[Item]):
    """Does one job for each item, in their order, and gives up items when too many wait.

    Threads: one thread calls the methods; jobs run in the thread of this object, which nothing that a job raises ends.

    ``failed`` is called with what a job raised; no more than ``places`` items wait.
    """

    def __init__(self, job: Callable[[Item], None], failed: Callable[[Exception], object], places: int) -> None:
        self._job, self._failed = job, failed
        self._queue: queue.Queue[Item | None] = queue.Queue()
        self._places = places
        self._thread = threading.Thread(target=self._run, name="measuring", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """How many items wait."""
        return self._queue.qsize()

    def offer(self, item: Item) -> bool:
        """Hand over an item; return False, and forget it, where too many wait."""
        if self._queue.qsize() >= self._places:
            return False
        self._queue.put(item)
        return True

    def close(self, timeout_s: float) -> bool:
        """Let the thread do what waits and end; return whether it has ended in time."""
        self._queue.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            try:
                self._job(item)
            except Exception as error:
                self._failed(error)
