"""Writes estimates as a bag with the stamps of their frames, so that other programs, and a report, can show them beside the truth."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.serialization import serialize_message
from sensor_msgs.msg import PointCloud2, PointField

from evaluation.metrics.instance import Instances
from scene_description import CameraPose
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.evaluate.readings import BoxList, Cloud
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS
from scene_synth_ros.messages.cdr import CdrWriter
from scene_synth_ros.messages.conversions import ENCODING_CHANNELS, header, image_to_msg, pose_to_msg

WORLD = "map"
_MILLIMETRES_A_METRE = 1000.0


class EstimatesBag:
    """A bag of estimates on the topics that ``scene_synth evaluate --estimates`` looks for first.

    The folder must not exist.

    Raises:
        BagWriteError: it exists, or cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self._writer = BagWriter(folder)

    def __enter__(self) -> "EstimatesBag":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if error is not None and not self._writer.closed:
            self._writer.discard()  # a part of the estimates must not look like all of them
        self._writer.close()

    def add(self, task: str, value: Any, stamp_ns: int, frame_id: str) -> None:
        """Write the estimate of a task.

        ``value`` is as the task measures it, an image of the dtype that the task reads; ``frame_id`` is that of the truth.

        Raises:
            BagWriteError: the disk refused it.
        """
        stream = TASK_STREAMS[task]
        kind = stream.types[0]
        self._writer.add_topic(stream.estimate, kind)
        self._writer.write(stream.estimate, _MESSAGES.get(task, _image)(task, value, stamp_ns, frame_id), stamp_ns, stamp_ns)


def _image(task: str, value: Any, stamp_ns: int, frame_id: str) -> bytes:
    encoding = TASK_STREAMS[task].encoding
    pixels = np.ascontiguousarray(value, ENCODING_CHANNELS[encoding][0])
    return bytes(serialize_message(image_to_msg(pixels, encoding, stamp_ns, frame_id)))


def _instances(task: str, value: Any, stamp_ns: int, frame_id: str) -> bytes:
    """Write masks as an image of ids from 1 on, the surest on top."""
    if not isinstance(value, Instances):
        return _image(task, value, stamp_ns, frame_id)
    ids = np.zeros(value.masks.shape[1:], np.uint16)
    scores = np.ones(len(value.masks)) if value.scores is None else np.asarray(value.scores)
    for number in np.argsort(scores, kind="stable"):
        ids[value.masks[number]] = number + 1
    return _image(task, ids, stamp_ns, frame_id)


def _pose(task: str, value: CameraPose, stamp_ns: int, frame_id: str) -> bytes:
    message: PoseStamped = pose_to_msg(replace(value, stamp_ns=stamp_ns), WORLD)
    return bytes(serialize_message(message))


def _points(task: str, value: Cloud, stamp_ns: int, frame_id: str) -> bytes:
    points = np.ascontiguousarray(value.points, np.float32)
    message = PointCloud2(header=header(stamp_ns, frame_id), height=1, width=len(points), point_step=12, row_step=12 * len(points))
    message.fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1) for i, name in enumerate("xyz")]
    message.is_dense = True
    message.data.frombytes(points.tobytes())
    return bytes(serialize_message(message))


def _detections(task: str, value: BoxList, stamp_ns: int, frame_id: str) -> bytes:
    writer = CdrWriter()
    writer.header(stamp_ns, frame_id)
    writer.numbers("I", len(value.scores))
    ids = value.ids or ("",) * len(value.scores)
    for name, score, (left, top, width, height), track in zip(value.class_ids, value.scores, value.boxes, ids, strict=True):
        writer.header(stamp_ns, frame_id)
        writer.numbers("I", 1)
        writer.text(name)
        writer.numbers("d", score, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, *(0.0,) * 36)
        writer.numbers("d", left + 0.5 * width, top + 0.5 * height, 0.0, width, height)
        writer.text(track)
    return writer.message()


_MESSAGES: dict[str, Callable[[str, Any, int, str], bytes]] = {
    "poses": _pose,
    "points": _points,
    "detections": _detections,
    "instance": _instances,
}
