"""The manifest of a dataset, ``manifest.json``: all completion files in order, written when every shard is complete.

The same bytes whoever has made the shards, in whatever order and however often interrupted.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypedDict

from scene_synth_ros.dataset.file_names import MANIFEST_SCHEMA
from scene_synth_ros.shards.completion import Completion, FailedRow, read_completion, shard_name
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.store import Store

_READERS = 16


class Manifest(TypedDict):
    """A manifest; ``rooms`` and ``frames`` count what is there, ``failed`` lists what is not."""

    schema: str
    plan_sha256: str
    rooms: int
    frames: int
    failed: list[FailedRow]
    shards: list[Completion]


def missing_shards(plan: DatasetPlan, store: Store, shards: Sequence[int] | None = None) -> list[int]:
    """Return the shards, of some or of all, that are not complete.

    One of whose completion file the folder of files is gone is not complete either.
    """
    files = set(store.names("shards"))
    asked = range(plan.shards) if shards is None else shards
    there = [shard for shard in asked if f"{shard_name(shard)}.json" in files]
    complete = {
        shard
        for shard, completion in zip(there, read_completions(store, plan, there), strict=True)
        if completion is not None and (not completion["files"] or shard_name(shard) in files)
    }
    return [shard for shard in asked if shard not in complete]


def read_completions(store: Store, plan: DatasetPlan, shards: Sequence[int]) -> Iterator[Completion | None]:
    """Yield the completion files of shards in their order, several read at once: an object store takes its time for each."""
    with ThreadPoolExecutor(_READERS, "completion") as readers:
        yield from readers.map(lambda shard: read_completion(store, plan, shard), shards)


def make_manifest(plan: DatasetPlan, store: Store) -> Manifest | None:
    """Return the manifest of a dataset; None while a shard is missing."""
    complete = [completion for completion in read_completions(store, plan, range(plan.shards)) if completion is not None]
    if len(complete) < plan.shards:
        return None
    return Manifest(
        schema=MANIFEST_SCHEMA,
        plan_sha256=plan.sha256,
        rooms=sum(len(completion["rooms"]) for completion in complete),
        frames=sum(row["frames"] for completion in complete for row in completion["rooms"]),
        failed=[row for completion in complete for row in completion["failed"]],
        shards=complete,
    )


def manifest_json(manifest: Manifest) -> bytes:
    """Return the file's bytes."""
    return (json.dumps(manifest, indent=1) + "\n").encode()
