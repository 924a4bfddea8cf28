"""Makes one shard by itself: the bag of its rooms, its hashes, and last its completion file."""

from __future__ import annotations

import hashlib
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription, SceneSynthError, error_line
from scene_description.polygons import signed_area_m2
from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.rules import rules_of
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.shards.completion import (
    FOLDER,
    Completion,
    FailedRow,
    RoomRow,
    completion_json,
    completion_name,
    describe_shard,
    shard_name,
)
from scene_synth_ros.shards.plan import DatasetPlan
from scene_synth_ros.shards.room_ahead import RoomsAhead
from scene_synth_ros.shards.store import Store

MAX_ATTEMPTS = 3
"""How often a room is tried before it is listed as failed."""


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

    It is made in a workspace, goes into the store when it is whole, and its completion file last.  A room that fails is tried again, at
    most ``MAX_ATTEMPTS`` times, then listed; the bytes of the other rooms are the same.

    Args:
        plan: of the dataset.
        shard: its number.
        store: where it goes.
        tell: called with what is done.
        given_up: rooms that are not tried any more, because they have ended whole processes: index -> error.

    Raises:
        ParameterError, GrammarError: the parameters do not fit.
        BagWriteError, OSError: the shard cannot be written; nothing of it counts.
    """
    settings = plan.settings_of(shard)
    rules = rules_of(settings)
    failed = {index: FailedRow(index=index, attempts=MAX_ATTEMPTS, error=error) for index, error in (given_up or {}).items()}
    maker = _Maker(plan, shard, settings, rules, tell, failed)
    with store.workspace(shard_name(shard)) as work:
        bag, rooms = maker.write(work / shard_name(shard))
        refused = [row for index, row in sorted(maker.tries.items()) if row["attempts"] >= MAX_ATTEMPTS]
        completion = describe_shard(plan, shard, rooms, refused, bag)
        store.remove(completion_name(shard))
        if bag is None:
            store.remove(f"{FOLDER}/{shard_name(shard)}")
        else:
            store.put_folder(bag, f"{FOLDER}/{shard_name(shard)}")
        store.write(completion_name(shard), completion_json(completion))
    return completion


class _Maker:
    """Writes the bag of a shard, as often as it takes.

    Attributes:
        tries: index -> how often a room has failed so far, and its last error.
    """

    def __init__(
        self,
        plan: DatasetPlan,
        shard: int,
        settings: OfflineSettings,
        rules: SceneSynthesizer,
        tell: Callable[[Progress], None],
        tries: dict[int, FailedRow],
    ) -> None:
        self._plan, self._shard, self._settings, self._rules, self._tell = plan, shard, settings, rules, tell
        self.tries = tries

    def write(self, bag: Path) -> tuple[Path | None, list[RoomRow]]:
        """Return the bag, None where no room could be made, and its rooms."""
        while True:
            try:
                rooms = self._write(bag)
            except _Spoiled:
                continue
            return bag if rooms else None, rooms

    def _write(self, folder: Path) -> list[RoomRow]:
        """Write the bag once, without the rooms that have been given up; nothing is left of a bag without rooms.

        Raises:
            _Spoiled: a room failed half-way, and nothing is left of the bag.
        """
        bag = OfflineBag(folder, self._settings, self._rules.floor_map, machine=False)
        try:
            with RoomsAhead(self._rules, self._settings, self._plan.rooms_of(self._shard)) as ahead:
                tried = [self._add(bag, ahead, index) for index in self._plan.rooms_of(self._shard)]
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
        """Add a room and say what it is; None if it has failed too often."""
        while index not in self.tries or self.tries[index]["attempts"] < MAX_ATTEMPTS:
            self._tell(Progress("room", index))
            before = bag.rooms
            try:
                scene = ahead.take(index)
                text = bag.add_room(scene, rendered=lambda: self._tell(Progress("frame", index)))
            except (BagWriteError, OSError, MemoryError):  # of the disk and the machine, not of the room
                raise
            except Exception as error:  # whatever it is, the other rooms are made, and this one is listed
                self._count(index, error)
                if bag.rooms > before:
                    raise _Spoiled from error
            else:
                return _row(scene, text)
        return None

    def _count(self, index: int, error: Exception) -> None:
        attempts = self.tries[index]["attempts"] + 1 if index in self.tries else 1
        self.tries[index] = FailedRow(index=index, attempts=attempts, error=_line(error))
        self._tell(Progress("failed", index, self.tries[index]["error"]))


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
