"""The store of a dataset by what a user says, a folder or a URL."""

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path

from scene_synth_ros.shards.store import LocalStore, Store
from scene_synth_ros.shards.url_store import StoreError, UrlStore
from scene_synth_ros.workers.folder_lock import folder_lock

_FILE = "file://"


def is_url(where: str) -> bool:
    """Return whether a dataset is elsewhere than in a folder of this machine."""
    return "://" in where and not where.startswith(_FILE)


def open_store(where: str) -> Store:
    """Return the store of a dataset; a folder need not exist.

    Raises:
        StoreError: the URL is of no kind that can be used, or names no bucket.
    """
    kind, _, place = where.partition("://")
    if is_url(where) and not place.partition("/")[0]:
        raise StoreError(f"{where}: expected a bucket and a folder, {kind}://bucket/folder, got no bucket")
    return UrlStore(where.rstrip("/")) if is_url(where) else LocalStore(Path(where.removeprefix(_FILE)))


@contextlib.contextmanager
def held(where: str, name: str) -> Iterator[Sequence[int]]:
    """Hold a dataset for this run (:func:`folder_lock`); yield the descriptors of its lock: none in an object store, which cannot be held.

    Raises:
        FolderInUseError: another run is at work there.
    """
    if not is_url(where):
        with folder_lock(Path(where.removeprefix(_FILE)), name) as descriptor:
            yield [descriptor]
    else:
        yield []
