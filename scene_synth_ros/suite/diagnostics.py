"""Publishes what a node knows of itself on ``/diagnostics``, once a second and at once when its level changes."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from scene_synth_ros.suite.suite_node import SuiteNode

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
Report = tuple[bytes, str, Mapping[str, object]]
"""Level, one-line message, named values."""
FAULT_S = 10.0
"""How long a fault of the program is the node's state; the count and the newest line stay among the values."""


class Diagnostics:
    """A timer that asks ``collect`` and publishes its report, with faults and memory, under the node's full name."""

    def __init__(self, node: SuiteNode, collect: Callable[[], Report], period_s: float = 1.0) -> None:
        self._node = node
        self._collect = collect
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._timer = node.create_timer(period_s, self.publish)

    def publish(self) -> None:
        """Publish the report now."""
        level, message, values = self._collect()
        faults = self._node.faults
        if faults.within(FAULT_S):
            level, message = ERROR, faults.last
        status = DiagnosticStatus(level=level, name=self._node.get_fully_qualified_name().lstrip("/"), message=message)
        status.hardware_id = "scene_synth"
        own = {"faults": faults.count, "last_fault": faults.last, "memory_mb": f"{resident_bytes() / 1e6:.0f}"}
        everything = {**values, **own}
        status.values = [KeyValue(key=key, value=str(value)) for key, value in everything.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)


def resident_bytes() -> int:
    """Return the memory of this process that is in use, shared pages included."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
