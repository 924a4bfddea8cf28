"""A cluster of Ray on this machine: a head with one processor, to which nodes are added."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from scene_synth_ros.suite.environment import environment

_RAY = {
    "RAY_AUTH_MODE": "token",
    "RAY_AUTH_TOKEN": "0" * 64,
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_NUM_REDIS_GET_RETRIES": "120",
    "RAY_worker_niceness": "0",
}
"""One token for all that this process speaks to, which it reads once; a busy machine has two minutes to start Ray, whose workers give way
to nobody: by itself Ray makes them the nicest processes of the machine."""
NODE = {"num_cpus": 1, "object_store_memory": 80 * 2**20, "include_dashboard": False, "include_log_monitor": False}


@contextmanager
def ray_cluster() -> Iterator[Any]:
    """Give a ``ray.cluster_utils.Cluster`` with a head; its files are in a folder that goes."""
    with (
        tempfile.TemporaryDirectory(prefix="ray_", dir="/tmp", ignore_cleanup_errors=True) as folder,
        environment({**_RAY, "RAY_TMPDIR": folder}),
    ):
        from ray.cluster_utils import Cluster  # reads the environment

        cluster = Cluster(initialize_head=True, head_node_args=NODE)
        try:
            yield cluster
        finally:
            cluster.shutdown()
