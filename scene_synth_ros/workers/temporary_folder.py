"""Temporary folders that no killed process leaves behind for long: the next one that makes some, or ends a run, removes them.

Their names cannot be guessed, and who works in one holds its lock.  Imports nothing but the standard library.
"""

import contextlib
import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

_PREFIX, _SUFFIX = ".scene_synth_", ".locked"
_TRIES = 3
"""How often a folder is removed in which threads still make files."""
_own: set[Path] = set()


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """Give a folder of this process alone, below ``TMPDIR``; it is removed in the end, and first what killed processes have left."""
    remove_abandoned_folders()
    folder, lock = _locked_folder()
    _own.add(folder)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _own.discard(folder)
        os.close(lock)


def remove_own_folders() -> None:
    """Remove the folders of this process, which is about to end in the middle of its work."""
    for folder in list(_own):
        for _ in range(_TRIES):
            shutil.rmtree(folder, ignore_errors=True)


def remove_abandoned_folders() -> int:
    """Remove the folders of processes of this user that are gone: nobody holds their locks; return how many there were."""
    removed = 0
    for folder in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*{_SUFFIX}"):
        with contextlib.suppress(OSError):  # gone by now, a link, another user's, or at work
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                if os.fstat(lock).st_uid == os.geteuid():
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(folder)
                    removed += 1
            finally:
                os.close(lock)
    return removed


def _locked_folder() -> tuple[Path, int]:
    """Return a new folder and the descriptor that locks it; one that was taken for abandoned before it was locked is made once more."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=_PREFIX, suffix=_SUFFIX))
        with contextlib.suppress(FileNotFoundError):
            lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            fcntl.flock(lock, fcntl.LOCK_EX)
            if folder.is_dir():
                return folder, lock
            os.close(lock)
