"""The topics of one camera and its scanner, one row each: the renderer's publishers are made of them, and so are bags written offline."""

from __future__ import annotations

from typing import NamedTuple

from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2
from std_msgs.msg import String

from renderer.camera.config import CameraConfig
from renderer.film.layers import LAYERS
from renderer.lidar.config import ScanConfig
from scene_synth_ros.messages.detections import ANNOTATION_MESSAGES, ANNOTATIONS
from scene_synth_ros.messages.frame_messages import StreamConfig, cloud_topics, enabled_layers, has_companion
from scene_synth_ros.messages.image_codec import compressed_topic
from scene_synth_ros.messages.label_info import LabelInfo
from scene_synth_ros.messages.scan_messages import SCAN_TOPICS
from scene_synth_ros.suite.qos import PROFILES, latched_qos, stream_qos

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # not among the PyPI wheels; transforms are then in the bags and in <camera>/pose only
    TFMessage = None

CLOCK, SETTINGS = "/clock", "~/settings"
TF, TF_STATIC = "/tf", "/tf_static"


class StreamTopic(NamedTuple):
    """A topic: its name below the namespace, its type and QoS, and the layers that must be rendered for who subscribes to it."""

    name: str
    message_type: type
    qos: QoSProfile
    layers: frozenset[str] = frozenset()


def stream_topics(config: StreamConfig, camera: CameraConfig, scan: ScanConfig) -> dict[str, StreamTopic]:
    """Return name -> topic, in the order in which they are published first.

    ``ANNOTATIONS`` stands among the layers for what is told of objects.  Camera info and labels need no pixels.
    """
    qos = PROFILES[config.qos]
    topics = [StreamTopic(CLOCK, Clock, stream_qos())] if config.publish_clock else []
    if config.publish_pose:
        topics.append(StreamTopic(f"{config.camera}/pose", PoseStamped, qos))
    topics.append(StreamTopic(SETTINGS, String, latched_qos(qos.depth)))
    for layer in enabled_layers(config, camera):
        topics += _layer_topics(config, layer)
    for name, row in ANNOTATION_MESSAGES.items() if config.annotations else ():
        topics.append(StreamTopic(f"{config.camera}/{name}", row.message_type, qos, frozenset({ANNOTATIONS})))
    topics += [StreamTopic(name, PointCloud2, qos, frozenset(layers)) for name, layers in cloud_topics(config, camera).items()]
    topics += [StreamTopic(name, message_type, qos) for name, message_type in SCAN_TOPICS.items() if scan.enabled]
    if TFMessage is not None and config.publish_tf:
        topics += [StreamTopic(TF, TFMessage, stream_qos(100)), StreamTopic(TF_STATIC, TFMessage, latched_qos())]
    return {topic.name: topic for topic in topics}


def _layer_topics(config: StreamConfig, layer: str) -> list[StreamTopic]:
    """Return the topics of a layer: its images, raw, compressed and for people, and what goes with them."""
    base, qos, row, shown = f"{config.camera}/{layer}", PROFILES[config.qos], LAYERS[layer], frozenset({layer})
    topics = [StreamTopic(f"{base}/image_raw", Image, qos, shown)]
    if has_companion(row) and config.color_companions:
        topics.append(StreamTopic(f"{base}/image_color", Image, qos, shown))
    if row.compression:
        topics.append(StreamTopic(compressed_topic(f"{base}/image_raw"), CompressedImage, qos, shown))
    topics.append(StreamTopic(f"{base}/camera_info", CameraInfo, qos))
    if row.labels is not None:
        topics.append(StreamTopic(f"{base}/labels", String, latched_qos(qos.depth)))
        if LabelInfo is not None:
            topics.append(StreamTopic(f"{base}/label_info", LabelInfo, latched_qos(qos.depth)))
    return topics
