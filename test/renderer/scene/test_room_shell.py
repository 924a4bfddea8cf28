"""The shell of a room: areas, holes, triangulation, and that no ray leaves it."""

import math

import numpy as np
import pytest
from embreex_reference import reference_hits
from shell_rooms import L_SHAPE, RECTANGLE, area_vectors, opening, room_of

from renderer.geometry.shapes import merged
from renderer.models.openings import OPENING_MODELS
from renderer.scene.room_shell import build_opening, build_shell, triangulate, wall_frame
from scene_description import SceneSynthError

ACUTE = ((0.0, 0.0), (4.0, 0.3), (4.4, 2.9), (1.0, 1.4))
STAR = tuple((r * math.cos(a), r * math.sin(a)) for a, r in ((math.pi * k / 5, 3.0 if k % 2 == 0 else 1.6) for k in range(10)))
OUTLINES = {"rectangle": RECTANGLE, "l_shape": L_SHAPE, "acute": ACUTE, "star": STAR}


def polygon_area(outline: tuple[tuple[float, float], ...]) -> float:
    x, y = np.array(outline).T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES.keys())
def test_triangulation_covers_the_outline_once(outline: tuple[tuple[float, float], ...]) -> None:
    points = np.array(outline)
    triangles = triangulate(points)
    assert len(triangles) == len(outline) - 2
    a, b, c = (points[triangles[:, k]] for k in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (areas > 0.0).all() and areas.sum() == pytest.approx(polygon_area(outline))


def test_triangulation_takes_collinear_points_and_refuses_what_is_not_simple() -> None:
    points = np.array([(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)], float)
    triangles = triangulate(points)
    assert len(triangles) == 4
    with pytest.raises(SceneSynthError, match="simple polygon"):
        triangulate(np.array([(0, 0), (0, 2), (2, 2), (2, 0)], float))


def test_inner_faces_have_the_rooms_areas() -> None:
    holes = (
        opening(1, "door", 0, 1.0, 0.0, 0.9, 2.0),
        opening(2, "window", 2, 1.0, 0.9, 1.2, 1.1),
        opening(3, "window", 2, 2.6, 0.9, 0.8, 1.1),
    )
    shell = build_shell(room_of(RECTANGLE, holes))
    floor = area_vectors(shell["floor"])
    assert floor[floor[:, 2] > 0.0, 2].sum() == pytest.approx(12.0)
    ceiling = area_vectors(shell["ceiling"])
    assert -ceiling[ceiling[:, 2] < 0.0, 2].sum() == pytest.approx(12.0)
    for wall, expected in ((0, 4.0 * 2.8 - 1.8), (1, 3.0 * 2.8), (2, 4.0 * 2.8 - 1.32 - 0.88)):
        start, _, inward, _ = wall_frame(np.array(RECTANGLE), wall)
        corners = shell["wall"].vertices[shell["wall"].faces]
        on_face = (np.abs((corners[..., :2] - start) @ inward) < 1e-6).all(axis=1)
        assert (area_vectors(shell["wall"])[on_face, :2] @ inward).sum() == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES.keys())
def test_shell_parts_are_closed(outline: tuple[tuple[float, float], ...]) -> None:
    for mesh in build_shell(room_of(outline, (opening(1, "window", 0, 0.4, 0.9, 1.0, 1.0),))).values():
        vectors = area_vectors(mesh)
        assert np.linalg.norm(vectors.sum(axis=0)) < 1e-5 * np.linalg.norm(vectors, axis=1).sum()


def test_skirting_stops_at_doors_and_stays_in_the_room() -> None:
    shell = build_shell(room_of(RECTANGLE, (opening(1, "door", 0, 1.0, 0.0, 0.9, 2.0), opening(2, "window", 1, 1.0, 0.9, 1.0, 1.0))))
    points = shell["skirting"].vertices
    assert points[:, 2].max() == pytest.approx(0.07, abs=1e-3)
    south = points[points[:, 1] < 0.013]
    assert not ((south[:, 0] > 0.95) & (south[:, 0] < 1.95)).any()
    assert points[:, :2].min() > -0.01 and points[:, 0].max() < 4.01 and points[:, 1].max() < 3.01


@pytest.mark.parametrize("style", OPENING_MODELS["door"].styles)
@pytest.mark.parametrize("swing", ["in", "out"])
def test_handle_lies_opposite_the_hinge(style: str, swing: str) -> None:
    for hinge, side in (("start", 1.0), ("end", -1.0)):
        door = opening(1, "door", 0, 1.0, 0.0, 0.9, 2.0, hinge=hinge, swing=swing)
        parts = build_opening(room_of(RECTANGLE, (door,)), door, "door", style, 5)
        points = parts["handle"].vertices
        lever = points[(points[:, 2] > 0.85) & (points[:, 2] < 1.1)]
        outer = lever[np.abs(lever[:, 0] - 1.45) < 0.42]
        assert side * (outer[:, 0].mean() - 1.45) > 0.2


