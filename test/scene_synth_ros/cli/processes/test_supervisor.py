"""Nodes that somebody ends or kills while the run goes on, in real processes."""

import os
import signal
import threading
from pathlib import Path

import pytest
from scene_synth_ros_suite import environment, wait_until

from scene_synth_ros.cli.processes.supervisor import Interrupts, NodeProcess, Outcome, run_nodes

NODE = """
import os, sys
from rclpy.lifecycle import LifecycleNode
from scene_synth_ros.suite.process import run_node
from scene_synth_ros.suite.suite_node import SuiteNode

class Idle(SuiteNode):
    def __init__(self):
        super().__init__("idle")
        self.declare_parameter("exit_when_done", True)
        self.begin(True)
        open(sys.argv[1] + "/" + sys.argv[2] + "_" + str(os.getpid()), "w").close()
        if sys.argv[3:]:
            self.create_timer(0.1, self.trigger_shutdown)

run_node(Idle, [])
"""


def processes(folder: Path, **words: tuple[str, ...]) -> list[NodeProcess]:
    (folder / "idle_node_of_a_test.py").write_text(NODE)
    (folder / "pids").mkdir()
    return [
        NodeProcess(name=name, module="idle_node_of_a_test", parameters=folder, words=(str(folder / "pids"), name, *more))
        for name, more in words.items()
    ]


@pytest.fixture(autouse=True)
def surroundings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in environment().items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ["PYTHONPATH"]]))


def run(nodes: list[NodeProcess], work: threading.Thread | None = None) -> Outcome:
    """Run nodes; fail instead of waiting for ever where nobody ends them."""
    interrupts = Interrupts()
    watch = threading.Timer(30.0, lambda: setattr(interrupts, "count", 1))
    watch.start()
    if work is not None:
        work.start()
    try:
        return run_nodes(nodes, "/synth", interrupts)
    finally:
        watch.cancel()


@pytest.mark.parametrize(("node", "number"), [("recorder_node", signal.SIGTERM), ("renderer_node", signal.SIGINT)])
def test_a_node_that_is_ended_by_a_signal_ends_the_run(
    tmp_path: Path, node: str, number: signal.Signals, capfd: pytest.CaptureFixture[str]
) -> None:
    nodes = processes(tmp_path, recorder_node=(), renderer_node=(), grammar_node=())

    def end() -> None:
        wait_until(lambda: len(list((tmp_path / "pids").iterdir())) == 3, 30, "the nodes")
        (mine,) = (tmp_path / "pids").glob(f"{node}_*")
        os.kill(int(mine.name.rpartition("_")[2]), number)

    outcome = run(nodes, threading.Thread(target=end))
    assert outcome == Outcome(code=1, reason=f"{node} was ended by {number.name}", at=node)
    assert "before the run was over" not in capfd.readouterr().err, "the run's own line names the node, and no other line any node"


def test_a_node_that_is_shut_down_ends_the_run(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    outcome = run(processes(tmp_path, recorder_node=(), renderer_node=("shut down",)))
    assert outcome == Outcome(code=1, reason="renderer_node ended with code 1, for the reason told above", at="renderer_node")
    (line,) = (line for line in capfd.readouterr().err.splitlines() if "idle" in line)
    assert line == "[idle] shut down before the run was over"


DIES_ONCE = """
import os, pathlib, signal, time
first = pathlib.Path(__file__).with_name("has_died")
if not first.exists():
    first.touch()
    os.kill(os.getpid(), signal.SIGKILL)
time.sleep(600)
"""


def test_a_node_that_is_killed_when_the_others_are_done_is_not_waited_for(tmp_path: Path) -> None:
    """Started again after the last room, a renderer waits for one that never comes."""
    (tmp_path / "dies_once.py").write_text(DIES_ONCE)
    (tmp_path / "ends_well.py").write_text("import time\ntime.sleep(0.5)\n")
    nodes = [
        NodeProcess(name="renderer_node", module="dies_once", parameters=tmp_path, respawns=1, words=("none",)),
        NodeProcess(name="grammar_node", module="ends_well", parameters=tmp_path, words=("none",)),
    ]
    assert run(nodes) == Outcome(code=0)


CLOSES_LONG = """
import pathlib, signal, sys, time
def close(*_):
    time.sleep(3.5)
    pathlib.Path(__file__).with_name("closed").touch()
    sys.exit(0)
signal.signal(signal.SIGTERM, close)
pathlib.Path(__file__).with_name("ready").touch()
time.sleep(600)
"""


def test_a_recorder_that_takes_seconds_to_close_its_bag_on_a_busy_machine_is_not_killed(tmp_path: Path) -> None:
    waits = f"import pathlib, sys, time\nwhile not pathlib.Path({str(tmp_path / 'ready')!r}).exists():\n    time.sleep(0.05)\nsys.exit(3)\n"
    for name, text in {"closes_long": CLOSES_LONG, "fails": waits}.items():
        (tmp_path / f"{name}.py").write_text(text)
    modules = {"recorder_node": "closes_long", "grammar_node": "fails"}
    nodes = [NodeProcess(name=name, module=module, parameters=tmp_path, words=("none",)) for name, module in modules.items()]
    assert run(nodes).at == "grammar_node"
    assert (tmp_path / "closed").exists()


def test_a_node_that_is_interrupted_while_it_loads_its_modules_has_no_traceback(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "loads_long.py").write_text(
        "import os, signal, time\nimport scene_synth_ros\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(60)\n"
    )
    outcome = run([NodeProcess(name="recorder_node", module="loads_long", parameters=tmp_path, words=("none",))])
    assert outcome == Outcome(code=1, reason="recorder_node was ended by SIGINT", at="recorder_node")
    assert "Traceback" not in capfd.readouterr().err
