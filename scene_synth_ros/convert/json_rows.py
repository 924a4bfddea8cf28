"""Lists of a JSON document that are written as they come, so that memory does not grow with them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any


class JsonRows:
    """A list in the making, in a file of its own.

    Args:
        path: of that file, which its owner removes.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._file = path, path.open("wb")
        self.count = 0

    def add(self, row: Any) -> None:
        """Append a row."""
        self._file.write((b",\n" if self.count else b"") + json.dumps(row).encode())
        self.count += 1

    def close(self) -> Path:
        """Return the file, with all rows in it."""
        self._file.close()
        return self._path


def write_document(path: Path, head: Mapping[str, Any], lists: Mapping[str, JsonRows]) -> None:
    """Write a document: what ``head`` has, then the lists, by their names.

    Raises:
        OSError: a file cannot be written.
    """
    with path.open("wb") as document:
        document.write(json.dumps(head).removesuffix("}").encode())
        for name, rows in lists.items():
            document.write(b", " + json.dumps(name).encode() + b": [\n")
            with rows.close().open("rb") as part:
                shutil.copyfileobj(part, document)
            document.write(b"\n]")
        document.write(b"}\n")
