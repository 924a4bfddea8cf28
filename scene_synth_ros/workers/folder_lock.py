"""The lock of a folder in which one run is at work at a time."""

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

from scene_description import SceneSynthError

_PATIENCE_S = 5.0
_POLL_S = 0.1


class FolderInUseError(SceneSynthError):
    """Another run is at work in a folder; one line."""


@contextlib.contextmanager
def folder_lock(folder: Path, name: str = ".lock") -> Iterator[int]:
    """Hold a folder for this run; yield the descriptor of the lock, which workers inherit so that it lasts until the last of them is gone.

    The workers of a run that was killed end by themselves within a moment: for so long the lock is waited for.

    Args:
        folder: is made where it is missing.
        name: of the lock's file; runs that share a folder on purpose, each with its own part of the work, take a name each.

    Raises:
        FolderInUseError: another run is at work there.
        OSError: the folder cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder / name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        end = time.monotonic() + _PATIENCE_S
        while True:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > end:
                    raise FolderInUseError(f"{folder}: another run is at work there; wait for it, or choose another folder") from None
                time.sleep(_POLL_S)
        yield descriptor
    finally:
        os.close(descriptor)
