"""Where the estimates of a bag come from: topics of a bag, or a Python algorithm that is given the images of the bag."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo

from evaluation.metrics.instance import Instances
from scene_description import CameraPose
from scene_description.poses import quaternion_from_rotation, world_from_optical
from scene_synth_ros.bags.indexed_bag import IndexedBag
from scene_synth_ros.evaluate.algorithm import NEXT, THIS, Algorithm, AlgorithmFrame, frame_of
from scene_synth_ros.evaluate.bag_index import BagIndex
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.measuring import Estimates
from scene_synth_ros.evaluate.readings import BoxList, Cloud, Reading, read_message
from scene_synth_ros.evaluate.task_streams import POSES, TASK_STREAMS, read_for_task
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.messages.stamps import CdrBytes

OWN_CAMERA = ""
"""Name among camera infos of that of the camera that is judged."""

Frames = Mapping[str, Mapping[str, CdrBytes]]
"""Which frame, of ``algorithm.THIS`` and its neighbours, -> topic -> message; a neighbour that the room has not is left out."""


class EstimateSource(Protocol):
    """Gives the estimates of a bag, frame by frame."""

    def begin_room(self, room: int) -> None:
        """Take that the frames to come are those of another room."""

    def of_frame(self, stamp_ns: int, frames: Frames) -> Estimates:
        """Return the estimates of a frame, given its messages in the truth's bag and those of its neighbours."""


class BagEstimates:
    """Estimates on topics of a bag."""

    def __init__(self, bag: IndexedBag, topics: Mapping[str, TypedTopic], index: BagIndex) -> None:
        self._bag, self._topics, self._index = bag, topics, index

    def begin_room(self, room: int) -> None:
        """Do nothing: a bag has all rooms."""

    def of_frame(self, stamp_ns: int, frames: Frames) -> Estimates:
        """Return what the bag has at a stamp."""
        found = self._bag.read_all({topic.name for topic in self._topics.values() if topic.type_name not in POSES}, stamp_ns)
        estimates: dict[str, Reading | EstimateError] = {}
        for task, topic in self._topics.items():
            if topic.type_name in POSES:
                pose = self._index.poses.get(topic.name, {}).get(stamp_ns)
                if pose is not None:
                    estimates[task] = Reading((pose,), None)
            elif topic.name in found:
                estimates[task] = _tried(read_for_task, task, topic.type_name, found[topic.name], topic.name)
        return estimates


class AlgorithmEstimates:
    """Estimates of a user's Python algorithm.

    ``infos`` are by the names of its images, and by ``OWN_CAMERA`` of the camera that is judged; ``poses`` is empty unless it asks for
    them.
    """

    def __init__(
        self,
        algorithm: Algorithm,
        tasks: Sequence[str],
        images: Mapping[str, TypedTopic],
        infos: Mapping[str, TypedTopic],
        poses: Mapping[int, CameraPose],
    ) -> None:
        self._algorithm, self._tasks, self._images, self._infos, self._poses = algorithm, tasks, images, infos, poses
        self._room = 0

    def begin_room(self, room: int) -> None:
        """Construct the algorithm's class anew.

        Raises:
            EvaluateError: it raised something.
        """
        self._room = room
        self._algorithm.begin_room(room)

    def of_frame(self, stamp_ns: int, frames: Frames) -> Estimates:
        """Return what the algorithm makes of a frame; nothing where the bag lacks one of its inputs for this stamp.

        Raises:
            EvaluateError: the algorithm raised something.
        """
        lacking = [name for name, topic in self._images.items() if topic.name not in frames.get(frame_of(name), {})]
        if lacking:
            beyond = frame_of(lacking[0]) not in frames
            got = f"the {'last' if frame_of(lacking[0]) == NEXT else 'first'} frame of its room" if beyond else "none"
            advice = "" if beyond else "; record that stream whole"
            reason = EstimateError(f"expected the algorithm's input '{lacking[0]}' at this stamp, got {got}{advice}")
            return dict.fromkeys(self._tasks, reason)
        found = self._algorithm.estimate(self._frame(stamp_ns, frames))
        unknown = [str(task)[:40] for task in found if task not in TASK_STREAMS]
        if unknown:
            raise EvaluateError(f"--algorithm {self._algorithm.words}: expected tasks of {', '.join(TASK_STREAMS)}, got '{unknown[0]}'")
        values = {task: found.get(task, found.get(TASK_STREAMS[task].name)) for task in self._tasks}
        return {task: _tried(returned_estimate, task, value, stamp_ns) for task, value in values.items() if value is not None}

    def _frame(self, stamp_ns: int, frames: Frames) -> AlgorithmFrame:
        images = {
            name: read_message(topic.type_name, frames[frame_of(name)][topic.name], topic.name).value
            for name, topic in self._images.items()
        }
        messages = frames[THIS]
        for image in images.values():
            image.flags.writeable = False
        infos = {
            name: deserialize_message(bytes(messages[topic.name]), CameraInfo)
            for name, topic in self._infos.items()
            if topic.name in messages
        }
        own = infos.get(OWN_CAMERA) or next(iter(infos.values()), CameraInfo())
        pose = self._poses.get(stamp_ns)
        return AlgorithmFrame(
            stamp_ns=stamp_ns,
            K=np.array(own.k, np.float64).reshape(3, 3),
            width=own.width,
            height=own.height,
            images=images,
            D=np.array(own.d, np.float64),
            projections={name: np.array(info.p, np.float64).reshape(3, 4) for name, info in infos.items() if name},
            world_from_camera=None if pose is None else world_from_optical(pose.position_m, pose.orientation),
            room=self._room,
        )


