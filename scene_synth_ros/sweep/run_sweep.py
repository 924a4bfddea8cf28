"""Makes what is missing of a sweep, in one process or several; the bags do not depend on how many."""

import json
import os
import shutil
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from itertools import groupby, islice
from pathlib import Path
from typing import NamedTuple

from grammar.counterfactual import apply_change, as_base
from scene_description import SceneSynthError, error_line
from scene_description.whole import write_whole
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.rules import rules_of
from scene_synth_ros.render.renderer_config import catalog_folder
from scene_synth_ros.render.room import RenderedRoom, room_settings
from scene_synth_ros.sweep.sweep_file import SweepError
from scene_synth_ros.sweep.sweep_json import SWEEP_NAME
from scene_synth_ros.sweep.variant import RECORD_NAME, BaseRoom, SweepPlan, Variant, sweep_document
from scene_synth_ros.workers.folder_lock import folder_lock
from scene_synth_ros.workers.pool import Tell, WorkerPool


class Outcome(NamedTuple):
    """How a sweep ended: ids of the variants that were there already, what became of the others."""

    found: tuple[str, ...]
    made: "tuple[Made, ...]"


def run_sweep(
    plan: SweepPlan, folder: Path, only: Sequence[str] = (), workers: int = 1, tell: "Callable[[Made, int, int], None]" = lambda *_: None
) -> Outcome:
    """Make the variants of a sweep whose bags are not there; write ``sweep.json`` at the end, also of a run that is interrupted.

    ``only``: ids of the variants to make; empty: all.
    ``tell``: called with every variant that is made or refused, how many are done with, and of how many.

    Raises:
        SweepError: the folder holds something else.
        FolderInUseError: another run is at work in it.
        BagWriteError, WorkerError: a bag cannot be written, or a worker was killed.
    """
    exposure = plan.spec.run.exposure
    strangers = folder.is_dir() and [path for path in folder.iterdir() if not path.name.startswith(".lock")]
    if strangers and not ((folder / SWEEP_NAME).exists() or (folder / "variants").exists()):
        raise SweepError(f"--out {folder}: expected a new folder or one of a sweep, got one that holds other things")
    with folder_lock(folder) as lock:
        chosen = [variant for variant in plan.variants if not only or variant.id in only]
        found = [variant.id for variant in chosen if is_done(variant, folder, exposure)]
        left = [variant for variant in chosen if variant.id not in found]
        made: list[Made] = []

        def take(done: Made) -> None:
            made.append(done)
            tell(done, len(made), len(left))

        try:
            _make_all(left, folder, exposure, workers, lock, take)
        finally:
            there = [variant.id for variant in plan.variants if is_done(variant, folder, exposure)]
            refused = {done.id: done.refused for done in made if done.refused}
            write_whole(folder / SWEEP_NAME, json.dumps(sweep_document(plan, there, refused), indent=1) + "\n")
    return Outcome(tuple(found), tuple(made))


def _make_all(variants: Sequence[Variant], folder: Path, exposure: str, workers: int, lock: int, take: "Callable[[Made], None]") -> None:
    """Make the variants; ``take`` is called with what becomes of each."""
    if workers == 1 or len(variants) < 2:
        with closing(HeldRoom()) as held:
            for variant in variants:
                take(make_variant(variant, folder, exposure, held))
        return
    count = min(workers, len(variants))
    share = -(-len(os.sched_getaffinity(0)) // count)
    with WorkerPool(prepare_variants, (folder, exposure), count, share, [lock]) as pool:
        deque(pool.results(tasks_of(variants, count), take), maxlen=0)


_TASKS = 2
"""Of a worker, at least."""


def tasks_of(variants: Sequence[Variant], workers: int) -> Iterator[tuple[Variant, ...]]:
    """Yield what a worker makes at a time: the variants of a base room, in parts where there are few rooms."""
    most = -(-len(variants) // (_TASKS * workers))
    for _, of_room in groupby(variants, lambda variant: id(variant.base)):
        while task := tuple(islice(of_room, most)):
            yield task


def prepare_variants(setup: tuple[Path, str]) -> Callable[[Sequence[Variant], Tell], None]:
    """Return what makes variants in a worker process, and tells of each; ``setup`` is the folder of the sweep and its exposure."""
    held = HeldRoom()

    def make(variants: Sequence[Variant], tell: Tell) -> None:
        for variant in variants:
            tell(make_variant(variant, *setup, held))

    return make


class HeldRoom:
    """The base room of the variants at work, kept open: they have its exposure, and share with it what they have in common.

    Threads: one calls every method.
    """

    def __init__(self) -> None:
        self._base: BaseRoom | None = None
        self._rooms: dict[str, RenderedRoom] = {}

    def of(self, base: BaseRoom) -> Mapping[str, RenderedRoom]:
        """Return a base room as each renderer has it, by their names; the one before is closed.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        if self._base != base:
            self.close()
            scene, former = as_base(base.scene), None
            for name, groups in base.settings.renderers.items():
                former = RenderedRoom(scene, room_settings(groups, catalog_folder("renderer_node", groups)), former)
                self._rooms[name] = former
                former.make()
            self._base = base
        return self._rooms

    def close(self) -> None:
        """Release the room's threads and memory."""
        for room in self._rooms.values():
            room.close()
        self._rooms, self._base = {}, None


class Made(NamedTuple):
    """What became of a variant: how many frames it has, or why it cannot be."""

    id: str
    frames: int
    refused: str


def make_variant(variant: Variant, folder: Path, exposure: str, held: HeldRoom) -> Made:
    """Write the bag of a variant below the folder of its sweep.

    The same random numbers, frame indices and stamps as of the base room; its exposure too, if ``exposure`` is ``held``.

    Raises:
        BagWriteError: the bag cannot be written.
        SweepError: something else is where it shall be.
    """
    bag = folder / variant.bag
    remove_stale(bag)
    rules = rules_of(variant.base.settings)
    try:
        rooms = held.of(variant.base)
        scene = as_base(variant.base.scene)
        for change in variant.changes:
            scene = apply_change(scene, change, rules)
        with OfflineBag(bag, variant.settings, rules.floor_map, {RECORD_NAME: variant.record(exposure)}) as writer:
            metered = (lambda renderer: rooms[renderer].metered) if exposure == "held" else None
            writer.add_room(scene, metered, former=next(iter(rooms.values())))
    except BagWriteError:
        raise
    except SceneSynthError as error:
        return Made(variant.id, 0, error_line(error))
    return Made(variant.id, len(scene.camera_path), "")


def is_done(variant: Variant, folder: Path, exposure: str) -> bool:
    """Return whether a variant's bag is there, whole, and records what the plan says; the command that made it does not matter."""
    try:
        with BagReader(folder / variant.bag) as reader:
            summary = reader.summary
    except (BagReadError, OSError):
        return False
    record = summary.records.get(RECORD_NAME, {})
    return summary.finished and not summary.faults and _compared(record) == _compared(variant.record(exposure))


def remove_stale(bag: Path) -> None:
    """Remove the bag of a variant that is not what the plan says.

    Raises:
        SweepError: there is something that is no bag.
    """
    if not bag.exists():
        return
    strangers = [file.name for file in bag.iterdir() if ".mcap" not in file.name and not file.name.startswith("metadata.yaml")]
    if strangers:
        raise SweepError(f"{bag}: expected a bag of this sweep, got a folder that holds {strangers[0]}; choose another --out")
    shutil.rmtree(bag)


def _compared(record: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in record.items() if name != "command"}
