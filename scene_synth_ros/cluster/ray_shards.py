"""Makes what is missing of a dataset as tasks of Ray Core: each makes a shard on whatever node has room for it.

A task returns what its completion file says; pixels never pass through Ray.  Extra ``ray``.
"""

import contextlib
import importlib.util
import logging
import os
import secrets
import signal
import socket
import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from scene_description import SceneSynthError, error_line
from scene_description.strict import whole_number
from scene_synth_ros.cluster.ray_task import make_on_node
from scene_synth_ros.shards.completion import ShardError
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.url_store import StoreError
from scene_synth_ros.suite.environment import environment

LOCAL, AUTO = "local", "auto"
"""Addresses: a Ray of this run's own on this machine; the cluster that Ray finds (``RAY_ADDRESS``, or one started on this machine)."""
RETRIES = 5
"""How often Ray starts a task again whose worker or node is lost, or that could not reach the store."""
_OBJECT_STORE_BYTES = 80 * 2**20
"""Ray's least; manifests are small and do not go through it."""
_OWN = {"RAY_AUTH_MODE": "token", "RAY_USAGE_STATS_ENABLED": "0", "RAY_NUM_REDIS_GET_RETRIES": "120"}
"""Environment of a Ray of this run's own: nobody else may use it, it reports to nobody, and a busy machine has two minutes to start it."""
_POLL_S = 1.0
_KNOCK_S = 5.0
_LONGEST_TEMPORARY = 40
"""Characters: Ray's sockets lie below its folder, and their paths may have 107."""


def make_on_ray(
    plan: DatasetPlan,
    where: str,
    shards: Sequence[int],
    *,
    address: str,
    workers: int,
    threads: int = 1,
    told: Callable[[dict[str, Any]], None] = lambda _: None,
) -> None:
    """Make shards as Ray tasks.

    Args:
        plan: of the dataset.
        where: URL of the dataset, or a folder that all nodes share.
        shards: to make.
        address: of the cluster, or ``local`` or ``auto``.
        workers: tasks at once, where Ray is this run's own; a cluster decides by its processors.
        threads: processors of each task.
        told: called with ``{"what": "done", "shard", "completion"}`` for every shard.

    Raises:
        ShardError: Ray is missing or cannot be reached, or a shard could not be made; the others are made first.
    """
    refuse_no_ray(address)
    failed: list[str] = []
    with _connected(address, workers * threads) as ray:
        options = {"num_cpus": threads, "max_retries": RETRIES, "retry_exceptions": [OSError, StoreError]}
        remote = ray.remote(**options)(make_on_node)
        waiting, running = deque(shards), dict[Any, int]()
        while waiting or running:
            while waiting and len(running) < _most_at_once(ray):
                shard = waiting.popleft()
                running[remote.remote(plan.to_json().decode(), where, shard, threads)] = shard
            ready, _ = ray.wait(list(running), num_returns=1, timeout=_POLL_S)
            for reference in ready:
                shard = running.pop(reference)
                try:
                    told({"what": "done", "shard": shard, "completion": ray.get(reference)})
                except ray.exceptions.RayError as error:
                    failed.append(f"shard {shard}: {_line(error)}")
                    told({"what": "broken", "shard": shard, "error": failed[-1]})
    if failed:
        raise ShardError(f"{len(failed)} of {len(shards)} shards could not be made: {failed[0]}; --resume for what is missing")


@contextlib.contextmanager
def _connected(address: str, processors: int) -> Iterator[Any]:
    """Give Ray, connected; a Ray of this run's own ends with it, and its folder goes.

    Raises:
        ShardError: it cannot be reached.
    """
    with contextlib.ExitStack() as ends:
        options: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR, "address": address}
        if address == LOCAL:
            own = ends.enter_context(tempfile.TemporaryDirectory(prefix="ray_", dir=_temporary(), ignore_cleanup_errors=True))
            ends.enter_context(environment({**_OWN, "RAY_AUTH_TOKEN": os.environ.get("RAY_AUTH_TOKEN") or secrets.token_hex(32)}))
            options |= {
                "num_cpus": processors,
                "_node_ip_address": "127.0.0.1",
                "include_dashboard": False,
                "object_store_memory": _OBJECT_STORE_BYTES,
                "_temp_dir": own,
            }
        ray = importlib.import_module("ray")
        terminated = signal.getsignal(signal.SIGTERM)  # init puts its own in place, which prints a stack
        try:
            ray.init(**options)
        except Exception as error:  # of many kinds, some of the system's
            raise ShardError(f"--ray {address}: cannot be reached: {_line(error)}") from None
        ends.callback(ray.shutdown)
        signal.signal(signal.SIGTERM, terminated)
        yield ray


def refuse_no_ray(address: str) -> None:
    """Refuse to begin where Ray is not installed, or nobody answers at an address: Ray would end the whole process, after a minute.

    Args:
        address: as :func:`make_on_ray` has it; nothing is asked of ``auto``.

    Raises:
        ShardError: Ray is missing, or nobody answers.
    """
    if importlib.util.find_spec("ray") is None:
        raise ShardError("--ray: Ray is not installed: pip install 'scene_synth_ros[ray]'")
    if address in (LOCAL, AUTO):
        return
    host, colon, port = address.rpartition(":")
    number = whole_number(port)
    if not colon or number is None or "/" in host:
        raise ShardError(f"--ray {address}: expected HOST:PORT of a cluster's head, auto, or no address; run this on a node of the cluster")
    try:
        socket.create_connection((host, number), _KNOCK_S).close()
    except (OSError, OverflowError) as error:
        raise ShardError(f"--ray {address}: cannot be reached ({error}); see that ray start --head runs there") from None


def _most_at_once(ray: Any) -> int:
    """Return how many tasks may be with Ray: more than find processors, so that none waits and a cluster that grows sees that it should."""
    return 16 + 4 * int(ray.cluster_resources().get("CPU", 1))


def _temporary() -> str:
    folder = tempfile.gettempdir()
    return folder if len(folder) <= _LONGEST_TEMPORARY else "/tmp"


def _line(error: BaseException) -> str:
    """Return what was wrong in one line: of an error in a task, what the task said."""
    cause = getattr(error, "cause", None)
    if isinstance(cause, SceneSynthError | OSError):
        return error_line(cause)
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if cause is not None and lines else " ".join(lines)[:300] or type(error).__name__
