"""Dressing: colours, palettes, sharing, determinism, refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from grammar.appearance.appearance import MaterialPool, sample_appearance
from grammar.appearance.appearance_rules import Appearance, load_appearance, sample_wear
from grammar.appearance.materials import linear_rgb
from grammar.spec.rules import GrammarError
from scene_description import ModelReference, Opening, Part, Room, SceneObject, Support
from scene_description.scene_json import SURFACES
from scene_description.share import config_path


@pytest.fixture(scope="module")
def appearance() -> Appearance:
    return load_appearance(config_path("appearance.yaml"), config_path("materials.yaml"))


def make_item(number: int, category: str, group: int | None = None, on: int | None = None) -> SceneObject:
    return SceneObject(
        id=number,
        category=category,
        label=1,
        size_m=(0.5, 0.5, 0.5),
        position_m=(0.0, 0.0, 0.0),
        yaw_rad=0.0,
        support=Support(kind="object", id=on) if on else Support(kind="floor"),
        group=group,
        model=ModelReference(generator=category),
        parts=(),
    )


def make_room() -> Room:
    window = Opening(
        id=100,
        category="window",
        label=9,
        wall=0,
        offset_m=1.0,
        sill_m=0.9,
        width_m=1.0,
        height_m=1.0,
        model=ModelReference(generator="window"),
        parts=(),
    )
    return Room(
        polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)), height_m=2.5, wall_thickness_m=0.15, openings=(window,), surfaces=()
    )


def make_objects() -> tuple[SceneObject, ...]:
    return (
        make_item(1, "bed"),
        make_item(2, "nightstand", group=1),
        make_item(3, "nightstand", group=1),
        make_item(4, "table_lamp", on=2),
        make_item(5, "table_lamp", on=3),
        make_item(6, "dresser"),
        make_item(7, "table_lamp", on=6),
        make_item(8, "picture"),
        make_item(9, "picture"),
        make_item(10, "bookshelf"),
        make_item(11, "armchair"),
        make_item(12, "armchair"),
    )


def test_oklch_known_colours() -> None:
    assert linear_rgb(1.0, 0.0, 0.0) == pytest.approx((1.0, 1.0, 1.0), abs=1e-4)
    assert linear_rgb(0.5, 0.0, 90.0) == pytest.approx((0.125, 0.125, 0.125), abs=1e-4)
    assert linear_rgb(0.627955, 0.257683, 29.2339) == pytest.approx((1.0, 0.0, 0.0), abs=0.06)
    assert linear_rgb(0.866440, 0.294827 * 0.9, 142.4953)[1] > 0.8
    for lightness in (0.1, 0.5, 0.95):
        for hue in range(0, 360, 30):
            assert all(0.0 <= value <= 1.0 for value in linear_rgb(lightness, 0.4, hue))


def test_every_part_has_a_material_of_an_allowed_family(appearance: Appearance) -> None:
    for seed in range(40):
        room, objects, materials = sample_appearance(np.random.default_rng(seed), appearance, make_room(), make_objects())
        family = {material.id: material.family for material in materials}
        assert len(family) == len(materials)
        assert {part.name for part in room.surfaces} - {"skirting"} == set(SURFACES)
        for item in (*objects, *room.openings):
            look = appearance.categories[item.category]
            assert tuple(part.name for part in item.parts) == look.styles[item.model.style].parts
            assert item.model.generator == item.category and 0 <= item.model.seed < 2**63
            for part in item.parts:
                rule = look.parts[part.name]
                allowed = set(rule.by_style.get(item.model.style, rule.families))
                liked = [other.material for other in item.parts if other.name == rule.like]
                assert family[part.material] in allowed or part.material in liked


def test_materials_lie_in_their_ranges(appearance: Appearance) -> None:
    for seed in range(20):
        _, _, materials = sample_appearance(np.random.default_rng(seed), appearance, make_room(), make_objects())
        for material in materials:
            kind = appearance.materials[material.id.rsplit("_", 1)[0]]
            assert kind.family == material.family
            assert kind.roughness[0] - 1e-3 <= material.roughness <= kind.roughness[1] + 1e-3
            lightness = float(np.cbrt(material.base_color @ np.array([0.2126, 0.7152, 0.0722])))
            assert kind.lightness[0] - 0.06 <= lightness <= kind.lightness[1] + 0.06, material


def test_what_belongs_together_looks_alike(appearance: Appearance) -> None:
    other_lamp_differs = 0
    for seed in range(20):
        _, objects, _ = sample_appearance(np.random.default_rng(seed), appearance, make_room(), make_objects())
        by_id = {item.id: item for item in objects}
        for one, two in ((2, 3), (4, 5), (11, 12)):
            assert by_id[one].model == by_id[two].model and by_id[one].parts == by_id[two].parts
        assert by_id[8].model.seed != by_id[9].model.seed
        other_lamp_differs += by_id[4].model != by_id[7].model
    assert other_lamp_differs == 20


def test_a_suite_has_one_style_and_one_material_of_fronts_and_worktops(appearance: Appearance) -> None:
    kitchen = tuple(make_item(k, name) for k, name in enumerate(("kitchen_counter", "sink_counter", "wall_cabinet", "dishwasher"), 1))
    styles = set()
    for seed in range(20):
        _, objects, _ = sample_appearance(np.random.default_rng(seed), appearance, make_room(), kitchen)
        assert len({item.model.style for item in objects[:3]}) == 1
        styles.add(objects[0].model.style)
        parts = [{part.name: part.material for part in item.parts} for item in objects]
        assert len({names["fronts"] for names in parts[:3]}) == len({parts[k]["worktop"] for k in (0, 1, 3)}) == 1
    assert styles == {"flat", "framed", "handleless"}


def test_a_room_keeps_few_woods_and_one_metal(appearance: Appearance) -> None:
    for seed in range(30):
        _, _, materials = sample_appearance(np.random.default_rng(seed), appearance, make_room(), make_objects())
        assert sum(material.family == "wood" for material in materials) <= appearance.palette.kept["wood"]
        assert sum(material.family == "metal" for material in materials) <= 1


def test_ceilings_are_light_and_so_are_most_walls(appearance: Appearance) -> None:
    walls = []
    for seed in range(80):
        room, _, materials = sample_appearance(np.random.default_rng(seed), appearance, make_room(), ())
        color = {material.id: material.base_color for material in materials}
        albedo = {part.name: float(np.dot(color[part.material], (0.2126, 0.7152, 0.0722))) for part in room.surfaces}
        assert 0.1 < albedo["wall"] < 0.87 and 0.75 < albedo["ceiling"] < 0.9 and albedo["floor"] < 0.55
        walls.append(albedo["wall"])
    assert np.quantile(walls, 0.2) > 0.35 and np.median(walls) > 0.5


def test_a_second_hue_is_kept_off_violets(appearance: Appearance) -> None:
    low, high = appearance.palette.avoided_deg
    hues = np.array([MaterialPool(np.random.default_rng(seed), appearance)._palette.second_deg % 360.0 for seed in range(300)])
    assert not ((hues > low) & (hues < high)).any()
    assert (hues == low).any() and (hues == high).any()


def test_accents_lie_apart_from_the_main_hue(appearance: Appearance) -> None:
    """Of a material of the accent's hue, whatever the room's main hue; garments follow neither."""
    least = appearance.palette.accent_apart_deg - 2.0 * appearance.palette.jitter_deg - 8.0
    for seed in range(40):
        palette = MaterialPool(np.random.default_rng(seed), appearance)._palette
        apart = abs((palette.accent_deg - palette.main_deg + 180.0) % 360.0 - 180.0)
        assert apart >= least, seed
    assert appearance.materials["accent_cloth"].hue == "accent"
    assert all(appearance.materials[name].hue == "own" for name in (*appearance.families["coat"], *appearance.families["laundry"]))


def test_surfaces_depend_on_the_room_type(appearance: Appearance) -> None:
    usual = set(appearance.surfaces["floor"].families)
    for room_type, families in (("bathroom", {"floor_tile"}), ("garage", {"floor_concrete"}), ("", usual)):
        seen = set()
        for seed in range(60):
            room, _, materials = sample_appearance(np.random.default_rng(seed), appearance, make_room(), (), room_type)
            family = {material.id: material.family for material in materials}
            seen |= {family[part.material] for part in room.surfaces if part.name == "floor"}
        assert seen == families


def test_textures_are_drawn_from_their_ranges_and_differ(appearance: Appearance) -> None:
    scales, seeds = [], []
    for seed in range(60):
        _, _, materials = sample_appearance(np.random.default_rng(seed), appearance, make_room(), make_objects(), "bedroom")
        for material in materials:
            kind = appearance.materials[material.id.rsplit("_", 1)[0]].texture
            assert (kind is None) == (material.texture is None)
            if kind is not None and material.texture is not None:
                got = material.texture
                assert got.generator == kind.generator and len(got.colors) == len(kind.colors)
                assert kind.scale_m[0] - 1e-4 <= got.scale_m <= kind.scale_m[1] + 1e-4
                assert kind.contrast[0] - 1e-3 <= got.contrast <= kind.contrast[1] + 1e-3
                scales.append(got.scale_m)
                seeds.append(got.seed)
    assert len(seeds) > 300 and len(set(seeds)) == len(seeds) and len(set(scales)) > 0.4 * len(scales)


def test_rooms_are_worn_as_asked_or_as_their_type_is(appearance: Appearance) -> None:
    rule = appearance.wear
    assert sample_wear(np.random.default_rng(1), rule, "garage", 0.0) == ()
    worn = sample_wear(np.random.default_rng(1), rule, "garage", 1.0)
    assert worn == tuple(rule.layers.values())
    for room_type in ("garage", "bedroom"):
        low, high = rule.rooms.get(room_type, rule.rooms["any"])
        for seed in range(20):
            drawn = sample_wear(np.random.default_rng(seed), rule, room_type, -1.0)
            share = drawn[1].strength / rule.layers["scuffs"].strength
            assert low - 1e-3 <= share <= high + 1e-3


def test_materials_show_wear_by_their_family(appearance: Appearance) -> None:
    for name, shown in (("white_wall", 1.0), ("deep_curtain", 0.0), ("oak", appearance.wear.shown["wood"])):
        pool = MaterialPool(np.random.default_rng(3), appearance)
        pool.draw_material(name)
        assert pool.materials[0].wear == shown


def test_half_of_the_windows_have_nets_or_blinds(appearance: Appearance) -> None:
    odds = {name: style.odds for name, style in appearance.categories["window"].styles.items()}
    assert sum(share for name, share in odds.items() if "_" in name) == pytest.approx(0.5 * sum(odds.values()))


def test_same_seed_same_dress(appearance: Appearance) -> None:
    first, again, other = (sample_appearance(np.random.default_rng(seed), appearance, make_room(), make_objects()) for seed in (5, 5, 6))
    assert first == again and first != other


def test_styles_follow_their_odds(appearance: Appearance) -> None:
    counts: dict[str, int] = {}
    for seed in range(600):
        _, objects, _ = sample_appearance(np.random.default_rng(seed), appearance, make_room(), (make_item(1, "waste_bin"),))
        counts[objects[0].model.style] = counts.get(objects[0].model.style, 0) + 1
    odds = {name: style.odds for name, style in appearance.categories["waste_bin"].styles.items()}
    for name, share in odds.items():
        expected = 600 * share / sum(odds.values())
        assert abs(counts[name] - expected) < 4.5 * np.sqrt(expected)


def test_model_files_keep_their_model_and_parts(appearance: Appearance) -> None:
    mine = replace(make_item(1, "bed"), model=ModelReference(file="bed.glb"), parts=(Part(name="all", material="x"),))
    _, objects, _ = sample_appearance(np.random.default_rng(1), appearance, make_room(), (mine,))
    assert objects == (mine,)


def test_lamps_emit_from_their_shade(appearance: Appearance) -> None:
    lamps = {name for name, look in appearance.categories.items() if look.emits}
    assert lamps >= {"table_lamp", "floor_lamp", "ceiling_lamp", "desk_lamp"}
    assert {appearance.categories[name].emits for name in lamps} == {"shade"}


def test_materials_library(appearance: Appearance) -> None:
    assert len(appearance.materials) >= 60
    clear = {"window_glass", "clear_glass", "shower_glass", "car_glass"}
    assert all(appearance.materials[name].transmission[0] >= 0.8 for name in clear)
    sheets = {name for name, kind in appearance.materials.items() if kind.diffuse_transmission[1] > 0.0}  # of which nets have holes
    others = appearance.materials.keys() - clear - sheets
    assert all(appearance.materials[name].transmission == (0.0, 0.0) for name in others) and len(sheets) < 30 < len(others)


def test_unknown_category_is_named(appearance: Appearance) -> None:
    with pytest.raises(GrammarError, match="'throne'"):
        sample_appearance(np.random.default_rng(1), appearance, make_room(), (make_item(1, "throne"),))


FAULTS = {
    "bed:\n    shared: room": ("bed:\n    shared: never", "categories.bed.shared"),
    "frame: {families: {wood: 0.8": ("frame: {families: {wud: 0.8", "categories.bed.parts.frame.families"),
    "parts: [frame, headboard, legs, slats": ("parts: [frame, hedboard, legs, slats", "categories.bed.styles"),
    "emits: shade": ("emits: halo", "emits"),
    "headboard: {like: frame}": ("headboard: {like: pillows}", "categories.bed.parts.headboard.like"),
    "ceiling: {families: {ceiling_paint: 1}}": ("ceiling: {families: {}}", "surfaces.ceiling.families"),
    "bathroom: {floor_tile: 1}": ("bathroom: {floor_tyle: 1}", "surfaces.floor.by_room.bathroom"),
}


@pytest.mark.parametrize("old", FAULTS)
def test_faults_of_the_appearance_are_named(tmp_path: Path, old: str) -> None:
    new, field = FAULTS[old]
    text = config_path("appearance.yaml").read_text()
    assert old in text
    (tmp_path / "appearance.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(GrammarError, match=field) as caught:
        load_appearance(tmp_path / "appearance.yaml", config_path("materials.yaml"))
    assert "\n" not in str(caught.value) and "appearance.yaml" in str(caught.value)


@pytest.mark.parametrize(
    ("line", "field"),
    [
        (
            "  odd: {family: x, lightness: [0.1, 2.0], chroma: [0, 0], hue_deg: [0, 1], roughness: [0, 1]}\n",
            r"materials.odd.lightness\[1\]",
        ),
        ("  odd: {family: x, lightness: [0.1, 0.2], chroma: [0, 0], roughness: [0, 1]}\n", "materials.odd"),
        ("  odd: {family: x, lightness: [0.1, 0.2], chroma: [0, 0], hue_deg: [0, 1], hue: main, roughness: [0, 1]}\n", "materials.odd"),
        (
            "  odd: {family: x, lightness: [0.1, 0.2], chroma: [0, 0], hue_deg: [0, 1], roughness: [0, 1], shine: 1}\n",
            "materials.odd.shine",
        ),
    ],
)
def test_faults_of_the_materials_are_named(tmp_path: Path, line: str, field: str) -> None:
    (tmp_path / "materials.yaml").write_text(config_path("materials.yaml").read_text() + line)
    with pytest.raises(GrammarError, match=field):
        load_appearance(config_path("appearance.yaml"), tmp_path / "materials.yaml")


def test_walls_of_tiles_bricks_and_concrete_have_no_skirting(appearance: Appearance) -> None:
    found = set()
    for seed in range(40):
        room, _, materials = sample_appearance(
            np.random.default_rng(seed), appearance, make_room(), (), "storage" if seed % 2 else "bathroom"
        )
        of = {part.name: next(material.family for material in materials if material.id == part.material) for part in room.surfaces}
        bare = of["wall"] in ("wall_tile", "wall_brick", "wall_concrete")
        assert ("skirting" in of) != bare
        found.add(bare)
    assert found == {True, False}
