"""Messages of one topic, read together: numbers of all of them at once, where they stand at the same places."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.messages.cdr import CdrReadError
from scene_synth_ros.messages.stamps import NANOSECONDS

Columns = tuple[Any, ...]
"""Arrays whose first axis is the message."""
_ORDERS = {0: ">", 1: "<", 6: ">", 7: "<"}
_HEADER_SIZE = 4


class UnlikeError(ValueError):
    """Messages whose later fields do not stand at the same places; ``by`` (n,) is what they differ by."""

    def __init__(self, by: NDArray[Any]) -> None:
        super().__init__("messages of different lengths")
        self.by = by


class Stack:
    """Messages of one size, read from front to back as :class:`scene_synth_ros.messages.cdr.CdrReader` reads one.

    Raises:
        CdrReadError: they are no plain CDR.  Every method raises it where they end too early.
        UnlikeError: they differ in the order of their bytes, or in the length of a text or sequence.
    """

    def __init__(self, messages: Sequence[memoryview]) -> None:
        self._bytes = np.frombuffer(b"".join(messages), np.uint8).reshape(len(messages), -1)
        if self._bytes.shape[1] < _HEADER_SIZE or self._bytes[:, 0].any() or not np.isin(self._bytes[:, 1], list(_ORDERS)).all():
            raise CdrReadError(f"expected messages as plain CDR, got {self._bytes.shape[1]} other bytes")
        self._order = _ORDERS[int(_same(self._bytes[:, 1]))]
        self._at = _HEADER_SIZE

    def numbers(self, kind: str, count: int = 1) -> NDArray[Any]:
        """Return numbers (n, count) of a kind, as numpy writes it (``f8``)."""
        item = np.dtype(self._order + kind)
        self._at += -(self._at - _HEADER_SIZE) % item.itemsize
        return self._octets(item.itemsize * count).view(item)

    def number(self, kind: str) -> int:
        """Return one whole number of a kind, which must be the same in all."""
        return int(_same(self.numbers(kind)[:, 0]))

    def text(self) -> NDArray[np.str_]:
        """Return strings (n,) of one length."""
        size = self.number("u4")
        octets = self._octets(size)
        if not size:
            return np.full(len(octets), "")
        kinds, of = np.unique(octets.view(f"S{size}")[:, 0], return_inverse=True)
        return np.char.decode(kinds, "utf-8")[of]

    def stamp(self) -> NDArray[np.int64]:
        """Return stamps (n,) in nanoseconds."""
        seconds = self.numbers("i4")[:, 0].astype(np.int64)
        return np.asarray(seconds * NANOSECONDS + self.numbers("u4")[:, 0])

    def header(self) -> tuple[NDArray[np.int64], NDArray[np.str_]]:
        """Return stamps (n,) in nanoseconds, and frames (n,), of each ``std_msgs/Header``."""
        return self.stamp(), self.text()

    def _octets(self, size: int) -> NDArray[np.uint8]:
        """Return the next bytes of each, (n, size)."""
        left = self._bytes.shape[1] - self._at
        if size > left:
            raise CdrReadError(f"expected {size} more bytes at byte {self._at} of the message, got {left}")
        self._at += size
        return np.ascontiguousarray(self._bytes[:, self._at - size : self._at])


def _same(values: NDArray[Any]) -> Any:
    if (values != values[0]).any():
        raise UnlikeError(values)
    return values[0]


def read_table(messages: Sequence[memoryview], read: Callable[[Stack], list[Columns]], kind: Callable[..., Any]) -> Any:
    """Return what messages say as a table, an array for each field of ``kind``, in their order.

    ``read`` returns, of messages that stand alike, the columns of the first row of each, of the second, and so on.

    Raises:
        CdrReadError: they end too early, or are no plain CDR.
        ValueError: they hold no rows, or rows of different widths.
    """
    found: list[tuple[NDArray[np.int64], int, Columns]] = []
    groups = _by(np.array([len(message) for message in messages]), np.arange(len(messages)))
    while groups:
        rows = groups.pop()
        try:
            read_rows = read(Stack([messages[row] for row in rows]))
        except UnlikeError as error:
            groups += _by(error.by, rows)
            continue
        found += [(rows, number, columns) for number, columns in enumerate(read_rows)]
    places = [np.column_stack([rows, np.full(len(rows), number)]) for rows, number, _ in found]
    first, then = np.concatenate(places).T
    order = np.lexsort((then, first))
    return kind(*(np.concatenate(values)[order] for values in zip(*(columns for _, _, columns in found), strict=True)))


def _by(values: NDArray[Any], rows: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the rows of each value."""
    kinds, of = np.unique(values, return_inverse=True)
    return [rows[of == number] for number in range(len(kinds))]
