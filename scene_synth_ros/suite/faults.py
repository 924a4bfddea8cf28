"""Faults of the program: exceptions that no user can cause.  They are told with what makes them again, counted, and never lost.

What a user can cause (``SceneSynthError``, ``OSError``) is one line and is handled where it comes up; everything else comes here.
"""

import shlex
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence

FAULT_STATUS = 70
"""Exit status after a fault of the program (EX_SOFTWARE of sysexits.h); a run that failed ends with 1, bad input with 2."""
_MAX_LINE = 800


def fault_line(error: BaseException, doing: str) -> str:
    """Return a fault in one line: what was being done, and the exception."""
    line = " ".join(f"fault of the program while {doing}: {type(error).__name__}: {error}".split())
    return line if len(line) <= _MAX_LINE else line[: _MAX_LINE - 3] + "..."


def fault_report(error: BaseException, doing: str, words: Sequence[str] | None = None) -> str:
    """Return what to tell of a fault: its traceback, its line, and how to report it.

    Args:
        error: what was raised.
        doing: what was being done, with seed and room where they are known.
        words: the command line to report; default: that of this process.
    """
    command = shlex.join(sys.orig_argv if words is None else words)
    lines = "".join(traceback.format_exception(error)).rstrip()
    return f"{lines}\n{fault_line(error, doing)}; please report it with the lines above and the command: {command}"


class Faults:
    """The faults of a node: each is logged with its traceback and counted.

    Threading: any thread may call :meth:`tell` and read; a lock guards the count and the last line.
    """

    def __init__(self, log: Callable[[str], object]) -> None:
        self._log = log
        self._lock = threading.Lock()
        self.count = 0
        self.last = ""
        """The newest fault in one line; empty if there was none."""
        self._last_s = 0.0

    def tell(self, error: BaseException, doing: str) -> str:
        """Log and count a fault; return its line."""
        with self._lock:
            self.count += 1
            self.last, self._last_s = fault_line(error, doing), time.monotonic()
            line = self.last
        self._log(fault_report(error, doing))
        return line

    def within(self, seconds: float) -> bool:
        """Return whether there was a fault in the last seconds."""
        with self._lock:
            return self.count > 0 and time.monotonic() - self._last_s < seconds
