"""Models as data: volumes of the pieces' kinds, hollow vessels, moves, and rows that are drawn along y."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from renderer.geometry.mesh import Mesh, signed_volume
from renderer.models.shape_rows import build_row, hollowed

PROFILES = {"disc": [[0, 0], [1, 0], [1, 1], [0, 1]]}
CIRCLE_64 = 0.5 * 64 * np.sin(2 * np.pi / 64)


def made(pieces: list[dict[str, Any]], size_m: tuple[float, float, float] = (2.0, 2.0, 3.0), **row: Any) -> Mesh:
    mesh = partial(build_row, {"styles": {"only": {"part": pieces}}, **row}, PROFILES)(np.random.default_rng(1), size_m, "only")["part"]
    assert isinstance(mesh, Mesh)
    return mesh


@pytest.mark.parametrize(
    ("piece", "volume"),
    [
        ({"lathe": "disc", "sides": 64}, 3 * CIRCLE_64),
        ({"lathe": "disc", "sides": 64, "r": 0.5, "span": [0.5, 1]}, 1.5 * 0.25 * CIRCLE_64),
        ({"lathe": "disc", "axis": "y", "sides": 64, "span": [-1, 1]}, 2 * CIRCLE_64),
        ({"box": [[-1, -1, 0], [1, 1, 0.5]]}, 2 * 2 * 1.5),
        ({"prism": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "span": [0, 1]}, 12.0),
        ({"prism": [[-1, -1], [-1, 1], [1, 1], [1, -1]], "span": [0, 1]}, 12.0),
        ({"prism": [[-1, 0], [1, 0], [0, 1]], "axis": "x", "span": [-1, 1]}, 2 * 3.0),
        ({"loft": [[1, 1, 0], [1, 1, 1]], "sides": 64}, 3 * CIRCLE_64),
        ({"tube": [[0, 0, 0], [0, 0, 1]], "r": 0.5, "sides": 64}, 3 * 0.25 * CIRCLE_64),
        ({"box": [[0, 0, 0], [0.5, 0.5, 0.2]], "copies": [[0, -0.6, 0], [0, 0, 0.5]]}, 3 * 0.5 * 0.5 * 0.6),
        ({"box": [[0.5, -0.1, 0], [0.7, 0.1, 0.1]], "around": 4, "grow": [2, 2]}, 4 * 0.2 * 0.2 * 0.6),
    ],
)
def test_pieces_have_the_volumes_of_their_solids(piece: dict[str, Any], volume: float) -> None:
    assert signed_volume(made([piece])) == pytest.approx(volume, rel=2e-3)


def test_a_vessel_has_a_wall_and_a_floor() -> None:
    outer = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    assert hollowed(outer, 0.1, 0.2) == pytest.approx(np.array([[0, 0], [1, 0], [1, 1], [0.9, 1], [0.9, 0.2], [0, 0.2]]))
    vessel = made([{"lathe": [[0, 0], [1, 0], [1, 1]], "wall": 0.1, "floor": 0.2, "sides": 64}])
    assert signed_volume(vessel) == pytest.approx(CIRCLE_64 * (3.0 - 0.81 * 0.8 * 3.0), rel=1e-3)


def test_moves_turn_before_they_shift() -> None:
    turned = made([{"box": [[0, -0.1, 0], [1, 0.1, 0.1]], "turn": {"z": 90}, "at": [0.5, 0, 0]}])
    low, high = turned.vertices.min(axis=0), turned.vertices.max(axis=0)
    assert [*low[:2], *high[:2]] == pytest.approx([0.4, 0.0, 0.6, 1.0], abs=1e-6)


def test_what_is_drawn_along_y_turns_with_the_box() -> None:
    piece = {"box": [[-0.1, 0, 0], [0.1, 1, 1]]}
    for size, along in (((1.0, 2.0, 1.0), 1), ((2.0, 1.0, 1.0), 0)):
        points = made([piece], size, long="y").vertices
        assert points[:, along].max() == pytest.approx(1.0) and points[:, 1 - along].max() == pytest.approx(0.05, abs=1e-6)
