"""The processors of a worker, which it takes before anything else is loaded, and the threads that its libraries may have.

Imports nothing but the standard library: numba, Embree and BLAS count processors when they are loaded.
"""

import contextlib
import os
import socket
from collections.abc import Iterator, Mapping, Sequence

_THREAD_VARIABLES = (
    "NUMBA_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


def processors_of(worker: int, threads: int, processors: Sequence[int]) -> list[int]:
    """Return the processors of a worker: ``threads`` of those there are, the next worker's beside them, from the beginning when they end.

    Args:
        worker: its number, from 0.
        threads: of a worker.
        processors: that this process may use.
    """
    count = min(threads, len(processors))
    return sorted({processors[(worker * threads + k) % len(processors)] for k in range(count)})


def default_workers(threads: int) -> int:
    """Return how many workers with so many processors each this process has processors for, at least one."""
    return max(1, len(os.sched_getaffinity(0)) // threads)


def pin(processors: Sequence[int]) -> None:
    """Let this process, and the threads that it will start, run on these processors only; set the thread counts of its libraries.

    Call it before numpy, numba or Embree are imported.
    """
    if processors:
        os.sched_setaffinity(0, processors)
    os.environ.update(_thread_variables(max(1, len(processors))))


def worker_environment(environment: Mapping[str, str], threads: int) -> dict[str, str]:
    """Return the environment of a worker's process."""
    return {**environment, **_thread_variables(threads)}


def _thread_variables(threads: int) -> dict[str, str]:
    return dict.fromkeys(_THREAD_VARIABLES, str(threads))


@contextlib.contextmanager
def claimed_processors(count: int) -> Iterator[list[int]]:
    """Take processors that no other process of this user has taken, the lowest ones; where too few are free, others' are shared.

    A claim is the abstract name of a socket (unix(7)): that of a process that is killed ends with it, and it is no file.

    Args:
        count: how many; at most as many as this process may use are given.
    """
    allowed = sorted(os.sched_getaffinity(0))
    most = min(count, len(allowed))
    taken: list[int] = []
    with contextlib.ExitStack() as claims:
        for processor in allowed:
            if len(taken) < most and _is_claimed(claims, f"\0scene_synth_processor_{os.getuid()}_{processor}"):
                taken.append(processor)
        others = [processor for processor in allowed if processor not in taken]
        yield sorted((taken + others)[:most])


def _is_claimed(claims: contextlib.ExitStack, name: str) -> bool:
    """Hold a name until the stack is closed; return False where another process has it."""
    claim = claims.enter_context(socket.socket(socket.AF_UNIX))
    try:
        claim.bind(name)
    except OSError:
        return False
    return True
