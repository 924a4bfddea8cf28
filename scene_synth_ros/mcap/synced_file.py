"""A file that only grows, whose writer need not stand still while the disk works: one append is synced while the next is prepared."""

import errno
import os
from concurrent.futures import Future, ThreadPoolExecutor
from io import RawIOBase


class SyncedFile:
    """Appends to a file so that everything but the last append is on disk, whatever becomes of the machine.

    Threads: one thread calls every method; the thread of this object only syncs, and every method that touches the file waits for it.

    Args:
        file: unbuffered, positioned at its start; stays open.

    Attributes:
        size: bytes in the file.
    """

    def __init__(self, file: RawIOBase) -> None:
        self._file = file
        self._pool = ThreadPoolExecutor(1, "sync")
        self._syncing: Future[None] | None = None
        self._synced = 0
        self.size = 0

    def append(self, *pieces: bytes | bytearray) -> None:
        """Write pieces at the end, one after the other, and begin to sync.

        Raises:
            OSError: the file is as it was; or the append before could not be synced, and the file ends before that.
        """
        self.sync()
        try:
            for piece in pieces:
                view = memoryview(piece)
                while view:
                    written = self._file.write(view)
                    if not written:
                        raise OSError(errno.EIO, "nothing was written")
                    view = view[written:]
        except OSError:
            self.cut(self.size)
            raise
        self.size += sum(map(len, pieces))
        self._syncing = self._pool.submit(os.fdatasync, self._file.fileno())

    def sync(self) -> None:
        """Wait until everything is on disk.

        Raises:
            OSError: the last append could not be synced, and the file ends before it.
        """
        syncing, self._syncing = self._syncing, None
        if syncing is None:
            return
        try:
            syncing.result()
        except OSError:
            self.cut(self._synced)
            raise
        self._synced = self.size

    def cut(self, size: int) -> None:
        """Shorten the file to so many bytes."""
        self.size, self._synced = size, min(self._synced, size)
        self._file.truncate(size)
        self._file.seek(size)

    def close(self) -> None:
        """Wait for the disk and end the thread; the file stays open.  Harmless when repeated."""
        self._pool.shutdown()
