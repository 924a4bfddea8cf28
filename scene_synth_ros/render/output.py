"""What a renderer publishes in one life: its frames, and the status that says how far it is."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from rclpy.node import Node
from std_msgs.msg import String

from renderer import CameraConfig
from renderer.film.frame import Frame
from renderer.lidar.config import ScanConfig
from renderer.lidar.scan import Scan
from scene_description import CameraPose
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.frame_settings import NO_SCAN
from scene_synth_ros.messages.image_codec import LiveCompression
from scene_synth_ros.render.streams import StreamPublishers
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_to_json


class Output:
    """The publishers of one life.

    Threading: the rendering thread publishes frames and tells which rooms are done; the executor's thread tells the state and closes.  One
    lock makes a change and its publication one step, so the newest status on the topic is the newest there is.  Once closed, nothing is
    published: the node may destroy its publishers while the rendering thread is still in a kernel.
    """

    def __init__(
        self,
        node: Node,
        config: StreamConfig,
        camera: CameraConfig,
        compression: Callable[[], LiveCompression],
        scan: ScanConfig = NO_SCAN,
    ) -> None:
        self.streams = StreamPublishers(node, config, camera, compression, scan)
        self._frame_topic = self.streams.frame_topic
        self.frames = 0
        """Frames published so far."""
        self.status = NodeStatus(node=node.get_fully_qualified_name(), role="renderer", state="starting", start=self.streams.start)
        self._status_publisher = node.create_publisher(String, "status", latched_qos(10))
        self._lock = threading.Lock()
        self._closed = False
        self.tell()

    @property
    def published(self) -> int:
        """How many messages went out on the topic that has one for every frame."""
        return self.streams.counts[self._frame_topic]

    def wanted_layers(self) -> set[str]:
        """Return the layers that somebody wants; none once closed."""
        with self._lock:
            return set() if self._closed else self.streams.wanted_layers()

    def tell(self, **changes: Any) -> None:
        """Change fields of the status, bring its counts up to date, and publish it."""
        with self._lock:
            self.status = replace(self.status, **changes, counts=dict(self.streams.counts))
            if not self._closed:
                self._status_publisher.publish(String(data=status_to_json(self.status)))

    def publish_frame(self, frame: Frame, pose: CameraPose, settings: str, *, with_clock: bool = True) -> None:
        """Publish a frame with all that belongs to it; its time on ``/clock`` too, unless stamps are the time of day."""
        with self._lock:
            if not self._closed:
                self.streams.publish(frame, pose, settings, with_clock=with_clock)
                self.frames += 1

    def wants_scans(self) -> bool:
        """Return whether somebody wants the scanner's scans; nobody does once closed."""
        with self._lock:
            return not self._closed and self.streams.wants_scans()

    def publish_scan(self, poses: Sequence[CameraPose], scan: Scan | None) -> dict[str, int]:
        """Publish a scan and its poses; return topic -> stamp (ns) of what went out."""
        with self._lock:
            return {} if self._closed else self.streams.publish_scan(poses, scan)

    def close(self, seconds: float) -> None:
        """Publish nothing any more; wait, for so long at most, until subscribers have what was published."""
        with self._lock:
            self._closed = True
        self.streams.wait_until_delivered(seconds)
