"""Print: strokes of letters within their boxes, a little proud of the side that they are on, read from outside."""

import numpy as np
import pytest

from renderer.models.printed import letter, on_side


def test_a_letter_fills_its_box_and_no_more() -> None:
    made = [letter(np.random.default_rng(seed), 0.1, 0.2, 0.04, 0.07, 0.01) for seed in range(40)]
    strokes = np.array([stroke for strokes in made for stroke in strokes])
    assert strokes[:, :2].min(axis=0) == pytest.approx([0.1, 0.2]) and strokes[:, 2:].max(axis=0) == pytest.approx([0.14, 0.27])
    assert all(strokes[0] == pytest.approx((0.1, 0.2, 0.11, 0.27)) for strokes in made), "its first stroke is upright"
    assert len({len(strokes) for strokes in made}) == 5, "with up to four more"


@pytest.mark.parametrize("x", [0.5, -0.5])
def test_print_faces_outwards_and_reads_from_left_to_right(x: float) -> None:
    mesh = on_side([(-0.2, 0.1, -0.1, 0.3), (0.1, 0.1, 0.15, 0.2)], x)
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (np.sign(normals[:, 0]) == np.sign(x)).all() and np.allclose(normals[:, 1:], 0.0)
    assert (np.abs(mesh.vertices[:, 0]) > 0.5).all() and np.abs(mesh.vertices[:, 0]).max() < 0.501
    first, second = mesh.vertices[:4, 1].mean(), mesh.vertices[4:, 1].mean()
    assert (second - first) * x > 0.0, "who looks at it from +x has +y on the right"
