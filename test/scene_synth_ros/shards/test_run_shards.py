"""What becomes of a shard whose worker dies or cannot make it."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest
from dataset_plans import tiny_plan

from scene_synth_ros.shards import run_shards as module
from scene_synth_ros.shards.completion import ShardError
from scene_synth_ros.shards.make_shard import MAX_ATTEMPTS, Progress
from scene_synth_ros.shards.run_shards import run_shards
from scene_synth_ros.shards.store import LocalStore
from scene_synth_ros.workers.pool import Death, WorkerError, WorkerPool

PLAN = tiny_plan(6, 2)


class Scripted(WorkerPool):
    """Stands for workers: room 3 ends them by a signal unless it is given up."""

    orders: ClassVar[list[tuple[int, dict[int, str]]]]
    fatal: ClassVar[signal.Signals]
    error: ClassVar[str]

    def results(self, tasks: Any, told: Callable[[Any], None] = print, died: Callable[[Death], Any] = print) -> Iterator[int]:
        for task in tasks:
            while task is not None:
                task = yield from self.make(task, told, died)

    def make(self, task: Any, told: Callable[[Any], None], died: Callable[[Death], Any]) -> Any:
        shard, given_up = task
        self.orders.append((shard, dict(given_up)))
        if self.error:
            raise WorkerError(self.error)
        for room in PLAN.rooms_of(shard):
            progress = Progress("room", room)
            told(progress)
            if room == 3 and room not in given_up:
                return died(Death("worker 0 (process 77)", task, progress, -self.fatal))
        yield shard


@pytest.fixture(autouse=True)
def scripted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WorkerPool", Scripted)
    for name, value in {"orders": [], "fatal": signal.SIGSEGV, "error": ""}.items():
        monkeypatch.setattr(Scripted, name, value, raising=False)


def run(shards: list[int], tmp_path: Path, told: Callable[[Any], None] = print) -> None:
    run_shards(PLAN, LocalStore(tmp_path), shards, workers=2, threads=1, locks=[], told=told)


def test_a_room_that_ends_its_process_is_tried_again_and_then_given_up(tmp_path: Path) -> None:
    told: list[str] = []
    run([0, 1, 2], tmp_path, lambda event: told.append(event["what"]))
    of_one = [given_up for shard, given_up in Scripted.orders if shard == 1]
    assert of_one == [{}] * MAX_ATTEMPTS + [{3: "a process that made it was ended by SIGSEGV"}]
    assert told.count("done") == 3


def test_a_worker_that_is_ended_from_outside_ends_the_run_and_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Scripted, "fatal", signal.SIGKILL)
    says = r"shard 1: worker 0 \(process 77\) was ended by SIGKILL, by lack of memory perhaps \(take fewer --workers\); --resume makes what"
    with pytest.raises(ShardError, match=says):
        run([1], tmp_path)


def test_a_shard_that_cannot_be_made_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Scripted, "error", "no space left on device")
    with pytest.raises(ShardError, match="no space left on device; --resume goes on from here"):
        run([1], tmp_path)
