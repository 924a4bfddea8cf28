"""Where a dataset goes: small files that are there whole or not at all, and the folders of shards.

What is temporary in a store has a name that begins with a dot.
"""

import contextlib
import hashlib
import shutil
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Protocol

from scene_description.whole import SUFFIX, move_folder, temporary_path, write_whole
from scene_synth_ros.bags.dataset_files import SHARDS_NAME

_PIECE = 2**20


class Store(Protocol):
    """The folder of a dataset, wherever it is.  Names are relative, with slashes.  Can be pickled; any process may use its copy."""

    @property
    def where(self) -> str:
        """What :func:`scene_synth_ros.shards.open_store.open_store` opens it by: a URL, or the folder's path."""

    def read(self, name: str) -> bytes | None:
        """Return a small file, None where there is none."""

    def sha256(self, name: str) -> str | None:
        """Return the SHA-256 of a file, in hexadecimal; None where there is none."""

    def write(self, name: str, data: bytes) -> None:
        """Write a small file, in place of one of its name; it has its name only once it is whole and on disk."""

    def names(self, folder: str) -> list[str]:
        """Return the names of what lies in a folder, in order; temporary things are left out; nothing where there is no folder."""

    def sizes(self, folder: str) -> dict[str, int]:
        """Return the bytes of the files in a folder and in those that it holds, by their names in it; temporary things are left out."""

    def workspace(self, shard: str) -> AbstractContextManager[Path]:
        """Give a local folder in which a shard is made, for this process alone; it is removed in the end."""

    def put_folder(self, made: Path, name: str) -> None:
        """Take a folder out of a workspace, in place of one of its name, which may be there from an interrupted run."""

    def fetched(self, name: str) -> AbstractContextManager[Path]:
        """Give a folder of files as a local one, to be read only."""

    def remove(self, name: str) -> None:
        """Remove a file or a folder; harmless where there is none."""

    def clean(self, shards: Collection[str] | None = None) -> int:
        """Remove what interrupted runs have left of some shards, None for all; call it while nobody makes these.

        Returns:
            How many things were removed.
        """


def sha256_of(file: BinaryIO) -> str:
    """Return the SHA-256 of what is left of a file, in hexadecimal."""
    digest, piece = hashlib.sha256(), memoryview(bytearray(_PIECE))
    while size := file.readinto(piece):  # type: ignore[attr-defined]
        digest.update(piece[:size])
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class LocalStore:
    """A dataset in a local folder; workspaces lie in it, so that what is made needs only its name.

    Args:
        root: the folder; made where it is missing.
    """

    root: Path

    @property
    def where(self) -> str:
        """Do as the protocol says."""
        return str(self.root.absolute())

    def read(self, name: str) -> bytes | None:
        """Do as the protocol says."""
        try:
            return (self.root / name).read_bytes()
        except FileNotFoundError:
            return None

    def sha256(self, name: str) -> str | None:
        """Do as the protocol says."""
        try:
            with (self.root / name).open("rb") as file:
                return sha256_of(file)
        except FileNotFoundError:
            return None

    def write(self, name: str, data: bytes) -> None:
        """Do as the protocol says."""
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, data, sync=True)

    def names(self, folder: str) -> list[str]:
        """Do as the protocol says."""
        try:
            return sorted(path.name for path in (self.root / folder).iterdir() if not path.name.startswith("."))
        except FileNotFoundError:
            return []

    def sizes(self, folder: str) -> dict[str, int]:
        """Do as the protocol says."""
        found = {}
        for name in self.names(folder):
            path = self.root / folder / name
            for file in sorted(path.iterdir()) if path.is_dir() else [path]:
                found[file.relative_to(self.root / folder).as_posix()] = file.stat().st_size
        return found

    @contextlib.contextmanager
    def workspace(self, shard: str) -> Iterator[Path]:
        """Do as the protocol says."""
        folder = temporary_path(self.root / SHARDS_NAME / shard)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def put_folder(self, made: Path, name: str) -> None:
        """Do as the protocol says."""
        self.remove(name)
        move_folder(made, self.root / name)

    @contextlib.contextmanager
    def fetched(self, name: str) -> Iterator[Path]:
        """Do as the protocol says."""
        yield self.root / name

    def remove(self, name: str) -> None:
        """Do as the protocol says."""
        path = self.root / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)

    def clean(self, shards: Collection[str] | None = None) -> int:
        """Do as the protocol says."""
        left = [*(self.root.glob(f".*{SUFFIX}") if shards is None else ()), *self.root.glob(f"*/.*{SUFFIX}")]
        mine = [path for path in left if shards is None or path.name[1:].partition(".")[0] in shards]
        for path in mine:
            self.remove(str(path.relative_to(self.root)))
        return len(mine)
