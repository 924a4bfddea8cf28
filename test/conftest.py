"""How tests are shared between processes, where pytest-xdist is told to (``make test``)."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from contextlib import suppress
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

_IS_WORKER = "PYTEST_XDIST_WORKER" in os.environ
_LAST_RUN = "scene_synth/seconds"
"""Where pytest's cache has what each file's tests took in their last run."""
_seconds: Counter[str] = Counter()


@cache
def group(path: str) -> str:
    """Return the group of a test file: its own, because its tests share fixtures and kernels, or that of all that speak over DDS."""
    text = Path(path).read_text(encoding="utf-8") if Path(path).is_file() else ""
    return PROCESSES if _SIGNS.search(text) else path


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Hand out whole groups, in the order of the collection."""
    from xdist.scheduler import LoadScopeScheduling

    class GroupScheduling(LoadScopeScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            return group(str(config.rootpath / nodeid.split("::", 1)[0]))

    config.option.loadscopereorder = False
    return GroupScheduling(config, log)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the tests first of which one process waits for nodes, then the files that take longest."""
    if not _IS_WORKER:
        return
    seconds = {path: 0.1 * tests for path, tests in Counter(_file_of(item) for item in items).items()}
    seconds |= config.cache.get(_LAST_RUN, {}) if hasattr(config, "cache") else {}
    items.sort(key=lambda item: (group(str(item.path)) != PROCESSES, -seconds[_file_of(item)], _file_of(item)))


def _file_of(item: pytest.Item) -> str:
    return item.nodeid.split("::", 1)[0]


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Give way to the nodes that another process waits for, which have its priority; have kernels compiled before it waits."""
    if _IS_WORKER:
        (_compile_kernels if group(str(item.path)) == PROCESSES else _give_way)()


@cache
def _give_way() -> None:
    os.nice(5)


@cache
def _compile_kernels() -> None:
    """Compile what most nodes need: the time-outs of the tests that wait for them are for what hangs."""
    warm_up = "import renderer; renderer.warm_up"
    commands = [["-c", f"{warm_up}()"], ["-c", f"{warm_up}(('color', *renderer.GEOMETRIC_LAYERS), integrator='cached')"]]
    commands.append(["-m", "scene_synth_ros", "sample", "--room", "hallway", "--out", tempfile.mkdtemp()])
    for process in [subprocess.Popen([sys.executable, *words], stdout=subprocess.DEVNULL) for words in commands]:
        process.wait()


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the seconds of files."""
    _seconds[report.nodeid.split("::", 1)[0]] += report.duration


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Keep the seconds for the next run."""
    if hasattr(session.config, "cache") and not _IS_WORKER:
        session.config.cache.set(_LAST_RUN, session.config.cache.get(_LAST_RUN, {}) | _seconds)


_TEMPORARY = pytest.StashKey[Path]()


def pytest_configure(config: pytest.Config) -> None:
    """Give the tests, and the processes that they start and kill, a temporary folder that goes when they end."""
    if not hasattr(config, "workerinput"):
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())
        config.stash[_TEMPORARY] = Path(tempfile.mkdtemp(prefix="synth_tests_"))
        os.environ["TMPDIR"] = tempfile.tempdir = str(config.stash[_TEMPORARY])


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the temporary folder, and pytest's own where no failed test has left anything in it."""
    if _TEMPORARY in config.stash:
        shutil.rmtree(config.stash[_TEMPORARY], ignore_errors=True)
        for folder in Path(os.environ["PYTEST_DEBUG_TEMPROOT"]).glob("pytest-of-*"):
            with suppress(OSError):
                folder.rmdir()


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leave out the test files that import message packages which nobody built here."""
    return (collection_path.is_file() and lacks_messages(collection_path)) or None


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say which tests were skipped for lack of a tool."""
    if line := missing_line():
        terminalreporter.write_line(line)
