"""How tests are shared between processes, where pytest-xdist is told to (``make test``)."""

from types import ModuleType

import pytest

PROCESSES = "processes"
"""Group of the tests that start processes or speak over DDS: one at a time, so that they neither starve nor hear each other."""


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "xdist_group(name): tests that one process runs one after the other")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep the tests of a file together, because they share fixtures and kernels; the longest group begins first."""
    if config.getoption("dist", "no") != "loadgroup":
        return
    groups = {item.nodeid: PROCESSES if _starts_processes(item.module) else str(item.path) for item in items}
    for item in items:
        item.add_marker(pytest.mark.xdist_group(groups[item.nodeid]))
    items.sort(key=lambda item: groups[item.nodeid] != PROCESSES)


def _starts_processes(module: ModuleType) -> bool:
    known = vars(module)
    return "subprocess" in known or "rclpy" in known or any(_origin(value) == "scene_synth_ros_suite" for value in known.values())


def _origin(value: object) -> str:
    return str(getattr(value, "__module__", ""))
