"""Lighting: colours against tabulated chromaticities, odds against the settings, what must hold in the dark."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sample_scene import sample_objects, sample_scene

from grammar.appearance.lighting import (
    read_lighting_config,
    sample_lighting,
    sample_surroundings,
)
from grammar.spec.rules import GrammarError
from scene_description import SceneObject, scene_from_json, scene_to_json
from scene_description.color_temperature import black_body_chromaticity, color_of_temperature, luminance_rgb, xyz_from_rgb
from scene_description.share import config_path

CONFIG = read_lighting_config(config_path("lighting.yaml"))
LUMINANCE_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
LAMPS = sample_objects()[2:]


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(
    ("temperature_k", "x", "y"),
    [(2000, 0.5267, 0.4133), (2856, 0.4476, 0.4074), (4000, 0.3805, 0.3768), (6500, 0.3135, 0.3237), (10000, 0.2807, 0.2884)],
)
def test_black_body_lies_on_the_planckian_locus(temperature_k: float, x: float, y: float) -> None:
    assert black_body_chromaticity(temperature_k) == pytest.approx((x, y), abs=1e-3)


def test_chromaticity_has_no_jumps() -> None:
    for border in (2222.0, 4000.0):
        assert black_body_chromaticity(border) == pytest.approx(black_body_chromaticity(border + 1e-6), abs=2e-3)


def test_white_of_bt_709_is_equal_parts_and_has_its_luminance_weights() -> None:
    x, y = 0.3127, 0.3290
    np.testing.assert_allclose(xyz_from_rgb() @ np.ones(3), [x / y, 1.0, (1 - x - y) / y], atol=1e-12)
    np.testing.assert_allclose(xyz_from_rgb()[1], LUMINANCE_WEIGHTS, atol=5e-5)


def test_colours_go_from_red_over_white_to_blue() -> None:
    warm, day, sky = (color_of_temperature(t) for t in (2700.0, 6504.0, 15000.0))
    assert warm[0] == 1.0
    assert warm[0] > warm[1] > warm[2] > 0.0
    assert min(day) > 0.93
    assert sky[2] == 1.0
    assert sky[0] < sky[1] < sky[2]
    assert color_of_temperature(1700.0)[2] == 0.0, "outside the gamut"
    ratios = [color_of_temperature(t)[2] / color_of_temperature(t)[0] for t in range(2000, 20001, 500)]
    assert (np.diff(ratios) > 0.0).all()


def test_luminance_of_coloured_light_is_what_was_asked_for() -> None:
    for temperature_k in (2000.0, 5000.0, 12000.0):
        rgb = luminance_rgb(temperature_k, 850.0)
        assert xyz_from_rgb()[1] @ rgb == pytest.approx(850.0, rel=1e-12)
        np.testing.assert_allclose(np.array(rgb) / max(rgb), color_of_temperature(temperature_k), rtol=1e-12)


def test_one_light_for_each_lamp_within_its_ranges() -> None:
    for seed in range(200):
        lights, _ = sample_lighting(rng(seed), CONFIG, sample_objects())
        assert [(light.object, light.part) for light in lights] == [(5, "shade"), (6, "shade")]
        for light, category in zip(lights, ("table_lamp", "ceiling_lamp"), strict=True):
            lamp = CONFIG.lamps[category]
            assert lamp.flux_lm[0] <= light.flux_lm <= lamp.flux_lm[1]
            assert lamp.color_temperature_k[0] <= light.color_temperature_k <= lamp.color_temperature_k[1]
            assert light.color == color_of_temperature(light.color_temperature_k)


def condition_of(zenith: tuple[float, float, float]) -> str:
    luminance = float(xyz_from_rgb()[1] @ zenith)
    ranges = {name: sky.zenith_cd_m2 for name, sky in CONFIG.daylight.items()}
    fits = [name for name, (low, high) in ranges.items() if low * (1 - 1e-9) <= luminance <= high * (1 + 1e-9)]
    return fits[0] if len(fits) == 1 else "overcast or clear"


def test_conditions_and_switches_have_their_odds() -> None:
    n = 4000
    conditions, on = [], []
    for seed in range(n):
        lights, environment = sample_lighting(rng(seed), CONFIG, LAMPS)
        conditions.append(condition_of(environment.zenith))
        on.append([light.on for light in lights])
    names, switches = np.array(conditions), np.array(on)
    for name in ("dusk", "night"):
        share = CONFIG.daylight[name].probability
        assert np.mean(names == name) == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / n))
    dark = np.isin(names, ("dusk", "night"))
    assert switches[dark].any(axis=1).all(), "someone is at home"
    by_day = switches[~dark]
    for column, category in enumerate(("table_lamp", "ceiling_lamp")):
        share = CONFIG.lamps[category].on_by_day
        assert by_day[:, column].mean() == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / len(by_day)))
    both_off = (1 - CONFIG.lamps["table_lamp"].on_in_dark) * (1 - CONFIG.lamps["ceiling_lamp"].on_in_dark)
    ceiling = CONFIG.lamps["ceiling_lamp"].on_in_dark + both_off
    assert switches[dark][:, 1].mean() == pytest.approx(ceiling, abs=4 * math.sqrt(ceiling * (1 - ceiling) / dark.sum()))


def test_in_the_dark_the_brightest_lamp_is_switched_on_if_none_is() -> None:
    never = {name: replace(lamp, on_in_dark=0.0) for name, lamp in CONFIG.lamps.items()}
    night = {"night": replace(CONFIG.daylight["night"], probability=1.0)}
    for seed in range(20):
        lights, _ = sample_lighting(rng(seed), replace(CONFIG, lamps=never, daylight=night), LAMPS)
        assert [light.on for light in lights] == [False, True]


def test_a_room_without_lamps_is_never_dark() -> None:
    for seed in range(300):
        lights, environment = sample_lighting(rng(seed), CONFIG, sample_objects()[:2])
        assert lights == ()
        assert condition_of(environment.zenith) not in ("dusk", "night")


def test_horizon_and_ground_follow_the_zenith_of_their_condition() -> None:
    clear = replace(CONFIG, daylight={"clear": replace(CONFIG.daylight["clear"], probability=1.0)})
    sky = CONFIG.daylight["clear"]
    for seed in range(100):
        _, environment = sample_lighting(rng(seed), clear, LAMPS)
        zenith, horizon, ground = (xyz_from_rgb()[1] @ color for color in (environment.zenith, environment.horizon, environment.ground))
        assert sky.horizon_ratio[0] <= horizon / zenith <= sky.horizon_ratio[1]
        assert sky.ground_ratio[0] <= ground / zenith <= sky.ground_ratio[1]
        assert environment.zenith[2] > environment.zenith[0], "a clear sky is blue"


def test_a_room_without_windows_has_a_lamp_on_at_any_hour() -> None:
    never = {name: replace(lamp, on_in_dark=0.0) for name, lamp in CONFIG.lamps.items()}
    for seed in range(20):
        lights, _ = sample_lighting(rng(seed), replace(CONFIG, lamps=never), LAMPS, windows=False)
        assert sum(light.on for light in lights) == 1


def test_the_seed_decides() -> None:
    assert sample_lighting(rng(3), CONFIG, LAMPS) == sample_lighting(rng(3), CONFIG, LAMPS)
    assert sample_lighting(rng(3), CONFIG, LAMPS) != sample_lighting(rng(4), CONFIG, LAMPS)


def test_lights_and_environment_are_valid_parts_of_a_scene() -> None:
    for seed in range(50):
        lights, environment = sample_lighting(rng(seed), CONFIG, sample_objects())
        scene = replace(sample_scene(), lights=lights, environment=environment)
        assert scene_from_json(scene_to_json(scene)) == scene


def test_refuses_a_lamp_without_its_part() -> None:
    lamp: SceneObject = replace(LAMPS[0], parts=LAMPS[0].parts[:1])
    with pytest.raises(GrammarError, match=r"^lamps\.table_lamp\.part: expected a part of object 5 \(base\), got 'shade'$"):
        sample_lighting(rng(0), CONFIG, [lamp])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("flux_lm: [400, 900]", "flux_lm: [900, 400]", "lamps.table_lamp.flux_lm: expected low <= high, got [900.0, 400.0]"),
        ("flux_lm: [400, 900]", "flux_lm: 400", "lamps.table_lamp.flux_lm: expected a list, got 400"),
        ("[2800, 4500]", "[1200, 4500]", "lamps.ceiling_lamp.color_temperature_k[0]: expected a number in [1700.0, 20000.0] K, got 1200"),
        ("probability: 0.35", "probability: 0.25", "daylight: expected probabilities that sum to 1, got 0.8"),
        ("dark: false", "dark: true", "daylight: expected at least one condition that is not dark, for rooms without lamps, got none"),
        ("dark: false", "sunny: true", "daylight.overcast.sunny: expected one of cloud_cover, dark, elevation_deg, ground_k"),
    ],
)
def test_refuses_settings_that_do_not_fit(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = config_path("lighting.yaml").read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "lighting.yaml"
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(GrammarError) as refused:
        read_lighting_config(file)
    assert str(refused.value).startswith(f"{file}: {message}")


def test_surroundings_have_their_odds_and_floors_and_what_is_asked_for_comes() -> None:
    drawn = [sample_surroundings(np.random.default_rng(seed), CONFIG) for seed in range(400)]
    names = Counter(item.setting for item in drawn if item is not None)
    for name, row in CONFIG.surroundings.items():
        assert abs(names[name] / 400 - row.probability) < 4.0 * math.sqrt(row.probability * (1.0 - row.probability) / 400)
    assert all(item is not None and item.floor_above_ground_m in CONFIG.surroundings[item.setting].floors_m for item in drawn)
    assert sample_surroundings(np.random.default_rng(0), CONFIG, "none") is None
    town = sample_surroundings(np.random.default_rng(0), CONFIG, "town")
    assert town is not None and town.setting == "town"
    # what is asked for changes nothing else of the draw
    assert drawn[0] is not None and town.seed == drawn[0].seed
    with pytest.raises(GrammarError, match="surroundings: expected one of suburb, got 'town'"):
        suburb = replace(CONFIG, surroundings={"suburb": replace(CONFIG.surroundings["suburb"], probability=1.0)})
        sample_surroundings(np.random.default_rng(0), suburb, "town")
