"""``scene_synth generate``: a dataset of rooms in shards, without DDS, with all processors, as often interrupted as need be."""

import argparse
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from scene_description import read_at_most
from scene_synth_ros.bags.dataset_files import PLAN_NAME, shard_name
from scene_synth_ros.cli.files.dataset_card import write_card
from scene_synth_ros.cli.lines import counted, say
from scene_synth_ros.cli.options import MAX_WORKERS, UsageError, add_number, add_workers
from scene_synth_ros.cli.parameters.run_parameters import add_run_options, run_parameters, run_words
from scene_synth_ros.cli.parameters.run_profile import NAMESPACE, check_namespace
from scene_synth_ros.cli.processes.dataset_progress import DatasetProgress
from scene_synth_ros.cluster.ray_shards import LOCAL, make_on_ray, refuse_no_ray
from scene_synth_ros.offline.rules import rules_of
from scene_synth_ros.shards.completion import Manifest, ShardError, Survey, survey
from scene_synth_ros.shards.open_store import held, open_store
from scene_synth_ros.shards.plan import MAX_PLAN_BYTES, MAX_ROOMS, DatasetPlan, make_plan, read_plan
from scene_synth_ros.shards.provenance import admit
from scene_synth_ros.shards.run_shards import (
    begin_dataset,
    check_shards,
    finish_dataset,
    read_size,
    refuse_another_plan,
    run_shards,
    sized_plan,
)
from scene_synth_ros.shards.store import Store
from scene_synth_ros.workers.pool import terminable
from scene_synth_ros.workers.processors import default_workers

_OF_PLAN = ("frames", "seed", "params", "overlay", "overrides", "scale_camera", "grammar", "shard_rooms", "shard_size")
"""Options that decide the plan, beside ``--rooms``."""
_SHOWN = 10
"""How many failed rooms are listed on the terminal; the manifest lists all."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's options."""
    add_run_options(parser, "number of rooms of the dataset")
    parser.add_argument("--plan", type=Path, metavar="FILE", help="dataset.json of another folder, in place of --rooms and the like")
    parser.add_argument(
        "--out", required=True, metavar="DIR|URL", help="folder of the dataset, or s3://bucket/folder: shards, manifest, card"
    )
    parser.add_argument("--namespace", default=NAMESPACE, help="namespace of the topics (default: %(default)s)")
    add_workers(parser, help="processes; they change nothing but the time (default: as processors allow)")
    add_number(parser, "--threads", 1, MAX_WORKERS, default=1, metavar="N", help="processors of each worker (default: %(default)s)")
    size = parser.add_mutually_exclusive_group()
    add_number(size, "--shard-rooms", 1, MAX_ROOMS, metavar="R", help="rooms of a shard (default: 1 to 16, by the number of rooms)")
    size.add_argument("--shard-size", metavar="SIZE", help="about the size of a shard, 1GB, say: R follows from the first room's bytes")
    resume = "make what is missing of a dataset, by its own plan; with more --rooms, extend it"
    parser.add_argument("--resume", action="store_true", help=resume)
    mixed = "go on with a dataset that another program, configuration or kind of machine has begun; plan and card list them"
    parser.add_argument("--accept-mixed", action="store_true", help=mixed)
    parser.add_argument("--check", action="store_true", help="with --resume: read the complete shards, too, and make damaged ones again")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--ray",
        nargs="?",
        const=LOCAL,
        metavar="ADDRESS",
        help="make shards as Ray tasks: of a cluster by its address, auto for the one Ray finds, no address for a Ray of this run's own",
    )
    where.add_argument(
        "--shard", metavar="I/N", help="make share I of N only, I from 0; begins or resumes; the last one writes the manifest"
    )
    where.add_argument(
        "--finish", action="store_true", help="make nothing; write the manifest and the card of a dataset whose shards are there"
    )


def run(arguments: argparse.Namespace) -> int:
    """Make a dataset; return 0, or 1 if a room could not be made."""
    _check_options(arguments)
    with terminable():
        return _generate(arguments)


def _generate(arguments: argparse.Namespace) -> int:
    store, share = open_store(arguments.out), read_share(arguments.shard) if arguments.shard else Share()
    plan = _plan(arguments, store)
    if arguments.ray:
        refuse_no_ray(arguments.ray)
    if not arguments.finish:
        _make(plan, store, share, arguments)
    return _finish(store, arguments)


