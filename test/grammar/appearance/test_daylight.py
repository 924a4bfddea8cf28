"""Moments: within their ranges and conditions, one request at a time, the same for the same seed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from sample_scene import sample_objects, sample_scene

from grammar.appearance.daylight import NO_DAYLIGHT_REQUEST, DaylightRequest, draw_moment
from grammar.appearance.lighting import read_lighting_config, sample_lighting
from grammar.spec.request import SceneRequest
from grammar.spec.rules import GrammarError
from grammar.synthesize import daylight_request
from scene_description import FieldError, scene_from_json, scene_to_json
from scene_description.rounding import rounded
from scene_description.share import config_path

CONFIG = read_lighting_config(config_path("lighting.yaml"))


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def daylights(request: DaylightRequest, count: int = 60):
    found = [sample_lighting(rng(seed), CONFIG, sample_objects(), request=request)[1].daylight for seed in range(count)]
    return [daylight for daylight in found if daylight is not None]


def test_days_have_a_sun_above_the_horizon_and_nights_none() -> None:
    for seed in range(80):
        _, environment = sample_lighting(rng(seed), CONFIG, sample_objects())
        if environment.daylight is not None:
            assert environment.daylight.sun_direction[2] >= math.sin(math.radians(4.0))
    assert not daylights(DaylightRequest(condition="night")) and not daylights(DaylightRequest(condition="dusk"))
    assert len(daylights(DaylightRequest(condition="clear"))) == 60


def test_moments_stay_in_their_ranges() -> None:
    assert CONFIG.moment is not None
    for seed in range(50):
        moment = draw_moment(rng(seed), CONFIG.moment, NO_DAYLIGHT_REQUEST, (4.0, 30.0))
        assert 25 <= moment.latitude_deg <= 60 and 1 <= moment.day_of_year <= 365 and 6 <= moment.solar_hour <= 20
        assert 4.0 <= math.degrees(moment.sun.elevation_rad) <= 30.0


@pytest.mark.parametrize(
    ("name", "value", "field", "expected"),
    [
        ("solar_hour", 15.5, "solar_hour", 15.5),
        ("day_of_year", 200, "day_of_year", 200),
        ("latitude_deg", 30.0, "latitude_rad", math.radians(30.0)),
        ("turbidity", 4.5, "turbidity", 4.5),
        ("north_yaw_deg", 90.0, "north_yaw_rad", math.radians(90.0)),
        ("cloud_cover", 0.3, "cloud_cover", 0.3),
    ],
)
def test_one_wish_is_kept_and_the_rest_is_drawn(name: str, value: float, field: str, expected: float) -> None:
    found = daylights(daylight_request(SceneRequest(**{name: value})))
    assert found and {getattr(daylight, field) for daylight in found} == {rounded(expected)}
    assert len({daylight.sun_direction for daylight in found}) > 5


def test_an_hour_brings_the_condition_that_fits_it() -> None:
    for seed in range(20):
        _, night = sample_lighting(rng(seed), CONFIG, sample_objects(), request=DaylightRequest(solar_hour=0.5, latitude_deg=30.0))
        assert night.daylight is None and max(night.zenith) < 1.0


def test_the_impossible_is_refused() -> None:
    request = DaylightRequest(condition="clear", solar_hour=23.5, latitude_deg=30.0)
    with pytest.raises(GrammarError, match="daylight: expected the sun between 4 and 90 degrees"):
        sample_lighting(rng(0), CONFIG, sample_objects(), request=request)
    with pytest.raises(GrammarError, match="expected one of overcast, clear, dusk, night, got 'hail'"):
        sample_lighting(rng(0), CONFIG, sample_objects(), request=DaylightRequest(condition="hail"))


def test_lamps_do_not_change_with_the_moment_asked_for() -> None:
    first, second = (
        sample_lighting(rng(3), CONFIG, sample_objects(), request=DaylightRequest(condition="clear", day_of_year=day))[0]
        for day in (100, 200)
    )
    assert first == second


def test_daylight_survives_json_and_old_scenes_have_none() -> None:
    _, environment = sample_lighting(rng(1), CONFIG, sample_objects(), request=DaylightRequest(condition="clear"))
    scene = replace(sample_scene(), environment=environment)
    assert scene_from_json(scene_to_json(scene)) == scene
    plain = replace(sample_scene(), environment=replace(environment, daylight=None))
    assert '"daylight"' not in scene_to_json(plain) and scene_from_json(scene_to_json(plain)) == plain
    assert environment.daylight is not None
    bent = replace(environment, daylight=replace(environment.daylight, sun_direction=(0.0, 0.5, 0.5)))
    with pytest.raises(FieldError, match=r"environment.daylight.sun_direction: expected a unit vector"):
        scene_from_json(scene_to_json(replace(scene, environment=bent)))
