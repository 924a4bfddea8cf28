"""Statistics of features as LeRobot keeps them: of an episode, and of all episodes together.

As ``lerobot/datasets/compute_stats.py`` (huggingface/lerobot 7427f318, Apache-2.0) defines them: minimum, maximum, mean, standard deviation
and quantiles over the frames; of images per channel and over some pixels, with a shape (channels, 1, 1); ``count`` is the number of frames.
Quantiles here are values that occur (the inverse of the distribution function), there they are read off histograms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Stats = dict[str, NDArray[Any]]
QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
_SIDE = 150
"""Images are thinned out to about so many pixels on the longer side."""


def thinned(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return every n-th row and column of an image as (pixels, channels)."""
    step = max(1, max(pixels.shape[:2]) // _SIDE)
    return pixels[::step, ::step].reshape(-1, 1 if pixels.ndim == 2 else pixels.shape[2])


def vector_stats(values: NDArray[Any]) -> Stats:
    """Return the statistics of a feature, values (frames, size)."""
    return _stats(values.astype(np.float64), len(values))


def image_stats(samples: Sequence[NDArray[Any]], scale: float) -> Stats:
    """Return the statistics of images from their thinned pixels, divided by ``scale``; pixels that are not finite are left out."""
    pixels = np.concatenate(samples).astype(np.float64) / scale
    finite = pixels[np.isfinite(pixels).all(axis=1)]
    stats = _stats(finite if len(finite) else np.zeros((1, pixels.shape[1])), len(samples))
    return {name: value if name == "count" else value.reshape(-1, 1, 1) for name, value in stats.items()}


def together(episodes: Sequence[Mapping[str, Stats]]) -> dict[str, Stats]:
    """Return the statistics of all episodes: exact but for the quantiles, which are bounds, as in LeRobot's own ``aggregate_stats``."""
    return {key: _merged([episode[key] for episode in episodes]) for key in episodes[0]}


def _stats(values: NDArray[np.float64], count: int) -> Stats:
    stats: Stats = {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        "count": np.array([count], np.int64),
    }
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0, method="inverted_cdf")
    return stats | dict(zip(QUANTILES, quantiles, strict=True))


def _merged(parts: Sequence[Stats]) -> Stats:
    counts = np.array([part["count"][0] for part in parts], np.float64)
    weights = counts / counts.sum()
    means = np.stack([part["mean"] for part in parts])
    squares = np.stack([part["std"] ** 2 for part in parts])
    mean = np.tensordot(weights, means, 1)
    merged: Stats = {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": mean,
        "std": np.sqrt(np.tensordot(weights, squares + (means - mean) ** 2, 1)),
        "count": np.array([int(counts.sum())], np.int64),
    }
    for name, share in QUANTILES.items():
        merged[name] = (np.min if share <= 0.5 else np.max)([part[name] for part in parts], axis=0)
    return merged
