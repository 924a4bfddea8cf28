"""Who makes which shard, and what becomes of a worker that dies; processors and locks."""

import queue
import signal
from pathlib import Path
from typing import Any, ClassVar

import pytest
from dataset_plans import tiny_plan

from scene_synth_ros.shards import open_store as lock_module
from scene_synth_ros.shards import workers as module
from scene_synth_ros.shards.completion import ShardError
from scene_synth_ros.shards.make_shard import MAX_ATTEMPTS
from scene_synth_ros.shards.open_store import folder_lock
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.shards.worker_start import processors_of, worker_environment
from scene_synth_ros.shards.workers import Workers

PLAN = tiny_plan(6, 2)


class Scripted:
    """Stands for a worker process: room 3 ends it by a signal unless it is given up."""

    orders: ClassVar[list[tuple[int, dict[int, str]]]] = []
    fatal = signal.SIGSEGV

    def __init__(self, number: int, threads: int, begin: dict[str, Any], events: queue.Queue[Any], lock: int) -> None:
        self.number, self.shard, self.room, self._events = number, -1, -1, events

    def begin(self, shard: int, given_up: dict[int, str]) -> None:
        self.shard = shard
        self.orders.append((shard, dict(given_up)))
        for room in PLAN.rooms_of(shard):
            self._events.put((self, {"what": "room", "room": room, "error": ""}))
            if room == 3 and room not in given_up:
                self._events.put((self, {"what": "ended", "status": -self.fatal}))
                return
        self._events.put((self, {"what": "done", "shard": shard}))

    def end(self) -> int:
        return 0


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Workers:
    monkeypatch.setattr(module, "_Worker", Scripted)
    monkeypatch.setattr(Scripted, "orders", [])
    return Workers(PLAN, tmp_path, 2, 1, -1)


def test_a_room_that_kills_its_process_is_tried_as_often_as_any_other_and_then_given_up(workers: Workers) -> None:
    told: list[str] = []
    workers.make([0, 1, 2], lambda event: told.append(event["what"]))
    of_one = [given_up for shard, given_up in Scripted.orders if shard == 1]
    assert of_one == [{}] * MAX_ATTEMPTS + [{3: "a process that made it ended by SIGSEGV"}]
    assert told.count("done") == 3


def test_a_worker_that_is_killed_from_outside_ends_the_run(workers: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Scripted, "fatal", signal.SIGKILL)
    with pytest.raises(ShardError, match="ended by SIGKILL, by lack of memory perhaps"):
        workers.make([1], lambda _: None)


def test_workers_take_processors_in_turn() -> None:
    assert [processors_of(worker, 1, [0, 1]) for worker in range(3)] == [[0], [1], [0]]
    assert [processors_of(worker, 2, [2, 3, 5]) for worker in range(2)] == [[2, 3], [2, 5]]
    assert processors_of(0, 8, [0, 1]) == [0, 1]
    assert worker_environment({"HOME": "/h"}, 3)["OPENBLAS_NUM_THREADS"] == "3"


def test_a_folder_has_one_run_at_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock_module, "_PATIENCE_S", 0.0)
    with folder_lock(tmp_path / "d"):
        with pytest.raises(ShardError, match="another run is at work there"), folder_lock(tmp_path / "d"):
            pass
        with folder_lock(tmp_path / "d", ".slice-1-of-2.lock"):
            pass
    with folder_lock(tmp_path / "d"):
        pass


def test_what_dead_runs_have_left_is_removed_and_nothing_else(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    store.write("dataset.json", b"plan")
    for name in ("shards/.00001.77.partial/x", "shards/00000/x"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "shards" / ".00001.json.77.partial").touch()
    (tmp_path / "shards" / "00000.json").touch()
    store.clean()
    assert store.names("shards") == ["00000", "00000.json"] and store.read("dataset.json") == b"plan"
    assert sorted(path.name for path in (tmp_path / "shards").iterdir()) == ["00000", "00000.json"]


def test_a_file_that_cannot_be_written_leaves_the_one_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = LocalStore(tmp_path)
    store.write("manifest.json", b"old")

    def refuse(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("scene_description.whole.os.fsync", refuse)
    with pytest.raises(OSError, match="No space left"):
        store.write("manifest.json", b"new")
    assert store.read("manifest.json") == b"old" and [path.name for path in tmp_path.iterdir()] == ["manifest.json"]
