"""The memory of a process: when Python looks for garbage, how many arenas the C heap has, when its free pages go back to the system."""

import ctypes
import gc

_GENERATIONS = (50_000, 20, 100)
_M_ARENA_MAX, _ARENAS = -8, 2


def collect_rarely() -> None:
    """Let Python look for cyclic garbage after 50,000 new objects instead of 700: a tenth of the time that kernels take to compile."""
    gc.set_threshold(*_GENERATIONS)


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
