"""Every generator: the same seed gives the same tile, fields are sane, repeats join without a seam."""

import numpy as np
import pytest

from renderer.textures.generators import GENERATORS
from renderer.textures.masonry import JOINT_M, PANEL_M, TIE_M
from renderer.textures.noise import _gain, cells, covered, noise
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


def test_noise_is_summed_in_double_precision() -> None:
    """Single precision, which numpy has had for transforms since 2.0, is further off."""
    shape, spectrum = (32, 32), np.random.default_rng(1).standard_normal((32, 17, 2), np.float32).view(np.complex64)[..., 0]
    made = noise(np.random.default_rng(1), shape, 1.0, 4.0)
    spectrum *= _gain(shape, 1.0, 4.0, 1.0, (1.0, 1.0))
    at = 2.0j * np.pi * np.arange(32)[:, None] * np.arange(32) / 32.0
    half = (np.exp(at)[:, :, None] * spectrum.astype(np.complex128)).sum(axis=1)
    weight = np.where(np.arange(17) % 16 == 0, 1.0, 2.0)
    exact = (half[:, None, :] * np.exp(at)[None, :, :17] * weight).sum(axis=2).real / 32**2
    assert np.abs(made - exact).max() <= 0.5 * np.spacing(np.abs(made).max())


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


def test_a_line_thinner_than_a_texel_keeps_its_width() -> None:
    texel, half = 0.0156, 0.0042
    for offset in np.linspace(0.0, 1.0, 9):
        distance = np.abs(np.arange(40) + 0.5 - 20.0 - offset) * texel
        assert covered(distance, half, texel).sum() * texel == pytest.approx(2.0 * half, rel=1e-5)


def test_boards_have_joints_of_a_millimetre_or_so() -> None:
    """Of planks 0.15 m wide, by the share of the long sides that is joint: the middle halves of the rows have ends of boards too."""
    made = drawn("planks", 4)
    assert isinstance(made, Pattern)
    rows, texels = 8, GENERATORS["planks"].shape[0]
    by_row = np.median(made.weights[1], axis=1).reshape(rows, texels // rows) / 0.85
    width_m = 0.15 * (by_row[:, 0] + np.roll(by_row[:, -1], 1)).mean() / (texels / rows)
    assert 0.001 <= width_m <= 0.0015


def test_rings_of_wood_are_some_millimetres_apart() -> None:
    """Across leaves 0.12 m wide: the middle distance of rises of late wood is that of rings, over the width of a leaf more than three."""
    gaps = []
    for seed in range(6):
        made = drawn("wood", seed)
        assert isinstance(made, Pattern)
        tall = GENERATORS["wood"].units[1] * 0.12 / GENERATORS["wood"].shape[0]
        for column in range(0, made.weights[0].shape[1], 128):
            (rises,) = np.nonzero(np.diff((made.weights[0][:, column] > 0.12).astype(int)) == 1)
            gaps += (tall * np.diff(rises)).tolist()
    assert 0.002 < np.median(gaps) < 0.006 and np.quantile(gaps, 0.9) < 0.02


@pytest.mark.parametrize(("name", "metres"), [("plaster", 0.5), ("concrete", 1.2), ("formed_concrete", PANEL_M)])
def test_what_is_cast_or_rolled_has_no_clouds(name: str, metres: float) -> None:
    made = drawn(name, 2)
    assert isinstance(made, Pattern) and made.shade is not None
    edge = min(int(0.15 / metres * made.shade.shape[1]), made.shade.shape[1] // 2)
    rows, columns = made.shade.shape[0] // edge, made.shade.shape[1] // edge
    means = made.shade[: rows * edge, : columns * edge].reshape(rows, edge, columns, edge).mean(axis=(1, 3))
    assert means.std() < 0.008


@pytest.mark.parametrize("name", ["plaster", "woodchip"])
def test_rolled_paint_is_uneven_where_a_camera_sees_it(name: str) -> None:
    """A pixel of a picture 512 wide covers some 8 mm of a wall three metres off; neighbours differ by a hundredth or so."""
    made = drawn(name, 3)
    assert isinstance(made, Pattern) and made.shade is not None
    pixels = made.shade.reshape(64, 8, 64, 8).mean(axis=(1, 3))
    assert 0.008 < pixels.std() < 0.03
    assert 0.006 < np.abs(np.diff(pixels, axis=1)).mean() < 0.03


def test_formed_concrete_has_joints_and_holes_of_ties_where_panels_have_them() -> None:
    made = drawn("formed_concrete", 1)
    dark = np.asarray(made.weights[0]) if isinstance(made, Pattern) else np.zeros(0)
    height, width = dark.shape
    assert all(dark[int(v * height), int(u * width)] > 0.95 for u in (0.25, 0.75) for v in (0.25, 0.75))
    around = int(1.2 * TIE_M / PANEL_M * width)
    assert np.median(dark[height // 4 - around, :]) < 0.05
    joint_m = (np.median(dark[:, 0]) + np.median(dark[:, -1])) / 0.9 * PANEL_M / width
    assert joint_m == pytest.approx(JOINT_M, rel=0.1)


@pytest.mark.parametrize("seed", range(6))
def test_packaging_has_its_name_on_a_field_and_small_print_below(seed: int) -> None:
    ink, field, roundel = drawn("packaging", seed).weights
    height, width = ink.shape
    rows = np.arange(height) / height
    assert 0.25 < (field + ink).mean(axis=1)[(rows > 0.6) & (rows < 0.8)].mean() and 0.2 < field.mean() < 0.55
    name = ink[(rows > 0.63) & (rows < 0.76)]
    assert name.max() > 0.85 and name[:, : width // 20].max() == 0.0, "in the middle"
    small = ink[rows < 0.17]
    assert 0.03 < small.mean() < 0.4 and ink[(rows > 0.2) & (rows < 0.3)].max() == 0.0
    assert (roundel * field).max() < 0.3 and roundel.max() == pytest.approx(0.9, abs=0.02)
