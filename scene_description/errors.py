"""The root of the errors that a user can cause, how they are told, and how files of others are read."""

import errno
import os
from pathlib import Path

_ADVICE = {
    errno.ENOENT: "check the path",
    errno.ENOTDIR: "a part of the path is a file",
    errno.EISDIR: "name a file, not a folder",
    errno.EEXIST: "choose another name or remove it",
    errno.EACCES: "check the permissions",
    errno.EPERM: "check the permissions",
    errno.EROFS: "choose another place",
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.ENAMETOOLONG: "choose a shorter name",
}
"""What to do, by the operating system's number of an error."""
_PIECE_BYTES = 2**20
_LONGEST_LINE = 5000


class SceneSynthError(Exception):
    """Bad input, or a request that cannot be met: what, where, got, expected and what to do, in one line.

    Edges (commands, nodes, parameters) catch this and ``OSError`` and tell the user :func:`error_line`.  Every other exception is a fault
    of the program: it is told with its traceback and with what reproduces it.

    The text is one line of at most 5,000 characters whatever it quotes: white space becomes blanks, controls become escapes.
    """

    def __str__(self) -> str:
        return _line(super().__str__())


def read_at_most(path: Path, most: int, error: type[SceneSynthError]) -> bytes:
    """Return the content of a file of at most so many bytes; of one that is longer, or has no end, not many more are read.

    Raises:
        error: it is longer.
        OSError: it cannot be read.
    """
    pieces, size = [], 0
    with path.open("rb") as file:
        step = min(os.fstat(file.fileno()).st_size, most) + 1  # a read takes as much memory as it asks for, however short the file
        while size <= most and (piece := file.read(step)):
            pieces.append(piece)
            size, step = size + len(piece), _PIECE_BYTES
    if size > most:
        raise error(f"{path}: expected at most {most} bytes, got more")
    return b"".join(pieces)


def error_line(error: BaseException) -> str:
    """Return what to tell the user of an error, in one line; of the operating system's, the path, what happened and what to do.

    >>> error_line(FileNotFoundError(errno.ENOENT, "No such file or directory", "room.json"))
    'room.json: no such file or directory; check the path'
    """
    if not isinstance(error, OSError) or not error.strerror:
        return _line(str(error)) or type(error).__name__
    paths = " -> ".join(os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, (str, bytes)))
    happened = error.strerror[:1].lower() + error.strerror[1:]
    advice = f"; {_ADVICE[error.errno]}" if error.errno in _ADVICE else ""
    return _line(f"{paths + ': ' if paths else ''}{happened}{advice}")


def _line(text: str) -> str:
    """Return a text in one line that every terminal shows and every file holds: controls and surrogates by their escapes.

    Of a long one the middle is left out: it begins with where, and ends with what was got.
    """
    if not text.isprintable():
        text = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in " ".join(text.split()))
    return text.strip() if len(text) <= _LONGEST_LINE else f"{text[: _LONGEST_LINE // 2]} ... {text[5 - _LONGEST_LINE // 2 :]}"
