"""What a Ray task does: one shard, on processors of its own.

Processes of a machine take processors for themselves without knowing each other.  Everything but the standard library is imported inside,
once the process is on its processors: numba, Embree and BLAS count them.
"""

import os
from typing import Any

from scene_synth_ros.workers.processors import claimed_processors, pin

_ALL = sorted(os.sched_getaffinity(0))
"""The processors that Ray has left to this process."""


def make_on_node(plan_text: str, where: str, shard: int, threads: int) -> dict[str, Any]:
    """Make a shard, put it where the dataset is, and return what its completion file says.

    ``plan_text``: ``dataset.json``.
    ``where``: URL of the dataset, or a folder that all nodes share.

    Raises:
        SceneSynthError, OSError: it cannot be made; nothing of it counts.
    """
    os.sched_setaffinity(0, _ALL)  # a process makes many shards
    with claimed_processors(threads) as processors:
        pin(processors)
        from scene_synth_ros.bags.dataset_files import PLAN_NAME
        from scene_synth_ros.shards.completion import ShardError
        from scene_synth_ros.shards.make_shard import make_shard
        from scene_synth_ros.shards.open_store import open_store
        from scene_synth_ros.shards.plan import read_plan
        from scene_synth_ros.shards.provenance import admit
        from scene_synth_ros.suite.heap import collect_rarely, limit_arenas

        limit_arenas()
        collect_rarely()
        plan, store, node = read_plan(plan_text.encode(), PLAN_NAME), open_store(where), os.uname().nodename
        admit(plan.provenance, [plan.own_provenance()], f"node {node}", accept=False)
        if store.read(PLAN_NAME) != plan_text.encode():
            raise ShardError(f"node {node}: expected the run's {PLAN_NAME} in {where}, got none or another; take a URL or a shared folder")
        return dict(make_shard(plan, shard, store))
