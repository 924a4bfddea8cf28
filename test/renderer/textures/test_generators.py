"""Every generator: the same seed gives the same tile, fields are sane, repeats join without a seam."""

import numpy as np
import pytest

from renderer.textures.generators import GENERATORS
from renderer.textures.noise import cells, noise
from renderer.textures.pattern import Pattern, Picture, Request

COLORS = ((0.3, 0.2, 0.1), (0.1, 0.2, 0.4), (0.5, 0.4, 0.2), (0.6, 0.6, 0.6))
SEAMS = {"desktop", "television", "art", "rug", "kilim", "planks", "spines"}
"""Mapped once, or with a true seam: rows of boards, and books."""


def drawn(name: str, seed: int) -> Pattern | Picture:
    generator = GENERATORS[name]
    return generator.draw(np.random.default_rng(seed), Request(generator.shape, 0.7, COLORS[: 1 + len(generator.tints)]))


def fields(made: Pattern | Picture) -> list[np.ndarray]:
    colors = [made.rgb[..., k] for k in range(3)] if isinstance(made, Picture) else [*made.weights, made.shade]
    return [np.asarray(field) for field in (*colors, made.roughness, made.height) if field is not None]


@pytest.mark.parametrize("name", GENERATORS)
def test_tiles_are_sane_and_follow_their_seed(name: str) -> None:
    first, again, other = (drawn(name, seed) for seed in (1, 1, 2))
    for a, b in zip(fields(first), fields(again), strict=True):
        assert a.shape == GENERATORS[name].shape and np.isfinite(a).all()
        np.testing.assert_array_equal(a, b)
    assert len(fields(first)) != len(fields(other)) or any((a != b).any() for a, b in zip(fields(first), fields(other), strict=True))
    if isinstance(first, Picture):
        assert 0.0 <= first.rgb.min() and first.rgb.max() <= 1.0 and first.rgb.std() > 0.01
    else:
        total = np.sum(first.weights, axis=0) if first.weights else np.zeros(1)
        assert all(np.min(weight) >= -1e-6 for weight in first.weights) and total.max() <= 1.0 + 1e-5
        if first.shade is not None:
            assert 0.7 < first.shade.mean() < 1.15  # the base colour stays what the material says
        assert sum(float(np.std(field)) for field in fields(first)) > 0.01  # there is a pattern


@pytest.mark.parametrize("name", [name for name in GENERATORS if name not in SEAMS])
def test_repeats_join_without_a_seam(name: str) -> None:
    """The step over the tile's edge is no larger than steps inside are."""
    for field in fields(drawn(name, 3)):
        for axis in (0, 1):
            steps = np.abs(np.diff(field, axis=axis)).max(axis=1 - axis)
            over = np.abs(np.take(field, 0, axis) - np.take(field, -1, axis)).max()
            assert over <= 1.5 * np.percentile(steps, 99) + 0.02


def test_noise_has_the_deviation_and_the_frequencies_asked_for() -> None:
    fine = noise(np.random.default_rng(1), (256, 256), 20.0, 40.0, 0.0)
    assert fine.std() == pytest.approx(1.0, abs=0.05) and abs(fine.mean()) < 1e-3
    power = np.abs(np.fft.fft2(fine)) ** 2
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(256, 1 / 256), np.fft.fftfreq(256, 1 / 256)))
    assert power[frequency < 19.0].sum() < 1e-6 * power.sum()
    assert power[frequency > 100.0].sum() < 0.01 * power.sum()
    broad = noise(np.random.default_rng(1), (256, 256), 1.0, 4.0, 0.0)  # made small and enlarged
    assert broad.std() == pytest.approx(1.0, abs=0.08)


def test_cells_are_nearest_points_also_over_the_edge() -> None:
    found = cells(np.random.default_rng(4), (40, 48), 6, 5, 0.9)
    points = (np.random.default_rng(4).random((2, 5, 6), np.float32) - np.float32(0.5)) * np.float32(0.9) + np.float32(0.5)
    x, y = points[0] + np.arange(6)[None, :], points[1] + np.arange(5)[:, None]
    for row, column in ((0, 0), (39, 47), (17, 23), (0, 47)):
        dx = np.abs((column + 0.5) * 6 / 48 - x)
        dy = np.abs((row + 0.5) * 5 / 40 - y)
        distance = np.hypot(np.minimum(dx, 6 - dx), np.minimum(dy, 5 - dy)).ravel()
        assert found.number[row, column] == np.argmin(distance)
        np.testing.assert_allclose([found.nearest[row, column], found.second[row, column]], np.sort(distance)[:2], rtol=1e-4)
