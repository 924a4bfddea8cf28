"""Average precision from matches, as COCO counts it (Lin et al., ECCV 2014; cocodataset.org, "Detection evaluation").

For each class and IoU threshold the estimates of all frames are put in order of their score; after each, precision is the share of right
ones so far and recall their share of the true objects.  Precision is made to fall with recall, and AP is its mean at the recalls 0, 0.01,
..., 1; ap is the mean of AP over the classes that the truth has and over the thresholds 0.5, 0.55, ..., 0.95.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.core.kernel import entry
from evaluation.core.sums import merge_sums, stack
from evaluation.core.task import Metric

IOU_THRESHOLDS: NDArray[np.float64] = np.linspace(0.5, 0.95, 10)
_RECALLS: NDArray[np.float64] = np.linspace(0.0, 1.0, 101)
_COCO = "Lin et al., ECCV 2014"
METRICS = (
    Metric(name="ap", better="higher", source=_COCO),
    Metric(name="ap50", better="higher", source=_COCO),
    Metric(name="ap75", better="higher", source=_COCO),
)
WRONG, RIGHT, IGNORED = 0, 1, 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Matches:
    """Which estimates of some frames are right.

    Attributes:
        scores: (n,) float64, higher is surer.
        classes: (n,) int64 estimated class ids.
        outcomes: (10, n) uint8 by IoU threshold: ``RIGHT``, ``WRONG``, or ``IGNORED`` where it counts as neither.
        truths: (classes,) float64, how many true objects each class has.
    """

    scores: NDArray[np.float64]
    classes: NDArray[np.int64]
    outcomes: NDArray[np.uint8]
    truths: NDArray[np.float64]


def merge_matches(tallies: Sequence[Matches]) -> Matches:
    """Return the matches of all these frames."""
    return Matches(
        scores=np.concatenate([tally.scores for tally in tallies]),
        classes=np.concatenate([tally.classes for tally in tallies]),
        outcomes=np.concatenate([tally.outcomes for tally in tallies], axis=1),
        truths=merge_sums([tally.truths for tally in tallies]),
    )


def average_precision(tallies: Sequence[Matches], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (draws, 3) ap, ap50 and ap75 for (draws, tallies) weights; NaN without a true object."""
    together = merge_matches(tallies)
    owners = np.repeat(np.arange(len(tallies)), [len(tally.scores) for tally in tallies])
    weights = np.array(weights)  # numba compiles once more for read-only ones
    truths = weights @ stack([tally.truths for tally in tallies])
    precisions = np.full((len(weights), truths.shape[1], len(IOU_THRESHOLDS)), np.nan)
    for label in np.flatnonzero(truths.any(axis=0)):
        of_class = np.flatnonzero(together.classes == label)
        order = of_class[np.argsort(-together.scores[of_class], kind="stable")]
        _interpolated(together.outcomes[:, order], owners[order], weights, truths[:, label], _RECALLS, precisions[:, label])
    known = ~np.isnan(precisions)
    with np.errstate(invalid="ignore"):
        mean = np.where(known, precisions, 0.0).sum(axis=1) / known.sum(axis=1)
    columns: NDArray[np.float64] = np.column_stack([mean.mean(axis=1), mean[:, 0], mean[:, 5]])
    return columns


@entry
def _interpolated(outcomes, owners, weights, truths, recalls, precisions):  # type: ignore[no-untyped-def]
    """Fill (draws, thresholds) with the AP of one class, whose estimates are in order; a draw without a true object keeps its NaN."""
    count = owners.size
    precision, recall = np.empty(count), np.empty(count)
    for draw in range(weights.shape[0]):
        if truths[draw] <= 0.0:
            continue
        for threshold in range(outcomes.shape[0]):
            right, wrong = 0.0, 0.0
            for i in range(count):
                weight = weights[draw, owners[i]]
                outcome = outcomes[threshold, i]
                right += weight * (outcome == 1)
                wrong += weight * (outcome == 0)
                recall[i] = right / truths[draw]
                precision[i] = right / (right + wrong) if right + wrong > 0.0 else 0.0
            for i in range(count - 1, 0, -1):
                precision[i - 1] = max(precision[i - 1], precision[i])
            total, i = 0.0, 0
            for level in recalls:
                while i < count and recall[i] < level:
                    i += 1
                if i == count:
                    break
                total += precision[i]
            precisions[draw, threshold] = total / recalls.size
