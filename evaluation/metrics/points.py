"""Point clouds: distances between surfaces, as in Knapitsch et al. (SIGGRAPH 2017, Tanks and Temples).

Of each estimated point the distance to the nearest true one, and the other way round.  Accuracy is the mean of the former, completeness
that of the latter, the chamfer distance the mean of both.  At a threshold, precision is the share of estimated points that are nearer than
it to the truth, recall the share of true points that are nearer to the estimate, and F = 2 precision recall / (precision + recall).

Points with a coordinate that is not finite are left out.  An estimated point belongs to the class and distance bin of the true point that
is nearest to it; distances of bins are along z.  Coverage is the recall at 0.1 m.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from evaluation.core.errors import EvaluationError
from evaluation.core.groups import NO_BIN, VOID, distance_bins
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth

THRESHOLDS_M = (0.02, 0.05, 0.1)
_KNAPITSCH = "Knapitsch et al., SIGGRAPH 2017"
_SHARES = [f"{name}_{100 * limit:g}cm" for limit in THRESHOLDS_M for name in ("precision", "recall", "f")]
METRICS = (
    Metric(name="accuracy", unit="m", source=_KNAPITSCH),
    Metric(name="completeness", unit="m", source=_KNAPITSCH),
    Metric(name="chamfer", unit="m", source="Barrow et al., IJCAI 1977"),
    *(Metric(name=name, better="higher", source=_KNAPITSCH) for name in _SHARES),
    Metric(name="coverage", better="higher"),
)
_ESTIMATED = 3 + len(THRESHOLDS_M)
"""Where the sums of estimated points begin, after those of true ones: how many, how many
with a distance, the sum of these, how many are below each threshold."""


def _cloud(points: object, whose: str) -> NDArray[np.float64]:
    cloud = np.asarray(points)
    if cloud.dtype.kind not in "if" or cloud.ndim < 2 or cloud.shape[-1] != 3:
        raise EvaluationError(f"{whose} of points: expected an array of shape (points, 3), got {cloud.shape} {cloud.dtype}")
    return cloud.reshape(-1, 3).astype(np.float64)


def _rows(distances: NDArray[np.float64]) -> NDArray[np.float64]:
    there = np.isfinite(distances)
    columns = [np.ones(len(distances)), there, np.where(there, distances, 0.0), *(distances < limit for limit in THRESHOLDS_M)]
    return np.column_stack(columns)


def _nearest(cloud: NDArray[np.float64], points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the distance of each point to the nearest one of a cloud, in m, and that one's index; infinite if the cloud has none."""
    if not len(cloud):
        return np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    distances, indices = cKDTree(cloud).query(points)
    return np.asarray(distances, np.float64), np.asarray(indices, np.int64)


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one pair of clouds."""
    if truth.get("points") is None:
        raise EvaluationError("truth of points: expected the layer 'points', got none; record it (streams.points)")
    true, found = _cloud(truth["points"], "truth"), _cloud(estimate, "estimate")
    classes = np.zeros(len(true), np.int64) if truth.get("point_classes") is None else np.asarray(truth["point_classes"]).ravel()
    if classes.shape != (len(true),):
        raise EvaluationError(f"truth of points: expected {len(true)} point_classes, one a point, got {classes.shape}")
    known = np.isfinite(true).all(axis=1)
    true, classes = true[known], classes[known].astype(np.int64)
    found = found[np.isfinite(found).all(axis=1)]
    bins = distance_bins(true[:, 2])
    true_rows, (to_true, nearest) = _rows(_nearest(found, true)[0]), _nearest(true, found)
    found_rows = _rows(to_true)

    def part(of_true: NDArray[np.bool_]) -> Sums:
        of_found = of_true[nearest] if len(true) else np.zeros(len(found), np.bool_)
        return np.concatenate([true_rows[of_true].sum(axis=0), found_rows[of_found].sum(axis=0)])

    return Measurement(
        whole=np.concatenate([true_rows.sum(axis=0), found_rows.sum(axis=0)]),
        by_class={int(key): part(classes == key) for key in np.unique(classes) if key != VOID},
        by_distance={int(key): part(bins == key) for key in np.unique(bins) if key != NO_BIN},
    )


def _formula(sums: Sums) -> Sums:
    true, found = sums[:, :_ESTIMATED], sums[:, _ESTIMATED:]
    completeness, accuracy = true[:, 2] / true[:, 1], found[:, 2] / found[:, 1]
    recalls, precisions = true[:, 3:] / true[:, :1], found[:, 3:] / found[:, :1]
    total = precisions + recalls
    f_scores = np.divide(2.0 * precisions * recalls, total, out=np.where(np.isnan(total), np.nan, 0.0), where=total > 0)
    shares = np.stack([precisions, recalls, f_scores], axis=2).reshape(len(sums), -1)
    return np.column_stack([accuracy, completeness, 0.5 * (accuracy + completeness), shares, recalls[:, -1]])


POINTS = Task(
    name="points",
    truth=("points",),
    estimate="(m, 3) points in the frame of the true ones, the camera's optical frame, m; not finite where unknown",
    metrics=METRICS,
    measure=_measure,
    tallying=sums_tallying(_formula),
)
