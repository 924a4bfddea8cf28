"""Blankets over seats: they lie on what is under them, and hang down at both ends."""

import numpy as np
import pytest

from renderer.geometry.shapes import block, merged
from renderer.models import build_model
from renderer.models.throws import heights, thrown

SEAT, BACK = block((-0.3, -0.5, 0.0), (0.4, 0.5, 0.4), 0.001), block((-0.4, -0.5, 0.0), (-0.3, 0.5, 0.9), 0.001)


def test_heights_are_those_of_the_uppermost_faces() -> None:
    x, y = np.array([[-0.35, 0.0], [0.2, 0.7]]), np.array([[0.0, 0.3], [-0.2, 0.0]])
    assert heights(merged(SEAT, BACK), x, y, -1.0) == pytest.approx(np.array([[0.9, 0.4], [0.4, -1.0]]), abs=1e-6)


def test_a_blanket_lies_on_seat_and_back_and_hangs_down_at_both_ends() -> None:
    mesh = thrown(np.random.default_rng(2), merged(SEAT, BACK), (-0.39, 0.39), (-0.25, 0.25), (0.2, 0.1))
    points = mesh.vertices.astype(np.float64)
    on_seat = points[(points[:, 0] > 0.0) & (points[:, 0] < 0.35)]
    assert 0.4 <= on_seat[:, 2].min() and on_seat[:, 2].max() < 0.44
    assert 0.9 < points[:, 2].max() < 0.94
    behind, before = points[points[:, 0] < -0.4], points[points[:, 0] > 0.4]
    assert 0.64 < behind[:, 2].min() < 0.78 and 0.26 < before[:, 2].min() < 0.34


@pytest.mark.parametrize("generator", ["sofa", "armchair"])
def test_a_style_with_a_throw_differs_from_that_without_by_the_blanket(generator: str) -> None:
    size = {"sofa": (0.95, 2.1, 0.85), "armchair": (0.85, 0.85, 0.95)}[generator]
    plain, thrown_over = (build_model(generator, style, 4, size) for style in ("lounge", "lounge_throw"))
    assert thrown_over.keys() - plain.keys() == {"throw"}
    low = thrown_over["throw"].vertices[:, 2].min()
    assert 0.05 < low < 0.5 * size[2], "it does not lie on the floor"


@pytest.mark.parametrize(("generator", "size"), [("sofa", (0.95, 2.1, 0.85)), ("armchair", (0.85, 0.85, 0.95))])
def test_nothing_pierces_a_blanket(generator: str, size: tuple[float, float, float]) -> None:
    pieces = build_model(generator, "lounge_throw", 3, size)
    throw, under = pieces["throw"], merged(*(pieces[name] for name in ("body", "seat", "back") if name in pieces))
    low, high = throw.vertices[:, 1].min() + 0.06, throw.vertices[:, 1].max() - 0.06
    x, y = np.meshgrid(np.linspace(-0.4, 0.4, 120), np.linspace(low, high, 40), indexing="ij")
    above = heights(throw, x, y, -1.0)
    assert (above > heights(under, x, y, -1.0))[above > 0.0].all()
