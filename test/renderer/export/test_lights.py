"""The table of lights: flux and luminance agree, places are those of the parts, sun and sky have the renderer's light."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sample_scene import sample_scene

from renderer.core.color import LUMINANCE
from renderer.export.lights import lights_table
from renderer.scene.flatten import flatten
from scene_description import Daylight, Luminaire, SceneDescription
from scene_description.labels import part_ids


def table_of(scene: SceneDescription) -> dict:
    return lights_table(scene, flatten(scene))


def test_a_lamp_has_its_place_area_and_light() -> None:
    scene = sample_scene()
    lamp, ceiling = table_of(scene)["lamps"]
    assert (lamp["object"], lamp["part"], lamp["category"], lamp["on"]) == (5, "shade", "table_lamp", True)
    assert lamp["part_id"] == part_ids(scene)["5/shade"]
    assert (lamp["flux_lm"], lamp["color_temperature_k"], lamp["color"]) == (400.0, 2700.0, [1.0, 0.42, 0.1])
    flux = math.pi * lamp["area_m2"] * float(np.asarray(lamp["luminance_cd_m2"]) @ LUMINANCE)
    assert flux == pytest.approx(400.0, rel=1e-5)
    low, high = np.array(lamp["bounds_m"])
    assert np.all(low <= lamp["position_m"]) and np.all(lamp["position_m"] <= high)
    assert lamp["position_m"][:2] == pytest.approx([0.25, 2.95], abs=2e-3) and 0.55 < low[2] < high[2] <= 0.951
    assert not ceiling["on"] and ceiling["luminance_cd_m2"] == [0.0, 0.0, 0.0] and ceiling["flux_lm"] == 2000.0


def test_windows_glowing_things_and_bare_lights_are_told() -> None:
    scene = sample_scene()
    spot = Luminaire(kind="spot", position_m=(2.0, 1.0, 2.5), flux_lm=600.0, color_temperature_k=3000.0, color=(1.0, 1.0, 1.0))
    glowing = tuple(replace(item, glow_cd_m2=50.0) if item.id == "brass" else item for item in scene.materials)
    table = table_of(replace(scene, luminaires=(spot,), materials=glowing))
    (pane,) = table["windows"]
    assert (pane["object"], pane["part"], pane["transmission"]) == (2, "pane", 0.9)
    assert pane["area_m2"] == pytest.approx(1.4 * 1.2, rel=0.02) and 3.5 <= pane["position_m"][1] <= 3.65
    (told,) = table["luminaires"]
    assert (told["index"], told["object"], told["position_m"], told["flux_lm"]) == (0, 0, [2.0, 1.0, 2.5], 600.0)
    assert {(item["object"], item["part"]) for item in table["glowing"]} >= {(5, "stem"), (4, "handles")}
    assert all(item["glow_cd_m2"] == 50.0 for item in table["glowing"]) and table_of(scene)["glowing"] == []


def test_a_gradient_has_no_sun() -> None:
    environment = table_of(sample_scene())["environment"]
    assert environment["sun"] is None and environment["sky"]["kind"] == "gradient"
    assert environment["sky"]["zenith_cd_m2"] == [900.0, 1000.0, 1300.0] == environment["description"]["zenith"]


def test_sun_and_sky_of_a_moment() -> None:
    scene = sample_scene()
    direction = (0.6, 0.0, 0.8)
    scene = replace(scene, environment=replace(scene.environment, daylight=Daylight(sun_direction=direction, solar_hour=10.5)))
    environment = table_of(scene)["environment"]
    sun, sky = environment["sun"], environment["sky"]
    assert sun["direction"] == pytest.approx(direction, abs=1e-6) and environment["description"]["daylight"]["solar_hour"] == 10.5
    assert sun["angular_radius_rad"] == pytest.approx(math.radians(0.533 / 2.0), rel=1e-3)
    assert 60_000.0 < float(np.asarray(sun["illuminance_lx"]) @ LUMINANCE) < 127_500.0
    assert sky["kind"] == "daylight" and 5_000.0 < float(np.asarray(sky["illuminance_lx"]) @ LUMINANCE) < 40_000.0


def test_an_even_sky_of_luminance_one_gives_a_level_plane_pi() -> None:
    scene = sample_scene()
    flat = flatten(scene)
    flat = flat._replace(sky=flat.sky._replace(table=np.ones((64, 128, 3), np.float32)))
    assert lights_table(scene, flat)["environment"]["sky"]["illuminance_lx"] == pytest.approx([math.pi] * 3, rel=1e-9)
