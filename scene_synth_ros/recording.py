"""Takes messages as they arrive, orders them by stamp and writes them to a bag in a thread of its own."""

from __future__ import annotations

import queue
import threading
from collections import Counter
from collections.abc import Collection, Iterable
from typing import NamedTuple

from rclpy.qos import QoSProfile

from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, multiply_quaternions
from scene_synth_ros.bag_writer import BagWriteError, BagWriter
from scene_synth_ros.frame_sorter import FrameSorter, OrderedMessage
from scene_synth_ros.qos import latched_qos, stream_qos
from scene_synth_ros.stamps import stamp_ns
from scene_synth_ros.transforms_cdr import StampedTransform, encode_tf_message

TF_TYPE = "tf2_msgs/msg/TFMessage"
WALL_STAMPED = ("diagnostic_msgs/msg/DiagnosticArray", "rcl_interfaces/msg/Log")
"""Types whose header holds wall time; in a bag of simulated time they are logged at the time of the frame before them."""


LEADING = ("/clock", "/scene", "/scene/map", "/scene/markers", "/tf_static", "/tf")
"""Ends of topics that go before the others of the same stamp."""


class TimedPose(NamedTuple):
    """The optical pose of a camera in a frame of the world, as its topic said it."""

    stamp_ns: int
    world: str
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


class Recording:
    """A bag that is being recorded; ``add`` never waits for the disk longer than its queue is full.

    Transforms are derived from the camera poses and written to ``/tf`` and ``/tf_static`` whether or not anybody publishes them.

    Attributes:
        written: messages in the bag or on their way to it, by topic.
        fault: why writing has ended early; empty while all is well.
    """

    def __init__(self, writer: BagWriter, queue_size: int = 256) -> None:
        self._writer = writer
        self._types: dict[str, str] = {}
        self._expected: set[str] = set()
        self._sorter = FrameSorter([], expected=None)
        self._early: list[tuple[str, bytes]] = []
        self._cameras: dict[str, str] = {}
        self._jobs: queue.Queue[tuple[str, bytes, int] | None] = queue.Queue(queue_size)
        self.written: Counter[str] = Counter()
        self.fault = ""
        self._thread = threading.Thread(target=self._write_all, name="bag", daemon=True)
        self._thread.start()

    def add_topic(self, topic: str, type_name: str, offered: list[QoSProfile]) -> None:
        """Open a channel for a topic."""
        self._types[topic] = type_name
        self._writer.add_topic(topic, type_name, offered)

    def expect(self, topics: Collection[str]) -> None:
        """Say which topics make a frame complete; frames leave as soon as all of them are there."""
        if set(topics) != self._expected:
            self._expected = set(topics)
            self._enqueue(self._sorter.configure(sorted(self._types, key=_rank), self._expected or None))

    def add(self, topic: str, data: bytes) -> None:
        """Take a message as it arrives.

        It is padded to whole words, as DDS does on the way between processes, so that bags do not depend on where a publisher runs.
        """
        type_name = self._types[topic]
        stamp = None if type_name in WALL_STAMPED else stamp_ns(type_name, data)
        self._enqueue(self._sorter.add(topic, stamp, data + bytes(-len(data) % 4)))

    def add_pose(self, topic: str, pose: TimedPose, camera: str) -> None:
        """Derive the transforms of a camera from its pose: world -> link at every stamp, link -> optical frame once."""
        link = f"{camera}_link"
        if camera not in self._cameras:
            self._cameras[camera] = link
            for name, qos in (("/tf", stream_qos(100)), ("/tf_static", latched_qos())):
                if name not in self._types:
                    self.add_topic(name, TF_TYPE, [qos])
            static = [
                StampedTransform(pose.stamp_ns, known_link, f"{known}_optical_frame", (0.0, 0.0, 0.0), LINK_FROM_OPTICAL)
                for known, known_link in sorted(self._cameras.items())
            ]
            self._enqueue(self._sorter.add("/tf_static", pose.stamp_ns, encode_tf_message(static)))
        rotation = multiply_quaternions(pose.quaternion, conjugate_quaternion(LINK_FROM_OPTICAL))
        transform = StampedTransform(pose.stamp_ns, pose.world, link, pose.position_m, rotation)
        self._enqueue(self._sorter.add("/tf", pose.stamp_ns, encode_tf_message([transform])))

    def flush(self) -> None:
        """Hand everything that waits to the writer and wait until it is written."""
        self._enqueue(self._sorter.flush())
        if not self.fault:
            self._jobs.join()

    @property
    def waiting_bytes(self) -> int:
        """Bytes that wait for their frame to be complete."""
        return self._sorter.waiting_bytes

    def close(self) -> None:
        """Write the complete frames that wait and close the bag; a frame of which only a part has come, as at an interruption, is left out.

        Raises:
            BagWriteError: the bag could not be completed.
        """
        if self._expected:
            complete = [stamp for stamp, missing in self._sorter.missing().items() if not missing]
            self._enqueue(self._sorter.flush(max(complete, default=-1)))
        else:
            self._enqueue(self._sorter.flush())
        self._jobs.put(None)
        self._thread.join()
        self._writer.close()

    def _enqueue(self, messages: Iterable[OrderedMessage]) -> None:
        for message in messages:
            if message.stamp_ns is None and message.log_ns == 0:
                self._early = [*self._early[-999:], (message.topic, message.data)]
                continue
            for topic, data in self._early:
                self._jobs.put((topic, data, message.log_ns))
            self._early = []
            self._jobs.put((message.topic, message.data, message.log_ns))

    def _write_all(self) -> None:
        while (job := self._jobs.get()) is not None:
            topic, data, log_ns = job
            try:
                if not self.fault:
                    self._writer.write(topic, data, log_ns, log_ns)
                    self.written[topic] += 1
            except BagWriteError as error:
                self.fault = str(error)
            finally:
                self._jobs.task_done()
        self._jobs.task_done()


def _rank(topic: str) -> tuple[int, str]:
    return next((rank for rank, end in enumerate(LEADING) if topic.endswith(end)), len(LEADING)), topic
