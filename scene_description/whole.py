"""Files and folders that are there whole or not at all: made under a temporary name beside, they get their own when they are whole.

A temporary name is hidden, ends in ``.partial`` and names the process that makes it, so that what an interrupted run has left can be told
from what is being made.
"""

import glob
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

SUFFIX = ".partial"


def temporary_path(path: Path) -> Path:
    """Return where this process makes what is to be called ``path``: ``.<name>.<machine>.<process>.partial`` in the same folder."""
    return path.with_name(f".{path.name}.{os.uname().nodename}.{os.getpid()}{SUFFIX}")


@contextmanager
def whole_file(path: Path, *, sync: bool = False) -> Iterator[Path]:
    """Yield the path to write a file to; when the block ends, it gets its name, in place of a file that has it; on an error it goes.

    Args:
        path: of the file.
        sync: bring it, and its name, to the disk.

    Raises:
        OSError: it cannot be written; an earlier file stays.
    """
    partial = temporary_path(path)
    try:
        yield partial
        if sync:
            _sync(partial)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    if sync:
        _sync(path.parent)


def write_whole(path: Path, content: bytes | str, *, sync: bool = False) -> None:
    """Write a file, text as UTF-8, as :func:`whole_file` does."""
    with whole_file(path, sync=sync) as partial:
        partial.write_bytes(content if isinstance(content, bytes) else content.encode())


class WholeFolder:
    """A folder in the making.  As a context manager it yields the path to make it at; it is finished at the end, discarded on an error.

    What runs that were interrupted on this machine have left of the same folder is removed first.

    Args:
        path: the folder, not there yet; those around it are made where they are missing.

    Attributes:
        partial: where it is made; a folder of the same name that whoever makes it creates.

    Raises:
        OSError: nothing can be made there.
    """

    def __init__(self, path: Path) -> None:
        for left_over in path.parent.glob(f".{glob.escape(path.name)}.*{SUFFIX}"):
            if _is_of_dead_process(left_over, path.name):
                shutil.rmtree(left_over)
        self._path, self._around = path, temporary_path(path)
        self._around.mkdir(parents=True)
        self.partial = self._around / path.name

    def finish(self) -> None:
        """Give the folder its name.

        Raises:
            OSError: the name is taken; nothing is left of the folder.
        """
        try:
            self.partial.rename(self._path)
        finally:
            self.discard()

    def discard(self) -> None:
        """Remove what there is of it."""
        shutil.rmtree(self._around, ignore_errors=True)

    def __enter__(self) -> Path:
        return self.partial

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self.finish()
        else:
            self.discard()


def move_folder(made: Path, path: Path) -> None:
    """Give a folder that is whole its name, on the disk too; the folder around is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    made.rename(path)
    _sync(path.parent)


def _is_of_dead_process(partial: Path, name: str) -> bool:
    """Return whether a temporary path of ``name`` was left by a process of this machine that is gone; False of all that is not sure."""
    machine, _, process = partial.name.removeprefix(f".{name}.").removesuffix(SUFFIX).rpartition(".")
    if machine != os.uname().nodename or not process.isdigit():
        return False
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return True
    except (PermissionError, OverflowError):
        pass
    return False


def _sync(path: Path) -> None:
    """Bring a file's content, or the names in a folder, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
