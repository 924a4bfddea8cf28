"""Makes one shard by itself: its rooms, each sampled while the one before is rendered, their bag, and last its completion file."""

import hashlib
import os
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, SceneSynthError, error_line
from scene_description.polygons import signed_area_m2
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.bags.dataset_files import PLAN_NAME, completion_name, shard_folder, shard_name
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.rules import rules_of, sample_room
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.shards.completion import Completion, FailedRow, RoomRow, describe_shard, document_bytes
from scene_synth_ros.shards.open_store import open_store
from scene_synth_ros.shards.plan import DatasetPlan, read_plan
from scene_synth_ros.shards.provenance import admit
from scene_synth_ros.shards.store import Store
from scene_synth_ros.shards.url_store import StoreError
from scene_synth_ros.suite.daemon_job import start_daemon_job

MAX_ATTEMPTS = 3
"""How often is tried what may go well the next time: to read a file, to reach a store, to make a room that ended its process."""
_PAUSE_S = 1.0
"""Before a store is tried again."""


class RoomsAhead:
    """Samples rooms; what is sampled does not depend on when.

    On one processor nothing is sampled ahead: it would take from the frames what it saves.

    Threads: one calls every method; a room is sampled ahead in a thread of its own.
    """

    def __init__(self, rules: SceneSynthesizer, settings: OfflineSettings, indices: range) -> None:
        self._rules, self._settings, self._indices = rules, settings, indices
        self._ahead: dict[int, Future[SceneDescription]] = {}
        self._has_processor = len(os.sched_getaffinity(0)) > 1

    def take(self, index: int) -> SceneDescription:
        """Return a room, and begin with the next one.

        Raises:
            SceneSynthError: it cannot be sampled; asked for again, it is sampled again.
        """
        ahead = self._ahead.pop(index, None)
        try:
            return ahead.result() if ahead is not None else self._sample(index)
        finally:
            if self._has_processor and index + 1 in self._indices and index + 1 not in self._ahead:
                self._ahead = {index + 1: start_daemon_job("next room", lambda: self._sample(index + 1))}

    def _sample(self, index: int) -> SceneDescription:
        return sample_room(self._rules, self._settings, index)

    def __enter__(self) -> "RoomsAhead":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for ahead in self._ahead.values():  # no thread goes on behind the back of who is done
            ahead.exception()
        self._ahead = {}


class Progress(NamedTuple):
    """What a shard at work tells: ``what`` is ``room`` when one begins, ``frame`` when one is rendered, ``failed`` with its error."""

    what: str
    room: int
    error: str = ""


class _Spoiled(Exception):
    """A room failed when some of its messages were in the bag already."""


def make_shard(
    plan: DatasetPlan,
    shard: int,
    store: Store,
    tell: Callable[[Progress], None] = lambda _: None,
    given_up: Mapping[int, str] | None = None,
) -> Completion:
    """Make a shard and return what its completion file says.

    It is made in a workspace, goes into the store when it is whole, and its completion file last.  A room that fails is listed, as it would
    fail again by the same random numbers; the bytes of the other rooms are the same.  Only what files and stores refuse is tried again, at
    most ``MAX_ATTEMPTS`` times in all.

    ``given_up``: rooms that are not tried any more, because they have ended whole processes: index -> error.

    Raises:
        ParameterError, GrammarError: the parameters do not fit.
        BagWriteError, StoreError, OSError: the shard cannot be written, or a file of the user's not read; nothing of it counts.
    """
    settings = plan.settings_of(shard)
    rules = rules_of(settings)
    failed = {index: FailedRow(index=index, attempts=MAX_ATTEMPTS, error=error) for index, error in (given_up or {}).items()}
    maker = _Maker(plan, shard, settings, rules, tell, failed)
    with store.workspace(shard_name(shard)) as work:
        bag, rooms = maker.write(work / shard_name(shard))
        completion = describe_shard(plan, shard, rooms, [row for _, row in sorted(maker.failed.items())], bag)
        for attempt in range(1, MAX_ATTEMPTS + 1):
            try:
                _put(store, completion, bag)
                break
            except StoreError:
                if attempt == MAX_ATTEMPTS:
                    raise
                time.sleep(_PAUSE_S)
    return completion


