"""The sun's place against published examples."""

import math

import pytest

from scene_description.sun_position import direction_of, julian_day, sun_position, sun_position_at


def test_julian_days_of_meeus() -> None:
    """Meeus, Astronomical Algorithms, chapter 7."""
    assert julian_day(2000, 1, 1.5) == 2451545.0
    assert julian_day(1957, 10, 4.81) == pytest.approx(2436116.31, abs=1e-6)
    assert julian_day(1987, 1, 27.0) == 2446822.5


def test_the_example_of_nrels_algorithm() -> None:
    """Reda and Andreas, Solar Position Algorithm (NREL/TP-560-34302), Golden, Colorado; 0.016 degrees of refraction off."""
    julian = julian_day(2003, 10, 17 + (12 + 30 / 60 + 30 / 3600 + 7) / 24)
    sun = sun_position(julian, math.radians(39.742476), math.radians(-105.1786))
    assert 90.0 - math.degrees(sun.elevation_rad) == pytest.approx(50.11162 + 0.016, abs=0.01)
    assert math.degrees(sun.azimuth_rad) == pytest.approx(194.34024, abs=0.01)
    assert sun.distance_au == pytest.approx(0.996542, abs=2e-5)


@pytest.mark.parametrize(("day", "declination"), [(172, 23.44), (355, -23.43), (80, 0.1)])
@pytest.mark.parametrize("latitude", [0.0, 35.0, 60.0])
def test_noon_is_as_high_as_latitude_and_season_say(day: int, declination: float, latitude: float) -> None:
    sun = sun_position_at(day, 12.0, math.radians(latitude))
    assert math.degrees(sun.elevation_rad) == pytest.approx(90.0 - abs(latitude - declination), abs=0.45)
    assert math.degrees(sun.azimuth_rad) == pytest.approx(180.0 if latitude > declination else 0.0, abs=1e-6)


def test_the_sun_rises_in_the_east_and_north_turns_the_world() -> None:
    morning, evening = (sun_position_at(80, hour, math.radians(40.0)) for hour in (7.0, 17.0))
    assert 90.0 < math.degrees(morning.azimuth_rad) < 110.0 and 250.0 < math.degrees(evening.azimuth_rad) < 270.0
    x, y, z = direction_of(morning, math.pi / 2.0)  # north along +y, so east along +x
    assert x > 0.9 and y < 0.0 < z
    x, y, z = direction_of(morning, 0.0)  # north along +x, so east along -y
    assert y < -0.9 and x < 0.0 < z
    assert math.hypot(x, y, z) == pytest.approx(1.0)
