"""Objects by their boxes: average precision of COCO, of the detections of a frame.

Coverage is the share of true boxes that an estimated box of their class matches at IoU 0.5, the recall.  The distance of a box, where the
truth has the layer "depth" but the boxes tell none, is the median of the true depth in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.core.errors import EvaluationError
from evaluation.core.groups import distance_bins, image
from evaluation.core.task import Measurement, Metric, Tallying, Task, Truth
from evaluation.metrics import matches
from evaluation.metrics.coco_matching import Shapes, match
from evaluation.metrics.matches import RIGHT, Matches, average_precision, merge_matches

METRICS = (*matches.METRICS, Metric(name="coverage", better="higher"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Detections of a frame, true or estimated.

    Attributes:
        boxes_px: (n, 4) left, top, width, height in image coordinates, px.
        classes: (n,) class ids, from 1 on.
        scores: (n,) higher is surer; all equally sure if None.
        distances_m: (n,) along the optical axis, if known.
    """

    boxes_px: NDArray[np.float64]
    classes: NDArray[np.int64]
    scores: NDArray[np.float64] | None = None
    distances_m: NDArray[np.float64] | None = None


def _shapes(given: object, whose: str, truth: Truth) -> Shapes:
    if not isinstance(given, Boxes):
        raise EvaluationError(f"{whose} of detections: expected Boxes, got {type(given).__name__}")
    boxes = np.asarray(given.boxes_px, np.float64).reshape(-1, 4) if np.size(given.boxes_px) % 4 == 0 else np.zeros((0, 0))
    count = len(boxes)
    classes = np.asarray(given.classes, np.int64)
    scores = np.ones(count) if given.scores is None else np.asarray(given.scores, np.float64)
    distances = None if given.distances_m is None else np.asarray(given.distances_m, np.float64)
    for name, values in (("classes", classes), ("scores", scores), ("distances", distances)):
        if values is not None and values.shape != (count,):
            raise EvaluationError(f"{whose} of detections: expected {count} {name}, one a box of four numbers, got shape {values.shape}")
    if not (np.isfinite(boxes).all() and np.isfinite(scores).all() and (boxes.reshape(-1, 4)[:, 2:] >= 0).all()):
        raise EvaluationError(f"{whose} of detections: expected finite boxes and scores, no width or height below 0, got others")
    if ((classes < 1) | (classes > 65535)).any():
        raise EvaluationError(f"{whose} of detections: expected class ids from 1 to 65535, got others")
    if distances is None and truth.get("depth") is not None:
        distances = _distances(boxes, image(truth["depth"], "depth", "truth"))
    return Shapes(shapes=boxes, classes=classes, scores=scores, bins=None if distances is None else distance_bins(distances))


def _distances(boxes: NDArray[np.float64], depth: NDArray[np.floating]) -> NDArray[np.float64]:
    found = np.full(len(boxes), np.inf)
    for i, (left, top, width, height) in enumerate(boxes):
        rows = slice(int(max(np.floor(top), 0)), int(max(np.ceil(top + height), 0)))
        columns = slice(int(max(np.floor(left), 0)), int(max(np.ceil(left + width), 0)))
        inside = depth[rows, columns]
        known = inside[np.isfinite(inside) & (inside > 0)]
        if known.size:
            found[i] = np.median(known)
    return found


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one frame."""
    if truth.get("detections") is None:
        raise EvaluationError("truth of detections: expected the boxes of the frame's objects, got none; record them (streams.annotations)")
    true, found = _shapes(truth["detections"], "truth", truth), _shapes(estimate, "estimate", truth)
    frame = match(true, found, "bbox")
    return Measurement(whole=frame.whole, by_class=frame.by_class, by_distance=frame.by_distance)


def _finish(tallies: Sequence[Matches], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    right = np.array([np.count_nonzero(tally.outcomes[0] == RIGHT) for tally in tallies], np.float64)
    truths = np.array([tally.truths.sum() for tally in tallies])
    with np.errstate(divide="ignore", invalid="ignore"):
        coverage = (weights @ right) / (weights @ truths)
    return np.column_stack([average_precision(tallies, weights), coverage])


DETECTIONS = Task(
    name="detections",
    truth=("detections",),
    estimate="Boxes with classes and scores",
    metrics=METRICS,
    measure=_measure,
    tallying=Tallying(merge=merge_matches, finish=_finish),
)
