"""Workers that share tasks: who does which, what is told, and that nothing which ends one leaves the run waiting or a process behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from worker_tasks import prepare_silent_end, prepare_words

from scene_description import SceneSynthError
from scene_synth_ros.workers.pool import Death, WorkerError, WorkerPool, terminable

HELPERS = Path(__file__).parents[2] / "helpers"


@pytest.fixture(autouse=True)
def tasks_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(HELPERS))


def results(
    tasks: list[Any], prepare: Callable[[Any], Any] = prepare_words, setup: Any = "setup", workers: int = 1, **more: Any
) -> list[Any]:
    with WorkerPool(prepare, setup, workers) as pool:
        return list(pool.results(tasks, **more))


def test_tasks_are_done_on_processors_that_are_taken_before_libraries_load() -> None:
    told: list[str] = []
    made = results([("word", number) for number in range(5)], workers=2, told=told.append)
    assert sorted(value for _, value, *_ in made) == list(range(5)) and told == ["word begun"] * 5
    assert {setup for setup, *_ in made} == {"setup"}
    allowed = sorted(os.sched_getaffinity(0))
    assert {tuple(processors) for _, _, processors, *_ in made} <= {(processor,) for processor in allowed[:2]}
    assert {threads for *_, threads, _ in made} == {"1"}


def test_no_task_needs_no_worker() -> None:
    assert results([]) == []


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (SceneSynthError("no layout\nfits"), "no layout fits"),
        (OSError(28, "No space left on device"), "no space left on device; free some space or choose another disk"),
        (MemoryError(), "the memory does not suffice; take fewer --workers"),
        (ZeroDivisionError("in a task"), "fault of the program: ZeroDivisionError: in a task"),
    ],
)
def test_what_a_task_raises_ends_the_run_in_one_line(error: Exception, says: str) -> None:
    with pytest.raises(WorkerError) as raised:
        results([("raise", error)])
    assert str(raised.value) == says


@pytest.mark.parametrize("word", ["signal", "half"])
def test_a_worker_that_is_killed_ends_the_run_with_its_name_even_in_the_middle_of_a_message(word: str) -> None:
    began = time.monotonic()
    with pytest.raises(WorkerError, match=r"worker 0 \(process [0-9]+\) was ended by SIGKILL, by lack of memory perhaps"):
        results([(word, signal.SIGKILL)])
    assert time.monotonic() - began < 10.0


def test_a_worker_that_is_terminated_lacks_no_memory() -> None:
    with pytest.raises(WorkerError, match="was ended by SIGTERM; run again for what is missing"):
        results([("signal", signal.SIGTERM)])


def test_an_interrupt_of_the_terminal_is_not_the_workers() -> None:
    assert [value for _, value, *_ in results([("signal", signal.SIGINT)])] == [signal.SIGINT]


def test_a_task_whose_worker_has_died_is_done_by_the_next_one_as_it_is_told() -> None:
    deaths: list[Death] = []

    def died(death: Death) -> tuple[str, int]:
        deaths.append(death)
        return ("word", 7)

    assert sorted(value for _, value, *_ in results([("signal", signal.SIGSEGV), ("word", 8)], died=died)) == [7, 8]
    ((_, task, last, status),) = deaths
    assert (task, last, status) == (("signal", signal.SIGSEGV), "signal begun", -signal.SIGSEGV)


def test_a_worker_that_has_told_nothing_of_its_task_says_so() -> None:
    lasts: list[Any] = []
    with pytest.raises(WorkerError):
        results([1], prepare_silent_end, signal.SIGSEGV, died=lambda death: (lasts.append(death.last), end(death)))
    assert lasts == [None]


def end(death: Death) -> None:
    raise WorkerError(death.line)


def test_a_sigterm_ends_a_run_and_its_workers() -> None:
    with pytest.raises(SystemExit) as ended, terminable(), WorkerPool(prepare_words, "", 1) as pool:
        for _ in pool.results([("folder", 60.0)], told=lambda line: os.kill(os.getpid(), signal.SIGTERM)):
            pass
    assert ended.value.code == 143
    assert all(worker.process.returncode is not None for worker in pool._processes)


HOLD = """
import sys
from worker_tasks import prepare_words
from scene_synth_ros.workers.pool import WorkerPool
with WorkerPool(prepare_words, "", 2) as pool:
    for _ in pool.results([("folder", 60.0)] * 2, lambda line: print(line, flush=True)):
        pass
"""


def test_workers_of_a_run_that_is_killed_end_and_remove_their_folders(tmp_path: Path) -> None:
    env = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": f"{HELPERS}:{Path(__file__).parents[3]}", "SCENE_SYNTH_TEST": str(tmp_path)}
    run = subprocess.Popen([sys.executable, "-c", HOLD], env=env, stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    while not len([path for path in tmp_path.iterdir() if path.is_dir()]) == 2:
        assert run.stdout.readline()
    run.kill()
    run.wait()
    end_s = time.monotonic() + 20.0
    while (processes_with(f"SCENE_SYNTH_TEST={tmp_path}") or list(tmp_path.iterdir())) and time.monotonic() < end_s:
        time.sleep(0.02)
    assert processes_with(f"SCENE_SYNTH_TEST={tmp_path}") == [] and list(tmp_path.iterdir()) == []


def processes_with(variable: str) -> list[int]:
    """Return the processes that have a variable in their environment."""
    pids = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            if variable.encode() in path.read_bytes().split(b"\0"):
                pids.append(int(path.parent.name))
        except OSError:
            pass
    return pids
