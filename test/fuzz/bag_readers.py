"""Rows of the table for bags: whole files, and the serialised messages of every type that is decoded."""

from __future__ import annotations

import io
import json
import struct
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzz.cases import Reader
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from nav_msgs.msg import Path as PathMessage
from PIL import Image as Picture
from rclpy.serialization import serialize_message
from room_bag import write_room_bag
from sensor_msgs.msg import CompressedImage, PointCloud2, PointField

from evaluation.evaluation_file import TruthRecord
from scene_description.annotations import ANNOTATIONS_SCHEMA, annotations_from_json
from scene_description.strict import from_mapping, to_mapping
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_repair import repair_bag
from scene_synth_ros.dataset import open_dataset
from scene_synth_ros.dataset.camera import read_camera
from scene_synth_ros.evaluate.readings import read_message
from scene_synth_ros.evaluate.truth_facts import camera_facts, label_facts, read_class_names
from scene_synth_ros.messages.cdr import CdrWriter, read_text
from scene_synth_ros.messages.detections import encode_detections, read_annotations
from scene_synth_ros.messages.image_reader import decode_pixels, read_image
from scene_synth_ros.messages.label_info import read_labels
from scene_synth_ros.messages.streams import (
    CLOUD_TYPE,
    COMPRESSED_TYPE,
    DETECTIONS_2D_TYPE,
    DETECTIONS_3D_TYPE,
    IMAGE_TYPE,
    INFO_TYPE,
    ODOMETRY_TYPE,
    PATH_TYPE,
    POSE_TYPE,
    TF_TYPE,
)

TOPIC = "/synth/camera/depth/image_raw"


