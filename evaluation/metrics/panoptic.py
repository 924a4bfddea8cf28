"""Panoptic quality of objects, as in Kirillov et al. (CVPR 2019).

A true and an estimated object of one class match where their IoU is above 0.5; each has at most one such partner.  Of each class, with TP
matches, FP estimates and FN objects left over: SQ = mean IoU of the matches, RQ = TP / (TP + FP / 2 + FN / 2), PQ = SQ RQ.  All three are
means over the classes that have any object or estimate.  Only objects count, not the room's shell: the paper's "things".
"""

import numpy as np
from numpy.typing import NDArray

from evaluation.core.sums import Sums
from evaluation.core.task import Metric

_KIRILLOV = "Kirillov et al., CVPR 2019"
METRICS = (
    Metric(name="pq", better="higher", source=_KIRILLOV),
    Metric(name="sq", better="higher", source=_KIRILLOV),
    Metric(name="rq", better="higher", source=_KIRILLOV),
)
COUNTS = 4
"""Numbers that a class has: matches, estimates left over, true objects left over, sum of the matches' IoU."""


def segment_matches(
    truth: NDArray[np.int64], estimate: NDArray[np.int64], true_classes: NDArray[np.int64], classes: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Match the segments of two images.

    Args:
        truth: (pixels,) number of the true object from 1 on, 0 for none, -1 for void: what the truth says nothing of.
        estimate: (pixels,) number of the estimated object from 1 on, 0 for none.
        true_classes: (n,) class of each true object.
        classes: (m,) class of each estimated object.

    Returns:
        (n,) number of the estimate from 1 on that each true object matches, 0 for none; (n,) IoU of the match; (m,) whether the estimate
        counts: one that lies in void by more than a half does not, if it matches nothing.
    """
    n, m = len(true_classes), len(classes)
    overlap = np.bincount((truth + 1) * (m + 1) + estimate, minlength=(n + 2) * (m + 1)).reshape(n + 2, m + 1)
    void, both = overlap[0, 1:], overlap[2:, 1:]
    sizes = overlap[:, 1:].sum(axis=0)
    union = overlap[2:].sum(axis=1)[:, None] + (sizes - void) - both
    iou = np.where(true_classes[:, None] == classes, both / np.maximum(union, 1), 0.0)
    partner = np.zeros(n, np.int64)
    quality = np.zeros(n)
    if m:
        best = iou.argmax(axis=1)
        quality = iou[np.arange(n), best]
        partner = np.where(quality > 0.5, best + 1, 0)
        quality = np.where(partner > 0, quality, 0.0)
    counts = (void <= 0.5 * sizes) & (sizes > 0)
    counts[partner[partner > 0] - 1] = True
    return partner, quality, counts


def panoptic_quality(counts: Sums) -> Sums:
    """Return (draws, 3) pq, sq and rq of (draws, classes * COUNTS) sums; NaN without any object or estimate."""
    right, wrong, missed, iou = np.moveaxis(counts.reshape(len(counts), -1, COUNTS), 2, 0)
    size = right + 0.5 * wrong + 0.5 * missed
    there = size > 0
    sq = np.divide(iou, right, out=np.zeros_like(iou), where=right > 0)
    rq = np.divide(right, size, out=np.zeros_like(iou), where=there)
    columns = [(values * there).sum(axis=1) / there.sum(axis=1) for values in (sq * rq, sq, rq)]
    return np.column_stack(columns)
