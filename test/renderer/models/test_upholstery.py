"""Piping, lined cloth, buttoned panels and covers against known volumes and shapes."""

import numpy as np
import pytest

from renderer.geometry.cloth import Drape, cloth, drape, layer, lined
from renderer.geometry.mesh import signed_volume
from renderer.geometry.shapes import block, repeated
from renderer.geometry.upholstery import cushion, piping, rounded_loop, tufted


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_piping_round_a_circle_is_a_torus(turn: float) -> None:
    angle = turn * np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    cord = piping(np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]), 0.05, 48)
    assert signed_volume(cord) == pytest.approx(2.0 * np.pi**2 * 0.05**2, rel=5e-3)
    distance = np.hypot(np.hypot(cord.vertices[:, 0], cord.vertices[:, 1]) - 1.0, cord.vertices[:, 2])
    assert distance == pytest.approx(0.05, abs=1e-4)


def test_a_rounded_loop_encloses_a_rectangle_less_its_corners() -> None:
    x, y = rounded_loop(0.5, 1.0, 0.2, per_corner=40).T
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert area == pytest.approx(2.0 - (4.0 - np.pi) * 0.2**2, rel=1e-4)


@pytest.mark.parametrize("crossed", [False, True])
def test_a_lined_sheet_is_closed_with_a_coarse_lower_side(crossed: bool) -> None:
    u, v = np.meshgrid(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 2.0, 9), indexing="ij")
    flags = np.full((4, 8), crossed)
    sheet = lined(np.dstack([u, v, 0.5 + 0 * u]), np.dstack([u, v, 0 * u]), flags)
    assert signed_volume(sheet) == pytest.approx(1.0)
    assert len(sheet.faces) == 2 * 4 * 8 + 2 * 2 * 4 + 3 * (4 + 8)
    edges = np.sort(sheet.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all(), "each edge belongs to two faces"


def test_copies_have_the_volume_of_all() -> None:
    cube = block((0, 0, 0), (1, 1, 1), 1e-6)
    assert signed_volume(repeated(cube, [(0, 0, 0), (2, 0, 0), (0, 3, 1)])) == pytest.approx(3.0, rel=1e-4)


def test_a_buttoned_panel_is_deepest_at_its_buttons() -> None:
    panel = tufted((0.0, 1.0), (0.0, 0.6), (0.0, 0.1), (0.25, 0.2))
    points = panel.vertices
    assert points[:, 0].min() == 0.0 and 0.08 < points[:, 0].max() <= 0.1
    cushions = points[: len(points) // 2]
    at_button = np.hypot(cushions[:, 1] - 0.5, cushions[:, 2] - 0.4) < 0.02
    between = np.hypot(cushions[:, 1] - 0.5, cushions[:, 2] - 0.2) < 0.02
    assert cushions[at_button & (cushions[:, 0] > 0.0), 0].max() < cushions[between, 0].max() - 0.02


def test_piped_cushions_stay_within_a_cord_of_their_corners() -> None:
    soft = cushion(np.random.default_rng(1), (0, 0, 0), (0.7, 0.6, 0.16), 0.05, 0.03, piping_m=0.005)
    assert soft.vertices.min() > -0.006 and (soft.vertices.max(axis=0) < np.array([0.706, 0.606, 0.166])).all()


def test_a_duvet_falls_in_folds_and_its_throw_lies_on_it() -> None:
    plan = Drape(0.9, 0.75, 0.5, 0.3, 0.3, 0.0, 0.06)
    cover = drape(np.random.default_rng(4), plan, 41, 41)
    side = cover.points[:, -1]
    hem = side[np.abs(side[:, 0]) < 0.8]
    assert hem[:, 2].max() < 0.3 and np.ptp(hem[:, 1]) > 0.02, "the hem swings in and out"
    top = cover.points[np.abs(cover.s) < 0.7][:, np.abs(cover.t) < 0.5]
    assert (np.abs(top[..., 2] - 0.5) < 0.08).all()
    duvet, throw = cloth(cover, 0.03), layer(cover, (0.2, 0.6), 0.95, 0.011, 0.009)
    assert signed_volume(duvet) > 0.01 and signed_volume(throw) > 0.0
    assert throw.vertices[:, 2].max() > top[..., 2].max()
