"""Work over a range that can be cancelled and taken up again."""

from __future__ import annotations

from collections.abc import Callable

from renderer.core.workers import Workers

PIECE = 1024


class Pieces:
    """The pieces of a range of ``count`` items that are still to be done."""

    def __init__(self, count: int) -> None:
        self._left = {(first, min(first + PIECE, count)) for first in range(0, count, PIECE)}

    def run(self, workers: Workers, work: Callable[[int, tuple[int, int]], None], cancelled: Callable[[], bool] | None = None) -> None:
        """Call ``work(worker, (first, end))`` for the pieces that are left; those that are done stay done.

        Raises:
            RenderCancelled: ``cancelled`` returned True; call again for the rest.
        """

        def do(worker: int, piece: tuple[int, int]) -> None:
            work(worker, piece)
            self._left.discard(piece)

        if self._left:
            workers.run(do, sorted(self._left), cancelled)
