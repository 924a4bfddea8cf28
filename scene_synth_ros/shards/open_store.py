"""The store of a dataset by what a user says, a folder or a URL; one run at a time in a folder."""

from __future__ import annotations

import contextlib
import fcntl
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from scene_synth_ros.shards.completion import ShardError
from scene_synth_ros.shards.store import LocalStore, Store
from scene_synth_ros.shards.url_store import UrlStore

_FILE = "file://"
_PATIENCE_S = 5.0
_POLL_S = 0.1


def is_url(where: str) -> bool:
    """Return whether a dataset is elsewhere than in a folder of this machine."""
    return "://" in where and not where.startswith(_FILE)


def open_store(where: str) -> Store:
    """Return the store of a dataset; a folder need not exist.

    Raises:
        StoreError: the URL is of no kind that can be used.
    """
    return UrlStore(where.rstrip("/")) if is_url(where) else LocalStore(Path(where.removeprefix(_FILE)))


@contextlib.contextmanager
def held(where: str, name: str) -> Iterator[int]:
    """Hold a dataset for this run (:func:`folder_lock`); yield the descriptor of the lock.  In an object store nothing can be held.

    Args:
        where: folder or URL.
        name: of the lock.

    Raises:
        ShardError: another run is at work there.
    """
    if not is_url(where):
        with folder_lock(Path(where.removeprefix(_FILE)), name) as descriptor:
            yield descriptor
    else:
        with tempfile.TemporaryFile() as file:
            yield file.fileno()


@contextlib.contextmanager
def folder_lock(folder: Path, name: str = ".lock") -> Iterator[int]:
    """Hold a folder for this run; yield the descriptor of the lock, which workers inherit so that it lasts until the last of them is gone.

    The workers of a run that was killed end by themselves within a moment: for so long the lock is waited for.

    Args:
        folder: is made where it is missing.
        name: of the lock's file; runs that share a folder on purpose, each with its own shards, take a name each.

    Raises:
        ShardError: another run is at work there.
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
                    raise ShardError(f"{folder}: another run is at work there; wait for it, or choose another folder") from None
                time.sleep(_POLL_S)
        yield descriptor
    finally:
        os.close(descriptor)
