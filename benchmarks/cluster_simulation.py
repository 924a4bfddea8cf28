"""A run on a cluster, simulated shard by shard: how long, how much is made twice, what storage and scheduler see.

What is assumed, all of it in :class:`Cluster` and :func:`simulate`: rooms cost independent lognormal times with the mean and the spread
that ``scene_synth estimate`` has measured on one processor of this machine; a worker uploads a shard when it is made, at its share of the
rate of its node's network, and makes nothing meanwhile; nodes fail at exponential times, whatever they have at work is lost, and they come
back after a pause with cold workers.  The store itself is never slow: how much it would have to take is reported instead.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_NONE = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """What is made: rooms, rooms of a shard, seconds of a room (mean and coefficient of variation), bytes of a room."""

    rooms: int
    rooms_per_shard: int
    room_s: float
    room_cv: float
    room_bytes: float

    @property
    def shards(self) -> int:
        """How many shards there are."""
        return math.ceil(self.rooms / self.rooms_per_shard)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cluster:
    """Where it is made: nodes and workers of each, start of a worker (s), network of a node (bytes/s), failures.

    ``between_failures_h`` is of one node, 0 for never; ``repair_s`` what it takes until a node is back.  ``shares``: every worker has its
    share of the shards from the beginning (``--shard I/N``); otherwise whoever is free takes the next one (Ray).
    """

    nodes: int
    workers: int
    start_s: float = 15.0
    node_bytes_s: float = 1.25e9
    between_failures_h: float = 0.0
    repair_s: float = 600.0
    shares: bool = False


class Outcome(NamedTuple):
    """What came of it.

    Attributes:
        seconds: until the last shard is complete.
        busy: worker-seconds of work that counts, over worker-seconds of all workers until the end.
        lost: worker-seconds of work that was lost with nodes, over those that count.
        failures: of nodes.
        mean_bytes_s: that the store takes, over the whole run.
        peak_bytes_s: that it takes in the busiest minute.
        peak_starts_s: shards that are begun in the busiest second.
    """

    seconds: float
    busy: float
    lost: float
    failures: int
    mean_bytes_s: float
    peak_bytes_s: float
    peak_starts_s: float


def shard_seconds(dataset: Dataset, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the seconds of each shard, (shards,) float64, sums of its rooms' lognormal times."""
    variance = math.log1p(dataset.room_cv**2)
    mean = math.log(dataset.room_s) - variance / 2.0
    rooms = rng.lognormal(mean, math.sqrt(variance), dataset.rooms)
    return np.add.reduceat(rooms, np.arange(0, dataset.rooms, dataset.rooms_per_shard))


def simulate(dataset: Dataset, cluster: Cluster, rng: np.random.Generator) -> Outcome:
    """Run a dataset on a cluster.

    Args:
        dataset: what is made.
        cluster: where.
        rng: source of times and failures.
    """
    seconds = shard_seconds(dataset, rng)
    counts = np.diff(np.append(np.arange(0, dataset.rooms, dataset.rooms_per_shard), dataset.rooms))
    sizes = counts * dataset.room_bytes
    whole = seconds + sizes * cluster.workers / cluster.node_bytes_s
    slots = cluster.nodes * cluster.workers
    queue = _Queue(len(seconds), slots, cluster.shares)
    fails = np.full(cluster.nodes, math.inf)
    if cluster.between_failures_h:
        fails = rng.exponential(cluster.between_failures_h * 3600.0, cluster.nodes)
    events = [(cluster.start_s, slot, _NONE) for slot in range(slots)]  # when a slot is free, and what it had at work when its node failed
    heapq.heapify(events)
    ends, begins, lost, failures = np.zeros(len(seconds)), list[float](), 0.0, 0
    failed_until = np.zeros(cluster.nodes)
    while events:
        now, slot, lost_shard = heapq.heappop(events)
        if lost_shard != _NONE:
            for idle in queue.give_back(slot, lost_shard):
                heapq.heappush(events, (now, idle, _NONE))
        node = slot % cluster.nodes
        if now >= fails[node]:
            failures += 1
            failed_until[node] = fails[node] + cluster.repair_s
            fails[node] = failed_until[node] + rng.exponential(cluster.between_failures_h * 3600.0)
        if now < failed_until[node]:
            heapq.heappush(events, (failed_until[node] + cluster.start_s, slot, _NONE))
            continue
        shard = queue.take(slot)
        if shard == _NONE:
            continue
        begins.append(now)
        ends[shard] = now + whole[shard]
        if ends[shard] > fails[node]:
            lost += fails[node] - now
            heapq.heappush(events, (fails[node], slot, shard))
        else:
            heapq.heappush(events, (ends[shard], slot, _NONE))
    total = float(ends.max())
    minutes = np.bincount((ends // 60.0).astype(int), sizes) / 60.0
    return Outcome(
        seconds=total,
        busy=float(whole.sum()) / (slots * total),
        lost=lost / float(whole.sum()),
        failures=failures,
        mean_bytes_s=float(sizes.sum()) / total,
        peak_bytes_s=float(minutes.max()),
        peak_starts_s=float(np.bincount(np.asarray(begins).astype(int)).max()),
    )


class _Queue:
    """Shards that wait: one queue for all, or one for each slot."""

    def __init__(self, shards: int, slots: int, shares: bool) -> None:
        self._queues = [list(range(slot, shards, slots))[::-1] for slot in range(slots)] if shares else [list(range(shards))[::-1]]
        self._idle: list[int] = []

    def take(self, slot: int) -> int:
        """Return the next shard of a slot; ``_NONE`` if it has none, and is idle then."""
        queue = self._queues[slot % len(self._queues)]
        if queue:
            return queue.pop()
        self._idle.append(slot)
        return _NONE

    def give_back(self, slot: int, shard: int) -> list[int]:
        """Put a shard back to the front; return a slot that was idle and may take it, if there is one."""
        self._queues[slot % len(self._queues)].append(shard)
        return [self._idle.pop()] if self._idle and len(self._queues) == 1 else []
