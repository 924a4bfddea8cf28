"""Which estimates match which true objects of a frame, by pycocotools; the one place that knows it."""

import contextlib
import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from evaluation.core.errors import EvaluationError
from evaluation.core.groups import NO_BIN, VOID
from evaluation.metrics.matches import IGNORED, IOU_THRESHOLDS, RIGHT, WRONG, Matches

MOST_ESTIMATES = 100
"""How many estimates of a class count in a frame, the best first, as in COCO."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shapes:
    """Objects of one frame, true or estimated.

    Attributes:
        shapes: (n, h, w) bool masks, or (n, 4) float64 boxes: left, top, width, height, px.
        classes: (n,) int64 class ids.
        scores: (n,) float64, higher is surer.
        bins: (n,) distance bins; None where distances are not known.
    """

    shapes: NDArray[Any]
    classes: NDArray[np.int64]
    scores: NDArray[np.float64]
    bins: NDArray[np.uint8] | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameMatches:
    """The matches of a frame: all of them, and those of each class and of each distance bin."""

    whole: Matches
    by_class: Mapping[int, Matches]
    by_distance: Mapping[int, Matches]


def match(truth: Shapes, estimate: Shapes, kind: Literal["segm", "bbox"]) -> FrameMatches:
    """Match the estimates of a frame with its true objects, class by class, the surest first, each with the best that is left.

    Raises:
        EvaluationError: pycocotools is not installed.
    """
    parts = []
    for found in _evaluated_classes(truth, estimate, kind):
        # Ids count from 1, so 0 says unmatched.
        chosen = np.array(found["dtIds"], np.int64) - 1
        matched = np.asarray(found["dtMatches"], np.int64).reshape(len(IOU_THRESHOLDS), len(chosen)) - 1
        parts.append((chosen, matched))
    chosen = np.concatenate([part[0] for part in parts]) if parts else np.zeros(0, np.int64)
    matched = np.concatenate([part[1] for part in parts], axis=1) if parts else np.zeros((len(IOU_THRESHOLDS), 0), np.int64)
    outcomes = np.where(matched >= 0, RIGHT, WRONG).astype(np.uint8)
    whole = Matches(scores=estimate.scores[chosen], classes=estimate.classes[chosen], outcomes=outcomes, truths=_counts(truth.classes))
    labels = np.union1d(truth.classes, estimate.classes)
    by_class = {int(label): _of_class(whole, int(label)) for label in labels if label != VOID}
    by_distance = {}
    if truth.bins is not None and estimate.bins is not None:
        # An estimate lies in the bin of the object that it matches, else in its own.
        own = np.broadcast_to(estimate.bins[chosen], matched.shape)
        bins = np.where(matched >= 0, np.append(truth.bins, 0)[matched], own)
        for key in np.setdiff1d(np.append(truth.bins, bins), NO_BIN):
            in_bin = np.where(bins == key, outcomes, IGNORED).astype(np.uint8)
            truths = _counts(truth.classes[truth.bins == key])
            by_distance[int(key)] = Matches(scores=whole.scores, classes=whole.classes, outcomes=in_bin, truths=truths)
    return FrameMatches(whole=whole, by_class=by_class, by_distance=by_distance)


def _counts(classes: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.bincount(classes, minlength=1).astype(np.float64)


def _of_class(matches: Matches, label: int) -> Matches:
    chosen = matches.classes == label
    truths = np.zeros(label + 1)
    truths[label:] = matches.truths[label : label + 1].sum()
    return Matches(scores=matches.scores[chosen], classes=matches.classes[chosen], outcomes=matches.outcomes[:, chosen], truths=truths)


def _evaluated_classes(truth: Shapes, estimate: Shapes, kind: Literal["segm", "bbox"]) -> list[dict[str, Any]]:
    """Return what COCOeval found of each class, those without any object or estimate left out."""
    try:
        from pycocotools import mask
        from pycocotools.coco import COCO
        from pycocotools.cocoeval import COCOeval
    except ImportError:
        raise EvaluationError(
            "average precision: expected the library pycocotools, got none installed; pip install 'scene_synth_ros[evaluate]' brings it"
        ) from None

    def coco(objects: Shapes) -> Any:
        if kind == "segm":
            codes = mask.encode(np.asfortranarray(objects.shapes.transpose(1, 2, 0).astype(np.uint8)))
            areas = mask.area(codes) if codes else []
        rows = []
        for i, (label, score) in enumerate(zip(objects.classes.tolist(), objects.scores.tolist(), strict=True)):
            row = {"id": i + 1, "image_id": 1, "category_id": label, "score": score, "iscrowd": 0}
            if kind == "segm":
                row |= {"segmentation": codes[i], "area": float(areas[i])}
            else:
                box = objects.shapes[i].tolist()
                row |= {"bbox": box, "area": box[2] * box[3]}
            rows.append(row)
        index = COCO()
        height, width = objects.shapes.shape[1:] if kind == "segm" else (0, 0)
        index.dataset = {"images": [{"id": 1, "height": height, "width": width}]}
        index.dataset |= {"annotations": rows, "categories": [{"id": label} for label in labels]}
        index.createIndex()
        return index

    labels = sorted({*truth.classes.tolist(), *estimate.classes.tolist()})
    if not labels:
        return []
    # pycocotools tells its progress on standard output.
    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = COCOeval(coco(truth), coco(estimate), kind)
        evaluation.params.areaRng, evaluation.params.areaRngLbl = [[0.0, 1e10]], ["all"]
        evaluation.params.maxDets = [MOST_ESTIMATES]
        evaluation.params.iouThrs = IOU_THRESHOLDS
        evaluation.evaluate()
    return [found for found in evaluation.evalImgs if found is not None]
