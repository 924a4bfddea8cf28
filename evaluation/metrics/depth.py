r"""Depth: the errors of Eigen, Puhrsch and Fergus (NeurIPS 2014), as they are and after an alignment.

With the true depth z and the estimate e of a pixel, over all n valid pixels of all frames: abs rel = mean |e - z| / z,
sq rel = mean (e - z)^2 / z, RMSE = sqrt mean (e - z)^2, RMSE log = sqrt mean (ln e - ln z)^2, log10 = mean |log10 e - log10 z|,
delta_k = share with max(e / z, z / e) < 1.25^k.  si log = 100 sqrt(mean d^2 - (mean d)^2) with d = ln e - ln z (the scale-invariant error
with lambda = 1, as KITTI prints it, Uhrig et al., 3DV 2017); its inner mean is that of one frame, or of one group of a frame's pixels.

A pixel is valid where truth and estimate are finite and positive.  Coverage: of the pixels with a valid truth, the share whose estimate is
valid too.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from evaluation.core.groups import image, layer, measurement_of, pixel_groups
from evaluation.core.kernel import entry
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth

MIN_ALIGNED_M = 1e-3
"""An aligned estimate that is nearer counts as this near: a scale with a shift can take depths below zero."""

Alignment = Callable[[NDArray[np.float64], NDArray[np.float64]], tuple[float, float]]
"""(true, estimated) depths of the valid pixels in m -> scale and shift that take the estimate to the truth."""

_EIGEN = "Eigen et al., NeurIPS 2014"
METRICS = (
    Metric(name="abs_rel", source=_EIGEN),
    Metric(name="sq_rel", unit="m", source=_EIGEN),
    Metric(name="rmse", unit="m", source=_EIGEN),
    Metric(name="rmse_log", source=_EIGEN),
    Metric(name="log10", source="Saxena et al., PAMI 2009"),
    Metric(name="delta_1", better="higher", source=_EIGEN),
    Metric(name="delta_2", better="higher", source=_EIGEN),
    Metric(name="delta_3", better="higher", source=_EIGEN),
    Metric(name="si_log", source="Eigen et al., NeurIPS 2014; Uhrig et al., 3DV 2017"),
    Metric(name="coverage", better="higher"),
)
_TRUE, _BOTH, _ABS_REL, _SQ_REL, _SQUARE, _LOG_SQUARE, _LOG10, _DELTA, _LOG = 0, 1, 2, 3, 4, 5, 6, 7, 10
_SUMS = 11


@entry
def _tabulate(truth, estimate, cells, scale, shift, smallest, table):  # type: ignore[no-untyped-def]
    """Add the terms of every pixel to its cell; depths in float64, m."""
    for pixel in range(truth.size):
        z = truth[pixel]
        if not 0.0 < z < np.inf:
            continue
        row = table[cells[pixel]]
        row[0] += 1.0
        if not 0.0 < estimate[pixel] < np.inf:
            continue
        e = max(scale * estimate[pixel] + shift, smallest)
        difference = e - z
        log = np.log(e / z)
        ratio = max(e / z, z / e)
        row[1] += 1.0
        row[2] += abs(difference) / z
        row[3] += difference * difference / z
        row[4] += difference * difference
        row[5] += log * log
        row[6] += abs(log)
        row[7] += ratio < 1.25
        row[8] += ratio < 1.25 * 1.25
        row[9] += ratio < 1.25 * 1.25 * 1.25
        row[10] += log


def _tally(row: Sums) -> Sums:
    """Put n (mean d^2 - (mean d)^2) of this frame, which adds up over frames, where the sum of d was."""
    tally = row.copy()
    tally[_LOG] = max(row[_LOG_SQUARE] - row[_LOG] ** 2 / row[_BOTH], 0.0) if row[_BOTH] else 0.0
    return tally


def _formula(sums: Sums) -> Sums:
    mean = sums / sums[:, _BOTH, None]
    columns = [
        mean[:, _ABS_REL],
        mean[:, _SQ_REL],
        np.sqrt(mean[:, _SQUARE]),
        np.sqrt(mean[:, _LOG_SQUARE]),
        mean[:, _LOG10] / np.log(10.0),
        *mean[:, _DELTA : _DELTA + 3].T,
        100.0 * np.sqrt(mean[:, _LOG]),
        sums[:, _BOTH] / sums[:, _TRUE],
    ]
    return np.column_stack(columns)


def median_scale(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> tuple[float, float]:
    """Return the ratio of the medians (Zhou et al., CVPR 2017), and no shift."""
    return float(np.median(truth) / np.median(estimate)), 0.0


def scale_and_shift(truth: NDArray[np.float64], estimate: NDArray[np.float64]) -> tuple[float, float]:
    """Return the least squares fit of ``scale * estimate + shift`` to the truth (Ranftl et al., PAMI 2022, eq. 2, here of depths).

    An estimate that is the same everywhere is only shifted.
    """
    mean_truth, mean_estimate = float(truth.mean()), float(estimate.mean())
    centred = estimate - mean_estimate
    spread = float(centred @ centred)
    scale = float(centred @ (truth - mean_truth)) / spread if spread > 0.0 else 1.0
    return scale, mean_truth - scale * mean_estimate


def _measure(name: str, align: Alignment | None) -> Callable[[Truth, object], Measurement]:
    def measure(truth: Truth, estimate: object) -> Measurement:
        """Return the measurement of one frame; the alignment, if any, is that of this frame."""
        true = layer(truth, "depth", name)
        groups = pixel_groups(truth, true.shape)
        z = true.astype(np.float64).ravel()
        e = image(estimate, name, "estimate", true.shape).astype(np.float64).ravel()
        scale, shift, smallest = 1.0, 0.0, 0.0
        if align is not None:
            valid = (z > 0.0) & (z < np.inf) & (e > 0.0) & (e < np.inf)
            if valid.any():
                (scale, shift), smallest = align(z[valid], e[valid]), MIN_ALIGNED_M
        table = np.zeros((groups.rows, _SUMS))
        _tabulate(z, e, groups.cells, scale, shift, smallest, table)
        return measurement_of(table, _tally)

    return measure


def _task(name: str, align: Alignment | None, how: str) -> Task:
    estimate = f"(h, w) depth along the optical axis, m; not finite or not positive where unknown{how}"
    return Task(
        name=name, truth=("depth",), estimate=estimate, metrics=METRICS, measure=_measure(name, align), tallying=sums_tallying(_formula)
    )


DEPTH = _task("depth", None, "")
DEPTH_ALIGNED = _task("depth_aligned", median_scale, "; scaled by the ratio of the medians of each frame")
DEPTH_AFFINE = _task("depth_affine", scale_and_shift, "; scaled and shifted by least squares of each frame")
