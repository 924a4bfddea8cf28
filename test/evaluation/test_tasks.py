"""What holds of every task of the table."""

import numpy as np
import pytest

from evaluation.core.groups import DISTANCE_EDGES_M, DISTANCE_NAMES, NO_BIN, distance_bins
from evaluation.metrics.detections import Boxes
from evaluation.metrics.poses import Trajectory
from evaluation.tasks import TASKS

SHAPE = (6, 8)
RNG = np.random.default_rng(0)
POSES = Trajectory(stamps_ns=np.arange(5), positions_m=RNG.normal(size=(5, 3)), orientations=np.tile([0.0, 0.0, 0.0, 1.0], (5, 1)))
TRUTH = {
    "depth": RNG.uniform(0.5, 5.0, SHAPE),
    "normals": RNG.normal(size=(*SHAPE, 3)),
    "semantic": np.repeat([[1, 1, 2, 2, 3, 3, 3, 3]], 6, axis=0),
    "instance": np.repeat([[0, 0, 1, 1, 2, 2, 2, 2]], 6, axis=0),
    **{name: RNG.normal(size=(*SHAPE, 2)) for name in ("flow", "flow_backward")},
    **{name: np.zeros(SHAPE, np.uint8) for name in ("occlusion", "occlusion_backward")},
    "poses": POSES,
    "detections": Boxes(boxes_px=np.array([[2.0, 0.0, 2.0, 6.0]]), classes=np.array([2])),
    "points": RNG.normal(size=(9, 3)),
}


@pytest.mark.parametrize("name", TASKS)
def test_the_truth_has_the_best_value_of_every_metric_and_merging_changes_none(name):
    task = TASKS[name]
    measurement = task.measure(TRUTH, TRUTH[task.truth[0]])
    score = task.score([measurement])
    assert list(score) == [metric.name for metric in task.metrics]
    assert score == pytest.approx({metric.name: float(metric.better == "higher") for metric in task.metrics}, abs=1e-6)
    assert task.score([task.merge([measurement, measurement])]) == pytest.approx(score, abs=1e-6)
    assert "coverage" in score
    assert all(np.isnan(value) for value in task.score([]).values())


def test_distances_are_in_the_bin_that_begins_with_them():
    bins = distance_bins(np.array([0.0, 0.5, *DISTANCE_EDGES_M[1:], 99.0, np.inf, np.nan, -1.0]))
    last = NO_BIN - 1
    assert bins.tolist() == [NO_BIN, 0, *range(1, NO_BIN), last, NO_BIN, NO_BIN, NO_BIN]
    assert (DISTANCE_NAMES[1], DISTANCE_NAMES[last]) == ("1 to 2 m", "8 m and more")
