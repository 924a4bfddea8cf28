"""Tiles that stay in memory for the next rooms, as many as a number of bytes allows."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar


class Sized(Protocol):
    """What says how much memory it takes."""

    @property
    def size_bytes(self) -> int:
        """Memory that it takes."""


Item = TypeVar("Item", bound=Sized)


class TileCache(Generic[Item]):
    """Keeps what was used last.  Bytes are counted, not items, so that a run of many rooms soon takes as much memory as it ever will.

    Threads may share it; what two of them draw at the same time is drawn twice and kept once.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._items: OrderedDict[Hashable, Item] = OrderedDict()
        self._lock = threading.Lock()
        self.size_bytes = 0

    def get(self, key: Hashable, draw: Callable[[], Item]) -> Item:
        """Return the item of a key, drawn if it is not kept; the one just asked for is kept in any case."""
        with self._lock:
            if key in self._items:
                self._items.move_to_end(key)
                return self._items[key]
        drawn = draw()
        with self._lock:
            item = self._items.setdefault(key, drawn)
            self._items.move_to_end(key)
            self.size_bytes += item.size_bytes if item is drawn else 0
            while self.size_bytes > self._max_bytes and len(self._items) > 1:
                self.size_bytes -= self._items.popitem(last=False)[1].size_bytes
            return item

    def clear(self) -> None:
        """Keep nothing."""
        with self._lock:
            self._items.clear()
            self.size_bytes = 0
