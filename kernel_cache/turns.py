"""Processes that start together compile each kernel once: who comes first compiles it, the others wait and load it.

A turn is a lock on one byte of a file in the cache's folder, so it ends with its process, however that ends.  A process waits only for what
its own kernel calls, and kernels do not call each other in circles, so two never wait for one another.
"""

import fcntl
import hashlib
import os
import time
from functools import cache
from pathlib import Path

_LONGEST_S = 300.0
"""After so long the other process is taken for stopped, and its kernel is compiled here as well."""
_EVERY_S = 0.02
_BYTES = 1 << 60


class Turns:
    """The turns that this process has in a folder."""

    def __init__(self, folder: str) -> None:
        """Take a folder, which is made when it is first needed."""
        self._folder = Path(folder)
        self._file: int | None = None
        self._taken: set[int] = set()

    @staticmethod
    @cache
    def of(folder: str) -> "Turns":
        """Return a folder's: one for a process, as closing any of its files would end all its locks."""
        return Turns(folder)

    def take(self, kernel: str) -> None:
        """Wait for the turn to compile a kernel; where files cannot be locked, each process compiles for itself."""
        byte, until = _byte_of(kernel), time.monotonic() + _LONGEST_S
        try:
            if self._file is None:
                self._folder.mkdir(parents=True, exist_ok=True)
                self._file = os.open(self._folder / "turns.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            while not _lock(self._file, byte) and time.monotonic() < until:
                time.sleep(_EVERY_S)
        except OSError:
            return
        self._taken.add(byte)

    def end(self, kernel: str) -> None:
        """End the turn of a kernel, if this process took it."""
        byte = _byte_of(kernel)
        if byte in self._taken:
            assert self._file is not None
            self._taken.remove(byte)
            fcntl.lockf(self._file, fcntl.LOCK_UN, 1, byte)


def _byte_of(kernel: str) -> int:
    return int.from_bytes(hashlib.blake2b(kernel.encode(), digest_size=8).digest(), "little") % _BYTES


def _lock(file: int, byte: int) -> bool:
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)
    except (BlockingIOError, PermissionError):
        return False
    return True
