"""The C heap of a node's process: how many arenas it has, and when its free pages go back to the system."""

from __future__ import annotations

import ctypes

_M_ARENA_MAX, _ARENAS = -8, 2


def limit_arenas() -> None:
    """Let the threads of this process share two arenas (mallopt of glibc); elsewhere, nothing.

    By itself each thread gets an arena of its own, and what one has freed is of no use to the others: images pass through many threads, and
    memory would grow by chance.
    """
    tune = getattr(ctypes.CDLL(None), "mallopt", None)
    if tune is not None:
        tune(_M_ARENA_MAX, _ARENAS)


def trim_heap() -> None:
    """Return the free pages of the C heap (malloc_trim of glibc); elsewhere, nothing.

    Rooms differ in size, and what they leave between blocks that stay is not returned by itself: the process would grow with the largest
    room so far.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
