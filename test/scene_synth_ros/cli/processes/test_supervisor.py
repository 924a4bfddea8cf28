"""Processes that are killed and started again: what a run waits for."""

import threading
from pathlib import Path

import pytest

from scene_synth_ros.cli.processes.supervisor import Interrupts, NodeProcess, Outcome, run_nodes

DIES_ONCE = """
import os, pathlib, signal, time
first = pathlib.Path(__file__).with_name("has_died")
if not first.exists():
    first.touch()
    os.kill(os.getpid(), signal.SIGKILL)
time.sleep(600)
"""


def test_a_node_that_is_killed_when_the_others_are_done_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Started again after the last room, a renderer waits for one that never comes."""
    (tmp_path / "dies_once.py").write_text(DIES_ONCE)
    (tmp_path / "ends_well.py").write_text("import time\ntime.sleep(0.5)\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    nodes = [
        NodeProcess(name="renderer_node", module="dies_once", parameters=tmp_path, respawns=1, words=("none",)),
        NodeProcess(name="grammar_node", module="ends_well", parameters=tmp_path, words=("none",)),
    ]
    interrupts = Interrupts()
    patience = threading.Timer(30.0, interrupts._count, (0, None))
    patience.start()
    outcome = run_nodes(nodes, "/synth", interrupts)
    patience.cancel()
    assert outcome == Outcome(code=0)
