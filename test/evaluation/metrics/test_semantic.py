"""Accuracy and IoU of classes: equal to scikit-learn's, void left out, by class and by distance."""

import numpy as np
import pytest
from sklearn import metrics as sk

from evaluation.core.errors import EvaluationError
from evaluation.tasks import TASKS

SHAPE = (20, 25)
SEMANTIC = TASKS["semantic"]


def by_sklearn(true, guess):
    known = true != 0
    t, e = true[known], guess[known]
    labels = np.unique(t)
    return {
        "pixel_accuracy": sk.accuracy_score(t, e),
        "mean_accuracy": sk.recall_score(t, e, labels=labels, average="macro"),
        "miou": sk.jaccard_score(t, e, labels=labels, average="macro"),
        "coverage": np.mean(e != 0),
    }


def test_scores_are_those_of_scikit_learn_in_every_part():
    rng = np.random.default_rng(0)
    pairs = [(rng.integers(0, 7 + 3 * i, SHAPE), rng.integers(0, 12, SHAPE), rng.uniform(0.1, 3.0, SHAPE)) for i in range(3)]
    pairs = [(true, np.where(rng.random(SHAPE) < 0.6, true, guess), depth) for true, guess, depth in pairs]
    measurements = [SEMANTIC.measure({"semantic": true, "depth": depth}, guess) for true, guess, depth in pairs]
    true, guess, depth = (np.stack(arrays) for arrays in zip(*pairs, strict=True))
    assert SEMANTIC.score(measurements) == pytest.approx(by_sklearn(true, guess), rel=1e-12)
    near = depth < 1.0
    assert SEMANTIC.score_by(measurements, "distance")[0] == pytest.approx(by_sklearn(true[near], guess[near]), rel=1e-12)
    by_class = SEMANTIC.score_by(measurements, "class")
    assert by_class.keys() == set(np.unique(true[true != 0]))
    known = true != 0
    assert by_class[3]["miou"] == pytest.approx(sk.jaccard_score(true[known] == 3, guess[known] == 3))
    assert by_class[3]["mean_accuracy"] == by_class[3]["pixel_accuracy"] == pytest.approx(np.mean(guess[true == 3] == 3))


def test_the_truth_is_perfect_even_where_void_is_filled():
    true = np.array([[0, 1], [2, 2]], np.uint8)
    score = SEMANTIC.score([SEMANTIC.measure({"semantic": true}, np.array([[9, 1], [2, 2]], np.uint16))])
    assert score == {"pixel_accuracy": 1.0, "mean_accuracy": 1.0, "miou": 1.0, "coverage": 1.0}


def test_a_known_error_is_found_exactly():
    true, guess = np.array([[1, 1, 1, 1, 2, 2]]), np.array([[1, 1, 1, 2, 2, 0]])
    score = SEMANTIC.score([SEMANTIC.measure({"semantic": true}, guess)])
    expected = {"pixel_accuracy": 4 / 6, "mean_accuracy": (3 / 4 + 1 / 2) / 2, "miou": (3 / 4 + 1 / 3) / 2, "coverage": 5 / 6}
    assert score == pytest.approx(expected)


def test_what_are_no_class_ids_is_told():
    true = np.ones(SHAPE, np.uint8)
    with pytest.raises(EvaluationError, match=r"^estimate of semantic: expected class ids as integers, got float64$"):
        SEMANTIC.measure({"semantic": true}, np.ones(SHAPE))
    with pytest.raises(EvaluationError, match=r"^estimate of semantic: expected class ids from 0 to 65535, got -1$"):
        SEMANTIC.measure({"semantic": true}, np.full(SHAPE, -1))
