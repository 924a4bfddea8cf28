"""Objects by their pixels: average precision of masks and panoptic quality, of the objects of a frame.

True objects are the ids of the layer "instance"; the class of one is the most frequent class of its pixels in the layer "semantic".  Id 0,
objects without a class, and the room's shell are no objects.  Void, for panoptic quality, is where neither layer says anything.  Coverage
is the share of the objects' pixels that any estimated object has.

The distance of an object is the median of the true depth of its pixels.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.core.errors import EvaluationError
from evaluation.core.groups import VOID, distance_bins, image, layer
from evaluation.core.sums import Sums, merge_sums, stack
from evaluation.core.task import Measurement, Metric, Tallying, Task, Truth
from evaluation.metrics import matches, panoptic
from evaluation.metrics.coco_matching import Shapes, match
from evaluation.metrics.matches import Matches, average_precision, merge_matches

METRICS = (*matches.METRICS, *panoptic.METRICS, Metric(name="coverage", better="higher"))
ANY_CLASS = 1
"""Class of all objects where the estimate tells none."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Instances:
    """Objects that an algorithm found in a frame.

    Attributes:
        masks: (n, h, w) bool; where they overlap, the surer has the pixel for panoptic quality.
        classes: (n,) class ids, from 1 on; None if the algorithm tells none: then the truth's classes do not count either.
        scores: (n,) higher is surer; all equally sure if None.
    """

    masks: NDArray[np.bool_]
    classes: NDArray[np.int64] | None = None
    scores: NDArray[np.float64] | None = None

    @classmethod
    def from_images(cls, ids: object, semantic: object | None = None, scores: Mapping[int, float] | None = None) -> "Instances":
        """Return the objects of an image of ids.

        Args:
            ids: (h, w) integers, 0 for none.
            semantic: (h, w) class ids; the class of an object is the most frequent of its pixels, void left out.
            scores: id -> score; 1 for ids that it lacks.
        """
        pixels = image(ids, "instance", "estimate")
        numbers = _numbers(pixels, "estimate")
        masks = pixels == numbers[:, None, None]
        classes = None if semantic is None else _classes(masks, image(semantic, "semantic", "estimate", pixels.shape))
        values = np.array([(scores or {}).get(int(number), 1.0) for number in numbers], np.float64)
        return cls(masks=masks, classes=classes, scores=values)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InstanceTally:
    """What is kept: the matches of masks, and sums: true pixels, those covered, then the counts of panoptic quality by class."""

    matches: Matches
    sums: Sums


def _numbers(ids: NDArray[np.integer], whose: str) -> NDArray[np.int64]:
    if not np.issubdtype(ids.dtype, np.integer):
        raise EvaluationError(f"{whose} of instance: expected object ids as integers, got {ids.dtype}")
    numbers = np.unique(ids).astype(np.int64)
    there: NDArray[np.int64] = numbers[numbers != 0]
    return there


def _classes(masks: NDArray[np.bool_], semantic: NDArray[np.integer]) -> NDArray[np.int64]:
    found = np.zeros(len(masks), np.int64)
    for i, mask in enumerate(masks):
        counts = np.bincount(semantic[mask])
        counts[:1] = 0
        found[i] = counts.argmax() if len(counts) else VOID
    return found


def _bins(masks: NDArray[np.bool_], truth: Truth) -> NDArray[np.uint8] | None:
    if truth.get("depth") is None:
        return None
    depth = image(truth["depth"], "depth", "truth", masks.shape[1:])
    known = np.isfinite(depth) & (depth > 0)
    medians = [np.median(depth[mask & known]) if (mask & known).any() else np.inf for mask in masks]
    return distance_bins(np.array(medians, np.float64))


