"""Optical flow to the next frame, or to the frame before: end-point error and KITTI's share of outliers.

EPE is the mean length of estimate - truth in pixels (Otte and Nagel, ECCV 1994; Baker et al., IJCV 2011).  Fl is the share of valid pixels
whose error is above 3 px and above 5 % of the true flow's length (Menze and Geiger, CVPR 2015, KITTI 2015).  ``epe_noc`` and ``fl_noc`` are
the same over the pixels that the other frame shows too, KITTI's non-occluded ones; undefined without the layer of occlusion.

A pixel is valid where truth and estimate are finite.  Coverage: of the pixels with a valid truth, the share whose estimate is valid too.
KITTI fills such holes before it counts; here they count in coverage alone.
"""

import numpy as np

from evaluation.core.groups import image, layer, measurement_of, pixel_groups
from evaluation.core.kernel import entry
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth

METRICS = (
    Metric(name="epe", unit="px", source="Baker et al., IJCV 2011"),
    Metric(name="fl", source="Menze and Geiger, CVPR 2015"),
    Metric(name="epe_noc", unit="px", source="Menze and Geiger, CVPR 2015"),
    Metric(name="fl_noc", source="Menze and Geiger, CVPR 2015"),
    Metric(name="coverage", better="higher"),
)
_TRUE, _BOTH = 0, 1
_SUMS = 7


@entry
def _tabulate(truth, estimate, visible, cells, table):  # type: ignore[no-untyped-def]
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
        outlier = error > 3.0 and error > 0.05 * np.hypot(tx, ty)
        row[1] += 1.0
        row[2] += error
        row[3] += outlier
        if visible[pixel]:
            row[4] += 1.0
            row[5] += error
            row[6] += outlier


def _formula(sums: Sums) -> Sums:
    both, visible = sums[:, _BOTH], sums[:, 4]
    return np.column_stack([sums[:, 2] / both, sums[:, 3] / both, sums[:, 5] / visible, sums[:, 6] / visible, both / sums[:, _TRUE]])


def _task(name: str, toward: str, occlusion: str) -> Task:
    """Return the task of a layer of flow; ``occlusion`` is the layer that is 0 where the other frame shows what a pixel sees."""

    def measure(truth: Truth, estimate: object) -> Measurement:
        true = layer(truth, name, name, channels=2)
        shape = true.shape[:2]
        guess = image(estimate, name, "estimate", shape, channels=2)
        visible = image(truth[occlusion], occlusion, "truth", shape) == 0 if occlusion in truth else np.zeros(shape, np.bool_)
        groups = pixel_groups(truth, shape)
        table = np.zeros((groups.rows, _SUMS))
        flows = true.astype(np.float64).reshape(-1, 2), guess.astype(np.float64).reshape(-1, 2)
        _tabulate(*flows, visible.reshape(-1), groups.cells, table)
        return measurement_of(table)

    return Task(
        name=name,
        truth=(name,),
        estimate=f"(h, w, 2) motion {toward}: where a pixel of this frame is there, less where it is here, px, right and down; not finite "
        "where unknown",
        metrics=METRICS,
        measure=measure,
        tallying=sums_tallying(_formula),
        beside=(occlusion,),
    )


FLOW = _task("flow", "to the next frame", "occlusion")
FLOW_BACKWARD = _task("flow_backward", "to the frame before", "occlusion_backward")
