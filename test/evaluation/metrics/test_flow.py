"""Errors of flow: equal to formulas written out by hand, and KITTI's two conditions for an outlier."""

import numpy as np
import pytest

from evaluation.tasks import TASKS

SHAPE = (20, 30)
FLOW = TASKS["flow"]


def by_hand(truth, estimate):
    error = np.sqrt(((estimate - truth) ** 2).sum(axis=-1))
    return {"epe": error.mean(), "fl": np.mean((error > 3.0) & (error / np.linalg.norm(truth, axis=-1) > 0.05)), "coverage": 1.0}


def test_errors_are_those_of_the_formulas_in_every_part():
    rng = np.random.default_rng(0)
    truth = {"flow": rng.normal(0.0, 40.0, (*SHAPE, 2)), "semantic": rng.integers(0, 3, SHAPE), "depth": rng.uniform(0.5, 2.5, SHAPE)}
    estimate = truth["flow"] + rng.normal(0.0, 3.0, (*SHAPE, 2))
    measurement = FLOW.measure(truth, estimate)
    assert FLOW.score([measurement]) == pytest.approx(by_hand(truth["flow"], estimate), rel=1e-9)
    floor, near = truth["semantic"] == 2, truth["depth"] < 1.0
    assert FLOW.score_by([measurement], "class")[2] == pytest.approx(by_hand(truth["flow"][floor], estimate[floor]), rel=1e-9)
    assert FLOW.score_by([measurement], "distance")[0] == pytest.approx(by_hand(truth["flow"][near], estimate[near]), rel=1e-9)


def test_the_truth_is_perfect_and_what_is_invalid_is_left_out():
    flow = np.random.default_rng(1).normal(size=(*SHAPE, 2))
    estimate = flow.copy()
    flow[0], estimate[1] = np.nan, np.inf
    assert FLOW.score([FLOW.measure({"flow": flow}, estimate)]) == {"epe": 0.0, "fl": 0.0, "coverage": pytest.approx(18 / 19)}


@pytest.mark.parametrize(("length", "error", "outlier"), [(10.0, 2.9, 0.0), (10.0, 3.1, 1.0), (100.0, 4.9, 0.0), (100.0, 5.1, 1.0)])
def test_an_outlier_is_far_and_far_for_its_length(length, error, outlier):
    flow, estimate = np.zeros((1, 1, 2)), np.zeros((1, 1, 2))
    flow[..., 0], estimate[..., 0] = length, length + error
    assert FLOW.score([FLOW.measure({"flow": flow}, estimate)]) == pytest.approx({"epe": error, "fl": outlier, "coverage": 1.0})
