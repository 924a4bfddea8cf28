"""When a launch is over; ROS 2's launch itself is stood in for, as the wheels have none."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from scene_synth_ros.cli.options import UsageError

LAUNCH = ("launch", "launch.actions", "launch.events.process", "launch.substitutions", "launch_ros.actions")


@pytest.fixture
def launching(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    for name in LAUNCH:
        monkeypatch.setitem(sys.modules, name, MagicMock())
    name = "scene_synth_ros.cli.processes.launching"
    module = importlib.import_module(name)
    monkeypatch.setattr(module, "Shutdown", lambda reason: f"shut down: {reason}")
    yield module
    del sys.modules[name]


class Launch:
    """Says to launch that nodes have ended, and keeps what its event loop counts as errors."""

    def __init__(self, end: Any) -> None:
        self.errors: list[str] = []
        self._end = end

    def ends(self, name: str, code: int, *, is_shutdown: bool = False) -> Any:
        loop = SimpleNamespace(call_exception_handler=lambda told: self.errors.append(told["message"]))
        context = SimpleNamespace(is_shutdown=is_shutdown, asyncio_loop=loop)
        return self._end.of(name)(SimpleNamespace(returncode=code), context)


def test_a_recorded_launch_ends_with_its_last_node(launching: ModuleType) -> None:
    launch = Launch(launching.SuiteEnd(["grammar_node", "renderer_node", "recorder_node"], by_themselves=True))
    assert launch.ends("recorder_node", 0) is None and launch.ends("grammar_node", 0) is None
    assert launch.ends("renderer_node", 0) == ["shut down: all nodes are done"]
    assert not launch.errors


@pytest.mark.parametrize(("code", "how"), [(1, "ended with code 1, for the reason told above"), (-9, "was ended by SIGKILL")])
def test_a_node_that_fails_ends_a_launch_with_an_error(launching: ModuleType, code: int, how: str) -> None:
    launch = Launch(launching.SuiteEnd(["grammar_node", "recorder_node"], by_themselves=True))
    assert launch.ends("recorder_node", 0) is None, "somebody has ended it: the grammar node will say so"
    assert launch.ends("grammar_node", code) == [f"shut down: grammar_node {how}"]
    assert launch.errors == [f"grammar_node {how}"]


def test_a_launch_without_an_end_ends_with_any_node(launching: ModuleType) -> None:
    launch = Launch(launching.SuiteEnd(["grammar_node", "renderer_node"], by_themselves=False))
    assert launch.ends("renderer_node", 0) == ["shut down: renderer_node has ended before the run was over"]
    assert launch.errors == ["renderer_node has ended before the run was over"]
    launch.ends("grammar_node", 0, is_shutdown=True)
    assert len(launch.errors) == 1, "after Ctrl-C the others end well"


def test_what_is_shown_beside_a_replay_outlives_it(launching: ModuleType) -> None:
    launch = Launch(launching.SuiteEnd(["replay_node"], by_themselves=True, with_last=False))
    assert launch.ends("replay_node", 0) is None and not launch.errors


def test_a_bag_that_exists_is_refused_before_a_node_starts(launching: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launching.Arguments, "text", lambda _, name: str(tmp_path if name == "there" else tmp_path / "new"))
    arguments = launching.Arguments(None)
    assert arguments.new_folder("bag_path") == str(tmp_path / "new")
    with pytest.raises(UsageError, match=f"there {tmp_path}: exists already; choose another folder or remove it"):
        arguments.new_folder("there")
