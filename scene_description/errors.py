"""The root of the errors that a user can cause, and how they are told."""

import errno
import os

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


class SceneSynthError(Exception):
    """Bad input, or a request that cannot be met: what, where, got, expected and what to do, in one line.

    Edges (commands, nodes, parameters) catch this and ``OSError`` and tell the user :func:`error_line`.  Every other exception is a fault
    of the program: it is told with its traceback and with what reproduces it.
    """


def error_line(error: BaseException) -> str:
    """Return what to tell the user of an error, in one line; of the operating system's, the path, what happened and what to do.

    >>> error_line(FileNotFoundError(errno.ENOENT, "No such file or directory", "room.json"))
    'room.json: no such file or directory; check the path'
    """
    if not isinstance(error, OSError) or not error.strerror:
        return " ".join(str(error).split()) or type(error).__name__
    paths = " -> ".join(os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, (str, bytes)))
    happened = error.strerror[:1].lower() + error.strerror[1:]
    advice = f"; {_ADVICE[error.errno]}" if error.errno in _ADVICE else ""
    return " ".join(f"{paths + ': ' if paths else ''}{happened}{advice}".split())
