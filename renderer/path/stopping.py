"""When sampling ends: all samples, a noise target or a time budget, whichever comes first.

Rounds double the samples so far, so that the two halves of all samples can be compared after each.  Rounds change no byte: a picture of n
samples is the same however it came to n.  The noise target is as repeatable as that; the time budget is not.
"""

import math

import numpy as np
from numpy.typing import NDArray

from renderer.path.config import RenderConfig

_FEWEST_TO_JUDGE = 4


def next_round(config: RenderConfig, done: int, elapsed_s: float) -> int:
    """Return how many samples per pixel to take after ``done`` in ``elapsed_s``; 0 ends sampling, never before the first sample.

    The cost of a sample is taken to be the mean of those before.
    """
    left = config.samples_per_pixel - done
    if not (config.noise_target or config.time_budget_s):
        return left
    size = min(left, max(done, 1))
    if config.time_budget_s and done:
        size = min(size, int((config.time_budget_s - elapsed_s) * done / max(elapsed_s, 1e-9)))
    return max(size, 0)


def relative_noise(first: NDArray[np.float32], both: NDArray[np.float32], samples: int, white: float) -> float:
    """Return the standard error of a picture relative to its mean, as shown: clipped at ``white``.

    Of two equal halves of the samples, differences are normal for many samples, and their mean size is sqrt(2 / pi) of their deviation.

    ``first``, ``both``: sums of the first half of the samples and of all, (height, width, 3); ``samples``: how many, even; ``white``:
    luminance of display white, in the units of the means.
    """
    half = samples / 2
    a, b = (np.minimum(part / half, white) for part in (first, both - first))
    mean = 0.5 * float((a + b).mean(dtype=np.float64))
    return 0.5 * math.sqrt(math.pi / 2.0) * float(np.abs(a - b).mean(dtype=np.float64)) / mean if mean > 0.0 else 0.0


def is_clean(config: RenderConfig, first: NDArray[np.float32], both: NDArray[np.float32], samples: int, white: float) -> bool:
    """Return whether the noise target is reached; judged from some samples on, and where both halves are equal."""
    judged = config.noise_target > 0.0 and samples >= _FEWEST_TO_JUDGE and samples & (samples - 1) == 0
    return judged and relative_noise(first, both, samples, white) <= config.noise_target


def variance_of_mean(mean: NDArray[np.float32], mean_square: NDArray[np.float32], samples: int) -> NDArray[np.float32]:
    """Return the variance of the mean of independent samples, (height, width, 3); NaN after one, which tells nothing.

    Samples of low discrepancy, as ours, spread less: their variance is at most about this.
    """
    if samples < 2:
        return np.full(mean.shape, np.nan, np.float32)
    spread = mean_square.astype(np.float64) - mean.astype(np.float64) ** 2
    return (np.maximum(spread, 0.0) / (samples - 1)).astype(np.float32)
