"""Makes what is missing of a dataset with worker processes on this machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from scene_synth_ros.dataset.file_names import MANIFEST_NAME, PLAN_NAME
from scene_synth_ros.shards.completion import completion_name, faults_of, read_completion
from scene_synth_ros.shards.manifest import Manifest, make_manifest, manifest_json
from scene_synth_ros.shards.plan import DatasetPlan, PlanError, read_plan
from scene_synth_ros.shards.store import Store
from scene_synth_ros.shards.workers import Told, Workers


def begin_dataset(plan: DatasetPlan, store: Store, where: str, *, resume: bool) -> None:
    """Write the plan of a new dataset, or see that it is the plan of one that goes on.

    Args:
        plan: of the dataset.
        store: where it goes.
        where: its name, for errors.
        resume: whether it may be there already.

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
    difference = plan.difference(read_plan(data, f"{where}/{PLAN_NAME}"))
    if difference:
        raise PlanError(f"{where}: holds a dataset of another plan: {difference}; repeat its options, or choose another folder")


def run_shards(
    plan: DatasetPlan, store: Store, shards: Sequence[int], *, workers: int, threads: int, lock: int, told: Told = lambda _: None
) -> None:
    """Make shards with worker processes.

    Args:
        plan: of the dataset.
        store: where it goes.
        shards: to make.
        workers: how many.
        threads: processors of each.
        lock: descriptor of the folder's lock.
        told: called with what workers say.

    Raises:
        ShardError: a shard could not be made.
    """
    with Workers(plan, store.where, workers, threads, lock) as processes:
        processes.make(shards, told)


def check_shards(plan: DatasetPlan, store: Store, shards: Sequence[int]) -> Iterator[str]:
    """Read the files of complete shards; yield a line for each that is not what was made, and let its shard count as missing.

    Args:
        plan: of the dataset.
        store: where it is.
        shards: to check.
    """
    for shard in shards:
        completion = read_completion(store, plan, shard)
        faults = list(faults_of(store, completion)) if completion is not None else []
        if faults:
            store.remove(completion_name(shard))
        yield from faults


def finish_dataset(plan: DatasetPlan, store: Store) -> Manifest | None:
    """Write the manifest if every shard is complete, and return it; None while one is missing."""
    manifest = make_manifest(plan, store)
    if manifest is not None:
        store.write(MANIFEST_NAME, manifest_json(manifest))
    return manifest
