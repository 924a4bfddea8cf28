"""Disk space kept for the end of a file, so that a full disk can still be met with a proper ending."""

from __future__ import annotations

import contextlib
import errno
import os

_UNSUPPORTED = (errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS)


class DiskReserve:
    """A hidden file beside the one that grows; releasing it frees its blocks.

    Args:
        folder_fd: descriptor of the folder.
        name: file name of the reserve; it must not exist.

    Raises:
        OSError: the space is not there.
    """

    def __init__(self, folder_fd: int, name: str, size: int) -> None:
        self._folder_fd, self._name = folder_fd, name
        self._fd: int | None = os.open(name, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o644, dir_fd=folder_fd)
        self.size = 0
        try:
            self.grow(size)
        except OSError:
            self.release()
            raise

    def grow(self, size: int) -> None:
        """Enlarge the reserve to ``size`` bytes; on file systems that cannot reserve, nothing is held back.

        Raises:
            OSError: the space is not there; the reserve keeps its size.
        """
        if self._fd is None or size <= self.size:
            return
        try:
            os.posix_fallocate(self._fd, 0, size)
        except OSError as error:
            if error.errno not in _UNSUPPORTED:
                raise
        self.size = size

    def release(self) -> None:
        """Remove the reserve; harmless if it is gone already."""
        if self._fd is None:
            return
        with contextlib.suppress(OSError):
            os.ftruncate(self._fd, 0)
        os.close(self._fd)
        self._fd = None
        with contextlib.suppress(OSError):
            os.unlink(self._name, dir_fd=self._folder_fd)
