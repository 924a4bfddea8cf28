"""A stamp of a source file and of all that it imports from these packages, by which compiled kernels are known to be fresh."""

import functools
import hashlib
import os
import re
from pathlib import Path
from typing import NamedTuple

_IMPORT = re.compile(r"\b(?:from|import)\s+((?:kernel_cache|scene_description|grammar|renderer|evaluation)(?:\.\w+)*)")


@functools.cache
def source_stamp(path: str | Path) -> str:
    """Return a digest (SHA-256, hex) of a Python file and of the files of these packages that it imports, directly or through others.

    Files are found by the text of import statements, wherever they stand, beside the package that holds ``path``; an import from a folder
    counts for all files in it.  So the digest changes when anything changes that a compiled function of the file may have taken in.
    """
    start = Path(path).resolve()
    root = next(folder for folder in start.parents if not (folder / "__init__.py").is_file())
    seen, waiting = {str(start)}, [str(start)]
    while waiting:
        new = _read(str(root), waiting.pop()).imported - seen
        seen |= new
        waiting.extend(new)
    digest = hashlib.sha256()
    for file in sorted(seen):
        digest.update(_read(str(root), file).digest)
    return digest.hexdigest()


class _Source(NamedTuple):
    """A file: what it imports from these packages, modules and every module of a folder that it names, and a digest of its content."""

    imported: frozenset[str]
    digest: bytes


@functools.cache
def _read(root: str, file: str) -> _Source:
    content = Path(file).read_bytes()
    files: set[str] = set()
    for name in set(_IMPORT.findall(content.decode(errors="replace"))):
        place = os.path.join(root, *name.split("."))
        if os.path.isfile(f"{place}.py"):
            files.add(f"{place}.py")
        elif os.path.isdir(place):
            files.update(entry.path for entry in os.scandir(place) if entry.name.endswith(".py"))
    return _Source(frozenset(files), hashlib.sha256(content).digest())
