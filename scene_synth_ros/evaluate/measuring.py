"""What :mod:`evaluation` measures, made of readings of messages: the layers of truth that a task needs, and its estimate."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evaluation.core.task import Measurement
from evaluation.metrics.detections import Boxes
from evaluation.metrics.instance import Instances
from evaluation.metrics.poses import trajectory_of
from evaluation.tasks import TASKS
from scene_description import CameraPose
from scene_description.strict import whole_number
from scene_synth_ros.evaluate.errors import EstimateError, EvaluateError
from scene_synth_ros.evaluate.readings import BoxList, Reading
from scene_synth_ros.evaluate.task_streams import TASK_STREAMS, check_pair, read_for_task
from scene_synth_ros.evaluate.topics import TypedTopic
from scene_synth_ros.messages.stamps import CdrBytes

GROUP_LAYERS = ("semantic", "depth")
"""Layers of truth by which pixels are grouped, by class and by distance, where they are there."""

Estimates = Mapping[str, Reading | EstimateError]
"""Task -> its estimate, or why there is none that can be measured; a task without any estimate of the frame is left out."""


def needed_layers(tasks: Sequence[str]) -> tuple[str, ...]:
    """Return the layers of truth without which these tasks cannot be judged."""
    return tuple(dict.fromkeys(layer for task in tasks for layer in (TASK_STREAMS[task].name, *TASKS[task].truth) if layer in TASK_STREAMS))


def layers_beside(tasks: Sequence[str]) -> tuple[str, ...]:
    """Return the layers of truth that are used where they are there: what groups pixels, and what else says more of these tasks."""
    return tuple(dict.fromkeys((*(layer for task in tasks for layer in TASKS[task].beside), *GROUP_LAYERS)))


class TruthFrame:
    """The truth of a frame; each layer is read once, when it is asked for first.

    ``class_ids``: name of a class -> its id, by which detections of named classes are understood.
    """

    def __init__(
        self, topics: Mapping[str, TypedTopic], messages: Mapping[str, CdrBytes], where: str, class_ids: Mapping[str, int] | None = None
    ) -> None:
        self._topics, self._messages, self._where = topics, messages, where
        self.class_ids = class_ids or {}
        self._readings: dict[str, Reading] = {}

    def layer(self, name: str) -> Reading | None:
        """Return a layer; None where the frame has none.

        Raises:
            EvaluateError: its message cannot be read.
        """
        topic = self._topics.get(name)
        if topic is None or topic.name not in self._messages:
            return None
        if name not in self._readings:
            try:
                self._readings[name] = read_for_task(name, topic.type_name, self._messages[topic.name], topic.name)
            except EstimateError as error:
                raise EvaluateError(f"{self._where}: truth on {topic.name}: {error}") from None
        return self._readings[name]

    def of_task(self, task: str) -> Reading:
        """Return what a task's estimates are laid over.

        Raises:
            EvaluateError: the frame has none, or it cannot be read.
        """
        reading = self.layer(TASK_STREAMS[task].name)
        if reading is None:
            raise EvaluateError(f"{self._where}: expected truth of {task}, got none")
        return reading

    def says_nothing(self, task: str) -> bool:
        """Return whether the truth of a task is an image without any finite number, as flow is where the path ends.

        One that cannot be read may say something: that is told where it is measured.
        """
        try:
            reading = self.layer(TASK_STREAMS[task].name) if TASK_STREAMS[task].encoding else None
        except EvaluateError:
            return False
        return reading is not None and not np.isfinite(reading.value).any()

    def layers(self, task: str) -> dict[str, Any]:
        """Return what ``measure`` of a task takes: layer -> value of what the task needs, and of what groups pixels.

        Raises:
            EvaluateError: a layer cannot be read.
        """
        found: dict[str, Any] = {}
        for name in (*needed_layers([task]), *layers_beside([task])):
            reading = self.layer(name)
            if reading is not None:
                found |= _TRUTH_FORMS.get(name, lambda reading, _, name=name: {name: reading.value})(reading, self.class_ids)
        return found


def measure_frame(task: str, truth: TruthFrame, estimates: Estimates) -> Measurement:
    """Return the measurement of a frame.

    Where classes are estimated too, objects of an image of ids have those.

    Raises:
        EstimateError, EvaluationError: the estimate cannot be laid over the truth.
        EvaluateError: the truth cannot be read.
    """
    estimate = estimates[task]
    if isinstance(estimate, EstimateError):
        raise estimate
    check_pair(task, truth.of_task(task), estimate)
    form, value = _ESTIMATE_FORMS.get(TASK_STREAMS[task].name), estimate.value
    return TASKS[task].measure(truth.layers(task), value if form is None else form(value, estimates, truth.class_ids))


def measure_room(task: str, truth: Sequence[CameraPose], estimate: Sequence[CameraPose]) -> Measurement | None:
    """Return the measurement of a room's trajectory; None without any estimate.

    Poses that say nothing, as of a tracker that is lost (numbers that are not finite, a quaternion of zeros), count as none.

    Raises:
        EvaluationError: the trajectories cannot be compared.
    """
    known = [pose for pose in estimate if np.isfinite([*pose.position_m, *pose.orientation]).all() and any(pose.orientation)]
    return TASKS[task].measure({TASK_STREAMS[task].name: trajectory_of(truth)}, trajectory_of(known)) if known else None


def _boxes(found: BoxList, class_ids: Mapping[str, int], *, truth: bool) -> Boxes:
    classes = [class_ids.get(name, -1) if (number := whole_number(name)) is None else number for name in found.class_ids]
    if -1 in classes:
        got = found.class_ids[classes.index(-1)]
        raise EstimateError(f"expected the class of a detection as an id such as '5', or as a name of the labels, got '{got[:40]}'")
    scores = np.ones(len(classes)) if truth else found.scores
    return Boxes(
        boxes_px=found.boxes,
        classes=np.array(classes, np.int64),
        scores=scores,
        distances_m=found.distances_m if truth else None,
    )


def _instances(value: Any, estimates: Estimates, _: Mapping[str, int]) -> Any:
    semantic = estimates.get("semantic")
    classes: NDArray[Any] | None = semantic.value if isinstance(semantic, Reading) else None
    if isinstance(value, Instances) or classes is None or classes.shape != value.shape:
        return value
    return Instances.from_images(value, semantic=classes)


def _cloud_truth(reading: Reading, _: Mapping[str, int]) -> dict[str, Any]:
    classes = {} if reading.value.labels is None else {"point_classes": reading.value.labels}
    return {"points": reading.value.points, **classes}


_TRUTH_FORMS: dict[str, Callable[[Reading, Mapping[str, int]], dict[str, Any]]] = {
    "points": _cloud_truth,
    "detections": lambda reading, class_ids: {"detections": _boxes(reading.value, class_ids, truth=True)},
}
"""Layer -> what of it ``measure`` takes, where that is not its array."""

_ESTIMATE_FORMS: dict[str, Callable[[Any, Estimates, Mapping[str, int]], Any]] = {
    "points": lambda value, *_: value.points,
    "detections": lambda value, _, class_ids: _boxes(value, class_ids, truth=False),
    "instance": _instances,
}
"""Name of a stream -> what of an estimate ``measure`` takes, where that is not its array."""
