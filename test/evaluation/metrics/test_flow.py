"""Errors of flow: equal to formulas written out by hand, and KITTI's two conditions for an outlier."""

import numpy as np
import pytest

from evaluation.tasks import TASKS

SHAPE = (20, 30)
FLOW = TASKS["flow"]


def by_hand(truth, estimate, occlusion):
    error = np.sqrt(((estimate - truth) ** 2).sum(axis=-1))
    outlier = (error > 3.0) & (error / np.linalg.norm(truth, axis=-1) > 0.05)
    visible = occlusion == 0
    noc = {"epe_noc": error[visible].mean(), "fl_noc": outlier[visible].mean()}
    return {"epe": error.mean(), "fl": outlier.mean(), **noc, "coverage": 1.0}


def without_occlusion(epe, fl, coverage):
    return {"epe": epe, "fl": fl, "epe_noc": np.nan, "fl_noc": np.nan, "coverage": coverage}


@pytest.mark.parametrize(("name", "occlusion"), [("flow", "occlusion"), ("flow_backward", "occlusion_backward")])
def test_errors_are_those_of_the_formulas_in_every_part(name, occlusion):
    rng, task = np.random.default_rng(0), TASKS[name]
    flow, hidden = rng.normal(0.0, 40.0, (*SHAPE, 2)), rng.integers(0, 4, SHAPE)
    truth = {name: flow, occlusion: hidden, "semantic": rng.integers(0, 3, SHAPE), "depth": rng.uniform(0.5, 2.5, SHAPE)}
    estimate = flow + rng.normal(0.0, 3.0, (*SHAPE, 2))
    measurement = task.measure(truth, estimate)
    assert task.score([measurement]) == pytest.approx(by_hand(flow, estimate, hidden), rel=1e-9)
    floor, near = truth["semantic"] == 2, truth["depth"] < 1.0
    assert task.score_by([measurement], "class")[2] == pytest.approx(by_hand(flow[floor], estimate[floor], hidden[floor]), rel=1e-9)
    assert task.score_by([measurement], "distance")[0] == pytest.approx(by_hand(flow[near], estimate[near], hidden[near]), rel=1e-9)


def test_the_truth_is_perfect_and_what_is_invalid_is_left_out():
    flow = np.random.default_rng(1).normal(size=(*SHAPE, 2))
    estimate = flow.copy()
    flow[0], estimate[1] = np.nan, np.inf
    assert FLOW.score([FLOW.measure({"flow": flow}, estimate)]) == pytest.approx(without_occlusion(0.0, 0.0, 18 / 19), nan_ok=True)


@pytest.mark.parametrize(("length", "error", "outlier"), [(10.0, 2.9, 0.0), (10.0, 3.1, 1.0), (100.0, 4.9, 0.0), (100.0, 5.1, 1.0)])
def test_an_outlier_is_far_and_far_for_its_length(length, error, outlier):
    flow, estimate = np.zeros((1, 1, 2)), np.zeros((1, 1, 2))
    flow[..., 0], estimate[..., 0] = length, length + error
    assert FLOW.score([FLOW.measure({"flow": flow}, estimate)]) == pytest.approx(without_occlusion(error, outlier, 1.0), nan_ok=True)
