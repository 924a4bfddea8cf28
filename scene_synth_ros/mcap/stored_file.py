"""A file that is read in pieces, from wherever it is stored, without staying open."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple, Protocol


class Span(NamedTuple):
    """A piece of a file: where it begins and how long it is (bytes)."""

    start: int
    length: int


class OpenableFile(Protocol):
    """A file that can be opened: a :class:`pathlib.Path`, or one that lies elsewhere."""

    @property
    def name(self) -> str:
        """Last part of its path."""

    def open(self, mode: Literal["rb"]) -> BinaryIO:
        """Return it open for reading, seekable.

        Raises:
            OSError: it cannot be opened.
        """


class StoredFile(OpenableFile, Protocol):
    """A file of which pieces can be read at any time, by any thread or process; its text is its whole path."""

    def read(self, spans: Sequence[Span]) -> list[bytes]:
        """Return pieces of it; those that go beyond its end are short.

        Raises:
            OSError: it cannot be read.
        """


@dataclass(frozen=True, slots=True)
class LocalFile:
    """A file on this machine.  It is opened for each reading, so that threads, forks and pickles share nothing."""

    path: Path

    def __str__(self) -> str:
        return str(self.path)

    @property
    def name(self) -> str:
        """Last part of its path."""
        return self.path.name

    def open(self, mode: Literal["rb"]) -> BinaryIO:
        """Return it open for reading."""
        return self.path.open(mode)

    def read(self, spans: Sequence[Span]) -> list[bytes]:
        """Return pieces of it; those that go beyond its end are short."""
        file = os.open(self.path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            size = os.fstat(file).st_size
            return [os.pread(file, min(span.length, size - span.start), span.start) if span.start < size else b"" for span in spans]
        finally:
            os.close(file)
