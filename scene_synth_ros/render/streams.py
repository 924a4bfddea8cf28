"""The renderer's topics: publishers of one camera."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import Image
from std_msgs.msg import String

from renderer.camera.config import CameraConfig
from renderer.film.frame import Frame
from renderer.lidar.config import ScanConfig
from renderer.lidar.scan import Scan
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.messages.conversions import clock_to_msg, link_from_optical_to_msg, msg_to_image, world_from_link_to_msg
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig
from scene_synth_ros.messages.frame_settings import NO_SCAN
from scene_synth_ros.messages.image_codec import LiveCompression, compress_image, compressed_topic, image_form
from scene_synth_ros.messages.scan_messages import LASER_POSE, SCAN, SCAN_IDEAL, laser_pose_to_msgs, scan_to_msgs
from scene_synth_ros.messages.streams import IMAGE_TYPE, camera_frames, laser_frame
from scene_synth_ros.render.stream_topics import CLOCK, SETTINGS, TF, TF_STATIC, StreamTopic, TFMessage, stream_topics
from scene_synth_ros.suite.connections import identity_of, publishers_of
from scene_synth_ros.suite.qos import PROFILES
from scene_synth_ros.suite.status import NodeStatus


class StreamPublishers:
    """Publishers of one camera: makes them, says which layers are wanted, publishes a frame with one stamp.

    Topics below ``<camera>/``: ``<layer>/image_raw`` and ``<layer>/camera_info`` for every enabled layer, ``<layer>/image_color`` where
    viewers cannot show the raw form, ``<layer>/labels`` of those that hold ids (JSON, latched) and, where vision_msgs is installed,
    ``<layer>/label_info`` (LabelInfo, latched); where they are asked for, ``annotations`` (JSON) and, with vision_msgs, ``detections_2d``
    and ``detections_3d``; ``pose``; ``~/settings`` (JSON, latched: what the frame was rendered with); ``/clock``,
    ``/tf``, ``/tf_static``.  ``image_raw/compressed`` of colour and ids and ``image_raw/compressedDepth`` of depth are made only while
    somebody subscribes to them.  ``<camera>/points`` where they are enabled; ``scan``, ``scan_ideal`` and ``laser/pose`` of a scanner.

    Args:
        node: whose publishers they are.
        config: which streams.
        camera: for the camera info.
        compression: called for the settings of compressed images, which may change.
        scan: the scanner.
    """

    def __init__(
        self,
        node: Node,
        config: StreamConfig,
        camera: CameraConfig,
        compression: Callable[[], LiveCompression] = LiveCompression,
        scan: ScanConfig = NO_SCAN,
    ) -> None:
        self._config, self._scan = config, scan
        self._compression = compression
        self._node = node
        self.messages = FrameMessages(config, camera)
        """What is published of a frame."""
        self.counts: dict[str, int] = {}
        """Messages published so far, by topic."""
        self._publishers: dict[str, Publisher] = {}
        self._topics = stream_topics(config, camera, scan)
        for topic in self._topics.values():
            self._add(topic)
        self._static_sent = False

    @property
    def frame_topic(self) -> str:
        """A topic that has one message for every frame, whatever is subscribed to."""
        return str(self._publishers[SETTINGS].topic_name)

    @property
    def depth(self) -> int:
        """How many frames the publishers keep for subscribers that have not taken them yet."""
        return int(PROFILES[self._config.qos].depth)

    def wanted_layers(self) -> set[str]:
        """Return the layers that must be rendered now: all enabled ones, or those whose images have a subscriber if lazy.

        ``ANNOTATIONS`` stands among them for what is told of objects.  Camera info and labels need no pixels: they come with every frame to
        whoever subscribes to them alone.
        """
        return {layer for name, topic in self._topics.items() if topic.layers and self._is_wanted(name) for layer in topic.layers}

    @property
    def start(self) -> str:
        """The identity (GID, hexadecimal) of a publisher of this life of the node."""
        return identity_of(self._node, self._publishers[SETTINGS])

    def other_clocks(self) -> list[str]:
        """Return the nodes outside this suite's namespace that publish ``/clock``, as this camera does; none where it does not."""
        own = self._node.get_namespace()
        endpoints = publishers_of(self._node, CLOCK) if CLOCK in self._topics else ()
        return sorted({endpoint.node for endpoint in endpoints if (endpoint.node.rpartition("/")[0] or "/") != own})

    def leaves_clock(self) -> bool:
        """Return whether ``/clock`` is left to others that publish it now; never once this camera has published it."""
        return self.counts.get(CLOCK) == 0 and bool(self.other_clocks())

    def reach(self, recorders: Collection[NodeStatus], start: str) -> bool:
        """Return whether every topic is connected to every recorder that wants it, seen from both sides.

        Args:
            recorders: what the recorders say.
            start: of this life of the node.
        """
        return all(start in recorder.connected for recorder in recorders) and all(
            publisher.get_subscription_count() >= sum(recorder.counts.get(publisher.topic_name, 0) >= 0 for recorder in recorders)
            for publisher in self._publishers.values()
        )

    def begin_room(self, scene: SceneDescription) -> None:
        """Take the label tables of a room."""
        self.messages.begin_room(scene)

    def publish(self, frame: Frame, pose: CameraPose, settings: str, *, with_clock: bool = True) -> None:
        """Publish clock, transforms, settings, pose and every layer of a frame, all with the pose's stamp."""
        if CLOCK in self._topics and with_clock and not self.leaves_clock():
            self._send(CLOCK, clock_to_msg(pose.stamp_ns))
        if TF in self._topics:
            self._send_transforms(pose)
        self._send(SETTINGS, String(data=settings))
        for topic, message in self.messages.of_frame(frame, pose, self._is_wanted):
            if isinstance(message, Image):
                self._send_image(topic, message)
            else:
                self._send(topic, message)

    def wants_scans(self) -> bool:
        """Return whether scans must be cast: somebody subscribes to them, or all is published anyway."""
        return self._is_wanted(SCAN) or self._is_wanted(SCAN_IDEAL)

    def publish_scan(self, poses: Sequence[CameraPose], scan: Scan | None) -> dict[str, int]:
        """Publish a scan, if there is one, and where the scanner is meanwhile; return what went out: topic -> stamp (ns)."""
        laser, sent = laser_frame(self._config.frame_prefix), {}
        for pose in poses:
            stamped, transform = laser_pose_to_msgs(pose, self._config.world_frame, laser)
            self._send(LASER_POSE, stamped)
            sent[LASER_POSE] = pose.stamp_ns
            if TF in self._topics:
                self._send(TF, TFMessage(transforms=[transform]))
        for topic, message in scan_to_msgs(scan, self._scan, laser) if scan is not None else ():
            if self._is_wanted(topic):
                self._send(topic, message)
                sent[topic] = scan.stamp_ns if scan is not None else 0
        return sent

    def wait_until_delivered(self, seconds: float) -> None:
        """Wait, for so long at most, until reliable subscribers have what was published."""
        deadline = time.monotonic() + seconds
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _send_transforms(self, pose: CameraPose) -> None:
        """Publish world -> link and, before the first of them, link -> optical frame, which the middleware keeps for late subscribers."""
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
        return self._publishers[topic].get_subscription_count() > 0

    def _add(self, topic: StreamTopic) -> None:
        overrides = QoSOverridingOptions.with_default_policies()
        publisher = self._node.create_publisher(topic.message_type, topic.name, topic.qos, qos_overriding_options=overrides)
        self._publishers[topic.name] = publisher
        self.counts[publisher.topic_name] = 0

    def _send(self, topic: str, message: object) -> None:
        publisher = self._publishers[topic]
        publisher.publish(message)
        self.counts[publisher.topic_name] += 1
