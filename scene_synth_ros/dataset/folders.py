"""Folders of datasets, on this machine or behind a URL, by the few operations that reading needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from scene_synth_ros.dataset.url_folder import UrlFolder
from scene_synth_ros.mcap.stored_file import LocalFile, StoredFile


class Folder(Protocol):
    """A folder, or what may be one; its text is its whole path."""

    @property
    def name(self) -> str:
        """Last part of its path."""

    def __truediv__(self, name: str) -> Folder:
        """Return what lies in it."""

    def names(self) -> list[str] | None:
        """Return the names in it; None if it is no folder.

        Raises:
            OSError: it cannot be read.
        """

    def is_file(self) -> bool:
        """Return whether it is a file."""

    def file(self, name: str) -> StoredFile:
        """Return a file in it; the empty name is itself."""


@dataclass(frozen=True, slots=True)
class LocalFolder:
    """A folder on this machine."""

    path: Path

    def __str__(self) -> str:
        return str(self.path)

    def __truediv__(self, name: str) -> LocalFolder:
        return LocalFolder(self.path / name)

    @property
    def name(self) -> str:
        """Last part of its path."""
        return self.path.name

    def names(self) -> list[str] | None:
        """Return the names in it; None if it is no folder."""
        return [path.name for path in self.path.iterdir()] if self.path.is_dir() else None

    def is_file(self) -> bool:
        """Return whether it is a file."""
        return self.path.is_file()

    def file(self, name: str) -> StoredFile:
        """Return a file in it."""
        return LocalFile(self.path / name if name else self.path)


def open_folder(place: str | Path) -> Folder:
    """Return the folder at a path or URL."""
    return UrlFolder(str(place)) if "://" in str(place) else LocalFolder(Path(place))
