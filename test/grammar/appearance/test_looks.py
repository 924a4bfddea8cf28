"""Looks: what they change, that nothing else changes, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from grammar.appearance.appearance import MaterialPool, sample_appearance, sample_appearance_from
from grammar.appearance.appearance_rules import Appearance, load_appearance
from grammar.appearance.looks import apply_looks, read_looks
from grammar.appearance.materials import linear_rgb
from grammar.appearance.restrict import restricted
from grammar.spec.request import RequestError, SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_description import Material, ModelReference, Opening, Room, SceneDescription, SceneObject, Support
from scene_description.labels import LABEL_ID
from scene_description.share import config_path

DOOR = Opening(
    id=1, category="door", label=LABEL_ID["door"], wall=0, offset_m=1.0, sill_m=0.0, width_m=0.9, height_m=2.0,
    model=ModelReference(generator="door"), parts=(),
)  # fmt: skip
ROOM = Room(polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)), height_m=2.5, wall_thickness_m=0.15, openings=(DOOR,), surfaces=())


@pytest.fixture(scope="module")
def appearance() -> Appearance:
    return load_appearance(config_path("appearance.yaml"), config_path("materials.yaml"))


def make_item(identifier: int, category: str) -> SceneObject:
    return SceneObject(
        id=identifier, category=category, label=40, size_m=(0.5, 0.5, 0.5), position_m=(1.0, 1.0, 0.0), yaw_rad=0.0,
        support=Support(kind="floor"), model=ModelReference(generator=category), parts=(),
    )  # fmt: skip


ITEMS = (
    make_item(2, "bed"),
    make_item(3, "nightstand"),
    make_item(4, "nightstand"),
    make_item(5, "desk_chair"),
    make_item(6, "vase"),
    make_item(7, "vase"),
)


class Dressed:
    """A dressed room: the material of each part by ``id/part``."""

    def __init__(self, appearance: Appearance, *looks: str, seed: int = 3, **asked: object) -> None:
        request = SceneRequest(looks=looks, **asked)  # type: ignore[arg-type]
        rng = np.random.default_rng(seed)
        changed = restricted(appearance, request)
        pool = MaterialPool(rng, changed)
        room, items = sample_appearance_from(pool, rng, changed, ROOM, ITEMS, "bedroom")
        room, self.items = apply_looks(np.random.default_rng(seed), pool, request, room, items)
        table = {item.id: item for item in pool.materials}
        assert len(table) == len(pool.materials), "ids are unique"
        self.parts: dict[str, Material] = {f"room/{part.name}": table[part.material] for part in room.surfaces}
        for owner in (*room.openings, *self.items):
            self.parts |= {f"{owner.id}/{part.name}": table[part.material] for part in owner.parts}

    def changed_from(self, other: "Dressed") -> set[str]:
        return {name for name, material in self.parts.items() if other.parts[name] != material}


def test_without_looks_the_room_is_as_it_was(appearance: Appearance) -> None:
    rng = np.random.default_rng(3)
    _, items, materials = sample_appearance(rng, appearance, ROOM, ITEMS, "bedroom")
    table = {item.id: item for item in materials}
    plain = Dressed(appearance)
    assert all(plain.parts[f"{item.id}/{part.name}"] == table[part.material] for item in items for part in item.parts)


@pytest.mark.parametrize(
    ("look", "changed"),
    [
        ("bed/duvet: {material: deep_cover}", {"2/duvet"}),
        ("3/body: {color: '#c0392b'}", {"3/body"}),
        ("nightstand/handles: {roughness: 0.77}", {"3/handles", "4/handles"}),
        ("room/floor: {base_color: [0.1, 0.2, 0.3]}", {"room/floor"}),
        ("door/leaf: {family: colored_lacquer}", {"1/leaf"}),
        ("'*/handle': {metallic: 0.33}", {"1/handle"}),
        ("6/body: {roughness: 0.123}", {"6/body"}),
    ],
)
def test_a_look_changes_its_target_and_nothing_else(appearance: Appearance, look: str, changed: set[str]) -> None:
    assert Dressed(appearance, look).changed_from(Dressed(appearance)) == changed


def test_values_are_those_asked_for(appearance: Appearance) -> None:
    parts = Dressed(
        appearance,
        "bed/duvet: {material: deep_cover, base_color: [0.1, 0.2, 0.3], roughness: 0.5}",
        "bed/throw: {color: '#808080', clearcoat: 0.25}",
        "bed/frame: walnut",
        "desk_chair: {lightness: 0.6, chroma: 0.05, hue_deg: 30}",
    ).parts
    assert parts["2/duvet"].base_color == (0.1, 0.2, 0.3) and parts["2/duvet"].roughness == 0.5 and parts["2/duvet"].family == "cover"
    assert parts["2/throw"].base_color == pytest.approx((0.215861,) * 3, abs=1e-6) and parts["2/throw"].clearcoat == 0.25
    assert parts["2/frame"].id.startswith("walnut_") and parts["2/frame"].family == "wood"
    colors = {parts[name].base_color for name in parts if name.startswith("5/")}
    assert colors == {linear_rgb(0.6, 0.05, 30.0)}


def test_ranges_are_drawn_alike_or_for_each(appearance: Appearance) -> None:
    alike = Dressed(appearance, "nightstand/handles: {roughness: [0.1, 0.9]}").parts
    assert alike["3/handles"].roughness == alike["4/handles"].roughness
    each = Dressed(appearance, "vase/body: {roughness: [0.1, 0.9], each: true}").parts
    assert each["6/body"].roughness != each["7/body"].roughness
    drawn = [Dressed(appearance, "bed/duvet: {roughness: [0.2, 0.6]}", seed=seed).parts["2/duvet"].roughness for seed in range(40)]
    assert 0.2 <= min(drawn) < 0.28 and 0.52 < max(drawn) <= 0.6, "the whole range is used"


def test_later_looks_win_and_do_not_disturb_others(appearance: Appearance) -> None:
    first, second = "bed/duvet: {roughness: [0.1, 0.9]}", "bed/throw: {roughness: [0.1, 0.9]}"
    both = Dressed(appearance, first, second, "vase: {roughness: 0.5}").parts
    assert both["2/duvet"].roughness == Dressed(appearance, first).parts["2/duvet"].roughness
    assert both["2/throw"].roughness == Dressed(appearance, second).parts["2/throw"].roughness
    assert Dressed(appearance, first, "bed: {roughness: 0.3}").parts["2/duvet"].roughness == 0.3


def test_styles_are_chosen(appearance: Appearance) -> None:
    for seed in range(8):
        (bed,) = (item for item in Dressed(appearance, "bed: {styles: [panel]}", seed=seed).items if item.category == "bed")
        assert bed.model.style == "panel"
    styles = {Dressed(appearance, "bed: {styles: [panel, platform]}", seed=seed).items[0].model.style for seed in range(20)}
    assert styles == {"panel", "platform"}


def test_excluded_materials_are_not_drawn(appearance: Appearance) -> None:
    families = {m.family for seed in range(12) for m in Dressed(appearance, seed=seed, exclude_materials=("wood", "walnut")).parts.values()}
    assert "wood" not in families and "lacquer" in families
    rooms = [Dressed(appearance, seed=seed, exclude_materials=("oak", "pine")) for seed in range(25)]
    names = {material.id.rsplit("_", 1)[0] for room in rooms for material in room.parts.values()}
    assert not names & {"oak", "pine"} and "walnut" in names


def test_the_palette_follows_its_hue(appearance: Appearance) -> None:
    """Materials of the main hue are drawn within 8 degrees of it: compare with OKLCH's own conversion at that hue."""
    for hue in (30.0, 250.0):
        rng = np.random.default_rng(1)
        changed = restricted(appearance, SceneRequest(palette_hue_deg=hue))
        pool = MaterialPool(rng, changed)
        for _ in range(20):
            pool.draw_material("accent_main")
        mean = np.mean([item.base_color for item in pool.materials], axis=0)
        expected = np.array(linear_rgb(0.53, 0.051, hue))
        assert np.argmax(mean) == np.argmax(expected) and np.allclose(mean, expected, atol=0.03)


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        ({"exclude_materials": ("window_glass",)}, "style of window"),
        ({"looks": ("bed/duvet",)}, "expected one 'TARGET"),
        ({"looks": ("bed/duvet: {materal: oak}",)}, "materal: expected one of"),
        ({"looks": ("bed/duvet: {material: gold}",)}, "expected a material of materials.yaml .*got 'gold'"),
        ({"looks": ("bed/wheel: {roughness: 1}",)}, "expected a part of bed .*got 'wheel'"),
        ({"looks": ("spaceship: {roughness: 1}",)}, "an id, \\*, room or a category"),
        ({"looks": ("bed: {styles: [gothic]}",)}, "styles among"),
        ({"looks": ("bed/duvet: {styles: [panel]}",)}, "styles of a category"),
        ({"looks": ("3: {styles: [panel]}",)}, "styles of a category"),
        ({"looks": ("bed: {roughness: [0.9, 0.1]}",)}, "low <= high"),
        ({"looks": ("bed: {roughness: 7}",)}, r"\[0.0, 1.0\]"),
        ({"looks": ("bed: {lightness: 0.5}",)}, "together"),
        ({"looks": ("bed: {color: '#ffffff', base_color: [1, 1, 1]}",)}, "base_color or color"),
        ({"looks": ("bed: {color: red}",)}, "#"),
        ({"looks": ("bed: {}",)}, "nothing"),
        ({"looks": ("bed: [1, 2",)}, "expected YAML"),
        ({"looks": ("a/b/c: oak",)}, "expected a target"),
        ({"looks": ("bed/frame: oak",), "exclude_materials": ("wood",)}, "exclude_materials leaves"),
        ({"exclude_materials": ("unobtainium",)}, "unobtainium"),
        ({"exclude_materials": ("ceiling_paint",)}, "to be left for every part"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_before_a_room_is_sampled(asked: dict[str, tuple[str, ...]], reason: str) -> None:
    with pytest.raises(RequestError, match=reason) as caught:
        SYNTHESIZER.check(SceneRequest(**asked))  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


SYNTHESIZER = SceneSynthesizer.from_config()


def synthesize(*looks: str) -> SceneDescription:
    times = CameraTimes(frames=1, start_ns=0, rate_hz=10.0)
    return SYNTHESIZER.synthesize(SceneRequest(looks=looks), 5, 0, times)


def test_a_whole_room_changes_in_one_part_only() -> None:
    plain = synthesize()
    target = plain.objects[0]
    part = target.parts[0].name
    scene = synthesize(f"{target.id}/{part}: {{base_color: [0.9, 0.0, 0.0]}}")
    assert scene.objects[1:] == plain.objects[1:] and scene.room == plain.room and scene.lights == plain.lights
    (added,) = (item for item in scene.materials if item not in plain.materials)
    assert added.base_color == (0.9, 0.0, 0.0)
    assert scene.objects[0] == replace(target, parts=(replace(target.parts[0], material=added.id), *target.parts[1:]))
    for owner, words in (("999", "id of an object of this room"), ("\u00b2", "expected a target")):
        with pytest.raises(RequestError, match=words):
            synthesize(f"{owner}: {{roughness: 1}}")


def test_looks_are_read_once() -> None:
    assert read_looks(("bed: oak",)) is read_looks(("bed: oak",))
