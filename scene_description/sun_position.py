"""Where the sun stands: day, hour and place to elevation and azimuth.

The method of low accuracy of J. Meeus, "Astronomical Algorithms" (2nd edition, 1998, chapters 7, 13, 22, 25 and 28), as in the solar
calculator of NOAA's Global Monitoring Laboratory: within 0.02 degrees for years near 2000.  Refraction of the air is not counted.
"""

import math
from typing import NamedTuple

_REFERENCE_YEAR = 2001
"""Days of the year are counted in a common year; over four years the sun's place on a date wanders by half a degree at most."""


class SunPosition(NamedTuple):
    """Elevation above the horizon, and azimuth from north by way of east, in radians; distance in astronomical units."""

    elevation_rad: float
    azimuth_rad: float
    distance_au: float


def julian_day(year: int, month: int, day: float) -> float:
    """Return the Julian day of a date of the Gregorian calendar; fractions of ``day`` are hours of universal time (Meeus, chapter 7)."""
    if month <= 2:
        year, month = year - 1, month + 12
    century = year // 100
    leap = 2 - century + century // 4
    return math.floor(365.25 * (year + 4716)) + math.floor(30.6001 * (month + 1)) + day + leap - 1524.5


def sun_position(julian: float, latitude_rad: float, longitude_rad: float) -> SunPosition:
    """Return where the sun stands.

    Args:
        julian: Julian day, universal time.
        latitude_rad: north is positive.
        longitude_rad: east is positive.
    """
    right_ascension, declination, distance_au = _place_among_stars(julian)
    days = julian - 2451545.0
    century = days / 36525.0
    sidereal = math.radians((280.46061837 + 360.98564736629 * days + 0.000387933 * century**2) % 360.0)
    return _above_horizon(sidereal + longitude_rad - right_ascension, declination, latitude_rad, distance_au)


def sun_position_at(day_of_year: float, solar_hour: float, latitude_rad: float) -> SunPosition:
    """Return where the sun stands at a true solar time: at 12 it is due south or north, wherever the place and its clocks.

    Args:
        day_of_year: 1 is the first of January.
        solar_hour: 0 to 24.
        latitude_rad: north is positive.
    """
    _, declination, distance_au = _place_among_stars(julian_day(_REFERENCE_YEAR, 1, day_of_year + solar_hour / 24.0))
    return _above_horizon(math.radians(15.0 * (solar_hour - 12.0)), declination, latitude_rad, distance_au)


def direction_of(position: SunPosition, north_yaw_rad: float) -> tuple[float, float, float]:
    """Return the unit vector to the sun in a world, z up, whose north lies at yaw ``north_yaw_rad``."""
    yaw = north_yaw_rad - position.azimuth_rad
    level = math.cos(position.elevation_rad)
    return level * math.cos(yaw), level * math.sin(yaw), math.sin(position.elevation_rad)


def _place_among_stars(julian: float) -> tuple[float, float, float]:
    """Return apparent right ascension and declination in radians, and distance in astronomical units (Meeus, chapter 25)."""
    t = (julian - 2451545.0) / 36525.0
    mean_longitude = 280.46646 + t * (36000.76983 + 0.0003032 * t)
    anomaly = math.radians(357.52911 + t * (35999.05029 - 0.0001537 * t))
    eccentricity = 0.016708634 - t * (0.000042037 + 0.0000001267 * t)
    center = (
        math.sin(anomaly) * (1.914602 - t * (0.004817 + 0.000014 * t))
        + math.sin(2.0 * anomaly) * (0.019993 - 0.000101 * t)
        + math.sin(3.0 * anomaly) * 0.000289
    )
    true_anomaly = anomaly + math.radians(center)
    distance_au = 1.000001018 * (1.0 - eccentricity**2) / (1.0 + eccentricity * math.cos(true_anomaly))
    node = math.radians(125.04 - 1934.136 * t)
    longitude = math.radians(mean_longitude + center - 0.00569 - 0.00478 * math.sin(node))
    obliquity = math.radians(23.439291 - t * (0.0130042 + t * (0.00000016 - 0.000000504 * t)) + 0.00256 * math.cos(node))
    right_ascension = math.atan2(math.cos(obliquity) * math.sin(longitude), math.cos(longitude))
    return right_ascension, math.asin(math.sin(obliquity) * math.sin(longitude)), distance_au


def _above_horizon(hour_angle: float, declination: float, latitude: float, distance_au: float) -> SunPosition:
    """Return the position for an hour angle, westwards from the meridian (Meeus, chapter 13; azimuth counted from north)."""
    elevation = math.asin(math.sin(latitude) * math.sin(declination) + math.cos(latitude) * math.cos(declination) * math.cos(hour_angle))
    west = math.atan2(math.sin(hour_angle), math.cos(hour_angle) * math.sin(latitude) - math.tan(declination) * math.cos(latitude))
    return SunPosition(elevation, (west + math.pi) % (2.0 * math.pi), distance_au)
