"""Whether estimates of flow answer another question than was asked: of the other neighbour, the stamp before, with the sign turned."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.evaluate.measuring import Estimates, TruthFrame
from scene_synth_ros.evaluate.readings import Reading

_OTHER = {"flow": "flow_backward", "flow_backward": "flow"}
_TOWARD = {"flow": "the next frame", "flow_backward": "the frame before"}
_LEAST_PX = 0.25
"""Mean error from which a direction is questioned."""
_CLEARLY = 0.5
"""Another motion is meant where the estimates are nearer to it by this factor."""


class FlowDirections:
    """Compares estimates of flow with the truth and with what they may be mistaken for, over the frames of a bag or of a run.

    ``layers``: of the truth, which are read where they are there.
    """

    def __init__(self, tasks: Sequence[str]) -> None:
        self._sums: dict[str, dict[str, NDArray[np.float64]]] = {task: {} for task in tasks if task in _OTHER}
        self._before: dict[str, NDArray[Any]] = {}
        self.layers = tuple(_OTHER[task] for task in self._sums)

    def add(self, task: str, truth: TruthFrame, estimates: Estimates) -> None:
        """Take a frame that was measured; of other tasks than those of flow nothing.

        Raises:
            EvaluateError: a layer of the truth cannot be read.
        """
        estimate = estimates.get(task)
        if task not in self._sums or not isinstance(estimate, Reading):
            return
        true = truth.of_task(task).value
        for other, motion in self._others(task, true, truth):
            if motion.shape != true.shape:
                continue
            errors = [np.linalg.norm(estimate.value - flow, axis=2) for flow in (true, motion)]
            known = np.isfinite(errors[0]) & np.isfinite(errors[1])
            terms = np.array([np.count_nonzero(known), *(error[known].sum(dtype=np.float64) for error in errors)])
            self._sums[task][other] = self._sums[task].get(other, np.zeros(3)) + terms
        self._before[task] = true

    def _others(self, task: str, true: NDArray[Any], truth: TruthFrame) -> Iterator[tuple[str, NDArray[Any]]]:
        other = truth.layer(_OTHER[task])
        if other is not None:
            yield "other", other.value
        if task in self._before:
            yield "before", self._before[task]
        yield "turned", -true

    def lines(self) -> list[str]:
        """Return a sentence for each task whose estimates are far nearer to another motion than to the one that was asked for."""
        return [line for task, sums in self._sums.items() for line in self._line(task, sums)]

    def _line(self, task: str, sums: Mapping[str, NDArray[np.float64]]) -> Iterator[str]:
        errors = {name: (right / count, other / count) for name, (count, right, other) in sums.items() if count > 0}
        nearest = min(errors, key=lambda name: errors[name][1], default="")
        if nearest and errors[nearest][0] > _LEAST_PX and errors[nearest][1] < _CLEARLY * errors[nearest][0]:
            toward, other, opposite = _TOWARD[task], _OTHER[task], _TOWARD[_OTHER[task]]
            meant = {
                "other": f"the motion to {opposite}, the truth of {other}; judge them with --task {other}, or swap the two images",
                "before": f"the motion at the stamp before; give each estimate the stamp of the image whose pixels it is of, {task} being "
                f"their motion to {toward}",
                "turned": f"the motion with its sign turned; {task} is where a pixel is in {toward} less where it is in this one, and the "
                f"motion to {opposite} is judged as {other}",
            }
            yield f"{task}: expected the motion to {toward}, got estimates that are far nearer to {meant[nearest]}"
