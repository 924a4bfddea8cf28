"""The pytest plugin: marks tests with their rooms, gives them ``judge``, and tells scores at the end.

It is loaded into every run of pytest where the package is installed, so nothing is imported before a test asks for it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from scene_synth_ros.testing.judge import Judge

_MARK = "scene_synth_room"
_LINES = pytest.StashKey[list[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare where bags are kept."""
    group = parser.getgroup("scene_synth")
    group.addoption(
        "--scene-synth-bags", metavar="DIR", default=None, help="folder that keeps the bags of @room tests (default: pytest's cache)"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Declare the mark."""
    config.addinivalue_line("markers", f"{_MARK}(test): rooms of scene_synth_ros that a test judges an estimator in; made by @room")
    config.stash[_LINES] = []


@pytest.fixture
def judge(request: pytest.FixtureRequest) -> Judge:
    """Return what judges an estimator in the rooms of a test, which fails where it is not good: called with a function, or ``command``."""
    from scene_synth_ros.testing.judge import Judge

    mark = request.node.get_closest_marker(_MARK)
    if mark is None:
        raise pytest.UsageError(f"{request.node.nodeid}: judge: expected @room(seed=..., ate_m=...) above the test, got none")
    return Judge(mark.args[0], _folder(request.config), _told(request))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell the scores of all tests, good ones too."""
    lines = terminalreporter.config.stash[_LINES]
    if lines:
        terminalreporter.section("rooms")
    for line in lines:
        terminalreporter.line(line)


def _folder(config: pytest.Config) -> Path:
    chosen = config.getoption("--scene-synth-bags")
    if chosen is not None:
        return Path(chosen)
    cache = config.cache
    if cache is None:
        raise pytest.UsageError("--scene-synth-bags: expected a folder where pytest has no cache, got none")
    return Path(cache.mkdir("scene_synth"))


def _told(request: pytest.FixtureRequest) -> Callable[[str], None]:
    lines = request.config.stash[_LINES]
    return lambda line: lines.append(f"{request.node.nodeid}: {line}")