def returned_estimate(task: str, value: Any, stamp_ns: int) -> Reading:
    """Return what an algorithm has returned for a task as its messages would be read.

    Raises:
        EstimateError: it has another form than the task takes.
    """
    read: Callable[[str, Any, int], Any] = _RETURNED.get(task, _image)
    return Reading(read(task, value, stamp_ns), None)


def _image(task: str, value: Any, stamp_ns: int) -> NDArray[Any]:
    try:
        pixels = np.asarray(value)
    except ValueError as error:
        raise EstimateError(f"expected an array for {task}, got {type(value).__name__} ({str(error)[:80]})") from None
    if pixels.dtype == np.uint16 and TASK_STREAMS[task].encoding == "32FC1":
        raise EstimateError(f"expected {task} in metres as floats, got uint16; divide by 1000 if it is millimetres")
    converted: NDArray[Any] = TASK_STREAMS[task].convert(pixels)
    return converted


def _pose(task: str, value: Any, stamp_ns: int) -> tuple[CameraPose, ...]:
    matrix = np.asarray(value, np.float64)
    rotation = matrix[:3, :3] if matrix.shape == (4, 4) else None
    if rotation is None or not np.isfinite(matrix).all() or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3):
        got = "no rotation in it" if rotation is not None else f"shape {matrix.shape}"
        raise EstimateError(f"expected a pose as a (4, 4) array world_from_camera, got {got}")
    x, y, z = map(float, matrix[:3, 3])
    return (CameraPose(stamp_ns=stamp_ns, position_m=(x, y, z), orientation=quaternion_from_rotation(rotation)),)


def _points(task: str, value: Any, stamp_ns: int) -> Cloud:
    points = np.asarray(value, np.float64)
    if points.ndim < 2 or points.shape[-1] != 3:
        raise EstimateError(f"expected points as an (n, 3) array, got shape {points.shape}")
    points = points.reshape(-1, 3)
    return Cloud(points[np.isfinite(points).all(axis=1)])


def _instances(task: str, value: Any, stamp_ns: int) -> Any:
    return value if isinstance(value, Instances) else _image(task, value, stamp_ns)


def _boxes(task: str, value: Any, stamp_ns: int) -> BoxList:
    """Take a mapping with ``boxes`` (n, 4) left, top, width, height in pixels, ``classes`` (n,) and ``scores`` (n,)."""
    if not isinstance(value, Mapping) or not {"boxes", "classes", "scores"} <= value.keys():
        got = ", ".join(map(str, value)) if isinstance(value, Mapping) else type(value).__name__
        raise EstimateError(f"expected detections as a mapping with boxes, classes and scores, got {got[:80]}")
    boxes = np.asarray(value["boxes"], np.float64).reshape(-1, 4)
    classes, scores = tuple(str(name) for name in value["classes"]), np.asarray(value["scores"], np.float64).reshape(-1)
    if not len(boxes) == len(classes) == len(scores):
        raise EstimateError(f"expected as many boxes as classes and scores, got {len(boxes)}, {len(classes)} and {len(scores)}")
    return BoxList(classes, scores, boxes, ("",) * len(boxes))


_RETURNED: dict[str, Callable[[str, Any, int], Any]] = {"poses": _pose, "points": _points, "detections": _boxes, "instance": _instances}
"""Task -> how what is returned for it is taken; images otherwise."""


def _tried(read: Callable[..., Reading], *values: Any) -> Reading | EstimateError:
    try:
        return read(*values)
    except EstimateError as error:
        return error
    except (TypeError, ValueError) as error:  # numpy's, for what an algorithm returns in place of numbers
        return EstimateError(f"expected an estimate as an array of numbers ({' '.join(str(error).split())[:120]})")
