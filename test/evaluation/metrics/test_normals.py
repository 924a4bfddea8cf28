"""Angles between normals: equal to formulas written out by hand, exact for known errors, by class and by distance."""

import numpy as np
import pytest

from evaluation.tasks import TASKS

SHAPE = (24, 32)
NORMALS = TASKS["normals"]


def directions(rng):
    vectors = rng.normal(size=(*SHAPE, 3))
    return (vectors / np.linalg.norm(vectors, axis=2, keepdims=True)).astype(np.float32)


def by_hand(truth, estimate):
    t, e = truth.reshape(-1, 3).astype(float), estimate.reshape(-1, 3).astype(float)
    cosine = (t * e).sum(axis=1) / np.linalg.norm(t, axis=1) / np.linalg.norm(e, axis=1)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    shares = {f"within_{limit:g}": np.mean(angle < limit) for limit in (11.25, 22.5, 30.0)}
    return {"mean": angle.mean(), "median": np.median(angle), "rms": np.sqrt(np.mean(angle**2)), **shares, "coverage": 1.0}


def test_angles_are_those_of_the_formulas_in_every_part():
    rng = np.random.default_rng(0)
    truth = {"normals": directions(rng), "semantic": rng.integers(0, 4, SHAPE), "depth": rng.uniform(0.1, 5.0, SHAPE)}
    estimate = truth["normals"] + rng.normal(0.0, 0.4, (*SHAPE, 3))
    measurement = NORMALS.measure(truth, estimate)
    assert NORMALS.score([measurement]) == pytest.approx(by_hand(truth["normals"], estimate), abs=1e-6)
    by_class, by_distance = NORMALS.score_by([measurement], "class"), NORMALS.score_by([measurement], "distance")
    assert (by_class.keys(), by_distance.keys()) == ({1, 2, 3}, {0, 1, 2, 3, 4})
    walls, near = truth["semantic"] == 1, truth["depth"] < 1.0
    assert by_class[1] == pytest.approx(by_hand(truth["normals"][walls], estimate[walls]), abs=1e-6)
    assert by_distance[0] == pytest.approx(by_hand(truth["normals"][near], estimate[near]), abs=1e-6)


def test_the_truth_is_perfect_and_what_is_invalid_is_left_out():
    normals = directions(np.random.default_rng(1))
    estimate = 7.0 * normals
    normals[0] = 0.0
    estimate[1], estimate[2] = 0.0, np.nan
    score = NORMALS.score([NORMALS.measure({"normals": normals}, estimate)])
    assert score.pop("coverage") == pytest.approx((SHAPE[0] - 3) / (SHAPE[0] - 1))
    assert score == pytest.approx({name: float(name.startswith("within")) for name in score}, abs=1e-5)


def test_a_known_turn_is_found_exactly():
    normals = np.zeros((*SHAPE, 3))
    normals[..., 2] = -1.0
    turned = np.zeros_like(normals)
    turned[..., 1], turned[..., 2] = np.sin(np.radians(20.0)), -np.cos(np.radians(20.0))
    score = NORMALS.score([NORMALS.measure({"normals": normals}, turned)])
    assert [score[name] for name in ("mean", "median", "rms")] == pytest.approx([20.0] * 3)
    assert [score[name] for name in ("within_11.25", "within_22.5", "within_30")] == [0.0, 1.0, 1.0]


def test_the_median_of_several_frames_is_the_mean_of_theirs():
    normals = np.zeros((*SHAPE, 3))
    normals[..., 2] = 1.0
    frames = []
    for degrees, holes in ((10.0, 0), (40.0, SHAPE[0] // 2)):
        estimate = np.zeros_like(normals)
        estimate[..., 0], estimate[..., 2] = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        estimate[:holes] = 0.0
        frames.append(NORMALS.measure({"normals": normals}, estimate))
    assert NORMALS.score(frames)["median"] == pytest.approx(20.0)
