"""Runs the nodes of a suite as processes: starts them, watches them, ends them, and never leaves one behind."""

import contextlib
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from scene_synth_ros.suite.environment import RUN, SUPERVISED, die_with_parent
from scene_synth_ros.suite.faults import FAULT_STATUS
from scene_synth_ros.suite.stale_shared_memory import remove_stale_shared_memory

RECORDER, ONE_PROCESS = "recorder_node", "one_process"
PUBLISHERS_STOP_S, STOP_S, WRITERS_STOP_S = 1.2, 2.5, 10.0
"""How long nodes get to end by themselves, counted from the beginning of the end: those that publish, all, and those that write a bag."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeProcess:
    """A process to run: its name, its module, the parameter file of the node, and how often it is started again when a signal kills it.

    ``words`` stand after the module, instead of what a node is given.
    """

    name: str
    module: str
    parameters: Path
    respawns: int = 0
    words: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a run ended: 0 and no reason if every node ended well; 130 if it was interrupted; FAULT_STATUS after a fault of the program."""

    code: int
    reason: str = ""
    at: str = ""
    """The node that ended the run; empty if none did."""


class Interrupts:
    """Counts SIGINT and SIGTERM while the block runs, instead of raising in the middle of something."""

    def __init__(self) -> None:
        self.count = 0
        self._before: dict[int, object] = {}

    def __enter__(self) -> "Interrupts":
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._count)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]

    def _count(self, _number: int, _frame: object) -> None:
        self.count += 1


def run_nodes(nodes: list[NodeProcess], namespace: str, interrupts: Interrupts, log_level: str = "info") -> Outcome:
    """Run nodes until all have ended, one has failed or was ended by somebody, or a signal comes; then end the others.

    What fails in one node makes others fail too, perhaps before it has ended itself: the outcome names the one at fault, after a fault of
    the program that one, and not a recorder where another node has failed.

    Nodes run in sessions of their own, so that a Ctrl-C of the terminal reaches only this process, which ends them in order; they die with
    this process if it is killed.
    """
    environment = node_environment(os.environ)
    running: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for node in nodes:
            running[node.name] = _start(node, namespace, environment, log_level)
        outcome = _watch(running, interrupts, _Respawner(nodes, lambda node: _start(node, namespace, environment, log_level)))
    finally:
        _stop(running, interrupts)
        remove_stale_shared_memory()
    codes = {name: process.returncode for name, process in running.items()}
    faulty = [name for name, code in codes.items() if code == FAULT_STATUS]
    if faulty:
        return Outcome(code=FAULT_STATUS, reason=describe_end(faulty[0], FAULT_STATUS))
    failed = [name for name, code in codes.items() if code > 0 and name != RECORDER]
    return Outcome(code=1, reason=describe_end(failed[0], codes[failed[0]])) if outcome.at == RECORDER and failed else outcome


@contextlib.contextmanager
def companion(words: Sequence[str]) -> Iterator[None]:
    """Run a process beside the nodes, which the run neither needs nor waits for; an empty command runs none."""
    if not words:
        yield
        return
    environment = node_environment(os.environ)
    process = subprocess.Popen(words, env=environment, stdin=subprocess.DEVNULL, start_new_session=True, preexec_fn=die_with_parent())
    try:
        yield
    finally:
        process.terminate()
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def node_environment(outer: Mapping[str, str]) -> dict[str, str]:
    """Return the environment of the nodes: what the user has set, and defaults for what ROS needs beyond it."""
    defaults = {
        "AMENT_PREFIX_PATH": sys.prefix,
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": "[{name}] {message}",
        "PYTHONUNBUFFERED": "1",
    }
    return {**defaults, **outer, SUPERVISED: "1", RUN: uuid.uuid4().hex}


