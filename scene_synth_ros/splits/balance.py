"""Weights that balance the classes of a split: of classes, for a loss, and of frames, for a sampler.

A class weighs the median frequency of all classes over its own, where the frequency of a class is its share of the pixels of the frames
that see it (Eigen and Fergus, "Predicting Depth, Surface Normals and Semantic Labels with a Common Multi-Scale Convolutional Architecture",
2015).  A frame weighs the greatest repeat factor of the classes that it sees, ``max(1, sqrt(threshold / share of the frames that see the
class))`` (Gupta, Dollar and Girshick, "LVIS", 2019).
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

_DIGITS = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassBalance:
    """A class in the frames of a split.

    Attributes:
        frames: that see it.
        pixels: its share of all pixels.
        weight: of its pixels in a loss.
        drawn: share of the frames that see it when frames are drawn by their weights.
    """

    frames: int
    pixels: float
    weight: float
    drawn: float


def frame_weights(frames: Sequence[Mapping[str, int]], threshold: float) -> list[float]:
    """Return the weight of each frame in a sampler.

    Args:
        frames: class -> pixels of each.
        threshold: share of the frames that see a class below which frames with it are drawn more often.
    """
    seen = Counter(name for frame in frames for name in frame)
    factor = {name: max(1.0, math.sqrt(threshold * len(frames) / count)) for name, count in seen.items()}
    return [round(max((factor[name] for name in frame), default=1.0), _DIGITS) for frame in frames]


def class_balance(frames: Sequence[Mapping[str, int]], weights: Sequence[float]) -> dict[str, ClassBalance]:
    """Return the classes of some frames by name.

    Args:
        frames: class -> pixels of each.
        weights: of the frames, as :func:`frame_weights` has them.
    """
    pixels, among, seen = Counter[str](), Counter[str](), Counter[str]()
    drawn: dict[str, float] = {}
    for frame, weight in zip(frames, weights, strict=True):
        size = sum(frame.values())
        pixels.update(frame)
        among.update(dict.fromkeys(frame, size))
        seen.update(frame.keys())
        for name in frame:
            drawn[name] = drawn.get(name, 0.0) + weight
    frequency = {name: count / among[name] for name, count in pixels.items()}
    middle, total, draws = median(frequency.values()) if frequency else 0.0, pixels.total(), math.fsum(weights)
    return {
        name: ClassBalance(
            frames=seen[name],
            pixels=round(pixels[name] / total, _DIGITS),
            weight=round(middle / frequency[name], _DIGITS),
            drawn=round(drawn[name] / draws, _DIGITS),
        )
        for name in sorted(pixels)
    }
