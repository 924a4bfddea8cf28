"""Texture coordinates are metres along the surface, whole and continuous over a shape's sides."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from sample_scene import sample_scene

from renderer.geometry.cloth import Drape, cloth, drape
from renderer.geometry.coordinates import box_mapped
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import (
    block,
    flat_quads,
    lathe,
    make_mesh,
    merged,
    mirrored,
    moved,
    rod,
    rotated,
    rounded_box,
    sheet,
    slab,
    stretched,
)
from renderer.geometry.upholstery import cushion, pillow
from renderer.scene.room_shell import build_shell


def edge_ratios(mesh: Mesh, smallest_m2: float = 0.0) -> np.ndarray:
    """Length in texture coordinates over length in space, for the edges of all triangles larger than ``smallest_m2``."""
    corners, flat = mesh.vertices[mesh.faces].astype(np.float64), mesh.uvs[mesh.faces].astype(np.float64)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    corners, flat = corners[area > smallest_m2], flat[area > smallest_m2]
    space = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return (np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2) / space).ravel()


def waved(length_m: float) -> np.ndarray:
    u, v = np.meshgrid(np.linspace(0.0, length_m, 80), np.linspace(0.0, 1.0, 12), indexing="ij")
    return np.dstack([u, v, 0.05 * np.sin(9.0 * u)])


EXACT: dict[str, Callable[[], Mesh]] = {
    "cylinder": lambda: lathe([(0.0, 0.0), (0.2, 0.0), (0.2, 0.7), (0.0, 0.7)], 64),
    "rod": lambda: rod((0.1, 0.2, 0.0), (0.3, 0.1, 1.0), 0.03, segments=32),
    "sheet": lambda: sheet(waved(1.5), waved(1.5) - (0.0, 0.0, 0.01)),
    "slab": lambda: slab([(0.0, 0.0), (1.0, 0.0), (1.2, 0.8), (0.1, 0.9)], 0.1, 0.2),
    "quads": lambda: flat_quads([[(0, 0, 0), (1, 0, 0), (1, 2, 0.5), (0, 2, 0.5)]]),
    "rounded": lambda: rounded_box((0, 0, 0), (0.5, 0.3, 0.2), 0.05, segments=6),
}


SMALLEST_M2 = {"sheet": 5e-4, "rounded": 3e-4}
"""Leaves out what has no flat map: the rims of a sheet, the corners of a rounded box."""


@pytest.mark.parametrize("name", EXACT)
def test_texture_lengths_are_lengths_on_the_surface(name: str) -> None:
    mesh = EXACT[name]()
    assert mesh.uvs.dtype == np.float32 and mesh.uvs.shape == (len(mesh.vertices), 2)
    ratios = edge_ratios(mesh, SMALLEST_M2.get(name, 0.0))
    assert np.percentile(np.abs(ratios - 1.0), 90) < 0.04, (name, np.percentile(ratios, [0, 5, 50, 95, 100]))


def test_a_board_has_its_grain_along_its_longest_side_on_all_four_sides() -> None:
    for longest in range(3):
        size = np.roll([1.2, 0.3, 0.04], longest)
        mesh = block((0.3, -0.2, 0.1), (0.3 + size[0], -0.2 + size[1], 0.1 + size[2]))
        assert np.allclose(edge_ratios(mesh, 4e-3), 1.0, atol=0.02)
        along = np.abs(mesh.normals[:, longest]) < 0.5
        u, x = mesh.uvs[along, 0], mesh.vertices[along, longest]
        assert np.ptp(u - x) < 1e-5 or np.ptp(u + x) < 1e-5
        ends = ~along
        assert np.ptp(mesh.uvs[ends, 0]) == pytest.approx(0.3, abs=0.01)


def test_the_sides_of_a_board_follow_each_other_without_a_jump() -> None:
    mesh = block((0, 0, 0), (1.0, 0.2, 0.1))
    flat, corners = mesh.uvs[mesh.faces], mesh.vertices[mesh.faces]
    across = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min(axis=1) < 0.006
    jump = np.abs(flat - np.roll(flat, 1, axis=1)).max(axis=(1, 2))
    smooth = jump[across & (np.ptp(corners[:, :, 0], axis=1) > 0.5)]
    assert len(smooth) == 8
    assert np.sort(smooth)[:6].max() < 1.01  # three of the four long edges: along the board only, no jump round it


def test_neighbouring_bands_of_a_smooth_turned_body_share_their_coordinates() -> None:
    angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 12)
    ball = lathe([(0.3 * math.cos(a), 0.3 * math.sin(a)) for a in angle], 24)
    key = np.round(np.hstack([ball.vertices, np.tile(np.arange(25), 22)[:, None]]), 5)
    for point in np.unique(key, axis=0):
        same = (key == point).all(axis=1)
        if abs(point[2]) < 0.299:  # not the poles
            assert np.ptp(ball.uvs[same], axis=0).max() < 1e-6


def test_cloth_that_falls_in_folds_keeps_the_size_of_its_pattern() -> None:
    cover = drape(np.random.default_rng(1), Drape(0.9, 0.7, 0.5, 0.3, 0.3, 0.0, 0.05))
    ratios = edge_ratios(cloth(cover, 0.01), 1e-4)
    assert 0.9 < np.median(ratios) < 1.1
    assert np.mean((ratios > 0.75) & (ratios < 1.3)) > 0.85
    for soft in (
        cushion(np.random.default_rng(2), (0, 0, 0), (0.6, 0.5, 0.15), 0.05, 0.03),
        pillow(np.random.default_rng(3), 0.4, 0.6, 0.15),
    ):
        assert np.isfinite(soft.uvs).all()
        assert 0.85 < np.median(edge_ratios(soft, 1e-4)) < 1.15


def test_moving_turning_mirroring_and_joining_keep_coordinates() -> None:
    mesh = block((0, 0, 0), (1, 0.5, 0.2))
    for other in (moved(mesh, 1.0, 2.0, 3.0), rotated(mesh, "x", 0.7), mirrored(mesh, "y")):
        np.testing.assert_array_equal(other.uvs, mesh.uvs)
    joined = merged(mesh, rod((0, 0, 0), (0, 0, 1), 0.1))
    np.testing.assert_array_equal(joined.uvs[: len(mesh.uvs)], mesh.uvs)
    assert np.median(edge_ratios(stretched(mesh, (1.5, 1.5, 1.5), (0, 0, 0)), 1e-3)) == pytest.approx(1.0, abs=1e-3)


def test_meshes_without_coordinates_are_mapped_by_boxes() -> None:
    corners = [[(0, 0, 0), (2, 0, 0), (2, 1, 0)], [(0, 0, 0), (0, 1, 0), (0, 1, 3)]]
    bare = make_mesh(np.reshape(corners, (-1, 3)), [(0, 0, 1)] * 6, [(0, 1, 2), (3, 4, 5)])
    assert len(bare.uvs) == 0
    mesh = box_mapped(bare)
    np.testing.assert_allclose(edge_ratios(mesh), 1.0)
    np.testing.assert_allclose(np.ptp(mesh.uvs[mesh.faces[0]], axis=0), (2, 1))
    np.testing.assert_allclose(np.ptp(mesh.uvs[mesh.faces[1]], axis=0), (3, 1))  # u along z, the longer side of the box


def test_box_mapping_splits_shared_vertices_and_leaves_the_rest_alone() -> None:
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
    faces = [
        (0, 1, 3),
        (0, 3, 2),
        (4, 6, 7),
        (4, 7, 5),
        (0, 4, 5),
        (0, 5, 1),
        (2, 3, 7),
        (2, 7, 6),
        (0, 2, 6),
        (0, 6, 4),
        (1, 5, 7),
        (1, 7, 3),
    ]
    board = block((2, 0, 0), (3, 0.2, 0.1))
    both = box_mapped(merged(make_mesh(cube, cube - 0.5, faces), board))
    assert np.isfinite(both.uvs).all() and len(both.uvs) == len(both.vertices)
    np.testing.assert_allclose(edge_ratios(both)[: 3 * 12], 1.0, atol=1e-6)
    whole = merged(make_mesh(cube, cube - 0.5, faces), board)
    np.testing.assert_array_equal(both.vertices[both.faces], whole.vertices[whole.faces])
    np.testing.assert_array_equal(both.uvs[both.faces[12:]], board.uvs[board.faces])
    assert box_mapped(both) is both


def test_floor_and_walls_are_mapped_in_metres_and_wallpaper_goes_round_the_corner() -> None:
    shell = build_shell(sample_scene().room)
    for name in ("floor", "wall", "ceiling"):
        mesh = shell[name]
        assert np.isfinite(mesh.uvs).all()
        assert np.mean(np.abs(edge_ratios(mesh, 0.02) - 1.0) < 1e-4) > 0.9  # the hidden ends of walls are cut obliquely
    wall = shell["wall"]
    inner = np.abs(wall.vertices[:, 2] - wall.uvs[:, 1]) < 1e-5
    assert inner.mean() > 0.7
