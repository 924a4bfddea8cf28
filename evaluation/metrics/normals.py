"""Surface normals: the angles between truth and estimate, as in Fouhey, Gupta and Hebert (ICCV 2013).

Mean, median and RMS of the angle in degrees, and the shares of pixels whose angle is below 11.25, 22.5 and 30 degrees.  The angle is
atan2(|a x b|, a . b), which is exact for small angles too; lengths of the vectors do not matter.

Means and shares are those of all valid pixels of all frames.  The median is exact in one frame, and in one group of a frame's pixels; of
several frames it is the mean of their medians, each counted by its valid pixels, as the median of all would need every angle to be kept.

A pixel is valid where truth and estimate are finite and not zero.  Coverage: of the pixels with a valid truth, the share whose estimate is
valid too.
"""

import numpy as np
from numpy.typing import NDArray

from evaluation.core.groups import NO_BIN, VOID, Groups, image, layer, pixel_groups
from evaluation.core.kernel import entry
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth

_FOUHEY = "Fouhey et al., ICCV 2013"
METRICS = (
    Metric(name="mean", unit="deg", source=_FOUHEY),
    Metric(name="median", unit="deg", source=_FOUHEY),
    Metric(name="rms", unit="deg", source=_FOUHEY),
    Metric(name="within_11.25", better="higher", source=_FOUHEY),
    Metric(name="within_22.5", better="higher", source=_FOUHEY),
    Metric(name="within_30", better="higher", source=_FOUHEY),
    Metric(name="coverage", better="higher"),
)
_TRUE, _BOTH, _MEDIAN = 0, 1, 7


@entry
def _tabulate(truth, estimate, cells, table, angles):  # type: ignore[no-untyped-def]
    """Add the terms of every pixel to its cell, and keep its angle in degrees, or -1 where it has none."""
    for pixel in range(cells.size):
        angles[pixel] = -1.0
        tx, ty, tz = truth[pixel]
        length = tx * tx + ty * ty + tz * tz
        if not 0.0 < length < np.inf:
            continue
        row = table[cells[pixel]]
        row[0] += 1.0
        ex, ey, ez = estimate[pixel]
        length = ex * ex + ey * ey + ez * ez
        if not 0.0 < length < np.inf:
            continue
        cx, cy, cz = ty * ez - tz * ey, tz * ex - tx * ez, tx * ey - ty * ex
        angle = np.degrees(np.arctan2(np.sqrt(cx * cx + cy * cy + cz * cz), tx * ex + ty * ey + tz * ez))
        angles[pixel] = angle
        row[1] += 1.0
        row[2] += angle
        row[3] += angle * angle
        row[4] += angle < 11.25
        row[5] += angle < 22.5
        row[6] += angle < 30.0


@entry
def _medians(angles, groups, counts, medians):  # type: ignore[no-untyped-def]
    """Fill the median of the angles of each group, those below 0 left out; ``counts`` says how many each has."""
    starts = np.zeros(counts.size + 1, np.int64)
    starts[1:] = np.cumsum(counts)
    ends = starts[:-1].copy()
    ordered = np.empty(starts[-1], np.float64)
    for pixel in range(angles.size):
        if angles[pixel] >= 0.0:
            group = groups[pixel]
            ordered[ends[group]] = angles[pixel]
            ends[group] += 1
    for group in range(counts.size):
        if counts[group]:
            medians[group] = np.median(ordered[starts[group] : ends[group]])


def _tallies(rows: NDArray[np.float64], angles: NDArray[np.float64], groups: NDArray[np.integer], left_out: int) -> dict[int, Sums]:
    medians = np.zeros(len(rows))
    _medians(angles, groups, rows[:, _BOTH].astype(np.int64), medians)
    columns = np.column_stack([rows, medians * rows[:, _BOTH]])
    return {key: row for key, row in enumerate(columns) if key != left_out and row[_TRUE] > 0}


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one frame."""
    true = layer(truth, "normals", "normals", channels=3)
    shape = true.shape[:2]
    guess = image(estimate, "normals", "estimate", shape, channels=3)
    groups: Groups = pixel_groups(truth, shape)
    table = np.zeros((groups.rows, _MEDIAN))
    angles = np.empty(groups.cells.size)
    _tabulate(true.astype(np.float64).reshape(-1, 3), guess.astype(np.float64).reshape(-1, 3), groups.cells, table, angles)
    cells = table.reshape(-1, NO_BIN + 1, _MEDIAN)
    classes, bins = np.divmod(groups.cells, np.int32(NO_BIN + 1))
    whole = _tallies(cells.sum(axis=(0, 1))[None], angles, np.zeros_like(bins), left_out=-1)
    return Measurement(
        whole=whole.get(0, np.zeros(_MEDIAN + 1)),
        by_class=_tallies(cells.sum(axis=1), angles, classes, left_out=VOID),
        by_distance=_tallies(cells.sum(axis=0), angles, bins, left_out=NO_BIN),
    )


def _formula(sums: Sums) -> Sums:
    mean = sums / sums[:, _BOTH, None]
    columns = [mean[:, 2], mean[:, _MEDIAN], np.sqrt(mean[:, 3]), *mean[:, 4:7].T, sums[:, _BOTH] / sums[:, _TRUE]]
    return np.column_stack(columns)


NORMALS = Task(
    name="normals",
    truth=("normals",),
    estimate="(h, w, 3) normals in the optical frame, of any length; zero or not finite where unknown",
    metrics=METRICS,
    measure=_measure,
    tallying=sums_tallying(_formula),
)
