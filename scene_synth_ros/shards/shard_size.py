"""How many rooms a shard of a wanted size has: as many as the first room goes into it."""

from __future__ import annotations

import re
from dataclasses import replace

from scene_synth_ros.shards.completion import ShardError, read_completion
from scene_synth_ros.shards.plan import DatasetPlan, PlanError
from scene_synth_ros.shards.run_shards import run_shards
from scene_synth_ros.shards.store import LocalStore, Store

_UNITS = {"": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}
_SIZE = re.compile(r"([0-9]+(?:\.[0-9]+)?) *([KMGT]?I?B|)")
_ROOMS_TRIED = 5


def read_size(text: str) -> int:
    """Return a size like ``1GB`` or ``256 MiB`` in bytes.

    Raises:
        PlanError: it is none.
    """
    found = _SIZE.fullmatch(text.strip().upper())
    size = round(float(found[1]) * _UNITS[found[2]]) if found and found[2] in _UNITS else 0
    if size <= 0:
        raise PlanError(f"--shard-size {text}: expected a number of bytes with a unit, 1GB or 256MiB, say")
    return size


def sized_plan(plan: DatasetPlan, store: Store, *, threads: int, lock: int) -> DatasetPlan:
    """Return a plan whose shards are about as large as its ``shard_bytes``: the first room that can be made is made to know its bytes.

    Args:
        plan: with ``shard_bytes``.
        store: of the dataset; the room is made in a workspace of it.
        threads: processors of the worker that makes it.
        lock: descriptor of the folder's lock.

    Raises:
        ShardError: none of the first rooms can be made.
    """
    single = replace(plan, rooms_per_shard=1)
    with store.workspace("size") as folder:
        trial = LocalStore(folder)
        for room in range(min(_ROOMS_TRIED, plan.rooms)):
            run_shards(single, trial, [room], workers=1, threads=threads, lock=lock)
            completion = read_completion(trial, single, room)
            size = sum(row["bytes"] for row in completion["files"]) if completion else 0
            if size:
                return replace(plan, rooms_per_shard=max(1, min(plan.rooms, round(plan.shard_bytes / size))))
    raise ShardError(f"none of the first {min(_ROOMS_TRIED, plan.rooms)} rooms can be made: {completion['failed'][0]['error']}")  # type: ignore[index]
