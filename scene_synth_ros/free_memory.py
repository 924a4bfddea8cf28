"""Gives memory that is free but kept by the allocator back to the system."""

from __future__ import annotations

import ctypes

_M_MMAP_THRESHOLD, _M_ARENA_MAX = -3, -8
_LARGE_BYTES, _ARENAS = 1 << 20, 2


def keep_memory_even() -> None:
    """Let this process take no more memory late than early, as far as the C heap goes (mallopt of glibc); elsewhere, nothing.

    By itself the heap learns to keep large blocks that were freed once, and gives every thread a part of its own: what a process of a few
    threads and many images takes then depends on chance.  With this, blocks of a mebibyte and more go back when they are freed.
    """
    tune = getattr(ctypes.CDLL(None), "mallopt", None)
    if tune is not None:
        tune(_M_MMAP_THRESHOLD, _LARGE_BYTES)
        tune(_M_ARENA_MAX, _ARENAS)


def give_back_memory() -> None:
    """Return the free pages of the C heap (malloc_trim of glibc); elsewhere, nothing.

    Rooms differ in size, and what they leave between blocks that stay is not given back by itself: the process would grow with the largest
    room so far.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
