"""What a Ray task does: one shard, on processors of its own.

Processes of a machine take processors for themselves without knowing each other.  Everything but the standard library is imported inside,
once the process is on its processors: numba, Embree and BLAS count them.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from scene_synth_ros.shards.worker_start import pin

_FOLDER = "scene_synth_processors"
_ALL = sorted(os.sched_getaffinity(0))
"""The processors that Ray has left to this process."""


@contextlib.contextmanager
def claimed_processors(count: int) -> Iterator[list[int]]:
    """Take processors that no other process of this user has taken, the lowest ones; where too few are free, others' are shared.

    A claim is a lock on a file of the machine's temporary folder: that of a process that is killed ends with it.

    Args:
        count: how many; at most as many as this process may use are given.
    """
    folder = Path(tempfile.gettempdir()) / f"{_FOLDER}_{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    allowed = sorted(os.sched_getaffinity(0))
    wanted = min(count, len(allowed))
    taken: list[int] = []
    with contextlib.ExitStack() as held:
        for processor in allowed:
            if len(taken) < wanted and _is_locked(held, folder / str(processor)):
                taken.append(processor)
        others = [processor for processor in allowed if processor not in taken]
        yield sorted((taken + others)[:wanted])


def _is_locked(held: contextlib.ExitStack, path: Path) -> bool:
    """Lock a file until the stack is closed; return False where another process has it."""
    file = held.enter_context(path.open("w"))
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def make_on_node(plan_text: str, where: str, shard: int, threads: int) -> dict[str, Any]:
    """Make a shard, put it where the dataset is, and return what its completion file says.

    Args:
        plan_text: ``dataset.json``.
        where: URL of the dataset, or a folder that all nodes share.
        shard: its number.
        threads: processors to use.

    Raises:
        SceneSynthError, OSError: it cannot be made; nothing of it counts.
    """
    os.sched_setaffinity(0, _ALL)  # a process makes many shards
    with claimed_processors(threads) as processors:
        pin(processors)
        from scene_synth_ros.bags.dataset_files import PLAN_NAME
        from scene_synth_ros.bags.run_info import versions
        from scene_synth_ros.shards.completion import ShardError
        from scene_synth_ros.shards.make_shard import make_shard
        from scene_synth_ros.shards.open_store import open_store
        from scene_synth_ros.shards.plan import read_plan
        from scene_synth_ros.suite.heap import collect_rarely, limit_arenas

        limit_arenas()
        collect_rarely()
        plan, store, node = read_plan(plan_text.encode(), PLAN_NAME), open_store(where), os.uname().nodename
        own = versions()["scene_synth_ros"]
        if own != plan.version:
            raise ShardError(f"node {node}: expected scene_synth_ros {plan.version} as where the run began, got {own}")
        if store.read(PLAN_NAME) != plan_text.encode():
            raise ShardError(f"node {node}: expected the run's {PLAN_NAME} in {where}, got none or another; take a URL or a shared folder")
        return dict(make_shard(plan, shard, store))