def _make(plan: DatasetPlan, store: Store, share: "Share", arguments: argparse.Namespace) -> None:
    """Make what is missing of a share."""
    with held(store.where, share.lock) as locks:
        plan = _begun(plan, store, arguments, locks)
        shards = share.shards(plan)
        names = None if share.count == 1 else {shard_name(shard) for shard in shards}
        if left := store.clean(names):
            say(f"removed what an interrupted run has left of {counted(left, 'shard')}")
        found = survey(plan, store, shards)
        plan = _admitted(plan, found, store, arguments)
        for fault in found.faults:
            say(f"{fault}; its shard is made again")
        try:
            _complete(plan, store, shards, found.missing, arguments, locks)
        except (KeyboardInterrupt, SystemExit):
            say(f"interrupted; what is complete stays: scene_synth generate --out {arguments.out} --resume")
            raise
        finally:
            store.clean(names)


def _finish(store: Store, arguments: argparse.Namespace) -> int:
    """Write manifest and card once every shard is there, whoever has made it; return the exit status."""
    with held(store.where, ".lock.finish"):
        plan = read_plan(store.read(PLAN_NAME) or b"", f"{arguments.out}/{PLAN_NAME}")  # another share may have extended it
        found = survey(plan, store)
        plan = _admitted(plan, found, store, arguments)
        manifest = finish_dataset(plan, store, found)
        if manifest is not None:
            write_card(plan, manifest, store)
    if manifest is None:
        told = f"{len(found.missing)} of {plan.shards} shards are missing, {found.missing[0]} the first"
        if not arguments.shard:
            raise ShardError(f"{arguments.out}: {'; '.join((*found.faults[:1], told))}; --resume makes them")
        say(f"{arguments.out}: this share is complete; {told}; whoever makes the last one writes the manifest")
        return 0
    say(_summary(manifest, arguments.out))
    return 1 if manifest["failed"] and not arguments.shard else 0


def _check_options(arguments: argparse.Namespace) -> None:
    if arguments.rooms is None:
        if given := _given(arguments):
            raise UsageError(f"--{given[0].replace('_', '-')}: expected together with --rooms; a plan that there is already has its own")
        if arguments.plan is None and not _goes_on(arguments):
            raise UsageError("--rooms: expected a number of rooms, or --plan; --resume, --shard and --finish take the plan of the folder")
    elif arguments.plan is not None:
        raise UsageError("--rooms: expected this or --plan, got both")
    if arguments.finish and (arguments.rooms, arguments.plan) != (None, None):
        raise UsageError("--finish: expected neither --rooms nor --plan: what is there has its own plan")
    processors = len(os.sched_getaffinity(0))
    if arguments.threads > processors and not arguments.ray:
        raise UsageError(f"--threads: expected 1 to {processors}, the processors that this process may use, got {arguments.threads}")
    if arguments.check and not arguments.resume:
        raise UsageError("--check: expected together with --resume: what it finds damaged is made again")
    check_namespace(arguments.namespace)


def _given(arguments: argparse.Namespace) -> list[str]:
    """Return which options that decide the plan were given, beside ``--rooms``."""
    return [name for name in _OF_PLAN if getattr(arguments, name) not in (None, [], False)]


def _plan(arguments: argparse.Namespace, store: Store) -> DatasetPlan:
    """Return the plan that the options ask for, that of a file, or that of the folder."""
    data = store.read(PLAN_NAME) if _goes_on(arguments) else None
    there = read_plan(data, f"{arguments.out}/{PLAN_NAME}") if data is not None else None
    if there is not None and arguments.rooms is not None and not _given(arguments) and arguments.namespace == NAMESPACE:
        plan = there.extended(arguments.rooms) if arguments.rooms > there.rooms else replace(there, rooms=arguments.rooms)
    elif arguments.rooms is not None:
        plan = _given_plan(arguments, there)
    elif arguments.plan is not None:
        plan = read_plan(read_at_most(arguments.plan, MAX_PLAN_BYTES, UsageError), str(arguments.plan))
    elif there is not None:
        plan = there
    else:
        raise UsageError(f"{arguments.out}: holds no dataset; give --rooms and the other options of a new one")
    settings = plan.settings_of(0)
    rules_of(settings).check(settings.grammar["scene"])
    if there is not None:
        refuse_another_plan(plan, there, arguments.out)
    own = plan.own_provenance()
    where, known = (arguments.out, there.provenance) if there is not None else (str(arguments.plan), plan.provenance)
    admitted = admit(known, [own], where, accept=arguments.accept_mixed)
    return replace(plan, provenance=admitted if there is not None else (own,))


