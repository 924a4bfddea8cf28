"""Optical flow: end-point error and KITTI's share of outliers.

EPE is the mean length of estimate - truth in pixels (Otte and Nagel, ECCV 1994; Baker et al., IJCV 2011).  Fl is the share of valid pixels
whose error is above 3 px and above 5 % of the true flow's length (Menze and Geiger, CVPR 2015, KITTI 2015).

A pixel is valid where truth and estimate are finite.  Coverage: of the pixels with a valid truth, the share whose estimate is valid too.
KITTI fills such holes before it counts; here they count in coverage alone.
"""

from __future__ import annotations

import numpy as np

from evaluation.core.groups import image, layer, measurement_of, pixel_groups
from evaluation.core.kernel import entry
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth

METRICS = (
    Metric(name="epe", unit="px", source="Baker et al., IJCV 2011"),
    Metric(name="fl", source="Menze and Geiger, CVPR 2015"),
    Metric(name="coverage", better="higher"),
)
_TRUE, _BOTH = 0, 1
_SUMS = 4


@entry
def _tabulate(truth, estimate, cells, table):  # type: ignore[no-untyped-def]
    """Add the terms of every pixel to its cell; flows are (pixels, 2) float64, px."""
    for pixel in range(cells.size):
        tx, ty = truth[pixel]
        if not (np.isfinite(tx) and np.isfinite(ty)):
            continue
        row = table[cells[pixel]]
        row[0] += 1.0
        ex, ey = estimate[pixel]
        if not (np.isfinite(ex) and np.isfinite(ey)):
            continue
        error = np.hypot(ex - tx, ey - ty)
        row[1] += 1.0
        row[2] += error
        row[3] += error > 3.0 and error > 0.05 * np.hypot(tx, ty)


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one frame."""
    true = layer(truth, "flow", "flow", channels=2)
    shape = true.shape[:2]
    guess = image(estimate, "flow", "estimate", shape, channels=2)
    groups = pixel_groups(truth, shape)
    table = np.zeros((groups.rows, _SUMS))
    _tabulate(true.astype(np.float64).reshape(-1, 2), guess.astype(np.float64).reshape(-1, 2), groups.cells, table)
    return measurement_of(table)


def _formula(sums: Sums) -> Sums:
    both = sums[:, _BOTH]
    return np.column_stack([sums[:, 2] / both, sums[:, 3] / both, both / sums[:, _TRUE]])


FLOW = Task(
    name="flow",
    truth=("flow",),
    estimate="(h, w, 2) motion to the next frame, px, right and down; not finite where unknown",
    metrics=METRICS,
    measure=_measure,
    tallying=sums_tallying(_formula),
)
