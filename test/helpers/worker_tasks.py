"""Tasks for worker processes in tests, of the standard library alone: workers call them by their names."""

from __future__ import annotations

import os
import signal
import struct
import sys
import time
from collections.abc import Callable
from typing import Any

from scene_synth_ros.workers.temporary_folder import temporary_folder

Do = Callable[[Any, Callable[[Any], None]], Any]


def prepare_words(setup: object) -> Do:
    """Return what does as its task, a word and a value, says, once; ``("once", PATH)`` ends the process unless the file is there."""

    def do(task: tuple[str, Any], tell: Callable[[Any], None]) -> object:
        word, value = task
        tell(f"{word} begun")
        if word == "signal":
            os.kill(os.getpid(), value)
        elif word == "half":
            os.write(int(sys.argv[1]), struct.pack("!i", 100) + b"half a message")
            os.kill(os.getpid(), signal.SIGKILL)
        elif word == "raise":
            raise value
        elif word == "folder":
            with temporary_folder() as folder:
                tell(str(folder))
                time.sleep(value)
        return setup, value, sorted(os.sched_getaffinity(0)), os.environ["OPENBLAS_NUM_THREADS"], "numpy" in sys.modules

    return do


def prepare_silent_end(setup: int) -> Do:
    """Return what ends its process by a signal before it tells anything."""
    return lambda task, tell: os.kill(os.getpid(), setup)
