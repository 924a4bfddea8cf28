"""The renderer's topics: publishers of one camera."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence

from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import String

from renderer.camera.config import CameraConfig
from renderer.film.frame import Frame
from renderer.film.layers import LAYERS
from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import Scan
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.messages.camera_frames import camera_frames
from scene_synth_ros.messages.conversions import clock_to_msg, link_from_optical_to_msg, msg_to_image, world_from_link_to_msg
from scene_synth_ros.messages.detections import ANNOTATION_MESSAGES, ANNOTATIONS
from scene_synth_ros.messages.frame_messages import FrameMessages, StreamConfig, has_companion
from scene_synth_ros.messages.frame_settings import NO_SCAN
from scene_synth_ros.messages.image_codec import IMAGE_TYPE, LiveCompression, compress_image, compressed_topic, image_form
from scene_synth_ros.messages.label_info import LabelInfo
from scene_synth_ros.messages.scan_messages import LASER_POSE, SCAN, SCAN_IDEAL, SCAN_TOPICS, laser_frame, laser_pose_to_msgs, scan_to_msgs
from scene_synth_ros.suite.connections import identity_of, publishers_of
from scene_synth_ros.suite.qos import PROFILES, latched_qos, stream_qos
from scene_synth_ros.suite.status import NodeStatus

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # not among the PyPI wheels; transforms are then in the bags and in <camera>/pose only
    TFMessage = None

CLOCK, SETTINGS = "/clock", "~/settings"


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
        self._images: dict[str, list[str]] = {}
        self._clock = self._add(Clock, CLOCK, stream_qos()) if config.publish_clock else ""
        self._qos = PROFILES[config.qos]
        if config.publish_pose:
            self._add(PoseStamped, f"{config.camera}/pose", self._qos)
        self._add(String, SETTINGS, latched_qos(self._qos.depth))
        for layer in self.messages.layers:
            self._add_stream(layer)
        told = ANNOTATION_MESSAGES if config.annotations else {}
        self._annotations = [self._add(row.message_type, f"{config.camera}/{name}", self._qos) for name, row in told.items()]
        for topic in self.messages.clouds:
            self._add(PointCloud2, topic, self._qos)
        for topic, message_type in SCAN_TOPICS.items() if scan.enabled else ():
            self._add(message_type, topic, self._qos)
        self._tf = self._tf_static = ""
        self._static_sent = False
        if TFMessage is not None and config.publish_tf:
            self._tf = self._add(TFMessage, "/tf", stream_qos(100))
            self._tf_static = self._add(TFMessage, "/tf_static", latched_qos())

    @property
    def frame_topic(self) -> str:
        """A topic that has one message for every frame, whatever is subscribed to."""
        return str(self._publishers[SETTINGS].topic_name)

    @property
    def depth(self) -> int:
        """How many frames the publishers keep for subscribers that have not taken them yet."""
        return int(self._qos.depth)

    def wanted_layers(self) -> set[str]:
        """Return the layers that must be rendered now: all enabled ones, or those whose images have a subscriber if lazy.

        ``ANNOTATIONS`` stands among them for what is told of objects.  Camera info and labels need no pixels: they come with every frame to
        whoever subscribes to them alone.
        """
        annotated = {ANNOTATIONS} if any(map(self._is_wanted, self._annotations)) else set()
        wanted = annotated | {layer for layer in self._images if not self._config.lazy or self.subscribers(layer)}
        return wanted.union(*(layers for topic, layers in self.messages.clouds.items() if self._is_wanted(topic)))

    def subscribers(self, layer: str) -> int:
        """Return how many subscriptions a layer's images have: raw, compressed and coloured."""
        return sum(self._publishers[topic].get_subscription_count() for topic in self._images[layer])

    @property
    def start(self) -> str:
        """The identity (GID, hexadecimal) of a publisher of this life of the node."""
        return identity_of(self._node, self._publishers[SETTINGS])

    def other_clocks(self) -> list[str]:
        """Return the nodes outside this suite's namespace that publish ``/clock``, as this camera does; none where it does not."""
        own = self._node.get_namespace()
        endpoints = publishers_of(self._node, CLOCK) if self._clock else ()
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
        if self._clock and with_clock and not self.leaves_clock():
            self._send(self._clock, clock_to_msg(pose.stamp_ns))
        if self._tf:
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
            if self._tf:
                self._send(self._tf, TFMessage(transforms=[transform]))
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
            self._send(self._tf_static, TFMessage(transforms=[link_from_optical_to_msg(pose.stamp_ns, link, optical)]))
            self._static_sent = True
        self._send(self._tf, TFMessage(transforms=[world_from_link_to_msg(pose, self._config.world_frame, link)]))

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

    def _add_stream(self, layer: str) -> None:
        base = f"{self._config.camera}/{layer}"
        self._images[layer] = [self._add(Image, f"{base}/image_raw", self._qos)]
        if has_companion(LAYERS[layer]) and self._config.color_companions:
            self._images[layer].append(self._add(Image, f"{base}/image_color", self._qos))
        if LAYERS[layer].compression:
            self._images[layer].append(self._add(CompressedImage, compressed_topic(f"{base}/image_raw"), self._qos))
        self._add(CameraInfo, f"{base}/camera_info", self._qos)
        if LAYERS[layer].labels is not None:
            self._add(String, f"{base}/labels", latched_qos(self._qos.depth))
            if LabelInfo is not None:
                self._add(LabelInfo, f"{base}/label_info", latched_qos(self._qos.depth))

    def _add(self, message_type: type, topic: str, qos: QoSProfile) -> str:
        overrides = QoSOverridingOptions.with_default_policies()
        publisher = self._node.create_publisher(message_type, topic, qos, qos_overriding_options=overrides)
        self._publishers[topic] = publisher
        self.counts[publisher.topic_name] = 0
        return topic

    def _send(self, topic: str, message: object) -> None:
        publisher = self._publishers[topic]
        publisher.publish(message)
        self.counts[publisher.topic_name] += 1