def _put(store: Store, completion: Completion, bag: Path | None) -> None:
    shard = completion["shard"]
    store.remove(completion_name(shard))
    if bag is None:
        store.remove(shard_folder(shard))
    else:
        store.put_folder(bag, shard_folder(shard))
    store.write(completion_name(shard), document_bytes(completion))


def prepare_shards(setup: tuple[bytes, str]) -> Callable[[tuple[int, Mapping[int, str]], Callable[[Progress], None]], int]:
    """Return what makes a shard in a worker process, by its number and the rooms that are not tried any more, and returns its number.

    Args:
        setup: ``dataset.json``, and folder or URL of the dataset.

    Raises:
        ProvenanceError: this process would make other bytes than those who began the dataset.
    """
    plan, store = read_plan(setup[0], PLAN_NAME), open_store(setup[1])
    admit(plan.provenance, [plan.own_provenance()], f"{setup[1]}: this worker", accept=False)

    def make(task: tuple[int, Mapping[int, str]], tell: Callable[[Progress], None]) -> int:
        shard, given_up = task
        make_shard(plan, shard, store, tell, given_up)
        return shard

    return make


class _Maker:
    """Writes the bag of a shard, as often as it takes.

    Attributes:
        failed: index -> a room that is not in the bag.
    """

    def __init__(
        self,
        plan: DatasetPlan,
        shard: int,
        settings: OfflineSettings,
        rules: SceneSynthesizer,
        tell: Callable[[Progress], None],
        failed: dict[int, FailedRow],
    ) -> None:
        self._rooms, self._settings, self._rules, self._tell = plan.rooms_of(shard), settings, rules, tell
        self.failed = failed
        self._unread: Counter[int] = Counter()

    def write(self, bag: Path) -> tuple[Path | None, list[RoomRow]]:
        """Return the bag, None where no room could be made, and its rooms."""
        while True:
            try:
                rooms = self._write(bag)
            except _Spoiled:
                continue
            return bag if rooms else None, rooms

    def _write(self, folder: Path) -> list[RoomRow]:
        """Write the bag once, without the rooms that have failed; nothing is left of a bag without rooms.

        Raises:
            _Spoiled: a room failed half-way, and nothing is left of the bag.
        """
        bag = OfflineBag(folder, self._settings, self._rules.floor_map, machine=False)
        try:
            with RoomsAhead(self._rules, self._settings, self._rooms) as ahead:
                tried = [self._add(bag, ahead, index) for index in self._rooms]
            rows = [row for row in tried if row is not None]
            if rows:
                bag.close()
        except BaseException:
            bag.discard()
            raise
        if not rows:
            bag.discard()
        return rows

    def _add(self, bag: OfflineBag, ahead: RoomsAhead, index: int) -> RoomRow | None:
        """Add a room and say what it is; None if it fails."""
        while index not in self.failed:
            self._tell(Progress("room", index))
            before = bag.rooms
            try:
                scene = ahead.take(index)
                text = bag.add_room(scene, rendered=lambda: self._tell(Progress("frame", index)))
            except (BagWriteError, MemoryError):  # of the disk and the machine, not of the room
                raise
            except OSError as error:  # of a file, which can perhaps be read the next time
                self._unread[index] += 1
                if self._unread[index] >= MAX_ATTEMPTS:
                    raise
                failure: Exception = error
            except Exception as error:  # whatever it is, the other rooms are made, and this one is listed
                self.failed[index] = FailedRow(index=index, attempts=1, error=_line(error))
                self._tell(Progress("failed", index, self.failed[index]["error"]))
                failure = error
            else:
                return _row(scene, text)
            if bag.rooms > before:
                raise _Spoiled from failure
        return None


def _row(scene: SceneDescription, text: str) -> RoomRow:
    return RoomRow(
        index=scene.index,
        seed=scene.seed,
        room_type=scene.category,
        scene_id=scene.id,
        scene_sha256=hashlib.sha256(text.encode()).hexdigest(),
        frames=len(scene.camera_path),
        floor_area_m2=round(signed_area_m2(scene.room.polygon_m), 6),
        objects=dict(sorted(Counter(thing.category for thing in scene.objects).items())),
    )


def _line(error: Exception) -> str:
    """Return an error in one line; a fault of the program tells where it is."""
    if isinstance(error, SceneSynthError):
        return error_line(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"fault of the program: {type(error).__name__}: {error_line(error)} ({Path(place.filename).name}:{place.lineno})"
