"""Gives memory that is free but kept by the allocator back to the system."""

from __future__ import annotations

import ctypes


def give_back_memory() -> None:
    """Return the free pages of the C heap (malloc_trim of glibc); elsewhere, nothing.

    Rooms differ in size, and what they leave between blocks that stay is not given back by itself: the process would grow with the largest
    room so far.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
