"""Makes what is missing of a dataset with worker processes on this machine; begins it, checks it, finishes it."""

import re
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from scene_synth_ros.bags.dataset_files import DATASET_MANIFEST_NAME, PLAN_NAME, completion_name
from scene_synth_ros.shards.completion import Manifest, ShardError, Survey, document_bytes, faults_of, make_manifest, read_completion
from scene_synth_ros.shards.make_shard import MAX_ATTEMPTS, prepare_shards
from scene_synth_ros.shards.plan import DatasetPlan, PlanError, read_plan
from scene_synth_ros.shards.store import LocalStore, Store
from scene_synth_ros.workers.pool import Death, WorkerError, WorkerPool

Told = Callable[[Mapping[str, Any]], None]

_OWN_DEATHS = {signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL}
"""Signals by which a process ends for what it does; any other comes from outside, and ends the run."""
_UNITS = {"": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30, "TIB": 2**40}
_SIZE = re.compile(r"([0-9]+(?:\.[0-9]+)?) *([KMGT]?I?B|)")
_ROOMS_TRIED = 5


def begin_dataset(plan: DatasetPlan, store: Store, where: str, *, resume: bool) -> None:
    """Write the plan of a new dataset, or see that it is the plan of one that goes on, perhaps with more rooms or makers.

    ``resume``: whether it may be there already.

    Raises:
        PlanError: there is a dataset, and it shall not go on, or has another plan; or there is something else.
    """
    data = store.read(PLAN_NAME)
    if data is None and (strangers := store.names("")):
        data = store.read(PLAN_NAME)  # another share may just have begun
        if data is None:
            raise PlanError(f"{where}: expected a new folder or one of a dataset, got one that holds {strangers[0]}")
    if data is None:
        store.write(PLAN_NAME, plan.to_json())
        return
    if not resume:
        raise PlanError(f"{where}: holds a dataset; say --resume for what is missing of it, or choose another folder")
    there = read_plan(data, f"{where}/{PLAN_NAME}")
    refuse_another_plan(plan, there, where)
    if plan != there:
        if plan.rooms > there.rooms:
            store.remove(DATASET_MANIFEST_NAME)  # which is of all shards, or not there
        store.write(PLAN_NAME, plan.to_json())


def refuse_another_plan(plan: DatasetPlan, there: DatasetPlan, where: str) -> None:
    """Refuse a plan by which a dataset cannot go on; it may have more rooms.

    Raises:
        PlanError: the line names the first difference.
    """
    difference = plan.difference(there.extended(plan.rooms) if plan.rooms > there.rooms else there)
    if difference:
        raise PlanError(f"{where}: holds a dataset of another plan: {difference}; repeat its options, or choose another folder")


def run_shards(
    plan: DatasetPlan, store: Store, shards: Sequence[int], *, workers: int, threads: int, locks: Sequence[int], told: Told = lambda _: None
) -> None:
    """Make shards with worker processes.

    A worker that ends by what it does is replaced; a room that ends it ``MAX_ATTEMPTS`` times is given up.

    ``locks``: descriptors of the folder's lock, which workers hold, too.
    ``told``: called with ``{"what", "room", "error"}`` as shards proceed (:class:`Progress`), and ``{"what": "done", "shard"}``.

    Raises:
        ShardError: a shard could not be made, or a worker was killed.
    """
    deaths: Counter[int] = Counter()
    given_up: dict[int, str] = {}

    def died(death: Death) -> tuple[int, dict[int, str]]:
        shard, _ = death.task
        if -death.status not in _OWN_DEATHS or death.last is None:
            raise ShardError(f"shard {shard}: {death.line}; --resume makes what is missing")
        room = death.last.room
        deaths[room] += 1
        if deaths[room] >= MAX_ATTEMPTS:
            given_up[room] = f"a process that made it was ended by {signal.Signals(-death.status).name}"
        return shard, given_up

    setup = plan.to_json(), store.where
    with WorkerPool(prepare_shards, setup, workers, threads, locks) as pool:
        try:
            for shard in pool.results(((shard, {}) for shard in shards), lambda progress: told(progress._asdict()), died):
                told({"what": "done", "shard": shard})
        except WorkerError as error:
            raise ShardError(f"{error}; --resume goes on from here") from None


def check_shards(plan: DatasetPlan, store: Store, shards: Sequence[int]) -> Iterator[str]:
    """Read the files of complete shards; yield a line for each that is not what was made, and let its shard count as missing."""
    for shard in shards:
        completion = read_completion(store, plan, shard)
        faults = list(faults_of(store, completion)) if completion is not None else []
        if faults:
            store.remove(completion_name(shard))
        yield from faults


def finish_dataset(plan: DatasetPlan, store: Store, found: Survey) -> Manifest | None:
    """Write the manifest if every shard was found complete, and return it; None while one is missing."""
    manifest = None if found.missing else make_manifest(plan, store)
    if manifest is not None:
        store.write(DATASET_MANIFEST_NAME, document_bytes(manifest))
    return manifest


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


def sized_plan(plan: DatasetPlan, store: Store, *, threads: int, locks: Sequence[int]) -> DatasetPlan:
    """Return a plan whose shards are about as large as its ``shard_bytes``: the first room that can be made is made to know its bytes.

    ``locks``: descriptors of the folder's lock.

    Raises:
        ShardError: none of the first rooms can be made.
    """
    single = replace(plan, rooms_per_shard=1)
    with store.workspace("size") as folder:
        trial = LocalStore(folder)
        for room in range(min(_ROOMS_TRIED, plan.rooms)):
            run_shards(single, trial, [room], workers=1, threads=threads, locks=locks)
            completion = read_completion(trial, single, room)
            size = sum(row["bytes"] for row in completion["files"]) if completion else 0
            if size:
                return replace(plan, rooms_per_shard=max(1, min(plan.rooms, round(plan.shard_bytes / size))))
    raise ShardError(f"none of the first {min(_ROOMS_TRIED, plan.rooms)} rooms can be made: {completion['failed'][0]['error']}")  # type: ignore[index]