@cache
def bag_files() -> tuple[bytes, ...]:
    """Return files with chunks of each compression, and one that nobody closed."""
    files = []
    for compression in ("none", "lz4", "zstd"):
        with tempfile.TemporaryDirectory() as folder:
            options = {"compression": compression, "chunk_size": 3000, "layers": ("color", "depth")}
            bag = write_room_bag(Path(folder) / "bag", rooms=1, frames=2, size=(6, 8), **options)
            files.append(next(bag.path.glob("*.mcap")).read_bytes())
    return (*files, files[0][: len(files[0]) // 2])


def messages_of(type_name: str) -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        bag = write_room_bag(Path(folder) / "bag", rooms=1, frames=1, size=(6, 8))
        with BagReader(bag.path) as reader:
            return [bytes(message.data) for message in reader.messages() if message.type_name == type_name]


def at(name: str, read: Callable[[Path, Path], object]) -> Callable[[bytes, Path], object]:
    """Return a call that puts a case into a file, which is read then; the reader gets the file and a name that is free."""

    def read_file(data: bytes, folder: Path) -> object:
        path = folder / "bags" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        return read(path, Path(tempfile.mkdtemp(dir=folder)) / "out")

    return read_file


def frames_of(path: Path, _: Path) -> list[dict[str, Any]]:
    return [dict(frame) for frame in open_dataset(path, layers=("color", "depth"))]


def reading(type_name: str, topic: str = TOPIC) -> Callable[[bytes, Path], object]:
    return lambda data, folder: read_message(type_name, data, topic)


def picture(transport: str) -> Callable[[bytes, Path], object]:
    return lambda data, folder: read_image(COMPRESSED_TYPE, data, f"{TOPIC}/{transport}")


def compressed(form: str, mode: str, head: bytes = b"") -> bytes:
    buffer = io.BytesIO()
    pixels = np.arange(48, dtype=np.uint16).reshape(6, 8) * 100
    (Picture.fromarray(pixels) if mode == "I;16" else Picture.fromarray(pixels.astype(np.uint8))).save(buffer, form)
    return head + buffer.getvalue()


def compressed_messages() -> list[bytes]:
    depth = compressed("png", "I;16", struct.pack("<iff", 0, 0.0, 0.0))
    pictures = {"rgb8; png compressed": compressed("png", "L"), "mono8; jpeg compressed": compressed("jpeg", "L")}
    pictures["16UC1; compressedDepth png"] = depth
    return [bytes(serialize_message(CompressedImage(format=form, data=data))) for form, data in pictures.items()]


def clouds() -> list[bytes]:
    fields = [PointField(name=axis, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, axis in enumerate("xyz")]
    data = np.arange(36, dtype=np.float32).tobytes()
    return [bytes(serialize_message(PointCloud2(height=1, width=12, fields=fields, point_step=12, row_step=144, data=data)))]


def serialised(*messages: Any) -> list[bytes]:
    return [bytes(serialize_message(message)) for message in messages]


def transforms() -> list[bytes]:
    writer = CdrWriter()
    writer.numbers("I", 1)
    writer.header(5, "map")
    writer.text("eye")
    writer.numbers("d", 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0)
    return [writer.message()]


def labels() -> list[bytes]:
    return [text_message(json.dumps({"labels": {"1": {"name": "wall"}}, "stamp_ns": 5}))]


def text_message(text: str) -> bytes:
    writer = CdrWriter()
    writer.text(text)
    return writer.message()


def annotations() -> list[str]:
    """Return the annotations of a frame with one object."""
    box = {"center_m": (0.0, 1.0, 2.0), "size_m": (1.0, 1.0, 1.0), "orientation": (0.0, 0.0, 0.0, 1.0)}
    corner = {"depth_m": 2.0, "in_image": True, "behind": False, "occluded": False, "u_px": 3.5, "v_px": 2.0}
    rectangle = {"x": 1, "y": 1, "width": 3, "height": 2}
    bed = {
        "id": 3, "category": "bed", "label": 4, "label_name": "bed", "visible_box": rectangle, "full_box": rectangle,
        "visible_pixels": 5, "full_pixels": 6, "visible_fraction": 0.8, "truncation": 0.0, "camera_box": box, "world_box": box,
        "corners": [corner] * 8, "mask": {"size": [6, 9], "counts": "05e0"},
    }  # fmt: skip
    relations = [{"subject": 3, "kind": "on_floor"}]
    head = {"schema": ANNOTATIONS_SCHEMA, "stamp_ns": 7, "scene": "s", "width": 9, "height": 6}
    return [json.dumps(head | {"objects": [bed], "relations": relations})]


def detections(type_name: str) -> list[bytes]:
    return [encode_detections(type_name, annotations_from_json(text), "eye") for text in annotations()]


def as_record(facts: dict[str, Any]) -> TruthRecord:
    """Return the facts of a truth, read as they are written into an evaluation."""
    return from_mapping(TruthRecord, to_mapping(TruthRecord(**facts)), "truth")


def row(make: Callable[[], Iterable[bytes]], read: Callable[[bytes, Path], object], share: float = 0.5, **more: Any) -> Reader:
    return Reader(kind="bytes", make=lambda: list(make()), read=read, share=share, **more)


BAG_READERS: dict[str, Reader] = {
    "mcap_inspect": row(bag_files, at("inspect.mcap", lambda path, _: inspect_bag(path))),
    "mcap_dataset": row(bag_files, at("dataset.mcap", frames_of)),
    "mcap_repair": row(bag_files, at("repair.mcap", repair_bag), share=0.2),
    "image": row(lambda: messages_of(IMAGE_TYPE), lambda data, _: read_image(IMAGE_TYPE, data, TOPIC)),
    "compressed_image": row(lambda: compressed_messages()[:2], picture("compressed")),
    "compressed_depth": row(lambda: compressed_messages()[2:], picture("compressedDepth")),
    "depth_picture": row(
        lambda: [compressed("png", "I;16", bytes(12))], lambda data, _: decode_pixels(f"{TOPIC}/compressedDepth", data, (6, 8))
    ),
    "camera_info": row(lambda: messages_of(INFO_TYPE), lambda data, _: read_camera("camera", data)),
    "camera_facts": row(lambda: messages_of(INFO_TYPE), lambda data, _: as_record(camera_facts(data)), refusals=()),
    "label_facts": row(labels, lambda data, _: as_record(label_facts(data)), refusals=()),
    "class_names": row(labels, lambda data, _: read_class_names(data)),
    "labels": row(labels, lambda data, _: read_labels(data)),
    "text": row(labels, lambda data, _: read_text(data)),
    "frame_annotations": row(lambda: [text_message(text) for text in annotations()], lambda data, _: read_annotations(data)),
    "boxes_estimate": row(lambda: detections(DETECTIONS_2D_TYPE), reading(DETECTIONS_2D_TYPE)),
    "boxes_3d_estimate": row(lambda: detections(DETECTIONS_3D_TYPE), reading(DETECTIONS_3D_TYPE)),
    "pose_estimate": row(lambda: serialised(PoseStamped()), reading(POSE_TYPE)),
    "odometry_estimate": row(lambda: serialised(Odometry()), reading(ODOMETRY_TYPE)),
    "path_estimate": row(lambda: serialised(PathMessage(poses=[PoseStamped()] * 2)), reading(PATH_TYPE)),
    "cloud_estimate": row(clouds, reading(CLOUD_TYPE)),
    "transforms_estimate": row(transforms, reading(TF_TYPE, "/tf@eye")),
}
