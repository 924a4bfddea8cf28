"""The moment at which a room is seen: day, hour, latitude and turbidity, from which the sun's position follows.

The condition outside (clear, overcast, dusk, night) is drawn first, then moments until the sun's elevation fits it.  Where the hour is
given, the moment is drawn first, then a condition among those that fit.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from grammar.spec.rules import GrammarError
from scene_description import Daylight, Limits
from scene_description.rounding import rounded
from scene_description.sun_position import SunPosition, direction_of, sun_position_at

Latitude = Annotated[float, Limits(ge=-90.0, le=90.0, unit="deg")]
Day = Annotated[int, Limits(ge=1, le=365)]
Hour = Annotated[float, Limits(ge=0.0, le=24.0, unit="h")]
LEAST_TURBIDITY = 1.7
Haze = Annotated[float, Limits(ge=LEAST_TURBIDITY, le=10.0)]
North = Annotated[float, Limits(ge=-360.0, le=360.0, unit="deg")]
Unit = Annotated[float, Limits(ge=0.0, le=1.0)]

TRIALS = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class MomentConfig:
    """Ranges of latitude, day of the year, true solar time, turbidity and the yaw of north, each uniform; the ground's colour."""

    latitude_deg: tuple[Latitude, Latitude]
    day_of_year: tuple[Day, Day]
    solar_hour: tuple[Hour, Hour]
    turbidity: tuple[Haze, Haze]
    north_yaw_deg: tuple[North, North]
    ground_color: tuple[Unit, Unit, Unit]


@dataclass(frozen=True, slots=True, kw_only=True)
class DaylightRequest:
    """What a request fixes of the daylight; what is None is drawn."""

    condition: str | None = None
    latitude_deg: float | None = None
    day_of_year: int | None = None
    solar_hour: float | None = None
    turbidity: float | None = None
    north_yaw_deg: float | None = None
    cloud_cover: float | None = None


NO_DAYLIGHT_REQUEST = DaylightRequest()


class Moment(NamedTuple):
    """Latitude, day, true solar time, turbidity and the yaw of north, and the sun's position then."""

    latitude_deg: float
    day_of_year: int
    solar_hour: float
    turbidity: float
    north_yaw_deg: float
    sun: SunPosition


def draw_moment(rng: np.random.Generator, config: MomentConfig, request: DaylightRequest, elevations_deg: tuple[float, float]) -> Moment:
    """Draw moments until the sun's elevation lies within bounds.

    Raises:
        GrammarError: none was found.
    """
    low, high = elevations_deg
    for _ in range(TRIALS):
        moment = _draw(rng, config, request)
        if low <= math.degrees(moment.sun.elevation_rad) <= high:
            return moment
    asked = ", ".join(f"{name} {value:g}" for name in _NUMBERS if (value := getattr(request, name)) is not None) or "any moment"
    raise GrammarError(f"daylight: expected the sun between {low:g} and {high:g} degrees at {asked}, got no such moment; ask for less")


def make_daylight(moment: Moment, cloud_cover: float, ground_color: tuple[float, float, float]) -> Daylight:
    """Return the sun and the sky of a moment for a scene description; the sun stands where the description's digits put it."""
    hour, latitude_rad, north_yaw_rad = rounded((moment.solar_hour, math.radians(moment.latitude_deg), math.radians(moment.north_yaw_deg)))
    sun = sun_position_at(moment.day_of_year, hour, latitude_rad)
    return Daylight(
        sun_direction=direction_of(sun, north_yaw_rad),
        turbidity=moment.turbidity,
        cloud_cover=cloud_cover,
        ground_color=ground_color,
        sun_distance_au=sun.distance_au,
        day_of_year=moment.day_of_year,
        solar_hour=hour,
        latitude_rad=latitude_rad,
        north_yaw_rad=north_yaw_rad,
    )


def fitting_conditions(moment: Moment, elevations_deg: Mapping[str, tuple[float, float]]) -> list[str]:
    """Return the names of the conditions, given by bounds of the sun's elevation, that fit a moment."""
    elevation = math.degrees(moment.sun.elevation_rad)
    return [name for name, (low, high) in elevations_deg.items() if low <= elevation <= high]


_NUMBERS = ("latitude_deg", "day_of_year", "solar_hour")


def _draw(rng: np.random.Generator, config: MomentConfig, request: DaylightRequest) -> Moment:
    """Draw a moment; every number is drawn, also where the request fixes it, so that the others stay as they are."""
    drawn = {
        "latitude_deg": float(rng.uniform(*config.latitude_deg)),
        "day_of_year": int(rng.integers(config.day_of_year[0], config.day_of_year[1] + 1)),
        "solar_hour": float(rng.uniform(*config.solar_hour)),
        "turbidity": float(rng.uniform(*config.turbidity)),
        "north_yaw_deg": float(rng.uniform(*config.north_yaw_deg)),
    }
    fixed = {name: getattr(request, name) for name in drawn}
    latitude, day, hour, turbidity, north = (float(drawn[name] if fixed[name] is None else fixed[name]) for name in drawn)
    return Moment(latitude, int(day), hour, turbidity, north, sun_position_at(day, hour, math.radians(latitude)))
