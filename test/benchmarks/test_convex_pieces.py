"""Convex pieces: a box is one, what is hollow is many that leave it hollow, what is flat gets a thickness."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from benchmarks.physics.convex_pieces import THIN_M, convex_pieces
from renderer.geometry.shapes import block, merged, moved
from renderer.models import build_model


def test_boxes_are_a_box_each() -> None:
    one = block((0.0, 0.0, 0.0), (0.4, 0.2, 0.1), 0.0)
    mesh = merged(one, moved(one, x=1.0))
    pieces = sorted(convex_pieces(mesh.vertices, mesh.faces), key=lambda piece: piece.corners[0, 0])
    assert [piece.is_box for piece in pieces] == [True, True]
    np.testing.assert_allclose(pieces[1].corners, [[1.0, 0.0, 0.0], [1.4, 0.2, 0.1]], atol=1e-6)


def test_a_bowl_stays_hollow() -> None:
    (mesh,) = build_model("bowl", "round", 1, (0.24, 0.24, 0.1)).values()
    middle = np.array([[0.0, 0.0, 0.06], [0.05, 0.0, 0.06]])
    pieces = convex_pieces(mesh.vertices, mesh.faces)
    assert len(pieces) > 8
    assert not any((Delaunay(piece.corners).find_simplex(middle) >= 0).any() for piece in pieces if not piece.is_box)


def test_a_flat_face_becomes_thin() -> None:
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    (piece,) = convex_pieces(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    assert np.ptp(piece.corners, axis=0) == pytest.approx([1.0, 1.0, THIN_M])
