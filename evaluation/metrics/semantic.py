"""Semantic classes: pixel accuracy, mean class accuracy and mean IoU, as in Long, Shelhamer and Darrell (CVPR 2015).

Over all frames, n_cc are the pixels of class c that are estimated as c, t_c all pixels of class c, and e_c all that are estimated as c:
pixel accuracy = sum n_cc / sum t_c, mean accuracy = mean n_cc / t_c, mean IoU = mean n_cc / (t_c + e_c - n_cc).  Means go over the classes
that the truth has.  In the part of one class they are that class's accuracy and IoU.

Pixels whose true class is void (0) are left out.  An estimate of 0 where the truth has a class is a wrong one, and counts against coverage:
the share of pixels with a true class whose estimate is not 0.
"""

import numpy as np

from evaluation.core.groups import NO_BIN, VOID, class_count, distance_bins, image, layer
from evaluation.core.kernel import entry
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth

_LONG = "Long et al., CVPR 2015"
METRICS = (
    Metric(name="pixel_accuracy", better="higher", source=_LONG),
    Metric(name="mean_accuracy", better="higher", source=_LONG),
    Metric(name="miou", better="higher", source=_LONG),
    Metric(name="coverage", better="higher"),
)
_TRUE, _ESTIMATED, _RIGHT, _UNKNOWN = 0, 1, 2, 3
_COUNTS = 4
"""Numbers of a class: its pixels, those estimated as it, those of both, and those of its pixels that are estimated as nothing."""


@entry
def _tabulate(truth, estimate, bins, table):  # type: ignore[no-untyped-def]
    """Count pixels by bin and class; ids are below the number of classes."""
    for pixel in range(truth.size):
        true, guess, counts = truth[pixel], estimate[pixel], table[bins[pixel]]
        if true != 0:
            counts[true, 0] += 1.0
            counts[guess, 1] += 1.0
            counts[true, 2] += true == guess
            counts[true, 3] += guess == 0


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one frame."""
    true = layer(truth, "semantic", "semantic")
    guess = image(estimate, "semantic", "estimate", true.shape)
    classes = max(class_count(true, "truth"), class_count(guess, "estimate"))
    depth = truth.get("depth")
    bins = np.full(true.shape, NO_BIN, np.uint8) if depth is None else distance_bins(image(depth, "depth", "truth", true.shape))
    table = np.zeros((NO_BIN + 1, classes, _COUNTS))
    _tabulate(true.astype(np.int32).ravel(), guess.astype(np.int32).ravel(), bins.ravel(), table)
    whole = table.sum(axis=0)
    # The part of one class has it alone, behind void.
    nothing = np.zeros(_COUNTS)
    by_class = {int(key): np.concatenate([nothing, whole[key]]) for key in np.flatnonzero(whole[:, _TRUE])}
    by_distance = {key: counts.ravel() for key, counts in enumerate(table[:NO_BIN]) if counts[:, _TRUE].any()}
    return Measurement(whole=whole.ravel(), by_class=by_class, by_distance=by_distance)


def _formula(sums: Sums) -> Sums:
    counts = sums.reshape(len(sums), -1, _COUNTS)
    counts = counts[:, VOID + 1 :]
    true, estimated, right, unknown = np.moveaxis(counts, 2, 0)
    known = true > 0
    classes = known.sum(axis=1)
    total = true.sum(axis=1)
    accuracy = np.divide(right, true, out=np.zeros_like(true), where=known)
    iou = np.divide(right, true + estimated - right, out=np.zeros_like(true), where=known)
    columns = [right.sum(axis=1) / total, accuracy.sum(axis=1) / classes, iou.sum(axis=1) / classes, 1.0 - unknown.sum(axis=1) / total]
    return np.column_stack(columns)


SEMANTIC = Task(
    name="semantic",
    truth=("semantic",),
    estimate="(h, w) class ids as integers; 0 where unknown",
    metrics=METRICS,
    measure=_measure,
    tallying=sums_tallying(_formula),
)
