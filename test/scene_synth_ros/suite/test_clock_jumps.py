"""Clocks that jump or stand still do not stop a node: its timers go by the steady clock."""

import time
from collections.abc import Callable
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rosgraph_msgs.msg import Clock
from scene_synth_ros_suite import Peer, node_process
from wall_clock import WallClock

from scene_synth_ros.messages.conversions import clock_to_msg

HOUR_S = 3600


class Listener(Peer):
    """Hears when a node reports, and what time it takes it to be (s)."""

    def __init__(self, context: Context) -> None:
        super().__init__(context)
        self.stamps_s: list[float] = []
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 10)

    def _on_report(self, message: DiagnosticArray) -> None:
        stamp = message.header.stamp
        self.stamps_s.append(stamp.sec + stamp.nanosec * 1e-9)

    def wait_for_reports(self, stamp_fits: Callable[[float], bool], count: int = 2) -> None:
        """Wait until a node that reports once a second has done so that often in the time that fits."""
        self.stamps_s.clear()
        self.spin_until(lambda: sum(map(stamp_fits, self.stamps_s)) >= count, 15, f"{count} reports")


def test_a_wall_clock_that_jumps_does_not_stop_a_node(tmp_path: Path) -> None:
    clock = WallClock(tmp_path)
    with node_process("recorder_node", {"bag": tmp_path / "bag"}, clock.environment) as context:
        listener = Listener(context)
        for hours in (0, -1, 2):
            clock.shift(hours * HOUR_S)
            listener.wait_for_reports(lambda stamp, hours=hours: abs(stamp - time.time() - hours * HOUR_S) < HOUR_S / 10)


def test_simulated_time_that_stands_still_or_jumps_does_not_stop_a_node(tmp_path: Path) -> None:
    with node_process("recorder_node", {"bag": tmp_path / "bag", "use_sim_time": True}) as context:
        listener = Listener(context)
        listener.wait_for_reports(lambda stamp: stamp == 0.0)
        clock = listener.node.create_publisher(Clock, "/clock", 10)
        for seconds in (5000, 20, 9000):
            repeat = listener.node.create_timer(0.2, lambda seconds=seconds: clock.publish(clock_to_msg(seconds * 1_000_000_000)))
            listener.wait_for_reports(lambda stamp, seconds=seconds: stamp == seconds)
            listener.node.destroy_timer(repeat)
