"""Disk space kept for the end of a file, so that a full disk can still be met with a proper ending."""

from __future__ import annotations

import errno
import os

_UNSUPPORTED = (errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS)


class DiskReserve:
    """A file without a name on the disk of a folder; releasing it, or the death of the process, frees its blocks.

    Args:
        folder_fd: descriptor of the folder.
        name: what the file is called for the moment between its making and its unlinking; it must not exist.

    Raises:
        OSError: the space is not there.
    """

    def __init__(self, folder_fd: int, name: str, size: int) -> None:
        self._fd: int | None = os.open(name, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600, dir_fd=folder_fd)
        self.size = 0
        try:
            os.unlink(name, dir_fd=folder_fd)
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
        """Free the space; harmless if it is free already."""
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None
