"""Processors of a machine that processes take for themselves without knowing each other.  Standard library only."""

from __future__ import annotations

import contextlib
import fcntl
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

_FOLDER = "scene_synth_processors"


@contextlib.contextmanager
def claimed_processors(count: int) -> Iterator[list[int]]:
    """Take processors that no other process of this user has taken, the lowest ones; where too few are free, others' are shared.

    A claim is a lock on a file of the machine's temporary folder: that of a process that is killed ends with it.

    Args:
        count: how many; at most as many as this process may use are given.
    """
    folder = Path(tempfile.gettempdir()) / f"{_FOLDER}_{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    allowed = sorted(os.sched_getaffinity(0))
    wanted = min(count, len(allowed))
    taken: list[int] = []
    with contextlib.ExitStack() as held:
        for processor in allowed:
            if len(taken) < wanted and _is_locked(held, folder / str(processor)):
                taken.append(processor)
        others = [processor for processor in allowed if processor not in taken]
        yield sorted((taken + others)[:wanted])


def _is_locked(held: contextlib.ExitStack, path: Path) -> bool:
    """Lock a file until the stack is closed; return False where another process has it."""
    file = held.enter_context(path.open("w"))
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
