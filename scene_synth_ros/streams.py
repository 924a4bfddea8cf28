"""The renderer's topics: one table row a stream, one namespace a stream, its own camera info in each."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos_overriding_options import QoSOverridingOptions
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String

from renderer.config import CameraConfig
from renderer.false_color import ids_to_color, normals_to_color
from renderer.frame import Frame
from scene_description import CameraPose, Limits, SceneDescription
from scene_description.labels import instance_palette, label_palette
from scene_synth_ros.conversions import (
    camera_info_to_msg,
    clock_to_msg,
    depth_to_millimetres,
    image_to_msg,
    instance_labels,
    labels_to_msg,
    pose_to_msg,
    semantic_labels,
    world_from_link_to_msg,
)
from scene_synth_ros.qos import latched_qos, stream_qos

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # not among the PyPI wheels; transforms are then in the bags and in <camera>/pose only
    TFMessage = None

_STREAMS_FIXED = "publishers are made at the start"


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamConfig:
    """Which streams a renderer publishes, and under which names."""

    camera: Annotated[
        str,
        Limits(
            min_length=1,
            max_length=80,
            pattern=r"[A-Za-z][A-Za-z0-9_]*",
            description="Camera name in topics and frames",
            fixed=_STREAMS_FIXED,
        ),
    ] = "camera"
    world_frame: Annotated[str, Limits(min_length=1, max_length=100, description="Frame of poses", fixed=_STREAMS_FIXED)] = "map"
    color: Annotated[bool, Limits(description="Publish colour", fixed=_STREAMS_FIXED)] = True
    depth: Annotated[
        bool, Limits(description="Publish depth along the optical axis; a panorama publishes range instead", fixed=_STREAMS_FIXED)
    ] = True
    range: Annotated[bool, Limits(description="Publish range, the distance along each ray", fixed=_STREAMS_FIXED)] = False
    normals: Annotated[bool, Limits(description="Publish surface normals", fixed=_STREAMS_FIXED)] = True
    semantic: Annotated[bool, Limits(description="Publish NYU40 class ids", fixed=_STREAMS_FIXED)] = True
    instance: Annotated[bool, Limits(description="Publish object ids", fixed=_STREAMS_FIXED)] = True
    color_companions: Annotated[
        bool, Limits(description="Publish image_color for streams that viewers cannot show", fixed=_STREAMS_FIXED)
    ] = True
    depth_encoding: Annotated[
        Literal["32FC1", "16UC1"], Limits(description="Depth in metres (32FC1) or millimetres (16UC1)", fixed="a bag has one encoding")
    ] = "32FC1"
    lazy: Annotated[bool, Limits(description="Render only what somebody subscribes to")] = True
    publish_clock: Annotated[bool, Limits(description="Publish /clock; one renderer of a run does", fixed=_STREAMS_FIXED)] = True
    publish_tf: Annotated[bool, Limits(description="Publish /tf and /tf_static where tf2_msgs is there", fixed=_STREAMS_FIXED)] = True


class Stream(NamedTuple):
    """A stream: its encoding on ``image_raw``, and how its picture for people is made from the pixels and the palettes."""

    encoding: str
    companion: Callable[[NDArray[Any], Palettes], NDArray[np.uint8]] | None


class Palettes(NamedTuple):
    """RGB tables, (n, 3) uint8: by class id and by object id of the scene."""

    semantic: NDArray[np.uint8]
    instance: NDArray[np.uint8]


STREAMS: dict[str, Stream] = {
    "color": Stream("rgb8", None),
    "depth": Stream("32FC1", None),
    "range": Stream("32FC1", None),
    "normals": Stream("32FC3", lambda image, _: normals_to_color(image)),
    "semantic": Stream("mono8", lambda image, palettes: ids_to_color(image, palettes.semantic)),
    "instance": Stream("16UC1", lambda image, palettes: ids_to_color(image, palettes.instance)),
}
"""Layer -> stream."""


def enabled_layers(config: StreamConfig, camera: CameraConfig) -> list[str]:
    """Return the layers that are published; a panorama sees all around, where depth along one axis means nothing: range instead."""
    enabled = {layer for layer in STREAMS if getattr(config, layer)}
    if camera.model == "equirectangular" and "depth" in enabled:
        enabled = enabled - {"depth"} | {"range"}
    return [layer for layer in STREAMS if layer in enabled]


class StreamPublishers:
    """Publishers of one camera: makes them, says which layers are wanted, publishes a frame with one stamp.

    Topics below ``<camera>/``: ``<layer>/image_raw`` and ``<layer>/camera_info`` for every enabled layer, ``<layer>/image_color`` where
    viewers cannot show the raw form, ``semantic/labels`` and ``instance/labels`` (JSON, latched), ``pose``; ``/clock``, ``/tf``,
    ``/tf_static``.
    """

    def __init__(self, node: Node, config: StreamConfig, camera: CameraConfig) -> None:
        self._config = config
        self._camera = camera
        self._node = node
        self.counts: dict[str, int] = {}
        """Messages published so far, by topic."""
        self._publishers: dict[str, Publisher] = {}
        self._images: dict[str, list[str]] = {}
        for layer in enabled_layers(config, camera):
            self._add_stream(layer, STREAMS[layer])
        self._pose = self._add(PoseStamped, f"{config.camera}/pose")
        self._clock = self._add(Clock, "/clock") if config.publish_clock else ""
        self._tf = self._tf_static = ""
        if TFMessage is not None and config.publish_tf:
            self._tf = self._add(TFMessage, "/tf", depth=100)
            self._tf_static = self._add(TFMessage, "/tf_static", latched=True)

    def wanted_layers(self) -> set[str]:
        """Return the layers that must be rendered now: all enabled ones, or those with a subscriber if lazy."""
        return {layer for layer in self._images if not self._config.lazy or self.subscribers(layer)}

    def subscribers(self, layer: str) -> int:
        """Return how many subscriptions a layer's images have, raw and coloured."""
        return sum(self._publishers[topic].get_subscription_count() for topic in self._images[layer])

    def unmatched(self, recorders: Sequence[Mapping[str, int]]) -> str:
        """Return a topic that a recorder has not yet considered or is not yet connected to; empty if there is none.

        Args:
            recorders: for each recorder the topics that it knows, -1 for those that it leaves out.
        """
        for publisher in self._publishers.values():
            name = publisher.topic_name
            if any(name not in known for known in recorders):
                return name
            if publisher.get_subscription_count() < sum(known[name] >= 0 for known in recorders):
                return name
        return ""

    def begin_room(self, scene: SceneDescription) -> None:
        """Take the palettes and label tables of a room."""
        top = max((thing.id for thing in (*scene.room.openings, *scene.objects)), default=0)
        self.begin_palettes(
            Palettes(label_palette(), instance_palette(top + 1)), {"semantic": semantic_labels(), "instance": instance_labels(scene)}
        )

    def begin_palettes(self, palettes: Palettes, labels: Mapping[str, Mapping[int, Mapping[str, object]]]) -> None:
        """Take palettes and, for the layers that hold ids, the label tables."""
        self._palettes, self._labels = palettes, labels

    def publish(self, frame: Frame, pose: CameraPose) -> None:
        """Publish clock, pose, transforms and every layer of a frame, all with the pose's stamp."""
        stamp_ns = pose.stamp_ns
        if self._clock:
            self._send(self._clock, clock_to_msg(stamp_ns))
        self._send(self._pose, pose_to_msg(pose, self._config.world_frame))
        if self._tf:
            self._send(
                self._tf, TFMessage(transforms=[world_from_link_to_msg(pose, self._config.world_frame, f"{self._config.camera}_link")])
            )
        for layer, image in frame.layers.items():
            self._publish_layer(layer, image, stamp_ns)

    def wait_until_delivered(self, seconds: float) -> None:
        """Wait, for so long at most, until reliable subscribers have what was published."""
        deadline = time.monotonic() + seconds
        for publisher in self._publishers.values():
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, deadline - time.monotonic())))

    def _publish_layer(self, layer: str, image: NDArray[Any], stamp_ns: int) -> None:
        stream, base = STREAMS[layer], f"{self._config.camera}/{layer}"
        frame_id = f"{self._config.camera}_optical_frame"
        info = camera_info_to_msg(self._camera, stamp_ns, frame_id)
        encoding = stream.encoding
        raw: NDArray[Any] = image
        if layer == "depth" and self._config.depth_encoding == "16UC1":
            raw, encoding = depth_to_millimetres(image), "16UC1"
        self._send(f"{base}/camera_info", info)
        if layer in self._labels:
            self._send(f"{base}/labels", labels_to_msg(self._labels[layer], stamp_ns))
        self._send(f"{base}/image_raw", image_to_msg(raw, encoding, stamp_ns, frame_id))
        color = f"{base}/image_color"
        if stream.companion is not None and color in self._publishers and self._is_wanted(color):
            self._send(color, image_to_msg(stream.companion(image, self._palettes), "rgb8", stamp_ns, frame_id))

    def _is_wanted(self, topic: str) -> bool:
        return not self._config.lazy or self._publishers[topic].get_subscription_count() > 0

    def _add_stream(self, layer: str, stream: Stream) -> None:
        base = f"{self._config.camera}/{layer}"
        self._images[layer] = [self._add(Image, f"{base}/image_raw")]
        if stream.companion is not None and self._config.color_companions:
            self._images[layer].append(self._add(Image, f"{base}/image_color"))
        self._add(CameraInfo, f"{base}/camera_info")
        if layer in ("semantic", "instance"):
            self._add(String, f"{base}/labels", latched=True)

    def _add(self, message_type: type, topic: str, *, depth: int = 10, latched: bool = False) -> str:
        qos = latched_qos() if latched else stream_qos(depth)
        overrides = QoSOverridingOptions.with_default_policies()
        publisher = self._node.create_publisher(message_type, topic, qos, qos_overriding_options=overrides)
        self._publishers[topic] = publisher
        self.counts[publisher.topic_name] = 0
        return topic

    def _send(self, topic: str, message: object) -> None:
        publisher = self._publishers[topic]
        publisher.publish(message)
        self.counts[publisher.topic_name] += 1
