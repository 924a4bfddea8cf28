"""The renderer's topics: publishers of one camera."""

import threading
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from copy import copy
from dataclasses import replace
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSHistoryPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Image
from std_msgs.msg import String

from renderer.camera.config import CameraConfig
from renderer.film.frame import Frame
from scene_description import CameraPose
from scene_synth_ros.messages.conversions import (
    clock_to_msg,
    link_from_optical_to_msg,
    msg_to_image,
    transform_to_msg,
    world_from_link_to_msg,
)
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig
from scene_synth_ros.messages.image_codec import LiveCompression, compress_image, compressed_topic, image_form
from scene_synth_ros.messages.rig_frames import RigFrame
from scene_synth_ros.messages.room_body import BodyMessage
from scene_synth_ros.messages.senses import NO_SENSES, Senses
from scene_synth_ros.messages.streams import IMAGE_TYPE, camera_frames
from scene_synth_ros.render.room_scans import DueScan, scan_messages, scans_wanted
from scene_synth_ros.render.stream_topics import CLOCK, SETTINGS, TF, TF_STATIC, StreamTopic, TFMessage, stream_topics
from scene_synth_ros.suite.connections import Endpoint, identity_of, publishers_of
from scene_synth_ros.suite.qos import latched_qos
from scene_synth_ros.suite.status import NodeStatus, status_to_json

UNNAMED = "a node whose name is not known yet"
"""What stands for a node of whose publisher DDS has told, but ROS not yet its name."""


