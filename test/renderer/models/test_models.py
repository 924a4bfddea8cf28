"""Every generator in every style and several sizes: box, closedness, normals, budgets, tops, determinism."""

import numpy as np
import pytest
from model_sizes import SIZES, random_cases, sizes_of
from trimesh.graph import connected_component_labels

from grammar.appearance.appearance_rules import load_appearance
from renderer.geometry.mesh import Mesh, signed_volume, surface_area
from renderer.geometry.shapes import (
    block,
    blocks,
    lathe,
    merged,
    mirrored,
    rod,
    rotated,
    rounded_box,
    sheet,
    slab,
)
from renderer.geometry.upholstery import pillow
from renderer.models import FAMILIES, MODELS, build_model, shape_rows
from scene_description.share import config_path

SMALL = set(shape_rows.MODELS) | {
    *("table_lamp", "alarm_clock", "book_stack", "laptop", "monitor", "keyboard", "vase", "picture", "wall_mirror", "speaker"),
    *(
        "photo_frame",
        "wall_clock",
        "wall_shelf",
        "wall_hooks",
        "towel_rail",
    ),
    *("globe", "desk_lamp", "printer", "whiteboard", "shoes", "gym_ball", "cardboard_box", "plastic_crate"),
}
TOPS = ("nightstand", "dresser", "desk", "bookshelf", "coffee_table", "tv_stand", "side_table", "sideboard", "dining_table")
TOPS += ("kitchen_counter", "dishwasher", "shoe_rack", "console_table", "wall_shelf", "china_cabinet")
SHEETS = {("curtain", "cloth"), ("potted_plant", "leaves"), ("vase", "stems"), ("cardboard_box", "print"), ("workbench", "prints")}
"""Parts of cloth, leaves and print, without thickness."""
CASES = [(generator, style) for generator, model in MODELS.items() for style in model.styles]
TOPS += ("filing_cabinet", "workbench", "tool_cabinet", "storage_shelf", "washing_machine", "window_sill")


def face_normals(mesh: Mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    return 0.5 * np.cross(b - a, c - a)


def test_sizes_cover_all_generators() -> None:
    assert set(SIZES) == set(MODELS)


def test_every_model_has_one_row() -> None:
    names = [name for family in FAMILIES for name in family.MODELS]
    assert len(names) == len(set(names)) == len(MODELS)
    assert len(FAMILIES) == len(set(FAMILIES))


def many_cases(generator: str) -> list[tuple[str, int, tuple[float, float, float]]]:
    """Eight random sizes and styles, and every style much smaller and much larger than usual."""
    styles = MODELS[generator].styles
    return random_cases(generator, styles, 8) + [(style, 1, size) for style in styles for size in sizes_of(generator)[1:3]]


@pytest.mark.parametrize("generator", MODELS)
def test_model_fills_its_box_with_closed_outward_parts(generator: str) -> None:
    for style, seed, size in many_cases(generator):
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
            if (generator, name) in SHEETS:
                continue
            assert np.linalg.norm(normals.sum(axis=0)) < 2e-4 * area.sum(), f"{where}: the area vectors of a closed surface cancel"
            assert signed_volume(mesh) > 0.0, where
            agree = np.einsum("ij,ij->i", normals, mesh.normals[mesh.faces].mean(axis=1)) > 0.0
            assert area[agree].sum() > 0.97 * area.sum(), where


@pytest.mark.parametrize(("generator", "style"), CASES)
def test_no_piece_of_a_part_is_turned_inside_out(generator: str, style: str) -> None:
    for name, mesh in build_model(generator, style, 1, SIZES[generator]).items():
        if (generator, name) in SHEETS:
            continue
        _, corners = np.unique(np.round(1e6 * mesh.vertices.astype(np.float64)).astype(np.int64), axis=0, return_inverse=True)
        faces = corners.reshape(-1)[mesh.faces.astype(np.int64)]
        piece_of = connected_component_labels(np.vstack([faces[:, :2], faces[:, 1:]]), node_count=corners.max() + 1)[faces[:, 0]]
        a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) - mesh.vertices.mean(axis=0) for k in range(3))
        volumes = np.bincount(piece_of, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0)
        assert volumes.min() > -1e-9, f"{generator} {style} {name}"


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


