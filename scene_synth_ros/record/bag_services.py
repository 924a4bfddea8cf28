"""What the recorder is asked to do while it runs: start, stop, split, snapshot."""

from concurrent.futures import Future, TimeoutError
from pathlib import Path

from rclpy.node import Node

from scene_synth_ros.bags.bag_writer import BagWriteError
from scene_synth_ros.record.recording import Recording
from scene_synth_ros.suite.suite_node import serve_trigger

ANSWER_TIMEOUT_S = 20.0


class BagServices:
    """Four services, each std_srvs/Trigger, that hand a request to the thread that writes and wait for its answer.

    Threads: the thread of the node's executor only; it stands still while the disk works on the answer.

    Args:
        bag: folder of the first bag; those after it, and the snapshots, are named after it.
    """

    def __init__(self, node: Node, recording: Recording, bag: Path) -> None:
        self._node, self._recording, self._bag = node, recording, bag
        for name, work in {"start": self.start, "stop": self.stop, "split": self._split, "snapshot": self._snapshot}.items():
            serve_trigger(node, name, work)

    def start(self) -> str:
        """Open the next bag; return its folder.

        Raises:
            BagWriteError: it cannot be begun.
        """
        folder = wait_for(self._recording.begin(self._bag))
        self._node.get_logger().info(f"recording to {folder}")
        return folder

    def stop(self) -> str:
        """Close the bag; return what it holds, in words.

        Raises:
            BagWriteError: it could not be completed.
        """
        return wait_for(self._recording.end())

    def _split(self) -> str:
        if not self._recording.writing:
            raise BagWriteError("no bag is open")
        self._recording.split()
        return "the next frame begins a new file"

    def _snapshot(self) -> str:
        return wait_for(self._recording.snapshot(self._bag.with_name(f"{self._bag.name}_snapshot")))


def wait_for(future: Future[str]) -> str:
    """Return what the thread that writes answers.

    Raises:
        BagWriteError: it refuses, or the disk has not answered in time.
    """
    try:
        return future.result(ANSWER_TIMEOUT_S)
    except TimeoutError:
        raise BagWriteError(f"the disk has not answered for {ANSWER_TIMEOUT_S:g} s; the request is still waiting for it") from None
