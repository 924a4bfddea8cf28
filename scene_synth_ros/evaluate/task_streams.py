"""How the truth and the estimates of each task come as messages: one row a task."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.evaluate.errors import EstimateError
from scene_synth_ros.evaluate.readings import Reading, read_message
from scene_synth_ros.messages.stamps import CdrBytes
from scene_synth_ros.messages.streams import (
    COMPRESSED_TYPE,
    DETECTIONS_2D,
    ESTIMATES,
    IMAGE_TYPE,
    ODOMETRY_TYPE,
    PATH_TYPE,
    POINTS,
    POINTS_SENSED,
    POSE,
    POSE_TYPE,
    RAW,
    TF_TYPE,
    Role,
    Stream,
)

IMAGES, POSES = (IMAGE_TYPE, COMPRESSED_TYPE), (POSE_TYPE, ODOMETRY_TYPE, PATH_TYPE, TF_TYPE)
_MILLIMETRES_A_METRE = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskStream:
    """The messages of a task.

    Attributes:
        name: what the messages are of; several tasks may judge the same.
        role: of the truth, below the camera, and of estimates, below ``/estimates``.
        layer: of both; empty unless the role is of a layer.
        types: of the messages that carry estimates, the first is that of estimates that are written.
        own: what the truth's bag may have below the camera that is an estimate by itself.
        convert: what of a message is measured; raises EstimateError.
        frame_matters: numbers are meant in the frame that the header names, so it must be that of the truth.
        encoding: of images of estimates that are written; empty for other messages.
    """

    name: str
    role: Role
    layer: str = ""
    types: tuple[str, ...] = IMAGES
    own: Stream | None = None
    convert: Callable[[Any], Any]
    frame_matters: bool = False
    encoding: str = ""

    def truth(self, camera: str) -> Stream:
        """Return the truth of a camera, given with its namespace."""
        return Stream(camera, self.role, self.layer)

    @property
    def estimate(self) -> str:
        """Default topic of estimates, and of those that are written."""
        return self.truth(ESTIMATES).topic


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
    TaskStream(name="depth", role=RAW, layer="depth", convert=_depth, own=Stream("", RAW, "depth_sensed"), encoding="32FC1"),
    TaskStream(name="normals", role=RAW, layer="normals", convert=_normals, frame_matters=True, encoding="32FC3"),
    TaskStream(name="semantic", role=RAW, layer="semantic", convert=_ids, encoding="16UC1"),
    TaskStream(name="instance", role=RAW, layer="instance", convert=_ids, encoding="16UC1"),
    TaskStream(name="flow", role=RAW, layer="flow", convert=_flow, encoding="32FC2"),
    TaskStream(name="flow_backward", role=RAW, layer="flow_backward", convert=_flow, encoding="32FC2"),
    TaskStream(name="poses", role=POSE, types=POSES, convert=_as_it_is),
    TaskStream(name="detections", role=DETECTIONS_2D, types=(DETECTIONS_2D.type_name,), convert=_as_it_is),
    TaskStream(name="points", role=POINTS, types=(POINTS.type_name,), convert=_as_it_is, own=Stream("", POINTS_SENSED), frame_matters=True),
)
_STREAM_OF = {"depth_aligned": "depth", "depth_affine": "depth"}
"""Task -> what it judges, where that has another name."""

TASK_STREAMS: dict[str, TaskStream] = {row.name: row for row in _ROWS} | {
    task: row for task, name in _STREAM_OF.items() for row in _ROWS if row.name == name
}
"""Task of ``evaluation.TASKS`` -> its messages."""

TRUTH_STREAMS: dict[str, TaskStream] = TASK_STREAMS | {
    layer: TaskStream(name=layer, role=RAW, layer=layer, convert=_ids) for layer in ("occlusion", "occlusion_backward")
}
"""The same, and layers of the truth that belong to a task and are none."""


def read_for_task(task: str, type_name: str, data: CdrBytes, topic: str) -> Reading:
    """Return what a message says, as the task, or one of ``TRUTH_STREAMS``, measures it.

    Raises:
        EstimateError: it cannot be read, or has another form than the task takes.
    """
    reading = read_message(type_name, data, topic)
    return Reading(TRUTH_STREAMS[task].convert(reading.value), reading.frame_id)


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
