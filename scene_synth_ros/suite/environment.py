"""Environment variables: for a while, and what processes of this package tell each other by them."""

import contextlib
import ctypes
import os
import signal
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

SUPERVISED = "SCENE_SYNTH_SUPERVISED"
"""Set in nodes that ``scene_synth run`` has started: it watches them, and ends them itself when the run is over."""
LAUNCH = "SCENE_SYNTH_LAUNCH"
"""The process id of the launch that has started a node, which ends with it, however that ends."""
RUN = "SCENE_SYNTH_RUN"
"""The token of the command or launch that has started a node, by which the nodes of a run know each other."""
_PR_SET_PDEATHSIG = 1


@contextlib.contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables of this process, which its children inherit; afterwards they are as before."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def die_with_parent() -> Callable[[], None]:
    """Return what lets the kernel send a process SIGTERM when the one that has started it ends (prctl(2))."""
    libc = ctypes.CDLL(None)
    return lambda: libc.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def die_with_launch() -> None:
    """End with the launch that has started this process, if one has: it cannot end its nodes when it is killed, and at SIGTERM does not."""
    launch = os.environ.get(LAUNCH)
    if launch is not None:
        die_with_parent()()
        try:
            lives = Path(f"/proc/{launch}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        except OSError:
            lives = False
        if not lives:
            os.kill(os.getpid(), signal.SIGTERM)