def _given_plan(arguments: argparse.Namespace, there: DatasetPlan | None) -> DatasetPlan:
    """Return the plan of the options; one that is there already keeps how it is cut unless they say otherwise."""
    size = read_size(arguments.shard_size) if arguments.shard_size else 0
    parameters = run_parameters(run_words(arguments, Path("bag")))
    plan = make_plan(parameters, rooms_per_shard=arguments.shard_rooms or 0, shard_bytes=size, namespace=arguments.namespace)
    if there is None:
        return plan
    if not arguments.shard_rooms and size in (0, there.shard_bytes):
        plan = replace(plan, rooms_per_shard=min(there.rooms_per_shard, plan.rooms), shard_bytes=there.shard_bytes)
    extended = there.extended(plan.rooms) if plan.rooms > there.rooms else there
    return replace(plan, extended_from=extended.extended_from)


def _admitted(plan: DatasetPlan, found: Survey, store: Store, arguments: argparse.Namespace) -> DatasetPlan:
    """Return the plan with what made the shards that there are, which is recorded where it is another and accepted."""
    provenance = admit(plan.provenance, found.made_by, arguments.out, accept=arguments.accept_mixed)
    if provenance != plan.provenance:
        plan = replace(plan, provenance=provenance)
        store.write(PLAN_NAME, plan.to_json())
    return plan


def _begun(plan: DatasetPlan, store: Store, arguments: argparse.Namespace, locks: Sequence[int]) -> DatasetPlan:
    """Write the plan, or see that it is the folder's; return it with the size of its shards."""
    if plan.shard_bytes and store.read(PLAN_NAME) is None and not store.names(""):
        say("making a room to know its size")
        plan = sized_plan(plan, store, threads=arguments.threads, locks=locks)
    begin_dataset(plan, store, arguments.out, resume=_goes_on(arguments))
    return plan


def _complete(
    plan: DatasetPlan, store: Store, shards: range, missing: Sequence[int], arguments: argparse.Namespace, locks: Sequence[int]
) -> None:
    """Make those of some shards that are missing, or damaged where that is to be checked."""
    workers = arguments.workers or default_workers(arguments.threads)
    if arguments.check:
        for line in check_shards(plan, store, sorted(set(shards) - set(missing))):
            say(f"{line}; its shard is made again")
        missing = survey(plan, store, shards).missing
    if not missing:
        return
    where = f"Ray ({arguments.ray})" if arguments.ray else counted(workers, "worker")
    each = counted(plan.rooms_per_shard, "room")
    say(f"{len(missing)} of {plan.shards} shards to make, {each} each; {where}; kernels are compiled on the first run")
    with DatasetProgress(plan, shards, missing) as progress:
        if arguments.ray:
            make_on_ray(plan, store.where, missing, address=arguments.ray, workers=workers, threads=arguments.threads, told=progress.take)
        else:
            run_shards(plan, store, missing, workers=workers, threads=arguments.threads, locks=locks, told=progress.take)


def _goes_on(arguments: argparse.Namespace) -> bool:
    """Return whether a dataset may be there already."""
    return bool(arguments.resume or arguments.shard or arguments.finish)


def _summary(manifest: Manifest, folder: str) -> str:
    size = sum(row["bytes"] for completion in manifest["shards"] for row in completion["files"])
    told = f"{counted(manifest['rooms'], 'room')}, {counted(manifest['frames'], 'frame')}"
    lines = [f"{folder}: {told}, {size / 1e6:.1f} MB in {counted(len(manifest['shards']), 'shard')}"]
    failed = manifest["failed"]
    lines += [f"failed after {row['attempts']} attempts: room {row['index']}: {row['error']}" for row in failed[:_SHOWN]]
    lines += [f"... {len(failed) - _SHOWN} more in manifest.json"] if len(failed) > _SHOWN else []
    return "\n".join(lines)


_FORM = re.compile(r"([0-9]{1,9})/([0-9]{1,9})")


@dataclass(frozen=True, slots=True)
class Share:
    """Every ``count``-th shard of a dataset, from shard ``index`` on, so that shares end at about the same time.

    Attributes:
        index: of this share, from 0.
        count: how many shares there are; 1 is all.
    """

    index: int = 0
    count: int = 1

    def shards(self, plan: DatasetPlan) -> range:
        """Return the shards of this share."""
        return range(self.index, plan.shards, self.count)

    @property
    def lock(self) -> str:
        """Name of the lock that a process holds which makes this share."""
        return ".lock" if self.count == 1 else f".lock.{self.index}"


def read_share(text: str) -> Share:
    """Return the share that ``I/N`` means.

    Raises:
        UsageError: it is none.
    """
    found = _FORM.fullmatch(text)
    index, count = (int(number) for number in found.groups()) if found else (0, 0)
    if not 0 <= index < count:
        raise UsageError(f"--shard {text}: expected I/N with I from 0 to N - 1: 0/4, 1/4, 2/4 or 3/4, say")
    return Share(index, count)
