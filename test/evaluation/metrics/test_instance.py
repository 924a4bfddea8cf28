"""Objects by their pixels: average precision equal to pycocotools' own, panoptic quality to its definition, parts by class and distance."""

import contextlib
import io
import sys

import numpy as np
import pytest
from pycocotools import mask
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from evaluation.core.errors import EvaluationError
from evaluation.metrics.instance import Instances
from evaluation.tasks import TASKS

SHAPE = (24, 32)
INSTANCE = TASKS["instance"]


def random_room(rng, objects=6, classes=3):
    """Return the truth of a frame of blocks on a grid, and estimates that move, lose, add and rename some of them."""
    ids, semantic = np.zeros(SHAPE, np.uint16), np.full(SHAPE, 1, np.uint8)
    depth = rng.uniform(0.5, 3.5, SHAPE)
    masks, labels, scores = [], [], []
    for i in range(objects):
        top, left = 8 * (i // 4), 8 * (i % 4)
        label = int(rng.integers(2, 2 + classes))
        ids[top : top + 7, left : left + 7] = i + 1
        semantic[top : top + 7, left : left + 7] = label
        if rng.random() < 0.8:
            found = np.zeros(SHAPE, bool)
            down, right = rng.integers(0, 4, 2)
            found[top + down : top + 7, left + right : left + 7] = True
            masks.append(found)
            labels.append(label if rng.random() < 0.7 else int(rng.integers(2, 2 + classes)))
            scores.append(rng.random())
    stray = np.zeros(SHAPE, bool)
    stray[17:23, 20:30] = True
    return (
        {"instance": ids, "semantic": semantic, "depth": depth},
        Instances(masks=np.array([*masks, stray]), classes=np.array([*labels, 2]), scores=np.array([*scores, rng.random()])),
    )


def by_pycocotools(pairs):
    """Return ap, ap50 and ap75 as COCOeval itself sums them up."""
    sets = {"truth": [], "estimate": []}
    for image_id, (truth, estimate) in enumerate(pairs, 1):
        for number in np.unique(truth["instance"][truth["instance"] > 0]):
            of_object = truth["instance"] == number
            sets["truth"].append((image_id, of_object, int(truth["semantic"][of_object][0]), 1.0))
        sets["estimate"] += [(image_id, *found) for found in zip(estimate.masks, estimate.classes, estimate.scores, strict=True)]
    cocos = []
    with contextlib.redirect_stdout(io.StringIO()):
        for rows in sets.values():
            coco = COCO()
            coco.dataset = {
                "images": [{"id": i, "height": SHAPE[0], "width": SHAPE[1]} for i in range(1, len(pairs) + 1)],
                "categories": [{"id": label} for label in range(1, 6)],
                "annotations": [
                    {
                        "id": number,
                        "image_id": image_id,
                        "category_id": int(label),
                        "score": float(score),
                        "iscrowd": 0,
                        "area": int(pixels.sum()),
                        "segmentation": mask.encode(np.asfortranarray(pixels.astype(np.uint8))),
                    }
                    for number, (image_id, pixels, label, score) in enumerate(rows, 1)
                ],
            }
            coco.createIndex()
            cocos.append(coco)
        evaluation = COCOeval(*cocos, "segm")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    return evaluation.stats[:3]


def test_average_precision_is_that_of_pycocotools():
    rng = np.random.default_rng(3)
    pairs = [random_room(rng) for _ in range(5)]
    score = INSTANCE.score([INSTANCE.measure(truth, estimate) for truth, estimate in pairs])
    assert [score["ap"], score["ap50"], score["ap75"]] == pytest.approx(by_pycocotools(pairs), abs=1e-9)
    assert 0.05 < score["ap"] < 0.95


def test_merged_and_repeated_frames_count_as_they_are():
    rng = np.random.default_rng(4)
    pairs = [random_room(rng) for _ in range(3)]
    measurements = [INSTANCE.measure(truth, estimate) for truth, estimate in pairs]
    assert INSTANCE.score([INSTANCE.merge(measurements)]) == INSTANCE.score(measurements)
    weights = np.array([[2.0, 0.0, 1.0]])
    weighted = INSTANCE.tallying.finish([measurement.whole for measurement in measurements], weights)[0]
    repeated = INSTANCE.score([measurements[0], measurements[0], measurements[2]])
    assert weighted == pytest.approx(list(repeated.values()), abs=1e-12)


def test_parts_are_those_of_one_class_and_of_one_distance():
    rng = np.random.default_rng(5)
    pairs = [random_room(rng) for _ in range(4)]
    by_class = INSTANCE.score_by([INSTANCE.measure(truth, estimate) for truth, estimate in pairs], "class")
    assert by_class.keys() == {2, 3, 4}
    only = [
        (
            {**truth, "instance": np.where(truth["semantic"] == 3, truth["instance"], 0)},
            Instances(
                masks=found.masks[found.classes == 3], classes=found.classes[found.classes == 3], scores=found.scores[found.classes == 3]
            ),
        )
        for truth, found in pairs
    ]
    assert by_class[3] == pytest.approx({**INSTANCE.score([INSTANCE.measure(*pair) for pair in only]), "coverage": by_class[3]["coverage"]})
    ids, depth = np.zeros(SHAPE, np.uint16), np.full(SHAPE, 0.5)
    ids[:4, :4], ids[10:14, :4] = 1, 2
    depth[8:] = 2.5
    only_near = Instances(masks=np.array([ids == 1, ids == 2])[:1], scores=np.ones(1))
    by_distance = INSTANCE.score_by([INSTANCE.measure({"instance": ids, "depth": depth}, only_near)], "distance")
    assert {key: (values["ap"], values["pq"], values["coverage"]) for key, values in by_distance.items()} == {0: (1.0,) * 3, 2: (0.0,) * 3}


def test_panoptic_quality_is_that_of_its_definition():
    """One object of class 2 with IoU 0.8, one lost; one of class 3 found whole, beside one too many."""
    ids, semantic, guess = np.zeros((1, 30), np.uint16), np.ones((1, 30), np.uint8), np.zeros((1, 30), np.uint16)
    ids[0, :5], ids[0, 5:10], ids[0, 10:15] = 1, 2, 3
    semantic[0, :10], semantic[0, 10:15] = 2, 3
    guess[0, :4], guess[0, 10:15], guess[0, 20:25] = 7, 8, 9
    classes = np.ones_like(semantic)
    classes[0, :4], classes[0, 10:25] = 2, 3
    measurement = INSTANCE.measure({"instance": ids, "semantic": semantic}, Instances.from_images(guess, classes))
    score = INSTANCE.score([measurement])
    assert {name: score[name] for name in ("pq", "sq", "rq")} == pytest.approx({"pq": (0.8 / 1.5 + 1 / 1.5) / 2, "sq": 0.9, "rq": 1 / 1.5})
    assert score["coverage"] == pytest.approx(9 / 15)
    by_class = INSTANCE.score_by([measurement], "class")
    assert (by_class[2]["pq"], by_class[3]["rq"]) == pytest.approx((0.8 / 1.5, 1 / 1.5))


def test_what_is_found_in_the_void_is_no_error_of_panoptic_quality():
    ids, semantic, guess = np.zeros((1, 20), np.uint16), np.zeros((1, 20), np.uint8), np.zeros((1, 20), np.uint16)
    ids[0, :5], semantic[0, :5], guess[0, :7], guess[0, 12:18] = 1, 2, 1, 2
    score = INSTANCE.score([INSTANCE.measure({"instance": ids, "semantic": semantic}, guess)])
    assert (score["pq"], score["sq"], score["rq"]) == (1.0, 1.0, 1.0)


def test_the_truth_is_perfect():
    truth, _ = random_room(np.random.default_rng(6))
    for estimate in (truth["instance"], Instances.from_images(truth["instance"], truth["semantic"], {1: 0.3})):
        score = INSTANCE.score([INSTANCE.measure(truth, estimate)])
        assert score == pytest.approx(dict.fromkeys(score, 1.0))


def test_frames_without_objects_or_estimates_count():
    truth, _ = random_room(np.random.default_rng(7))
    nothing = INSTANCE.measure(truth, np.zeros(SHAPE, int))
    assert INSTANCE.score([nothing]) == dict.fromkeys(INSTANCE.score([nothing]), 0.0)
    empty = INSTANCE.measure({"instance": np.zeros(SHAPE, int), "semantic": truth["semantic"]}, np.zeros(SHAPE, int))
    assert all(np.isnan(value) for value in INSTANCE.score([empty]).values())


def test_what_does_not_fit_is_told(monkeypatch):
    truth, _ = random_room(np.random.default_rng(8))
    with pytest.raises(EvaluationError, match=r"^estimate of instance: expected object ids as integers, got float64$"):
        INSTANCE.measure(truth, np.zeros(SHAPE))
    with pytest.raises(EvaluationError, match=r"expected 1 classes, one a mask, got \(2,\)$"):
        INSTANCE.measure(truth, Instances(masks=np.ones((1, *SHAPE), bool), classes=np.array([1, 2])))
    monkeypatch.setitem(sys.modules, "pycocotools", None)
    with pytest.raises(EvaluationError, match=r"expected the library pycocotools, got none installed; pip install .*evaluate"):
        INSTANCE.measure(truth, truth["instance"])
