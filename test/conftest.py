"""How tests are shared between processes, where pytest-xdist is told to (``make test``)."""

import os
import re
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from needed_tools import lacks_messages, missing_line

sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # the hundreds of processes that tests start find the modules compiled: 0.3 s each

PROCESSES = "processes"
"""Group of the tests that speak over DDS, or start who does: one at a time, so that they neither starve nor hear each other."""

_SIGNS = re.compile(
    r"^import rclpy|^from rclpy(\.(context|executors|lifecycle|node|parameter))? import"
    r"|\b(Child|Peer|claim_domain|dds_context|node_process|record_command|run_suite)\b",
    re.MULTILINE,
)
"""Of who has a node or waits for one; serialised messages, profiles of QoS and commands without nodes are none."""


@cache
def group(path: str) -> str:
    """Return the group of a test file: its own, because its tests share fixtures and kernels, or that of all that speak over DDS."""
    text = Path(path).read_text(encoding="utf-8") if Path(path).is_file() else ""
    return PROCESSES if _SIGNS.search(text) else path


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Hand out whole groups, the largest first."""
    from xdist.scheduler import LoadScopeScheduling

    class GroupScheduling(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return group(str(config.rootpath / nodeid.split("::", 1)[0]))

    return GroupScheduling(config, log)


_TEMPORARY = pytest.StashKey[Path]()


def pytest_configure(config: pytest.Config) -> None:
    """Give the tests, and the processes that they start and kill, a temporary folder that goes when they end."""
    if not hasattr(config, "workerinput"):
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())
        config.stash[_TEMPORARY] = Path(tempfile.mkdtemp(prefix="synth_tests_"))
        os.environ["TMPDIR"] = tempfile.tempdir = str(config.stash[_TEMPORARY])


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the temporary folder."""
    if _TEMPORARY in config.stash:
        shutil.rmtree(config.stash[_TEMPORARY], ignore_errors=True)


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leave out the test files that import message packages which nobody built here."""
    return (collection_path.is_file() and lacks_messages(collection_path)) or None


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say which tests were skipped for lack of a tool."""
    if line := missing_line():
        terminalreporter.write_line(line)
