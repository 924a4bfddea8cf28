"""The root of the errors that a user can cause."""


class SceneSynthError(Exception):
    """Bad input, or a request that cannot be met: what, where, got, expected and what to do, in one line.

    Edges (commands, nodes, parameters) catch this and ``OSError`` and tell the user the line.  Every other exception is a fault of the
    program: it is told with its traceback and with what reproduces it.
    """
