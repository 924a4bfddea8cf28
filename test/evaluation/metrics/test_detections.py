"""Objects by their boxes: average precision equal to pycocotools' own, recall, parts by class and distance."""

import contextlib
import io

import numpy as np
import pytest
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from evaluation.core.errors import EvaluationError
from evaluation.metrics.detections import Boxes
from evaluation.tasks import TASKS

DETECTIONS = TASKS["detections"]


def random_boxes(rng, count=8):
    boxes = np.column_stack([rng.uniform(0, 60, (count, 2)), rng.uniform(8, 30, (count, 2))])
    classes = rng.integers(1, 4, count)
    found = np.concatenate([boxes[:6] + rng.normal(0.0, 1.5, (6, 4)), boxes[:2] + 1.0, rng.uniform(5.0, 30.0, (2, 4))])
    labels = np.concatenate([classes[:6], classes[:2], rng.integers(1, 4, 2)])
    return Boxes(boxes_px=boxes, classes=classes), Boxes(boxes_px=found, classes=labels, scores=rng.random(10))


def by_pycocotools(pairs):
    cocos = []
    with contextlib.redirect_stdout(io.StringIO()):
        for which in range(2):
            coco = COCO()
            rows = [
                {"image_id": i, "category_id": int(label), "bbox": box.tolist(), "area": box[2] * box[3], "iscrowd": 0, "score": score}
                for i, pair in enumerate(pairs, 1)
                for box, label, score in zip(
                    pair[which].boxes_px,
                    pair[which].classes,
                    pair[which].scores if which else np.ones(len(pair[which].classes)),
                    strict=True,
                )
            ]
            coco.dataset = {"images": [{"id": i} for i in range(1, len(pairs) + 1)], "categories": [{"id": i} for i in (1, 2, 3)]}
            coco.dataset["annotations"] = [{"id": number, **row} for number, row in enumerate(rows, 1)]
            coco.createIndex()
            cocos.append(coco)
        evaluation = COCOeval(*cocos, "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return evaluation.stats[:3]


def test_average_precision_is_that_of_pycocotools():
    rng = np.random.default_rng(0)
    pairs = [random_boxes(rng) for _ in range(6)]
    score = DETECTIONS.score([DETECTIONS.measure({"detections": truth}, found) for truth, found in pairs])
    assert [score["ap"], score["ap50"], score["ap75"]] == pytest.approx(by_pycocotools(pairs), abs=1e-9)
    assert 0.05 < score["ap"] < 0.95


def test_the_truth_is_perfect_and_a_lost_box_is_found_exactly():
    truth = Boxes(boxes_px=np.array([[0, 0, 10, 10], [20, 0, 10, 10], [0, 20, 10, 10.0]]), classes=np.array([1, 1, 2]))
    score = DETECTIONS.score([DETECTIONS.measure({"detections": truth}, truth)])
    assert score == pytest.approx({"ap": 1.0, "ap50": 1.0, "ap75": 1.0, "coverage": 1.0})
    found = Boxes(boxes_px=truth.boxes_px[1:], classes=truth.classes[1:])
    score = DETECTIONS.score([DETECTIONS.measure({"detections": truth}, found)])
    # Of class 1 the recalls 0, 0.01, ..., 0.5 have precision 1, those above none.
    assert score == pytest.approx(dict.fromkeys(("ap", "ap50", "ap75"), (51 / 101 + 1) / 2) | {"coverage": 2 / 3})


def test_parts_are_those_of_one_class_and_of_one_distance():
    depth = np.full((30, 40), 1.5)
    depth[15:] = 5.0
    truth = Boxes(boxes_px=np.array([[0, 0, 10, 10], [0, 18, 10, 10.0]]), classes=np.array([1, 2]))
    found = Boxes(boxes_px=truth.boxes_px[:1], classes=truth.classes[:1])
    measurement = DETECTIONS.measure({"detections": truth, "depth": depth}, found)
    for by, right, lost in (("class", 1, 2), ("distance", 1, 4)):
        parts = DETECTIONS.score_by([measurement], by)
        assert {key: (values["ap"], values["coverage"]) for key, values in parts.items()} == {right: (1.0, 1.0), lost: (0.0, 0.0)}


def test_what_does_not_fit_is_told():
    truth = {"detections": Boxes(boxes_px=np.zeros((0, 4)), classes=np.zeros(0, int))}
    with pytest.raises(EvaluationError, match=r"^estimate of detections: expected Boxes, got ndarray$"):
        DETECTIONS.measure(truth, np.zeros((1, 4)))
    with pytest.raises(EvaluationError, match=r"expected 1 classes, one a box of four numbers, got shape \(2,\)$"):
        DETECTIONS.measure(truth, Boxes(boxes_px=np.ones((1, 4)), classes=np.array([1, 2])))
    with pytest.raises(EvaluationError, match=r"expected finite boxes and scores, no width or height below 0"):
        DETECTIONS.measure(truth, Boxes(boxes_px=-np.ones((1, 4)), classes=np.array([1])))
