"""The line of progress: what it counts and says, and that only a terminal gets it."""

import fcntl
import os
import pty
import struct
import subprocess
import termios
from pathlib import Path

import pytest
from scene_synth_ros_suite import environment, record_command

from scene_synth_ros.cli.processes.progress import Progress
from scene_synth_ros.suite.status import NodeStatus

COLOR, DEPTH = "/synth/camera/color/image_raw", "/synth/camera/depth/image_raw"


def status(role: str, state: str = "ready", done: int = -1, name: str = "", **counts: int) -> NodeStatus:
    topics = {"color": COLOR, "depth": DEPTH, "settings": f"/synth/{name or role}/settings"}
    by_topic = {topics[key]: count for key, count in counts.items()}
    return NodeStatus(node=f"/synth/{name or role + '_node'}", role=role, state=state, done_scene=done, counts=by_topic, run="a.0")


def test_it_says_what_the_run_waits_for() -> None:
    progress = Progress(4, 8)
    assert progress.line().startswith("waiting for the nodes")
    progress.take_status(status("renderer", "starting"))
    progress.take_status(status("grammar"))
    assert progress.line().startswith("waiting for renderer_node;")
    progress.take_status(status("renderer"))
    assert progress.line().startswith("synthesising the first room")


def test_frames_are_those_that_are_recorded_and_rooms_those_that_all_renderers_have_done() -> None:
    progress = Progress(4, 8)
    progress.take_status(status("grammar"))
    progress.take_status(status("renderer", done=0, color=9, depth=9, settings=9))
    assert (progress.frames, progress.total, progress.line()) == (9, 32, "room 2 of 4")
    progress.take_status(status("recorder", color=7, depth=6))
    progress.take_status(status("renderer", name="renderer_node_2", done=1, color=8))
    assert (progress.frames, progress.line()) == (7, "room 2 of 4")
    progress.take_status(status("renderer", done=3, color=16))
    progress.take_status(status("renderer", name="renderer_node_2", done=3, color=16))
    assert progress.line() == "room 4 of 4"


@pytest.mark.slow
def test_a_terminal_gets_one_line_and_no_log_and_a_pipe_gets_the_log(tmp_path: Path) -> None:
    seen = {}
    for kind in ("terminal", "pipe"):
        master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 110, 0, 0))
        words = record_command(tmp_path / kind, "--rooms", 1, "--frames", 30, "-p", "grammar_node.scene.room_type:=hallway")
        errors = slave if kind == "terminal" else subprocess.PIPE
        with subprocess.Popen(words, env=environment(), stdout=subprocess.DEVNULL, stderr=errors) as process:
            os.close(slave)
            seen[kind] = _everything(master) if kind == "terminal" else process.stderr.read().decode()
            assert process.wait(300) == 0
        os.close(master)
    assert "of 30 frames" in seen["terminal"] and "grammar_node]" not in seen["terminal"]
    assert "of 30 frames" not in seen["pipe"] and seen["pipe"].count("grammar_node] room 1/1") == 1


def _everything(terminal: int) -> str:
    """Read until the last process that writes to the terminal has ended."""
    text = b""
    while True:
        try:
            text += os.read(terminal, 65536)
        except OSError:  # Linux says so at the end
            return text.decode()
