"""Every generator in every style and several sizes: box, closedness, normals, budgets, tops, determinism."""

import numpy as np
import pytest

from grammar.appearance import load_appearance
from renderer.flat_scene import Mesh
from renderer.models import MODELS, build_model
from renderer.models.soft import pillow
from renderer.shapes import block, blocks, lathe, merged, mirrored, rod, rotated, rounded_box, sheet, signed_volume, slab, surface_area
from scene_description.share import config_path

SIZES = {
    "bed": (2.1, 1.7, 1.05),
    "nightstand": (0.42, 0.5, 0.52),
    "dresser": (0.48, 1.3, 0.85),
    "wardrobe": (0.6, 1.6, 2.1),
    "desk": (0.65, 1.3, 0.75),
    "desk_chair": (0.62, 0.62, 0.98),
    "bookshelf": (0.32, 0.95, 1.9),
    "armchair": (0.85, 0.82, 0.85),
    "pouf": (0.5, 0.5, 0.42),
    "floor_lamp": (0.45, 0.45, 1.6),
    "potted_plant": (0.5, 0.5, 1.1),
    "rug": (1.6, 2.3, 0.015),
    "waste_bin": (0.28, 0.28, 0.35),
    "table_lamp": (0.3, 0.3, 0.5),
    "alarm_clock": (0.07, 0.14, 0.12),
    "book_stack": (0.16, 0.22, 0.1),
    "laptop": (0.3, 0.34, 0.23),
    "monitor": (0.2, 0.55, 0.45),
    "keyboard": (0.14, 0.44, 0.03),
    "mug": (0.12, 0.085, 0.1),
    "vase": (0.14, 0.14, 0.3),
    "television": (0.25, 1.1, 0.68),
    "picture": (0.03, 0.7, 0.5),
    "wall_mirror": (0.03, 0.6, 0.9),
    "radiator": (0.1, 1.0, 0.6),
    "ceiling_lamp": (0.42, 0.42, 0.3),
}
SMALL = {"table_lamp", "alarm_clock", "book_stack", "laptop", "monitor", "keyboard", "mug", "vase", "picture", "wall_mirror", "waste_bin"}
TOPS = ("nightstand", "dresser", "desk", "bookshelf")
CASES = [(generator, style) for generator, model in MODELS.items() for style in model.styles]


def sizes_of(generator: str) -> list[tuple[float, float, float]]:
    rng = np.random.default_rng(sorted(MODELS).index(generator))
    nominal = np.array(SIZES[generator])
    shapes = [nominal, 0.72 * nominal, 1.3 * nominal, *(nominal * rng.uniform(0.75, 1.25, (3, 3)))]
    return [(float(d), float(w), float(h)) for d, w, h in shapes]


def face_normals(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    return 0.5 * np.cross(b - a, c - a)


def test_sizes_cover_all_generators() -> None:
    assert set(SIZES) == set(MODELS)


@pytest.mark.parametrize(("generator", "style"), CASES)
def test_model_fills_its_box_with_closed_outward_parts(generator: str, style: str) -> None:
    for seed, size in enumerate(sizes_of(generator)):
        parts = build_model(generator, style, seed, size)
        points = np.concatenate([mesh.vertices for mesh in parts.values()])
        low, high = points.min(axis=0), points.max(axis=0)
        half = 0.5 * np.array(size)
        assert (low >= (-half[0] - 1e-3, -half[1] - 1e-3, -1e-3)).all() and (high <= (half[0] + 1e-3, half[1] + 1e-3, size[2] + 1e-3)).all()
        assert (high - low >= 0.98 * np.array(size)).all()
        assert sum(len(mesh.faces) for mesh in parts.values()) <= (2000 if generator in SMALL else 15000)
        for name, mesh in parts.items():
            where = f"{generator} {style} seed {seed} {name}"
            assert mesh.vertices.dtype == mesh.normals.dtype == np.float32 and mesh.faces.dtype == np.uint32, where
            assert np.isfinite(mesh.vertices).all() and np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-4), where
            assert mesh.faces.max() < len(mesh.vertices), where
            normals = face_normals(mesh)
            area = np.linalg.norm(normals, axis=1)
            assert area.min() > 1e-12, where
            assert np.linalg.norm(normals.sum(axis=0)) < 2e-4 * area.sum(), f"{where}: the area vectors of a closed surface cancel"
            assert signed_volume(mesh) > 0.0, where
            agree = np.einsum("ij,ij->i", normals, mesh.normals[mesh.faces].mean(axis=1)) > 0.0
            assert area[agree].sum() > 0.97 * area.sum(), where


@pytest.mark.parametrize(("generator", "style"), [(g, s) for g, s in CASES if g in TOPS])
def test_tops_are_flat_at_the_objects_height(generator: str, style: str) -> None:
    for seed, size in enumerate(sizes_of(generator)):
        parts = build_model(generator, style, seed, size)
        mesh = merged(*parts.values())
        corners = mesh.vertices[mesh.faces]
        level = (np.abs(corners[..., 2] - size[2]) < 1e-3).all(axis=1)
        facing_up = face_normals(mesh)[level, 2]
        assert facing_up[facing_up > 0.0].sum() >= 0.9 * size[0] * size[1]


