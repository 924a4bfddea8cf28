"""Changes of lamps, daylight and materials: known answers, targets, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from counterfactual_rooms import difference, room, rules
from sample_scene import sample_scene

from grammar.counterfactual import FACTORS, Change, ChangeError, apply_change, as_base, current_value
from scene_description import Daylight, Luminaire, SceneDescription, scene_from_json, scene_to_json
from scene_description.color_temperature import color_of_temperature
from scene_description.sun_position import sun_position_at

DOCS = Path(__file__).resolve().parents[3] / "docs" / "counterfactuals.md"


def change(scene: SceneDescription, factor: str, value: object, **target: object) -> SceneDescription:
    return apply_change(scene, Change(factor, target, value), rules())


def refused(scene: SceneDescription, factor: str, value: object, **target: object) -> str:
    with pytest.raises(ChangeError) as caught:
        change(scene, factor, value, **target)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def by_day(**fields: float) -> SceneDescription:
    scene = sample_scene()
    sun = Daylight(sun_direction=(0.0, math.cos(0.7), math.sin(0.7)), latitude_rad=0.7, **fields)
    return replace(scene, environment=replace(scene.environment, daylight=sun))


def materials_of(scene: SceneDescription, identifier: int) -> dict[str, str]:
    parts = next(item.parts for item in scene.objects if item.id == identifier)
    return {part.name: part.material for part in parts}


def test_lamps_are_scaled_coloured_and_switched_one_by_one_or_together() -> None:
    scene = sample_scene()
    assert [light.flux_lm for light in change(scene, "light_intensity", 2.0, object=5).lights] == [800.0, 2000.0]
    assert [light.flux_lm for light in change(scene, "light_intensity", 0.5).lights] == [200.0, 1000.0]
    assert [light.on for light in change(scene, "lamp_on", True, category="ceiling_lamp").lights] == [True, True]
    assert [light.on for light in change(scene, "lamp_on", False, name="table_lamp_1").lights] == [False, False]
    for light in change(scene, "color_temperature_k", 5000).lights:
        assert light.color == color_of_temperature(5000.0) and light.color_temperature_k == 5000.0
    spot = Luminaire(kind="point", position_m=(2.0, 1.0, 2.0), flux_lm=300.0, color_temperature_k=3000.0, color=(1.0, 0.5, 0.2))
    lit = replace(scene, luminaires=(spot, spot))
    assert [lamp.flux_lm for lamp in change(lit, "light_intensity", 3, luminaire=1).luminaires] == [300.0, 900.0]
    assert current_value(scene, Change("color_temperature_k", {"object": 5})) == 2700.0
    assert current_value(scene, Change("color_temperature_k")) is None


def test_what_is_not_there_is_refused_in_one_line_that_says_what_is() -> None:
    scene = sample_scene()
    assert "(5 table_lamp, 6 ceiling_lamp), got objects that do not shine" in refused(scene, "lamp_on", True, category="bed")
    assert "expected object of the room (3, 4, 5, 6), got '9'" in refused(scene, "lamp_on", True, object=9)
    assert "expected a luminaire of the room (there is none)" in refused(scene, "lamp_on", True, luminaire=0)
    assert "expected object or name" in refused(scene, "lamp_on", True, colour="red")
    assert "none: it is of the whole scene" in refused(scene, "camera_height_m", 1.0, object=3)
    assert "got 'brightness'" in refused(scene, "brightness", 1.0) and "light_intensity" in refused(scene, "brightness", 1.0)
    assert "a number in [0.0, 1000000.0], got '2x'" in refused(scene, "light_intensity", "2x")
    assert "expected at most 500" in refused(scene, "light_intensity", 501.0)
    assert "true or false, got 1" in refused(scene, "lamp_on", 1)
    assert "[1667.0, 20000.0] K, got 900" in refused(scene, "color_temperature_k", 900)
    assert "a scene by day" in refused(scene, "sun_elevation_deg", 30)
    assert "when the sun is down" in refused(by_day(), "solar_hour", 1.0)
    assert "(cushion, duvet, frame" in refused(scene, "base_color", "#ffffff", category="bed", part="wing")
    assert "oak" in refused(scene, "material", "kryptonite", object=3) and "'kryptonite'" in refused(scene, "material", "kryptonite")
    assert "a part with a pattern" in refused(scene, "texture_scale", 2.0)


def test_sun_and_sky_go_where_they_are_put() -> None:
    scene = by_day()
    raised = change(scene, "sun_elevation_deg", 30).environment.daylight
    assert raised.sun_direction == pytest.approx((0.0, math.cos(math.pi / 6), 0.5))
    east = change(scene, "sun_azimuth_deg", 90).environment.daylight
    assert east.sun_direction == pytest.approx((math.cos(0.7), 0.0, math.sin(0.7)))
    later = change(scene, "solar_hour", 15.0).environment.daylight
    assert later.solar_hour == 15.0 and math.asin(later.sun_direction[2]) == pytest.approx(sun_position_at(172, 15.0, 0.7).elevation_rad)
    assert change(scene, "sun_intensity", 0).environment.daylight.sun_scale == 0.0
    twice = change(change(scene, "sky_intensity", 0.5), "sky_intensity", 0.5)
    assert twice.environment.daylight.sky_scale == 0.25 and len(twice.counterfactuals or ()) == 2
    assert change(scene, "turbidity", 6).environment.daylight.turbidity == 6.0
    assert change(sample_scene(), "sky_intensity", 0.5).environment.zenith == (450.0, 500.0, 650.0)
    assert current_value(scene, Change("sun_elevation_deg")) == pytest.approx(math.degrees(0.7))
    assert current_value(scene, Change("sun_azimuth_deg")) == pytest.approx(0.0)


def test_a_material_changes_for_the_parts_that_are_meant_and_no_others() -> None:
    scene = sample_scene()
    white = change(scene, "base_color", "#ffffff", category="bed", part="frame")
    assert materials_of(white, 3)["frame"] == "changed_1_oak" and materials_of(white, 3)["slats"] == "oak"
    assert materials_of(white, 4) == materials_of(scene, 4)
    assert white.materials[:-1] == scene.materials
    assert white.materials[-1] == replace(scene.materials[0], id="changed_1_oak", base_color=(1.0, 1.0, 1.0))
    group = change(scene, "roughness", 0.25, group=3)
    assert {part for key in (3, 4) for part in materials_of(group, key).values()} == {"changed_1_oak", "changed_2_linen", "changed_3_brass"}
    assert materials_of(group, 6) == materials_of(scene, 6)
    metal = change(scene, "metallic", 1.0, surface="floor")
    assert [part.material for part in metal.room.surfaces] == ["changed_1_oak", "paint", "paint", "paint"]
    walnut = change(scene, "material", "walnut", object=4)
    assert set(materials_of(walnut, 4).values()) == {"changed_1_walnut_1"} and walnut.materials[-1].family == "wood"
    assert walnut.materials[-1].texture.generator == "wood"
    wall = change(scene, "wall_finish", "walnut")
    assert [part.material for part in wall.room.surfaces] == ["oak", "changed_1_walnut_1", "paint", "paint"]
    assert current_value(scene, Change("roughness", {"surface": "floor"})) == 0.5


def test_textures_are_put_on_stretched_and_taken_away() -> None:
    plain = sample_scene()
    wood = change(plain, "texture", "wood", surface="floor")
    before = wood.materials[-1].texture
    assert before.generator == "wood" and wood.materials[-1].base_color == plain.materials[0].base_color
    assert change(wood, "texture_scale", 2.0, surface="floor").materials[-1].texture == replace(before, scale_m=2.0 * before.scale_m)
    assert change(wood, "texture_contrast", 0.0, surface="floor").materials[-1].texture == replace(before, contrast=0.0)
    assert change(wood, "texture", "none", surface="floor").materials[-1].texture is None


def test_the_value_that_a_scene_has_leaves_it_as_it_is() -> None:
    scene = as_base(room("bedroom"))
    neutral = {"environment.daylight.sun_scale", "environment.daylight.sky_scale", "counterfactuals"}
    for name in FACTORS:
        target = {"category": "potted_plant"} if name in ("object_added", "object_placed") else {}
        value = current_value(scene, Change(name, target), rules())
        if value is not None and name not in ("sun_elevation_deg", "sun_azimuth_deg"):
            assert difference(scene, change(scene, name, value, **target)) <= neutral, name


def test_a_change_is_recorded_and_reproducible_and_scenes_without_one_keep_their_bytes() -> None:
    scene = sample_scene()
    text = scene_to_json(scene)
    assert "counterfactuals" not in text and scene_to_json(scene_from_json(text)) == text
    first = change(scene, "material", "walnut", object=3)
    assert first == change(scene, "material", "walnut", object=3)
    (record,) = first.counterfactuals or ()
    assert (record.factor, record.target, record.value, record.objects) == ("material", {"object": "3"}, '"walnut"', (3,))
    other = apply_change(scene, Change("material", {"object": 3}, "walnut", seed=1), rules())
    assert other.materials[-1] != first.materials[-1]
    assert scene_from_json(scene_to_json(first)) == first
    assert first.id == scene.id and first.parse_graph == scene.parse_graph


def test_the_page_tells_of_every_factor() -> None:
    text = DOCS.read_text()
    for factor in FACTORS.values():
        assert f"| `{factor.name}` |" in text, factor.name
