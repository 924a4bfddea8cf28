"""Small bags with known content for the tests of bags."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_typestore

from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.bags.qos_metadata import OfferedQos
from scene_synth_ros.messages.poses import StampedTransform, encode_tf_message

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
STREAM = OfferedQos(depth=5)
LATCHED = OfferedQos(depth=1, durability="transient_local")
START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 100_000_000

TOPICS = {
    "/synth/scene": ("std_msgs/msg/String", LATCHED),
    "/synth/camera/color/image_raw": ("sensor_msgs/msg/Image", STREAM),
    "/synth/camera/color/camera_info": ("sensor_msgs/msg/CameraInfo", STREAM),
    "/synth/camera/depth/image_raw": ("sensor_msgs/msg/Image", STREAM),
    "/synth/camera/depth/camera_info": ("sensor_msgs/msg/CameraInfo", STREAM),
    "/synth/camera/semantic/labels": ("std_msgs/msg/String", LATCHED),
    "/tf_static": ("tf2_msgs/msg/TFMessage", LATCHED),
}


def header(stamp_ns: int):
    sec, nanosec = divmod(stamp_ns, 10**9)
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](sec, nanosec), "camera_optical_frame")


def cdr(message: object) -> bytes:
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


def image(stamp_ns: int, encoding: str, pixels: np.ndarray) -> bytes:
    height, width = pixels.shape[:2]
    data = np.frombuffer(pixels.tobytes(), np.uint8)
    return cdr(T["sensor_msgs/msg/Image"](header(stamp_ns), height, width, encoding, 0, data.size // height, data))


def camera_info(stamp_ns: int) -> bytes:
    region = T["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    k, r, p = np.arange(9.0), np.eye(3).ravel(), np.arange(12.0)
    return cdr(T["sensor_msgs/msg/CameraInfo"](header(stamp_ns), 12, 16, "plumb_bob", np.zeros(5), k, r, p, 0, 0, region))


def text(value: object) -> bytes:
    return cdr(T["std_msgs/msg/String"](json.dumps(value)))


def frame_messages(index: int, size: int = 16) -> list[tuple[str, int, bytes]]:
    """Return (topic, stamp_ns, CDR) of frame ``index``; the first frame brings the latched topics."""
    stamp_ns = START_NS + index * PERIOD_NS
    rng = np.random.default_rng(index)
    color = rng.integers(0, 256, (size, size, 3), np.uint8)
    depth = rng.random((size, size), np.float32)
    messages = [
        ("/synth/camera/color/image_raw", stamp_ns, image(stamp_ns, "rgb8", color)),
        ("/synth/camera/color/camera_info", stamp_ns, camera_info(stamp_ns)),
        ("/synth/camera/depth/image_raw", stamp_ns, image(stamp_ns, "32FC1", depth)),
        ("/synth/camera/depth/camera_info", stamp_ns, camera_info(stamp_ns)),
    ]
    if index == 0:
        transform = StampedTransform(stamp_ns, "camera_link", "camera_optical_frame", (0.0, 0.0, 0.0), (-0.5, 0.5, -0.5, 0.5))
        messages = [
            ("/synth/scene", stamp_ns, text({"camera_path": [{"stamp_ns": stamp_ns}, {"stamp_ns": stamp_ns + PERIOD_NS}]})),
            ("/synth/camera/semantic/labels", stamp_ns, text({"0": "void"})),
            ("/tf_static", stamp_ns, encode_tf_message([transform])),
            *messages,
        ]
    return messages


def write_bag(folder: Path, frames: int = 6, size: int = 16, **options) -> list[tuple[str, int, bytes]]:
    """Write a bag of ``frames`` frames; return its messages in order."""
    messages = [message for index in range(frames) for message in frame_messages(index, size)]
    with BagWriter(folder, **options) as writer:
        for topic, (type_name, qos) in TOPICS.items():
            writer.add_topic(topic, type_name, [qos])
        for topic, stamp_ns, data in messages:
            writer.write(topic, data, stamp_ns, stamp_ns)
    return messages
