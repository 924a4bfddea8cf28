"""A folder that appears under its name only when it is whole."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scene_synth_ros.cli.options import UsageError


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """Yield a folder under another name, which gets its own, that of ``--out``, when all has been written, and goes if not.

    Raises:
        UsageError: the folder exists, or the one that it is to be in does not.
    """
    if out.exists():
        raise UsageError(f"--out {out}: exists already; choose another folder or remove it")
    if not out.absolute().parent.is_dir():
        raise UsageError(f"--out {out}: expected a folder in a folder that exists")
    part = out.with_name(f".{out.name}.{os.getpid()}.part")
    part.mkdir()
    try:
        yield part
        part.rename(out)
    finally:
        shutil.rmtree(part, ignore_errors=True)
