"""One line of progress of a run: rooms, frames, rate, time left, and what the run waits for.  A process of its own, on a terminal only.

It listens to ``status`` like any other node of the suite and says nothing itself, so a run is the same with it and without it.
"""

import argparse
import signal
import sys
from collections.abc import Sequence
from types import FrameType

import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from tqdm import tqdm

from scene_description import FieldError
from scene_synth_ros.suite.process import init_ros
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, done_in_run, status_from_json

_PERIOD_S = 0.2
_FORM = "{desc} {bar:20} {n_fmt} of {total_fmt} frames, {rate_fmt}, {remaining} left"
_WAITING_FORM = "{desc} ({elapsed})"


class Progress:
    """What the statuses of a run's nodes amount to; no ROS, no clocks."""

    def __init__(self, rooms: int, frames: int) -> None:
        self._rooms, self._room_frames = rooms, frames
        self._statuses: dict[str, NodeStatus] = {}

    def take_status(self, status: NodeStatus) -> None:
        """Take the newest status of a node."""
        self._statuses[status.node] = status

    @property
    def frames(self) -> int:
        """Frames that are recorded or, where nothing records, published; those of a run that has begun again included."""
        by_role: dict[str, int] = {}
        for status in self._statuses.values():
            taken = [count for topic, count in status.counts.items() if topic.endswith("/image_raw")]
            by_role[status.role] = max(by_role.get(status.role, 0), *taken, 0)
        return by_role.get("recorder", by_role.get("renderer", 0))

    @property
    def total(self) -> int:
        """Frames of the whole run."""
        return self._rooms * self._room_frames

    def line(self) -> str:
        """Return what is going on, in words."""
        by_role = {role: [it for it in self._statuses.values() if it.role == role] for role in ("grammar", "renderer", "recorder")}
        starting = sorted(status.node.rsplit("/", 1)[-1] for status in self._statuses.values() if status.state == "starting")
        run = next((status.run for status in by_role["grammar"]), "")
        done = min((done_in_run(status, run) for status in by_role["renderer"]), default=-1) + 1
        if self.frames or done:
            return f"room {min(done + 1, self._rooms)} of {self._rooms}"
        if starting or not by_role["renderer"]:
            return f"waiting for {', '.join(starting) or 'the nodes'}; kernels are compiled on the first run"
        return "synthesising the first room; kernels are compiled on the first run"


def show(progress: Progress, node: Node) -> None:
    """Draw the line until a signal comes."""
    stopped: list[int] = []

    def stop(number: int, _frame: FrameType | None) -> None:
        stopped.append(number)

    def hear(message: String) -> None:
        try:
            progress.take_status(status_from_json(message.data))
        except FieldError:
            pass  # the nodes themselves tell of it

    node.create_subscription(String, "status", hear, latched_qos(100))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    with tqdm(total=progress.total, file=sys.stderr, bar_format=_WAITING_FORM, dynamic_ncols=True, leave=False, unit=" frames") as bar:
        while not stopped:
            rclpy.spin_once(node, timeout_sec=_PERIOD_S)
            if progress.frames and bar.bar_format != _FORM:
                bar.bar_format = _FORM
                bar.reset()
                bar.initial = progress.frames
            bar.set_description_str(progress.line(), refresh=False)
            bar.n = progress.frames
            bar.refresh()


def main(argv: Sequence[str] | None = None) -> None:
    """Follow a run until SIGTERM."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rooms", type=int, required=True)
    parser.add_argument("--frames", type=int, required=True)
    parser.add_argument("--namespace", required=True)
    arguments = parser.parse_args(argv)
    init_ros(["--ros-args", "--log-level", "warn"])
    node = Node("progress", namespace=arguments.namespace, enable_rosout=False, start_parameter_services=False)
    show(Progress(arguments.rooms, arguments.frames), node)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
