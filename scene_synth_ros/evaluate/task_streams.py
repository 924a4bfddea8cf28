"""How the truth and the estimates of each task come as messages: one row a task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.evaluate.errors import EstimateError
from scene_synth_ros.evaluate.readings import CLOUD, ODOMETRY, PATH, POSE, Reading, read_message
from scene_synth_ros.messages.image_reader import COMPRESSED_TYPE, IMAGE_TYPE
from scene_synth_ros.messages.message_definitions import DETECTIONS_2D, TF_MESSAGE

IMAGES, POSES = (IMAGE_TYPE, COMPRESSED_TYPE), (POSE, ODOMETRY, PATH, TF_MESSAGE)
_MILLIMETRES_A_METRE = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskStream:
    """The messages of a task.

    Attributes:
        name: what the messages are of; several tasks may judge the same.
        truth: ends of the truth's topic below the camera's name, the first that is found counts.
        types: of the messages that carry estimates, the first is that of estimates that are written.
        estimate: default topic of estimates, and of those that are written.
        own: end of a topic below the camera's name, in the truth's bag, that is an estimate by itself; empty if there is none.
        convert: what of a message is measured; raises EstimateError.
        frame_matters: numbers are meant in the frame that the header names, so it must be that of the truth.
        encoding: of images of estimates that are written; empty for other messages.
    """

    name: str
    truth: tuple[str, ...]
    types: tuple[str, ...]
    estimate: str
    convert: Callable[[Any], Any]
    own: str = ""
    frame_matters: bool = False
    encoding: str = ""


def _depth(pixels: NDArray[Any]) -> NDArray[np.float32]:
    """Return metres, float32; whole millimetres have NaN where they are 0 (REP 118)."""
    if pixels.ndim == 2 and pixels.dtype == np.uint16:
        metres: NDArray[np.float32] = np.where(pixels > 0, pixels / np.float32(_MILLIMETRES_A_METRE), np.float32(np.nan)).astype(np.float32)
        return metres
    return _numbers(pixels, 1, "32FC1 (metres) or 16UC1 (millimetres)")


def _numbers(pixels: NDArray[Any], channels: int, expected: str) -> NDArray[np.float32]:
    found = pixels.shape[2] if pixels.ndim == 3 else 1
    if pixels.dtype.kind != "f" or found != channels:
        raise EstimateError(f"expected an image {expected}, got {found} x {pixels.dtype} a pixel; publish that encoding")
    return pixels.astype(np.float32, copy=False)


def _normals(pixels: NDArray[Any]) -> NDArray[np.float32]:
    return _numbers(pixels, 3, "32FC3")


def _flow(pixels: NDArray[Any]) -> NDArray[np.float32]:
    return _numbers(pixels, 2, "32FC2 (pixels)")


def _ids(pixels: NDArray[Any]) -> NDArray[Any]:
    if pixels.dtype.kind not in "ui" or pixels.ndim != 2:
        found = pixels.shape[2] if pixels.ndim == 3 else 1
        raise EstimateError(f"expected an image of ids, mono8, 16UC1 or 32SC1, got {found} x {pixels.dtype} a pixel; publish that encoding")
    return pixels


def _as_it_is(value: Any) -> Any:
    return value


_ROWS = (
    TaskStream(
        name="depth", truth=("depth/image_raw",), types=IMAGES, estimate="/estimates/depth/image_raw", convert=_depth,
        own="depth_sensed/image_raw", encoding="32FC1",
    ),
    TaskStream(
        name="normals", truth=("normals/image_raw",), types=IMAGES, estimate="/estimates/normals/image_raw", convert=_normals,
        frame_matters=True, encoding="32FC3",
    ),
    TaskStream(
        name="semantic", truth=("semantic/image_raw",), types=IMAGES, estimate="/estimates/semantic/image_raw", convert=_ids,
        encoding="16UC1",
    ),
    TaskStream(
        name="instance", truth=("instance/image_raw",), types=IMAGES, estimate="/estimates/instance/image_raw", convert=_ids,
        encoding="16UC1",
    ),
    TaskStream(
        name="flow", truth=("flow/image_raw",), types=IMAGES, estimate="/estimates/flow/image_raw", convert=_flow, encoding="32FC2"
    ),
    TaskStream(name="poses", truth=("pose",), types=POSES, estimate="/estimates/pose", convert=_as_it_is),
    TaskStream(name="detections", truth=("detections_2d",), types=(DETECTIONS_2D,), estimate="/estimates/detections_2d", convert=_as_it_is),
    TaskStream(
        name="points", truth=("points",), types=(CLOUD,), estimate="/estimates/points", convert=_as_it_is, own="points_sensed",
        frame_matters=True,
    ),
)  # fmt: skip
_STREAM_OF = {"depth_aligned": "depth", "depth_affine": "depth"}
"""Task -> what it judges, where that has another name."""

TASK_STREAMS: dict[str, TaskStream] = {row.name: row for row in _ROWS} | {
    task: row for task, name in _STREAM_OF.items() for row in _ROWS if row.name == name
}
"""Task of ``evaluation.TASKS`` -> its messages."""

TRUTH_TYPES = {"poses": (POSE,)}
"""Task -> types of the truth's messages, where they are not those of estimates."""


def read_for_task(task: str, type_name: str, data: bytes, topic: str) -> Reading:
    """Return what a message says, as the task measures it.

    Raises:
        EstimateError: it cannot be read, or has another form than the task takes.
    """
    reading = read_message(type_name, data, topic)
    return Reading(TASK_STREAMS[task].convert(reading.value), reading.frame_id)


def check_pair(task: str, truth: Reading, estimate: Reading) -> None:
    """Refuse an estimate that cannot be laid over its truth.

    Raises:
        EstimateError: it has another size, or is meant in another frame.
    """
    stream = TASK_STREAMS[task]
    if stream.types is IMAGES and isinstance(estimate.value, np.ndarray) and truth.value.shape != estimate.value.shape:
        (height, width), (rows, columns) = truth.value.shape[:2], estimate.value.shape[:2]
        raise EstimateError(f"expected an image of {width}x{height} pixels as the truth is, got {columns}x{rows}; scale it to that size")
    if stream.frame_matters and estimate.frame_id not in (None, truth.frame_id):
        raise EstimateError(f"expected {task} in frame '{truth.frame_id}' as the truth is, got '{estimate.frame_id[:80]}'; transform them")
