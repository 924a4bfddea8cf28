"""Distances between point clouds: equal to formulas written out by hand, exact for known errors, by class and by distance."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from evaluation.core.errors import EvaluationError
from evaluation.tasks import TASKS

POINTS = TASKS["points"]


def by_hand(truth, estimate):
    distances = cdist(truth, estimate)
    to_estimate, to_truth = distances.min(axis=1), distances.min(axis=0)
    found = {"accuracy": to_truth.mean(), "completeness": to_estimate.mean(), "chamfer": (to_truth.mean() + to_estimate.mean()) / 2}
    for limit in (0.02, 0.05, 0.1):
        precision, recall = np.mean(to_truth < limit), np.mean(to_estimate < limit)
        f = 2 / (1 / precision + 1 / recall) if precision and recall else 0.0
        found |= {f"precision_{100 * limit:g}cm": precision, f"recall_{100 * limit:g}cm": recall, f"f_{100 * limit:g}cm": f}
    return found | {"coverage": found["recall_10cm"]}


def test_distances_are_those_of_the_formulas_in_every_part():
    rng = np.random.default_rng(0)
    truth = rng.uniform([-1, -1, 0.5], [1, 1, 2.5], (300, 3))
    estimate = truth[:200] + rng.normal(0.0, 0.03, (200, 3))
    classes = rng.integers(0, 3, 300)
    measurement = POINTS.measure({"points": truth, "point_classes": classes}, estimate)
    assert POINTS.score([measurement]) == pytest.approx(by_hand(truth, estimate), abs=1e-9)
    by_class, by_distance = POINTS.score_by([measurement], "class"), POINTS.score_by([measurement], "distance")
    assert (by_class.keys(), by_distance.keys()) == ({1, 2}, {0, 1, 2})
    nearest = cdist(truth, estimate).argmin(axis=0)
    of_class = cdist(truth[classes == 2], estimate).min(axis=1).mean()
    assert by_class[2]["completeness"] == pytest.approx(of_class)
    of_bin = np.linalg.norm(estimate - truth[nearest], axis=1)[truth[nearest][:, 2] < 1.0].mean()
    assert by_distance[0]["accuracy"] == pytest.approx(of_bin)


def test_known_errors_are_found_exactly_and_what_is_invalid_is_left_out():
    grid = np.stack(np.meshgrid(np.arange(5.0), np.arange(4.0), [2.0]), axis=-1).reshape(-1, 3)
    truth = np.concatenate([grid, [[np.nan, 0, 0]]])
    perfect = POINTS.score([POINTS.measure({"points": truth}, grid)])
    assert perfect == {name: 0.0 if name in ("accuracy", "completeness", "chamfer") else 1.0 for name in perfect}
    score = POINTS.score([POINTS.measure({"points": truth.reshape(3, 7, 3)}, grid + np.array([0.0, 0.0, 0.03]))])
    assert score["chamfer"] == pytest.approx(0.03)
    assert (score["f_2cm"], score["f_5cm"], score["f_10cm"]) == (0.0, 1.0, 1.0)


def test_an_empty_estimate_covers_nothing_and_spoils_no_other_frame():
    grid = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]])
    empty, whole = POINTS.measure({"points": grid}, np.zeros((0, 3))), POINTS.measure({"points": grid}, grid)
    alone, both = POINTS.score([empty]), POINTS.score([empty, whole])
    assert (alone["coverage"], both["coverage"], both["chamfer"]) == (0.0, 0.5, 0.0)
    assert np.isnan(alone["chamfer"])


def test_what_does_not_fit_is_told():
    with pytest.raises(EvaluationError, match=r"^estimate of points: expected an array of shape \(points, 3\), got \(4, 2\) float64$"):
        POINTS.measure({"points": np.zeros((4, 3))}, np.zeros((4, 2)))
    with pytest.raises(EvaluationError, match=r"^truth of points: expected 4 point_classes, one a point, got \(3,\)$"):
        POINTS.measure({"points": np.zeros((4, 3)), "point_classes": np.zeros(3, int)}, np.zeros((4, 3)))