def _start(node: NodeProcess, namespace: str, environment: Mapping[str, str], log_level: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", node.module]
    if node.words:
        command += node.words
    else:
        command += ["--ros-args", "-r", f"__ns:={namespace}", "-r", f"__node:={node.name}"]
        command += ["--params-file", str(node.parameters), "--log-level", log_level]
    return subprocess.Popen(command, env=dict(environment), stdin=subprocess.DEVNULL, start_new_session=True, preexec_fn=die_with_parent())


class _Respawner:
    """Starts nodes again that a signal has killed, as often as each of them may; ``respawned`` names those that it has started."""

    def __init__(self, nodes: list[NodeProcess], start: Callable[[NodeProcess], subprocess.Popen[bytes]]) -> None:
        self.respawned: set[str] = set()
        self._nodes = {node.name: node for node in nodes}
        self._left = {node.name: node.respawns for node in nodes}
        self._start = start

    def respawn(self, name: str, code: int) -> subprocess.Popen[bytes] | None:
        """Return the new process of a node that ended with a code; None if it stays dead."""
        if code >= 0 or not self._left[name]:
            return None
        self._left[name] -= 1
        self.respawned.add(name)
        sys.stderr.write(f"run: {describe_end(name, code)}; started again\n")
        return self._start(self._nodes[name])


def _watch(running: dict[str, subprocess.Popen[bytes]], interrupts: Interrupts, respawner: _Respawner) -> Outcome:
    while not interrupts.count:
        codes = {name: process.poll() for name, process in running.items()}
        for name, code in codes.items():
            if code:
                again = respawner.respawn(name, code)
                if again is None:
                    return Outcome(code=1, reason=describe_end(name, code), at=name)
                running[name], codes[name] = again, None
        # A node that was killed when the last room was done waits, started again, for one that never comes.
        if all(codes[name] == 0 for name in codes.keys() - respawner.respawned or codes):
            return Outcome(code=0)
        time.sleep(0.05)
    return Outcome(code=130, reason="interrupted")


def describe_end(name: str, code: int) -> str:
    """Return how a process has ended, which is not well."""
    if code < 0:
        return f"{name} was ended by {signal.Signals(-code).name}"
    fault = " after a fault of the program, which is told above" if code == FAULT_STATUS else ""
    return f"{name} ended with code {code}{fault or ', for the reason told above'}"


def _stop(running: Mapping[str, subprocess.Popen[bytes]], interrupts: Interrupts) -> None:
    """End what still runs: first the nodes that publish, then the recorder, so that it gets their last frames; kill what does not end."""
    seen = interrupts.count
    began = time.monotonic()
    writers = [process for name, process in running.items() if name in (RECORDER, ONE_PROCESS)]
    publishers = [process for process in running.values() if process not in writers]
    for processes, seconds in ((publishers, PUBLISHERS_STOP_S), (running.values(), STOP_S), (writers, WRITERS_STOP_S)):
        for process in processes:
            if process.poll() is None and seconds < WRITERS_STOP_S:
                process.terminate()
        while any(process.poll() is None for process in processes) and time.monotonic() - began < seconds and interrupts.count == seen:
            time.sleep(0.02)
    for process in running.values():
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


class NodeModule(NamedTuple):
    """A module with ``main``, and the class of the node in it."""

    module: str
    node_class: str


NODES = {
    "grammar_node": NodeModule("scene_synth_ros.synthesize.grammar_node", "GrammarNode"),
    "renderer_node": NodeModule("scene_synth_ros.render.renderer_node", "RendererNode"),
    "recorder_node": NodeModule("scene_synth_ros.record.recorder_node", "RecorderNode"),
    "evaluator_node": NodeModule("scene_synth_ros.evaluate.evaluator_node", "EvaluatorNode"),
    "replay_node": NodeModule("scene_synth_ros.replay.replay_node", "ReplayNode"),
}

PROGRESS_MODULE = "scene_synth_ros.cli.processes.progress"
"""Draws the line of progress of a run."""

ONE_PROCESS_MODULE = "scene_synth_ros.cli.processes.one_process"
"""Runs several of them in one process."""