@pytest.mark.parametrize("style", OPENING_MODELS["window"].styles)
def test_pane_is_one_quad_that_covers_the_hole(style: str) -> None:
    window = opening(1, "window", 1, 0.7, 0.9, 1.4, 1.2)
    pane = build_opening(room_of(RECTANGLE, (window,)), window, "window", style, 5)["pane"]
    assert len(pane.faces) == 2 and len(pane.vertices) == 4
    assert 4.0 < pane.vertices[:, 0].min() == pane.vertices[:, 0].max() < 4.15
    assert (pane.vertices.min(axis=0)[1:] <= (0.7, 0.9)).all() and (pane.vertices.max(axis=0)[1:] >= (2.1, 2.1)).all()
    assert np.allclose(pane.normals, (-1.0, 0.0, 0.0), atol=1e-6)


@pytest.mark.parametrize("style", [style for style in OPENING_MODELS["window"].styles if "_" in style])
def test_nets_and_blinds_hang_in_the_reveal_at_many_states(style: str) -> None:
    window = opening(1, "window", 1, 0.7, 0.9, 1.4, 1.2)
    heights = []
    for seed in range(24):
        parts = build_opening(room_of(RECTANGLE, (window,)), window, "window", style, seed)
        points = np.concatenate([parts["dressing"].vertices, parts["rail"].vertices])
        assert points[:, 0].min() >= 4.0 and points[:, 0].max() < parts["pane"].vertices[:, 0].min(), "the inner face is x = 4"
        assert 0.7 <= points[:, 1].min() and points[:, 1].max() <= 2.1 and 0.9 <= points[:, 2].min() and points[:, 2].max() <= 2.1
        heights.append(float(np.ptp(parts["dressing"].vertices[:, 2])))
    assert max(heights) > 0.6 and np.std(heights) > 0.05


@pytest.mark.parametrize(("name", "swing"), [(name, swing) for name in OUTLINES for swing in ("in", "out")])
def test_no_ray_leaves_the_room(name: str, swing: str) -> None:
    outline = OUTLINES[name]
    openings = (
        opening(1, "door", 0, 0.3, 0.0, 0.85, 2.0, swing=swing),
        opening(2, "window", 1, 0.25, 0.9, 0.8, 1.1),
        opening(3, "window", len(outline) - 1, 0.2, 0.8, 0.7, 1.3),
    )
    styles = {
        "rectangle": ("panelled", "double"),
        "l_shape": ("flush", "single"),
        "acute": ("planked", "grid"),
        "star": ("panelled", "grid"),
    }[name]
    room = room_of(outline, openings)
    pieces = [mesh for part, mesh in build_shell(room).items() if part != "skirting"]
    for item in openings:
        style = styles[0] if item.category == "door" else styles[1]
        pieces += build_opening(room, item, item.category, style, 7).values()
    mesh = merged(*pieces)
    rng = np.random.default_rng(3)
    points = np.array(outline)
    triangles = triangulate(points)
    mix = 0.97 * rng.dirichlet((1.0, 1.0, 1.0), 60000) + 0.01
    ground = np.einsum("nk,nkd->nd", mix, points[triangles[rng.integers(len(triangles), size=60000)]])
    levels = np.where(rng.random(60000) < 0.5, rng.uniform(0.08, 0.75, 60000), rng.uniform(1.0, 2.5, 60000))
    origins = np.column_stack([ground, levels])
    corner = rng.integers(len(points), size=20000)
    targets = np.column_stack([points[corner], rng.choice((0.0, 1.3, 2.6), 20000)])
    directions = np.vstack([targets - origins[:20000], rng.normal(size=(40000, 3))])
    hits = reference_hits(mesh.vertices[mesh.faces], origins, directions, robust=True)["primID"]
    assert (hits >= 0).all()
    normals = area_vectors(mesh)[hits]
    front = np.einsum("ij,ij->i", normals, directions) < 0.0
    assert front[20000:].all(), "a ray that slipped through a crack would see the back of a wall"
    first = mesh.vertices[mesh.faces[hits, 0]]
    reach = np.einsum("ij,ij->i", first - origins, normals) / np.einsum("ij,ij->i", directions, normals)
    behind = np.abs(reach[:20000][~front[:20000]] - 1.0)
    assert (behind < 1e-4).all(), "rays through the very corner stop there"


def test_no_wall_ends_in_the_inner_face_of_the_next() -> None:
    """Inner faces cover the outline once: where they overlapped another face, chance decided which of the two was seen."""
    mesh = build_shell(room_of(L_SHAPE))["wall"]
    normals = area_vectors(mesh)
    for index in range(len(L_SHAPE)):
        start, _, inward, length = wall_frame(np.array(L_SHAPE), index)
        corners = mesh.vertices[mesh.faces].astype(np.float64)
        flush = (np.abs((corners[..., :2] - start) @ inward) < 1e-5).all(axis=1)
        facing = flush & (normals[:, :2] @ inward > 0.0)
        beside = np.abs((corners[..., :2].mean(1) - start) @ np.array([inward[1], -inward[0]]) - 0.5 * length) < 0.5 * length
        assert np.linalg.norm(normals[facing & beside], axis=1).sum() == pytest.approx(length * 2.8, rel=1e-5)
