"""Inside a car: one sees through its panes to seats and a dashboard, which stand in a hollow of the body and below the roof."""

import numpy as np
import pytest
from shapely.geometry import MultiPoint, Point

from renderer.geometry.mesh import Mesh
from renderer.models import MODELS, build_model

SIZE_M = (4.2, 2.0, 1.48)


def crossings(mesh: Mesh, start: np.ndarray, way: np.ndarray) -> list[float]:
    """Return the distances at which a ray meets the triangles of a mesh, in order (T. Moeller and B. Trumbore, 1997)."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    p = np.cross(way, c - a)
    det = (p * (b - a)).sum(axis=1)
    det = np.where(np.abs(det) < 1e-12, np.inf, det)
    u = (p * (start - a)).sum(axis=1) / det
    q = np.cross(start - a, b - a)
    v, t = (q * way).sum(axis=1) / det, (q * (c - a)).sum(axis=1) / det
    return sorted(t[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)].tolist())


@pytest.mark.parametrize("style", MODELS["car"].styles)
def test_a_ray_through_a_side_window_meets_a_pane_and_then_a_seat(style: str) -> None:
    parts = build_model("car", style, 1, SIZE_M)
    seats = parts["seats"].vertices
    x = float(seats[:, 0].max()) - 0.1  # of the front seats' cushions
    start, target = np.array([x, 1.35, 1.75]), np.array([x, 0.25, 0.45])
    way = (target - start) / np.linalg.norm(target - start)
    first = {name: crossings(parts[name], start, way)[0] for name in ("glass", "seats", "body", "trim")}
    assert first["glass"] < first["seats"] < min(first["body"], first["trim"]), "the body is open where people sit"


@pytest.mark.parametrize("style", MODELS["car"].styles)
def test_seats_and_dashboard_lie_within_body_and_roof(style: str) -> None:
    parts = build_model("car", style, 1, SIZE_M)
    seats = parts["seats"].vertices
    assert np.abs(seats[:, 1]).max() < 0.9 * 0.5 * SIZE_M[1] and 0.8 * SIZE_M[2] < seats[:, 2].max() < 0.93 * SIZE_M[2]
    thickness = [
        b - a for a, b in zip(*[iter(crossings(parts["glass"], np.array([0.1, 2.0, 1.2]), np.array([0.0, -1.0, 0.0])))] * 2, strict=True)
    ]
    assert len(thickness) == 2 and np.allclose(thickness, 0.004, atol=0.001), "two panes of 4 mm"


@pytest.mark.parametrize("style", MODELS["car"].styles)
def test_the_shelf_behind_the_seats_ends_within_the_panes(style: str) -> None:
    parts = build_model("car", style, 1, SIZE_M)
    glass, trim = (parts[name].vertices.astype(np.float64) for name in ("glass", "trim"))
    shelf = trim[(trim[:, 2] > 0.5 * SIZE_M[2]) & (trim[:, 0] < -0.1 * SIZE_M[0]) & (np.abs(trim[:, 1]) < 0.36 * SIZE_M[1])]
    outline = MultiPoint(glass[np.abs(glass[:, 2] - shelf[:, 2].max()) < 0.15 * SIZE_M[2], :2]).convex_hull
    assert len(shelf) and all(outline.buffer(0.01).contains(Point(place)) for place in shelf[:, :2])
