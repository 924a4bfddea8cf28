"""What the grammar believes of a category holds for its models: tops carry things where it says, and solids contain the mesh."""

import numpy as np
import pytest
from model_sizes import SIZES, random_cases

from grammar.geometry.solids import local_solids, surface_top
from grammar.spec.categories import read_categories
from renderer.geometry.mesh import Mesh
from renderer.geometry.shapes import merged
from renderer.models import MODELS, build_model
from scene_description.share import config_path

CATEGORIES = {name: category for name, category in read_categories(config_path("categories.yaml")).items() if name in MODELS}
CARRYING = sorted(name for name, category in CATEGORIES.items() if category.surfaces)
COMPOUND = sorted(name for name, category in CATEGORIES.items() if category.solids)
FOOT_M = 0.06
"""Half the width of a thing that is put on a top: somewhere below it must be something to stand on."""
OUT_M = 0.002
"""How far a mesh may stick out of the solids of its category."""
SOFT = {("bed", "duvet"), ("bed", "sheet"), ("bed", "throw"), ("sofa", "seat"), ("sofa", "throw"), ("armchair", "throw")}
SINK_M = 0.05
"""What lies on these parts sinks into them so far."""


def heights_below(mesh: Mesh, points: np.ndarray, least_m: float) -> np.ndarray:
    """Return the highest z of the mesh under each point (n, 2), -inf where nothing reaches ``least_m``."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    corners = corners[corners[..., 2].max(axis=1) >= least_m]
    a, b, c = (corners[:, k] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    a, b, c, area = (rows[np.abs(area) > 1e-12] for rows in (a, b, c, area))
    dx, dy = points[:, None, 0] - a[:, 0], points[:, None, 1] - a[:, 1]
    u = (dx * (c[:, 1] - a[:, 1]) - dy * (c[:, 0] - a[:, 0])) / area
    v = (dy * (b[:, 0] - a[:, 0]) - dx * (b[:, 1] - a[:, 1])) / area
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
    z = a[:, 2] + u * (b[:, 2] - a[:, 2]) + v * (c[:, 2] - a[:, 2])
    return np.asarray(np.where(inside, z, -np.inf).max(axis=1, initial=-np.inf))


@pytest.mark.parametrize("category", CARRYING)
def test_tops_carry_things_where_the_categories_say(category: str) -> None:
    for style, seed, size in random_cases(category, MODELS[category].styles, 6):
        mesh = merged(*build_model(category, style, seed, size).values())
        for surface in CATEGORIES[category].surfaces:
            z, half_d, half_w = surface_top(surface, size)
            x, y = (np.linspace(-0.98 * half, 0.98 * half, max(5, round(half / 0.005))) for half in (half_d, half_w))
            points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
            held = heights_below(mesh, points.reshape(-1, 2), z - 0.01).reshape(len(x), len(y)) > z - 0.006
            near = [np.ceil(FOOT_M / (axis[1] - axis[0])).astype(int) for axis in (x, y)]
            padded = np.pad(held, ((near[0], near[0]), (near[1], near[1])))
            windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * near[0] + 1, 2 * near[1] + 1))
            carried = windows.any(axis=(2, 3)).mean()
            assert carried >= 0.97, f"{category} {style} {size}: {carried:.2f} of its top carries"


@pytest.mark.parametrize("category", COMPOUND)
def test_solids_contain_the_mesh(category: str) -> None:
    for style, seed, size in random_cases(category, MODELS[category].styles, 6, spread=0.1):
        for name, mesh in build_model(category, style, seed, size).items():
            corners = mesh.vertices[mesh.faces].astype(np.float64)
            points = np.concatenate([mesh.vertices, corners.mean(axis=1), 0.5 * (corners[:, 0] + corners[:, 1])])
            boxes = local_solids(CATEGORIES[category], size)
            away = np.stack(
                [
                    np.abs(points[:, None, 0] - boxes[:, 0]) - boxes[:, 4],
                    np.abs(points[:, None, 1] - boxes[:, 1]) - boxes[:, 5],
                    np.maximum(boxes[:, 2] - points[:, None, 2], points[:, None, 2] - boxes[:, 3]),
                ],
                axis=-1,
            ).max(axis=-1)
            worst = away.min(axis=1).max(initial=0.0)
            limit = SINK_M if (category, name) in SOFT else OUT_M
            assert worst <= limit, f"{category} {style} {size}: {name} sticks {1e3 * worst:.0f} mm out of the solids"


def test_every_model_has_a_category_and_a_size() -> None:
    assert set(CATEGORIES) == set(SIZES) == set(MODELS)
