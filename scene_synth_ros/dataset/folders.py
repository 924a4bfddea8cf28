"""Folders of datasets, on this machine or behind a URL, by the few operations that reading needs.

Behind URLs, ``s3://``, ``gs://``, ``https://`` and others, files are read in pieces through fsspec (extra ``cloud``).
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Literal, Protocol

from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.mcap.stored_file import LocalFile, Span, StoredFile


class Folder(Protocol):
    """A folder, or what may be one; its text is its whole path."""

    @property
    def name(self) -> str:
        """Last part of its path."""

    def __truediv__(self, name: str) -> "Folder":
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

    def __truediv__(self, name: str) -> "LocalFolder":
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


_BLOCK = 2**18
"""Bytes that one request gets while the index at the end of a file is read."""
_BLOCKS = 16


@dataclass(frozen=True, slots=True)
class UrlFile:
    """A file behind a URL.  Its file system is looked up for each reading, so that threads, forks and pickles share nothing."""

    url: str

    def __str__(self) -> str:
        return self.url

    @property
    def name(self) -> str:
        """Last part of its path."""
        return self.url.rsplit("/", 1)[-1]

    def open(self, mode: Literal["rb"]) -> BinaryIO:
        """Return it open for reading; what is read is fetched in blocks that are kept.

        Raises:
            OSError: it cannot be opened.
        """
        with _told(self.url) as (system, path):
            options = {"block_size": _BLOCK, "cache_type": "blockcache", "cache_options": {"maxblocks": _BLOCKS}}
            return system.open(path, mode, **options)  # type: ignore[no-any-return]

    def read(self, spans: Sequence[Span]) -> list[bytes]:
        """Return pieces of it, fetched together where the file system can; those that go beyond its end are short.

        Raises:
            OSError: it cannot be read.
        """
        with _told(self.url) as (system, path):
            if len(spans) == 1:
                return [bytes(system.cat_file(path, start=spans[0].start, end=spans[0].start + spans[0].length))]
            starts, ends = [span.start for span in spans], [span.start + span.length for span in spans]
            return [bytes(piece) for piece in system.cat_ranges([path] * len(spans), starts, ends, on_error="raise")]


@dataclass(frozen=True, slots=True)
class UrlFolder:
    """A folder behind a URL."""

    url: str

    def __str__(self) -> str:
        return self.url

    def __truediv__(self, name: str) -> "UrlFolder":
        return UrlFolder(f"{self.url.rstrip('/')}/{name}")

    @property
    def name(self) -> str:
        """Last part of its path."""
        return self.url.rstrip("/").rsplit("/", 1)[-1]

    def names(self) -> list[str] | None:
        """Return the names in it; None if it is no folder.

        Raises:
            OSError: it cannot be listed.
        """
        with _told(self.url) as (system, path):
            system.invalidate_cache(path)
            if not system.isdir(path):
                return None
            below = [str(name).strip("/") for name in system.ls(path, detail=False)]
            return sorted({name.rsplit("/", 1)[-1] for name in below if name != path.strip("/")})

    def is_file(self) -> bool:
        """Return whether it is a file.

        Raises:
            OSError: that cannot be told.
        """
        with _told(self.url) as (system, path):
            return bool(system.isfile(path))

    def file(self, name: str) -> UrlFile:
        """Return a file in it."""
        return UrlFile(str(self / name) if name else self.url)


@contextmanager
def _told(url: str) -> Iterator[tuple[Any, str]]:
    """Give the file system and path of a URL; what its library raises becomes an OSError or DatasetError that names the URL.

    Raises:
        DatasetError: nothing is installed that reads such URLs.
    """
    try:
        import fsspec
    except ImportError:
        raise DatasetError(f"{url}: expected fsspec for URLs, got no such package; pip install 'scene_synth_ros[cloud]'") from None
    try:
        system, path = fsspec.core.url_to_fs(url)
    except (ImportError, ValueError) as error:
        raise DatasetError(f"{url}: {' '.join(str(error).split())[:200]}; install what reads such URLs, or check the URL") from None
    try:
        yield system, str(path)
    except FileNotFoundError:
        raise OSError(f"{url}: not found; check the URL") from None
    except Exception as error:  # each file system has its own errors: of credentials, connections, permissions
        raise OSError(f"{url}: {type(error).__name__}: {' '.join(str(error).split())[:200]}") from None
