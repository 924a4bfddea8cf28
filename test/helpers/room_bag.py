"""Bags of the sample room with known pixels, for tests of what shows bags."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rclpy.serialization import serialize_message
from sample_scene import sample_scene
from std_msgs.msg import String

from renderer import LAYERS, CameraConfig
from scene_description import CameraPose, SceneDescription, scene_to_json
from scene_description.labels import instance_labels, semantic_labels
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.messages.conversions import (
    camera_info_to_msg,
    image_to_msg,
    labels_to_msg,
    layer_encoding,
    occupancy_to_msg,
    pose_to_msg,
)

CAMERA = "/synth/camera"
PERIOD_NS = 200_000_000
START_NS = 1_000_000_000
MESSAGE_TYPES = {"String": "std_msgs/msg", "Image": "sensor_msgs/msg", "CameraInfo": "sensor_msgs/msg"} | {
    "CompressedImage": "sensor_msgs/msg",
    "PoseStamped": "geometry_msgs/msg",
    "OccupancyGrid": "nav_msgs/msg",
}


class RoomBag(NamedTuple):
    """What was written: stamp -> layer -> pixels, the scenes, the camera."""

    path: Path
    images: dict[int, dict[str, np.ndarray]]
    scenes: list[SceneDescription]
    camera: CameraConfig


def write(writer: BagWriter, topic: str, message: Any, stamp_ns: int) -> None:
    """Add a topic, if it is new, and write a message on it."""
    kind = type(message).__name__
    writer.add_topic(topic, f"{MESSAGE_TYPES[kind]}/{kind}")
    writer.write(topic, bytes(serialize_message(message)), stamp_ns, stamp_ns)


def frame_images(number: int, height: int, width: int) -> dict[str, np.ndarray]:
    """Return pixels of every published layer, all different; in depth the first pixel is no hit, the second invalid, the third far."""
    rng = np.random.default_rng(number)
    depth = rng.uniform(0.3, 6.5, (height, width)).astype(np.float32)
    depth[0, :3] = np.inf, np.nan, 70.0
    normals = rng.normal(size=(height, width, 3))
    normals = (normals / np.linalg.norm(normals, axis=2, keepdims=True)).astype(np.float32)
    normals[0, 0] = 0.0
    color = np.broadcast_to(np.linspace(0, 255, width, dtype=np.uint8)[None, :, None], (height, width, 3)).copy()
    color[..., 0] = 40 * number % 256
    return {
        "color": color,
        "depth": depth,
        "normals": normals,
        "semantic": rng.integers(0, 41, (height, width), np.uint8),
        "instance": rng.integers(0, 7, (height, width), np.uint16),
    }


def room_scene(index: int, frames: int) -> SceneDescription:
    """Return the sample room with a path of its own stamps; rooms follow each other in time."""
    scene = sample_scene()
    first = START_NS + index * frames * PERIOD_NS
    pose = scene.camera_path[0]
    path = tuple(
        CameraPose(stamp_ns=first + k * PERIOD_NS, position_m=pose.position_m, orientation=pose.orientation) for k in range(frames)
    )
    return dataclasses.replace(scene, index=index, camera_path=path)


def write_room_bag(
    folder: Path,
    *,
    rooms: int = 2,
    frames: int = 3,
    size: tuple[int, int] = (48, 64),
    layers: Collection[str] = ("color", "depth", "normals", "semantic", "instance"),
    labels: Mapping[str, Any] | None = None,
    attachments: Mapping[str, bytes] | None = None,
    records: Mapping[str, Mapping[str, str]] | None = None,
    first_room: int = 0,
    more: Callable[[int], Mapping[str, np.ndarray]] = lambda frame: {},
    **options: Any,
) -> RoomBag:
    """Write a bag of some rooms.

    Args:
        folder: of the bag, new.
        rooms: how many.
        frames: of each room.
        size: height and width.
        layers: those that are recorded.
        labels: id -> row, in place of the semantic labels.
        attachments: files in the bag.
        records: metadata records of the bag, by name.
        first_room: index of the first room.
        more: further layers of a frame by its number in the room.
        options: of :class:`BagWriter`.
    """
    height, width = size
    camera = CameraConfig(width=width, height=height)
    scenes, images = [room_scene(index, frames) for index in range(first_room, first_room + rooms)], {}
    with BagWriter(folder, **options) as writer:
        for name, record in (records or {}).items():
            writer.set_record(name, record)
        for name, data in (attachments or {}).items():
            writer.set_attachment(name, data)
        for scene in scenes:
            first = scene.camera_path[0].stamp_ns
            write(writer, "/synth/scene", String(data=scene_to_json(scene)), first)
            write(writer, "/synth/scene/map", occupancy_to_msg(np.zeros((7, 8), np.int8), 0.5, (0.0, 0.0), first, "map"), first)
            for number, pose in enumerate(scene.camera_path):
                stamp = pose.stamp_ns
                images[stamp] = {k: v for k, v in frame_images(first_room * frames + len(images), height, width).items() if k in layers}
                images[stamp] |= more(number)
                for layer, pixels in images[stamp].items():
                    message = image_to_msg(pixels, layer_encoding(LAYERS[layer]), stamp, "eye")
                    write(writer, f"{CAMERA}/{layer}/image_raw", message, stamp)
                    write(writer, f"{CAMERA}/{layer}/camera_info", camera_info_to_msg(camera, stamp, "eye"), stamp)
                write(writer, f"{CAMERA}/pose", pose_to_msg(pose, "map"), stamp)
                told = String(data=json.dumps({"labels": labels})) if labels else labels_to_msg(semantic_labels(), stamp)
                write(writer, f"{CAMERA}/semantic/labels", told, stamp)
                write(writer, f"{CAMERA}/instance/labels", labels_to_msg(instance_labels(scene), stamp), stamp)
    return RoomBag(folder, images, scenes, camera)
