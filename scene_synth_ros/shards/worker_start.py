"""What a worker must do before anything else is loaded: take its processors, and tell the libraries how many threads they may have.

Imports nothing but the standard library: numba, Embree and BLAS count processors when they are loaded.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

THREAD_VARIABLES = (
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


def thread_environment(threads: int) -> dict[str, str]:
    """Return the environment variables that hold a worker's libraries to so many threads."""
    return dict.fromkeys(THREAD_VARIABLES, str(threads))


def pin(processors: Sequence[int]) -> None:
    """Let this process, and the threads that it will start, run on these processors only; set the thread counts of its libraries.

    Call it before numpy, numba or Embree are imported.
    """
    if processors:
        os.sched_setaffinity(0, processors)
    for name, value in thread_environment(max(1, len(processors))).items():
        os.environ[name] = value


def worker_environment(environment: Mapping[str, str], threads: int) -> dict[str, str]:
    """Return the environment of a worker's process."""
    return {**environment, **thread_environment(threads)}