@pytest.mark.parametrize("style", MODELS["sink_counter"].styles)
def test_worktop_of_a_sink_lies_at_the_height_of_its_neighbours(style: str) -> None:
    for tall in (1.05, 1.14, 1.2):
        parts = build_model("sink_counter", style, 1, (0.62, 1.0, tall))
        assert parts["worktop"].vertices[:, 2].max() == pytest.approx(0.9, abs=5e-4)
        basin = parts["sink"].vertices
        assert 0.7 < basin[:, 2].min() < 0.75 and parts["tap"].vertices[:, 2].max() == pytest.approx(tall, abs=1e-4)


@pytest.mark.parametrize("style", MODELS["corner_sofa"].styles)
def test_corner_sofa_is_an_l(style: str) -> None:
    depth, width, height = SIZES["corner_sofa"]
    points = np.concatenate([mesh.vertices for mesh in build_model("corner_sofa", style, 1, (depth, width, height)).values()])
    notch = (points[:, 0] > -0.5 * depth + 0.56 * depth) & (points[:, 1] < 0.5 * width - 0.41 * width)
    assert not notch.any()


@pytest.mark.parametrize("style", MODELS["curtain"].styles)
def test_curtain_leaves_the_window_open(style: str) -> None:
    for seed in range(4):
        cloth = build_model("curtain", style, seed, SIZES["curtain"])["cloth"].vertices
        assert np.abs(cloth[:, 1]).min() > 0.2 * SIZES["curtain"][1]


@pytest.mark.parametrize(("generator", "style"), CASES)
def test_same_seed_same_bytes(generator: str, style: str) -> None:
    first, again = (build_model(generator, style, 12345, SIZES[generator]) for _ in range(2))
    assert list(first) == list(again)
    for name in first:
        assert all(a.tobytes() == b.tobytes() for a, b in zip(first[name], again[name], strict=True))


def test_seeds_differ() -> None:
    first, other = (merged(*build_model("bookshelf", "classic", seed, SIZES["bookshelf"]).values()) for seed in (1, 2))
    assert first.vertices.tobytes() != other.vertices.tobytes()


@pytest.mark.parametrize("style", MODELS["weight_bench"].styles)
def test_a_wide_weight_bench_racks_its_bar_and_a_small_one_keeps_it_under_the_pad(style: str) -> None:
    for size, above in (((1.4, 1.5, 1.15), True), ((1.25, 0.55, 0.5), False)):
        parts = build_model("weight_bench", style, 1, size)
        bar_z, pad_z = (0.5 * (parts[name].vertices[:, 2].min() + parts[name].vertices[:, 2].max()) for name in ("bar", "pads"))
        assert (bar_z > pad_z) == above
        assert parts["bar"].vertices[:, 1].max() == pytest.approx(0.5 * size[1], abs=1e-3)


def test_a_bicycle_lies_along_the_longer_side() -> None:
    for size, axis in (((1.75, 0.58, 1.05), 0), ((0.58, 1.75, 1.05), 1)):
        wheels = build_model("bicycle", "diamond", 1, size)["tyres"].vertices
        across = wheels[:, 1 - axis]
        assert np.ptp(wheels[:, axis]) == pytest.approx(1.75, rel=0.03) and np.ptp(across) < 0.06


@pytest.mark.parametrize("style", MODELS["bathtub"].styles)
def test_a_bathtub_is_hollow(style: str) -> None:
    depth, width, height = SIZES["bathtub"]
    basin = build_model("bathtub", style, 1, (depth, width, height))["basin"]
    corners = basin.vertices[basin.faces]
    middle = (np.abs(corners[..., 0]) < 0.3 * depth).all(axis=1) & (np.abs(corners[..., 1]) < 0.3 * width).all(axis=1)
    floor = middle & (face_normals(basin)[:, 2] > 0.0)
    assert floor.any() and corners[floor][..., 2].max() < 0.35 * height


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
    for generator in ("table_lamp", "floor_lamp", "ceiling_lamp", "desk_lamp"):
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
