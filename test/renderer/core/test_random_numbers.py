"""Sobol's points, their stratification, and keys."""

import numpy as np
from scipy.stats import qmc

from renderer.core import random_numbers as number_kernels
from renderer.core.kernel import from_python
from renderer.core.random_numbers import make_frame_key

sample_2d = from_python(number_kernels.sample_2d)
mix_bits = from_python(number_kernels.mix_bits)
sobol_second_reversed = from_python(number_kernels.sobol_second_reversed)
reverse_bits = from_python(number_kernels.reverse_bits)


def draw(seed: int, pair: int, count: int) -> np.ndarray:
    """(count, 2, 16) points of 16 neighbouring seeds."""
    seeds = np.array([mix_bits(np.uint32(seed + lane)) for lane in range(16)], np.uint32)
    points = np.zeros((count, 32), np.float32)
    for index in range(count):
        sample_2d(seeds, np.uint32(index), np.uint32(pair), points[index])
    return points.reshape(count, 2, 16)


def test_unscrambled_points_are_sobols():
    # scipy walks the sequence in Gray code order.
    expected = qmc.Sobol(2, scramble=False).random(1024)
    index = [np.uint32(i ^ (i >> 1)) for i in range(1024)]
    ours = [(float(reverse_bits(i)) / 2**32, float(reverse_bits(sobol_second_reversed(i))) / 2**32) for i in index]
    np.testing.assert_array_equal(ours, expected)


def test_every_elementary_interval_holds_one_point():
    points = draw(7, 3, 256)
    assert points.min() >= 0 and points.max() < 1
    for half in (0, 128):  # aligned blocks of 2^m samples are nets too
        block = points[half : half + 128]
        for a in range(8):
            cells = np.floor(block[:, 0] * 2**a) * 2 ** (7 - a) + np.floor(block[:, 1] * 2 ** (7 - a))
            assert all(len(np.unique(cells[:, lane])) == 128 for lane in range(16))


def test_pixels_and_pairs_are_independent():
    points = np.concatenate([draw(seed, 0, 16) for seed in range(0, 4096, 16)], axis=2)
    other = np.concatenate([draw(seed, 1, 16) for seed in range(0, 4096, 16)], axis=2)
    first, second = points[0].astype(np.float64), other[0].astype(np.float64)
    columns = np.vstack([first, second, np.roll(first, 1, axis=1)])
    correlation = np.corrcoef(columns) - np.eye(6)
    assert np.abs(correlation).max() < 5 / np.sqrt(4096)
    counts = np.histogram2d(first[0], second[0], bins=8, range=[[0, 1], [0, 1]])[0]
    assert ((counts - 64) ** 2 / 64).sum() < 63 + 5 * np.sqrt(2 * 63)


def test_a_key_gives_the_same_points_and_another_key_others():
    assert np.array_equal(draw(5, 2, 8), draw(5, 2, 8))
    assert not np.array_equal(draw(5, 2, 8), draw(6, 2, 8))
    keys = {int(make_frame_key(scene, frame)) for scene in range(20) for frame in range(20)}
    assert len(keys) == 400


def test_keys_take_large_seeds():
    assert make_frame_key(2**63 - 1, 0) != make_frame_key(2**62 - 1, 0)
