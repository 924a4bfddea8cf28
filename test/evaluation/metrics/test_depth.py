"""Errors of depth: equal to formulas written out by hand, exact for known errors, by class and by distance."""

import numpy as np
import pytest
from sklearn import metrics as sk

from evaluation.core.errors import EvaluationError
from evaluation.core.groups import NO_BIN
from evaluation.tasks import TASKS

SHAPE = (30, 40)


def room(seed=0):
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.3, 9.0, SHAPE).astype(np.float32)
    semantic = rng.integers(0, 6, SHAPE).astype(np.uint8)
    return {"depth": depth, "semantic": semantic}, (depth * rng.uniform(0.6, 1.7, SHAPE)).astype(np.float32)


def by_hand(truth, estimate):
    z, e = truth.astype(np.float64).ravel(), estimate.astype(np.float64).ravel()
    d = np.log(e) - np.log(z)
    ratio = np.maximum(e / z, z / e)
    return {
        "abs_rel": sk.mean_absolute_percentage_error(z, e),
        "sq_rel": np.mean((e - z) ** 2 / z),
        "rmse": np.sqrt(sk.mean_squared_error(z, e)),
        "rmse_log": np.sqrt(sk.mean_squared_error(np.log(z), np.log(e))),
        "log10": sk.mean_absolute_error(np.log10(z), np.log10(e)),
        "delta_1": np.mean(ratio < 1.25),
        "delta_2": np.mean(ratio < 1.25**2),
        "delta_3": np.mean(ratio < 1.25**3),
        "si_log": 100.0 * np.std(d),
        "coverage": 1.0,
    }


def test_errors_are_those_of_the_formulas():
    truth, estimate = room()
    measurement = TASKS["depth"].measure(truth, estimate)
    assert TASKS["depth"].score([measurement]) == pytest.approx(by_hand(truth["depth"], estimate), rel=1e-9)


def test_parts_are_the_errors_of_their_pixels():
    truth, estimate = room()
    measurement = TASKS["depth"].measure(truth, estimate)
    chairs = truth["semantic"] == 5
    assert TASKS["depth"].score_by([measurement], "class").keys() == {1, 2, 3, 4, 5}, "void is no class"
    by_class = TASKS["depth"].score_by([measurement], "class")[5]
    assert by_class == pytest.approx(by_hand(truth["depth"][chairs], estimate[chairs]), rel=1e-9)
    near = (truth["depth"] >= 1.0) & (truth["depth"] < 2.0)
    by_distance = TASKS["depth"].score_by([measurement], "distance")
    assert by_distance[1] == pytest.approx(by_hand(truth["depth"][near], estimate[near]), rel=1e-9)
    assert NO_BIN not in by_distance


def test_several_frames_count_as_all_their_pixels():
    pairs = [room(seed) for seed in range(3)]
    together = TASKS["depth"].score([TASKS["depth"].measure(truth, estimate) for truth, estimate in pairs])
    truths, estimates = np.stack([truth["depth"] for truth, _ in pairs]), np.stack([estimate for _, estimate in pairs])
    expected = by_hand(truths, estimates)
    expected["si_log"] = 100.0 * np.sqrt(np.mean([np.var(np.log(e.astype(float) / z)) for z, e in zip(truths, estimates, strict=True)]))
    assert together == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("name", ["depth", "depth_aligned", "depth_affine"])
def test_the_truth_is_perfect_and_what_is_invalid_is_left_out(name):
    truth, _ = room()
    estimate = truth["depth"].copy()
    truth["depth"][0, :4] = [np.inf, np.nan, 0.0, -1.0]
    estimate[1, :] = np.nan
    estimate[2, :] = 0.0
    score = TASKS[name].score([TASKS[name].measure(truth, estimate)])
    valid = SHAPE[0] * SHAPE[1] - 4
    assert score.pop("coverage") == pytest.approx((valid - 80) / valid)
    assert score == pytest.approx({n: float(n.startswith("delta")) for n in score}, abs=1e-7)


def test_a_known_error_is_found_exactly():
    depth = np.full(SHAPE, 2.0)
    score = TASKS["depth"].score([TASKS["depth"].measure({"depth": depth}, depth + 0.5)])
    assert (score["abs_rel"], score["sq_rel"], score["rmse"]) == (0.25, 0.125, 0.5)
    assert (score["delta_1"], score["delta_2"]) == (0.0, 1.0), "1.25 is not below 1.25"
    assert score["si_log"] == pytest.approx(0.0, abs=1e-5)


def test_alignment_takes_back_what_it_should():
    truth, _ = room()
    aligned, affine = TASKS["depth_aligned"], TASKS["depth_affine"]
    scaled = aligned.score([aligned.measure(truth, 3.0 * truth["depth"])])
    assert scaled["rmse"] == pytest.approx(0.0, abs=1e-6)
    shifted = affine.score([affine.measure(truth, 0.25 * truth["depth"] + 7.0)])
    assert shifted["rmse"] == pytest.approx(0.0, abs=1e-5)
    noisy = truth["depth"] * np.random.default_rng(1).uniform(0.5, 1.5, SHAPE)
    scale, shift = np.polyfit(noisy.ravel(), truth["depth"].ravel().astype(float), 1)
    fitted = np.maximum(scale * noisy + shift, 1e-3)
    assert affine.score([affine.measure(truth, noisy)]) == pytest.approx(by_hand(truth["depth"], fitted), rel=1e-6)


def test_nothing_to_judge_is_told():
    truth, _ = room()
    score = TASKS["depth"].score([TASKS["depth"].measure(truth, np.zeros(SHAPE))])
    assert score.pop("coverage") == 0.0
    assert all(np.isnan(value) for value in score.values())
    with pytest.raises(EvaluationError, match=r"^estimate of depth: expected an image of shape \(30, 40\), got \(15, 20\); resize it"):
        TASKS["depth"].measure(truth, np.zeros((15, 20)))
    with pytest.raises(EvaluationError, match=r"^truth of depth: expected the layer 'depth', got semantic; record it"):
        TASKS["depth"].measure({"semantic": truth["semantic"]}, np.zeros(SHAPE))
