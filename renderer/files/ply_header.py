"""A look at what the header of a PLY file promises, before a reader makes room for it."""

from __future__ import annotations

from renderer.core.errors import MeshFileError
from renderer.files.gltf_meshes import MAX_FACES, MAX_VERTICES

_MOST = {"vertex": MAX_VERTICES, "face": MAX_FACES}
_MAX_HEADER_BYTES = 20_000


def check_ply(data: bytes) -> None:
    """Check the header and the counts of a PLY file.

    Raises:
        MeshFileError: no header, a count beyond its limit, or more rows than the file has room for.
    """
    end = data.find(b"end_header", 0, _MAX_HEADER_BYTES)
    if not data.startswith(b"ply") or end < 0:
        raise MeshFileError(f"expected a PLY header within {_MAX_HEADER_BYTES} bytes, got none")
    total = 0
    for line in data[:end].splitlines():
        words = line.split()
        if len(words) >= 3 and words[0] == b"element":
            name, count = words[1].decode("ascii", "replace"), words[2]
            if not count.isdigit() or len(count) > 12:
                raise MeshFileError(f"element {name}: expected a count, got {count[:20]!r}")
            total += int(count)
            if int(count) > _MOST.get(name, MAX_VERTICES):
                raise MeshFileError(f"element {name}: expected at most {_MOST.get(name, MAX_VERTICES)}, got {int(count)}")
    if total > len(data) - end:
        raise MeshFileError(f"expected a byte or more for each of the {total} rows that the header promises, got {len(data) - end} in all")