class StreamPublishers:
    """What a renderer publishes in one life: the frames of one camera, each with one stamp, and the status that says how far it is.

    Topics below ``<camera>/``: ``<layer>/image_raw`` and ``<layer>/camera_info`` for every enabled layer, ``<layer>/image_color`` where
    viewers cannot show the raw form, ``<layer>/labels`` of those that hold ids (JSON, latched) and, where vision_msgs is installed,
    ``<layer>/label_info`` (LabelInfo, latched); where they are asked for, ``annotations`` (JSON) and, with vision_msgs, ``detections_2d``
    and ``detections_3d``; ``pose``; ``~/settings`` (JSON, latched: what the frame was rendered with); ``/clock``,
    ``/tf``, ``/tf_static``.  ``image_raw/compressed`` of colour and ids and ``image_raw/compressedDepth`` of depth are made only while
    somebody subscribes to them.  ``<camera>/points`` where they are enabled; ``scan``, ``scan_ideal`` and ``laser/pose`` of a scanner.
    Of a body: ``odom/ideal``, ``robot_description``, ``imu/data``, ``imu/ideal``, ``odom``, ``joint_states``.
    ``status``: see :meth:`tell`.

    Threading: the rendering thread publishes frames and tells which rooms are done; the executor's thread tells the state and closes.  One
    lock makes a change and its publication one step, so the newest status on the topic is the newest there is.  Once closed, nothing is
    published: the node may destroy its publishers while the rendering thread is still in a kernel.

    Args:
        compression: called for the settings of compressed images, which may change.
        token: of the command or launch that has started the node.

    Attributes:
        messages: what is published of a frame.
        counts: messages published so far, by topic.
        frames: frames published so far.
        frame_topic: a topic that has one message for every frame, whatever is subscribed to.
        status: of the renderer, as it was told last.
    """

    def __init__(
        self,
        node: Node,
        config: StreamConfig,
        camera: CameraConfig,
        compression: Callable[[], LiveCompression] = LiveCompression,
        senses: Senses = NO_SENSES,
        token: str = "",
    ) -> None:
        self._node, self._config, self._compression, self._senses = node, config, compression, senses
        self.messages = FrameMessages(config, camera)
        self.counts: dict[str, int] = {}
        self.frames = 0
        self._publishers: dict[str, Publisher] = {}
        self._topics = stream_topics(config, camera, senses)
        self._clock_count = 0
        for topic in self._topics.values():
            if topic.name != CLOCK:
                self._add(topic)
        self._static_sent: object = None
        self.frame_topic = str(self._publishers[SETTINGS].topic_name)
        self.status = NodeStatus(node=node.get_fully_qualified_name(), role="renderer", state="starting", start=self.start, token=token)
        self._status_publisher = node.create_publisher(String, "status", latched_qos(10))
        self._lock = threading.Lock()
        self._closed = False

    def _add(self, topic: StreamTopic) -> None:
        overrides = QoSOverridingOptions.with_default_policies()
        qos = copy(topic.qos)  # rclpy writes the overrides of one topic into it
        publisher = self._node.create_publisher(topic.message_type, topic.name, qos, qos_overriding_options=overrides)
        self._publishers[topic.name] = publisher
        self.counts[publisher.topic_name] = self._clock_count if topic.name == CLOCK else 0

    @property
    def published(self) -> int:
        """How many messages went out on ``frame_topic``."""
        return self.counts[self.frame_topic]

    @property
    def depth(self) -> int:
        """How many frames every publisher keeps for subscribers that have not taken them yet."""
        with self._lock:
            offered = [publisher.qos_profile for name, publisher in self._publishers.items() if name != TF_STATIC]
        return min((int(qos.depth) for qos in offered if qos.history == QoSHistoryPolicy.KEEP_LAST), default=1000)

    def frames_kept(self, bursts: Mapping[str, int]) -> int:
        """Return of how many frames everything is kept that comes with each, at least 1: topic -> most messages with a frame."""
        with self._lock:
            kept = [(self._publishers[topic].qos_profile, most) for topic, most in bursts.items() if topic in self._publishers and most]
        return max(min((qos.depth // most for qos, most in kept if qos.history == QoSHistoryPolicy.KEEP_LAST), default=1000), 1)

    @property
    def start(self) -> str:
        """The identity (GID, hexadecimal) of a publisher of this life of the node."""
        return identity_of(self._node, self._publishers[SETTINGS])

    def wanted_layers(self) -> set[str]:
        """Return the layers that must be rendered now: all enabled ones, or those whose images have a subscriber if lazy; none once closed.

        ``ANNOTATIONS`` stands among them for what is told of objects.  Camera info and labels need no pixels: they come with every frame to
        whoever subscribes to them alone.
        """
        with self._lock:
            wanted = () if self._closed else [topic for name, topic in self._topics.items() if topic.layers and self._is_wanted(name)]
            return {layer for topic in wanted for layer in topic.layers}

    def wants_scans(self) -> bool:
        """Return whether scans must be cast: somebody subscribes to them, or all is published anyway; not once closed."""
        with self._lock:
            return not self._closed and scans_wanted(self._is_wanted)

    def other_clocks(self) -> list[Endpoint]:
        """Return the publishers of ``/clock`` outside this suite's namespace; none where this camera would publish none."""
        own = self._node.get_namespace()
        endpoints = publishers_of(self._node, CLOCK) if CLOCK in self._topics else ()
        return [endpoint for endpoint in endpoints if (endpoint.node.rpartition("/")[0] or "/") != own]

    @property
    def has_clock(self) -> bool:
        """Whether this camera publishes ``/clock``."""
        return CLOCK in self._publishers

    def settle_clock(self, *, wanted: bool = True) -> list[str]:
        """Publish ``/clock`` from now on, or leave it to others; return who else publishes it.

        A graph ends with one clock, whoever begins when: a camera takes one that nobody has, and gives it back to whoever knows nothing of
        other clocks, and to another suite's camera that has taken it at the same moment and has the smaller GID.
        """
        others = self.other_clocks()
        takes = wanted and CLOCK in self._topics and (self._outranks(others) if self.has_clock else not others)
        if takes != self.has_clock:
            with self._lock:
                if takes:
                    self._add(self._topics[CLOCK])
                else:
                    publisher = self._publishers.pop(CLOCK)
                    self._clock_count = self.counts.pop(publisher.topic_name)
                    self._node.destroy_publisher(publisher)
            self.tell()
        return sorted({endpoint.node if endpoint.is_named else UNNAMED for endpoint in others})

    def _outranks(self, others: Collection[Endpoint]) -> bool:
        """Return whether all others that publish ``/clock`` will leave it to this camera."""
        own = identity_of(self._node, self._publishers[CLOCK])
        return all(own < endpoint.gid and self._is_camera(endpoint.node) for endpoint in others)

    def _is_camera(self, node: str) -> bool:
        """Return whether a node speaks on the topic of a suite's status, as who leaves the clock to others does."""
        namespace = node.rpartition("/")[0]
        return any(endpoint.node == node for endpoint in publishers_of(self._node, f"{namespace}/status"))

    def reach(self, recorders: Collection[NodeStatus], start: str) -> bool:
        """Return whether every topic is connected to every recorder that wants it, seen from both sides."""
        publishers = {str(publisher.topic_name): publisher for publisher in self._publishers.values()}
        return all(start in recorder.connected and publishers.keys() <= recorder.counts.keys() for recorder in recorders) and all(
            publisher.get_subscription_count() >= sum(recorder.counts[topic] >= 0 for recorder in recorders)
            for topic, publisher in publishers.items()
        )

    def tell(self, **changes: Any) -> None:
        """Change fields of the status, bring its counts up to date, and publish it."""
        with self._lock:
            self.status = replace(self.status, **changes, counts=dict(self.counts))
            if not self._closed:
                self._status_publisher.publish(String(data=status_to_json(self.status)))

    def publish(self, frame: Frame, pose: CameraPose, settings: str, *, moves: bool = True, frames: tuple[RigFrame, ...] = ()) -> None:
        """Publish clock, transforms, settings, pose and every layer of a frame, all with the pose's stamp.

        ``frames``: those that are fixed to a body, if there is one, whose transforms come apart.
        ``moves``: whether time, and the camera, move with it; not with the answer to a request, which has neither clock nor transforms.
        """
        with self._lock:
            if self._closed:
                return
            if moves and self.has_clock:
                self._send(CLOCK, clock_to_msg(pose.stamp_ns))
            if moves and TF in self._topics:
                self._send_transforms(pose, frames)
            self._send(SETTINGS, String(data=settings))
            for topic, message in self.messages.of_frame(frame, pose, self._is_wanted):
                if isinstance(message, Image):
                    self._send_image(topic, message)
                else:
                    self._send(topic, message)
            self.frames += 1

    def publish_scan(self, scan: DueScan) -> dict[str, int]:
        """Publish a scan, if there is one, and where the scanner is meanwhile; return what went out: topic -> stamp (ns)."""
        sent: dict[str, int] = {}
        with self._lock:
            for message in () if self._closed else scan_messages(scan, self._senses.scan, self._config, self._is_wanted):
                self._send(message.topic, message.message)
                sent[message.topic] = message.stamp_ns
                if TF in self._topics and message.transform is not None:
                    self._send(TF, TFMessage(transforms=[message.transform]))
        return sent

    def publish_body(self, messages: Iterable[BodyMessage]) -> dict[str, int]:
        """Publish what a body senses; return what went out: topic -> stamp (ns) of the last."""
        sent: dict[str, int] = {}
        with self._lock:
            for message in () if self._closed else messages:
                if message.topic not in self._publishers:  # a clock that others have
                    continue
                self._send(message.topic, message.message)
                sent[message.topic] = message.stamp_ns
                if TF in self._topics and message.transform is not None:
                    self._send(TF, TFMessage(transforms=[message.transform]))
        return sent

    def is_wanted(self, topic: str) -> bool:
        """Return whether somebody has what is published on a topic: always, unless lazy."""
        return topic == CLOCK or (topic in self._publishers and self._is_wanted(topic))

    def close(self, seconds: float) -> None:
        """Publish nothing any more; wait, for so long at most, until reliable subscribers have what was published."""
        with self._lock:
            self._closed = True
        deadline = time.monotonic() + seconds
        for publisher in (*self._publishers.values(), self._status_publisher):
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _send_transforms(self, pose: CameraPose, frames: tuple[RigFrame, ...]) -> None:
        """Publish world -> link and, before the first of them, link -> optical frame, which the middleware keeps for late subscribers.

        Of a body only what is fixed, whenever it has changed.
        """
        if frames:
            if self._static_sent != frames:
                self._send(
                    TF_STATIC,
                    TFMessage(
                        transforms=[
                            transform_to_msg(pose.stamp_ns, frame.parent, frame.child, frame.place_m, frame.turn) for frame in frames
                        ]
                    ),
                )
                self._static_sent = frames
            return
        link, optical = camera_frames(self._config.camera, self._config.frame_prefix)
        if not self._static_sent:
            self._send(TF_STATIC, TFMessage(transforms=[link_from_optical_to_msg(pose.stamp_ns, link, optical)]))
            self._static_sent = True
        self._send(TF, TFMessage(transforms=[world_from_link_to_msg(pose, self._config.world_frame, link)]))

    def _send_image(self, topic: str, image: Image) -> None:
        """Publish an image, and its compressed form to those who subscribe to that."""
        if self._is_wanted(topic):
            self._send(topic, image)
        compressed = compressed_topic(topic)
        if compressed in self._publishers and self._has_subscribers(compressed):
            settings = self._compression()
            form = image_form(topic, IMAGE_TYPE, settings)
            pixels = msg_to_image(image)
            self._send(compressed, compress_image(image, pixels, compressed, form, settings.jpeg_quality, settings.depth_coding))

    def _is_wanted(self, topic: str) -> bool:
        return not self._config.lazy or self._has_subscribers(topic)

    def _has_subscribers(self, topic: str) -> bool:
        return int(self._publishers[topic].get_subscription_count()) > 0

    def _send(self, topic: str, message: object) -> None:
        publisher = self._publishers[topic]
        publisher.publish(message)
        self.counts[publisher.topic_name] += 1