@pytest.mark.parametrize("style", MODELS["desk"].styles)
def test_knees_find_room_under_the_desk(style: str) -> None:
    size = SIZES["desk"]
    points = np.concatenate([mesh.vertices for mesh in build_model("desk", style, 1, size).values()])
    knees = (points[:, 0] > 0.0) & (np.abs(points[:, 1]) < 0.5 * size[1] - 0.13) & (points[:, 2] < 0.6)
    assert not knees.any()


@pytest.mark.parametrize(("generator", "style"), CASES)
def test_same_seed_same_bytes(generator: str, style: str) -> None:
    first, again = (build_model(generator, style, 12345, SIZES[generator]) for _ in range(2))
    assert list(first) == list(again)
    for name in first:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(first[name], again[name], strict=True))


def test_seeds_differ() -> None:
    first, other = (merged(*build_model("bookshelf", "classic", seed, SIZES["bookshelf"]).values()) for seed in (1, 2))
    assert first.vertices.tobytes() != other.vertices.tobytes()


def test_styles_and_parts_agree_with_the_appearance() -> None:
    looks = load_appearance(config_path("appearance.yaml"), config_path("materials.yaml")).categories
    for generator, style in CASES:
        styles = looks[generator].styles
        assert set(styles) == set(MODELS[generator].styles)
        assert set(styles[style].parts) == set(build_model(generator, style, 3, SIZES[generator]))


def test_default_style_and_unknown_names() -> None:
    default = build_model("mug", "default", 1, SIZES["mug"])
    assert default["body"].vertices.tobytes() == build_model("mug", MODELS["mug"].styles[0], 1, SIZES["mug"])["body"].vertices.tobytes()
    with pytest.raises(KeyError):
        build_model("mug", "baroque", 1, SIZES["mug"])


def test_lamps_shine_outward_from_a_closed_shade() -> None:
    for generator in ("table_lamp", "floor_lamp", "ceiling_lamp"):
        for style in MODELS[generator].styles:
            shade = build_model(generator, style, 1, SIZES[generator])["shade"]
            normals, centers = face_normals(shade), shade.vertices[shade.faces].mean(axis=1)
            axis = 0.5 * (shade.vertices[:, :2].min(axis=0) + shade.vertices[:, :2].max(axis=0))
            outward = np.einsum("ij,ij->i", normals[:, :2], centers[:, :2] - axis)
            assert outward[outward > 0.0].sum() > 0.45 * np.abs(outward).sum()


def test_shapes_have_known_volumes_and_areas() -> None:
    cube = block((0, 0, 0), (1, 2, 3), 1e-6)
    assert signed_volume(cube) == pytest.approx(6.0, rel=1e-4) and surface_area(cube) == pytest.approx(22.0, rel=1e-4)
    assert signed_volume(blocks([(0, 0, 0), (2, 0, 0)], [(1, 1, 1), (3, 1, 1)], 1e-6)) == pytest.approx(2.0, rel=1e-4)
    n = 64
    polygon = 0.5 * n * np.sin(2 * np.pi / n)
    assert signed_volume(lathe([(0, 0), (1, 0), (1, 2), (0, 2)], n)) == pytest.approx(2 * polygon, rel=1e-5)
    ring = lathe([(1, 0), (2, 0), (2, 1), (1, 1)], n, closed=True)
    assert signed_volume(ring) == pytest.approx(3 * polygon, rel=1e-5)
    assert signed_volume(rod((0, 0, 0), (3, 0, 0), 0.5, segments=n)) == pytest.approx(0.75 * polygon, rel=1e-5)
    assert signed_volume(slab([(0, 0), (2, 0), (2, 1), (0, 1)], 0, 0.5)) == pytest.approx(1.0)
    assert signed_volume(rotated(mirrored(cube, "y"), "z", 0.7)) == pytest.approx(6.0, rel=1e-4)
    r, a = 0.2, 0.6
    expected = 1.0 - (8 * r**3 - 4 / 3 * np.pi * r**3) - 3 * a * (4 - np.pi) * r**2
    assert signed_volume(rounded_box((0, 0, 0), (1, 1, 1), r, 12)) == pytest.approx(expected, rel=2e-3)
    u, v = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 2, 5), indexing="ij")
    assert signed_volume(sheet(np.dstack([u, v, 1 + 0 * u]), np.dstack([u, v, 0 * u]))) == pytest.approx(2.0)


def test_pillow_is_thickest_in_the_middle() -> None:
    mesh = pillow(np.random.default_rng(1), 0.4, 0.6, 0.15)
    radius = np.abs(mesh.vertices[:, :2] / (0.2, 0.3)).max(axis=1)
    assert mesh.vertices[radius < 0.3, 2].max() > 0.05 > 0.02 > mesh.vertices[radius > 0.95, 2].max()