def _checked(estimate: object, shape: tuple[int, ...]) -> Instances:
    given = estimate if isinstance(estimate, Instances) else Instances.from_images(image(estimate, "instance", "estimate", shape))
    masks = np.asarray(given.masks)
    if masks.dtype != np.bool_ or masks.shape[1:] != shape:
        expected = ", ".join(map(str, ("objects", *shape)))
        raise EvaluationError(f"estimate of instance: expected masks of shape ({expected}) and type bool, got {masks.shape} {masks.dtype}")
    scores = np.ones(len(masks)) if given.scores is None else np.asarray(given.scores, np.float64)
    classes = None if given.classes is None else np.asarray(given.classes, np.int64)
    for name, values in (("scores", scores), ("classes", scores if classes is None else classes)):
        if values.shape != (len(masks),):
            raise EvaluationError(f"estimate of instance: expected {len(masks)} {name}, one a mask, got {values.shape}")
    if not np.isfinite(scores).all() or (classes is not None and ((classes < 0) | (classes > 65535)).any()):
        raise EvaluationError("estimate of instance: expected finite scores and class ids from 0 to 65535, got others")
    there = masks.any(axis=(1, 2)) & (True if classes is None else classes != VOID)
    return Instances(masks=masks[there], classes=None if classes is None else classes[there], scores=scores[there])


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one frame."""
    ids = layer(truth, "instance", "instance")
    given = _checked(estimate, ids.shape)
    scores = given.scores if given.scores is not None else np.ones(len(given.masks))
    numbers = _numbers(ids, "truth")
    masks = ids == numbers[:, None, None]
    semantic = None if truth.get("semantic") is None else image(truth["semantic"], "semantic", "truth", ids.shape)
    if given.classes is None or semantic is None:
        true_classes, classes = np.full(len(masks), ANY_CLASS), np.full(len(given.masks), ANY_CLASS)
    else:
        true_classes, classes = _classes(masks, semantic), given.classes
        masks, true_classes = masks[true_classes != VOID], true_classes[true_classes != VOID]
    true = Shapes(shapes=masks, classes=true_classes, scores=np.ones(len(masks)), bins=_bins(masks, truth))
    found = Shapes(shapes=given.masks, classes=classes, scores=scores, bins=_bins(given.masks, truth))
    void = np.zeros(ids.shape, np.bool_) if semantic is None else (ids == 0) & (semantic == VOID)
    frame = match(true, found, "segm")
    sums = _Sums(true, found, void)
    whole = InstanceTally(matches=frame.whole, sums=sums.of(np.ones(len(masks), np.bool_), np.ones(len(classes), np.bool_)))
    by_class = {}
    for key, part in frame.by_class.items() if given.classes is not None and semantic is not None else ():
        by_class[key] = InstanceTally(matches=part, sums=sums.of(true_classes == key, classes == key))
    by_distance = {}
    if true.bins is not None and found.bins is not None:
        for key, part in frame.by_distance.items():
            by_distance[key] = InstanceTally(matches=part, sums=sums.of(true.bins == key, found.bins == key))
    return Measurement(whole=whole, by_class=by_class, by_distance=by_distance)


class _Sums:
    """The sums of one frame, and of chosen objects of it."""

    def __init__(self, truth: Shapes, estimate: Shapes, void: NDArray[np.bool_]) -> None:
        self._truth, self._estimate = truth, estimate
        self._pixels = truth.shapes.sum(axis=(1, 2))
        self._covered = (truth.shapes & estimate.shapes.any(axis=0)).sum(axis=(1, 2))
        true_ids, ids = _painted(truth), _painted(estimate)
        true_ids[void & (true_ids == 0)] = -1
        self._partner, self._iou, self._counts = panoptic.segment_matches(true_ids.ravel(), ids.ravel(), truth.classes, estimate.classes)

    def of(self, true: NDArray[np.bool_], estimated: NDArray[np.bool_]) -> Sums:
        """Return the sums of the chosen true objects, and of those of the chosen estimates that match nothing."""
        matched = true & (self._partner > 0)
        free = estimated & self._counts
        free[self._partner[self._partner > 0] - 1] = False
        of_true, of_free = self._truth.classes, self._estimate.classes[free]
        size = 1 + max([0, *of_true[true].tolist(), *of_free.tolist()])
        columns = [
            np.bincount(of_true[matched], minlength=size),
            np.bincount(of_free, minlength=size),
            np.bincount(of_true[true & ~matched], minlength=size),
            np.bincount(of_true[matched], self._iou[matched], minlength=size),
        ]
        table = np.column_stack(columns).astype(np.float64)
        return np.concatenate([[self._pixels[true].sum(), self._covered[true].sum()], table.ravel()])


def _painted(objects: Shapes) -> NDArray[np.int64]:
    """Return (h, w) the number of the object from 1 on, the surest where several have a pixel."""
    numbers = np.zeros(objects.shapes.shape[1:], np.int64)
    for i in np.argsort(objects.scores, kind="stable"):
        numbers[objects.shapes[i]] = i + 1
    return numbers


def _merge(tallies: Sequence[InstanceTally]) -> InstanceTally:
    return InstanceTally(matches=merge_matches([tally.matches for tally in tallies]), sums=merge_sums([tally.sums for tally in tallies]))


def _finish(tallies: Sequence[InstanceTally], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    sums = weights @ stack([tally.sums for tally in tallies])
    with np.errstate(divide="ignore", invalid="ignore"):
        quality = panoptic.panoptic_quality(sums[:, 2:])
        coverage = sums[:, 1] / sums[:, 0]
    return np.column_stack([average_precision([tally.matches for tally in tallies], weights), quality, coverage])


INSTANCE = Task(
    name="instance",
    truth=("instance",),
    estimate="Instances: masks with classes and scores; or (h, w) object ids as integers, 0 for none, whose classes do not count",
    metrics=METRICS,
    measure=_measure,
    tallying=Tallying(merge=_merge, finish=_finish),
)
