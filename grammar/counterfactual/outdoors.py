"""What is outside the windows: where the sun stands, how much sun and sky shine, haze and clouds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from grammar.counterfactual.change import ChangeError
from grammar.counterfactual.factor import Factor, Outcome, Work
from grammar.counterfactual.values import number
from scene_description import Daylight
from scene_description.sun_position import SunPosition, direction_of, sun_position_at

_BRIGHTEST_CD_M2 = 1e6


def _daylight(work: Work) -> Daylight:
    """Return the sun and sky of the scene.

    Raises:
        ChangeError: it has none.
    """
    environment = work.scene.environment
    if environment.map is not None:
        raise ChangeError(f"{work.change}: expected a scene with a sun and a sky, got the picture '{environment.map.file}' outside")
    if environment.daylight is None:
        raise ChangeError(
            f"{work.change}: expected a scene by day (environment.daylight), got one without a sun; take a clear or overcast one"
        )
    return environment.daylight


def _with(work: Work, daylight: Daylight, note: str = "") -> Outcome:
    return Outcome(replace(work.scene, environment=replace(work.scene.environment, daylight=daylight)), note=note)


def _sun(daylight: Daylight) -> SunPosition:
    """Return where the sun of a scene stands, by its direction."""
    x, y, z = daylight.sun_direction
    azimuth = (daylight.north_yaw_rad - math.atan2(y, x)) % (2.0 * math.pi)
    return SunPosition(math.asin(max(-1.0, min(z, 1.0))), azimuth, daylight.sun_distance_au)


def _put_sun(work: Work, sun: SunPosition) -> Outcome:
    daylight = _daylight(work)
    note = "the sun is put there; day, hour and latitude beside it are those of the scene before"
    return _with(work, replace(daylight, sun_direction=direction_of(sun, daylight.north_yaw_rad)), note)


def set_elevation(work: Work) -> Outcome:
    """Raise or lower the sun; its azimuth stays."""
    return _put_sun(work, _sun(_daylight(work))._replace(elevation_rad=math.radians(number(work.change, 0.0, 90.0, "deg"))))


def set_azimuth(work: Work) -> Outcome:
    """Turn the sun round the room; its elevation stays."""
    return _put_sun(work, _sun(_daylight(work))._replace(azimuth_rad=math.radians(number(work.change, -360.0, 360.0, "deg"))))


def set_hour(work: Work) -> Outcome:
    """Move the sun along its way over the sky of that day and place."""
    daylight, hour = _daylight(work), number(work.change, 0.0, 24.0, "h")
    sun = sun_position_at(daylight.day_of_year, hour, daylight.latitude_rad)
    if sun.elevation_rad < 0.0:
        raise ChangeError(f"{work.change}: value: expected an hour of the day at that latitude, got {hour:g} h, when the sun is down")
    direction = direction_of(sun, daylight.north_yaw_rad)
    return _with(work, replace(daylight, solar_hour=hour, sun_direction=direction, sun_distance_au=sun.distance_au))


def _field(name: str, low: float, high: float) -> Callable[[Work], Outcome]:
    """Return a function that sets one number of the daylight."""

    def make(work: Work) -> Outcome:
        return _with(work, replace(_daylight(work), **{name: number(work.change, low, high)}))  # type: ignore[arg-type]

    return make


def scale_sun(work: Work) -> Outcome:
    """Multiply the light of the sun."""
    daylight, factor = _daylight(work), number(work.change, 0.0, 100.0)
    return _with(work, replace(daylight, sun_scale=factor * _scale(daylight.sun_scale)))


def scale_sky(work: Work) -> Outcome:
    """Multiply the light of the sky: of the day, of the plain one of a scene without a sun, or of the picture outside."""
    environment, factor = work.scene.environment, number(work.change, 0.0, 100.0)
    if environment.map is not None:
        scale = environment.map.luminance_scale * factor
        if scale < 1e-6:
            raise ChangeError(f"{work.change}: value: expected a number above 0 for a picture outside, got {factor:g}")
        return Outcome(replace(work.scene, environment=replace(environment, map=replace(environment.map, luminance_scale=scale))))
    if environment.daylight is not None:
        return _with(work, replace(environment.daylight, sky_scale=factor * _scale(environment.daylight.sky_scale)))
    colors = {name: tuple(factor * channel for channel in getattr(environment, name)) for name in ("zenith", "horizon", "ground")}
    if max(map(max, colors.values())) > _BRIGHTEST_CD_M2:
        raise ChangeError(f"{work.change}: value: expected a sky of at most {_BRIGHTEST_CD_M2:g} cd/m2, got factor {factor:g}")
    return Outcome(replace(work.scene, environment=replace(environment, **colors)))  # type: ignore[arg-type]


def _scale(value: float | None) -> float:
    return 1.0 if value is None else value


def _row(name: str, label: str, unit: str | None, value: str, make: Callable[[Work], Outcome], current: Callable[[Work], object]) -> Factor:
    return Factor(
        name=name, label=label, unit=unit, value=value, attribute="illumination", touches="light", targets=(), make=make, current=current
    )


FACTORS = (
    _row(
        "sun_elevation_deg",
        "elevation of the sun",
        "deg",
        "height of the sun above the horizon, 0 to 90 degrees",
        set_elevation,
        lambda work: math.degrees(_sun(_daylight(work)).elevation_rad),
    ),
    _row(
        "sun_azimuth_deg",
        "azimuth of the sun",
        "deg",
        "where the sun stands, from north by way of east, -360 to 360 degrees",
        set_azimuth,
        lambda work: math.degrees(_sun(_daylight(work)).azimuth_rad),
    ),
    _row(
        "solar_hour",
        "true solar time",
        "h",
        "hour of the day, 12 when the sun is due south or north; the sun moves along its way over that day's sky",
        set_hour,
        lambda work: _daylight(work).solar_hour,
    ),
    _row(
        "sun_intensity",
        "intensity of the sun",
        None,
        "factor on the light of the sun, 0 to 100; 0: no sun, 1: as it is",
        scale_sun,
        lambda work: 1.0 if _daylight(work) else None,
    ),
    _row(
        "sky_intensity",
        "intensity of the sky",
        None,
        "factor on the light of the sky, 0 to 100; 0: a black sky, 1: as it is",
        scale_sky,
        lambda work: 1.0,
    ),
    _row(
        "turbidity",
        "turbidity of the air",
        None,
        "haze, 1.7 (very clear) to 10",
        _field("turbidity", 1.7, 10.0),
        lambda work: _daylight(work).turbidity,
    ),
    _row(
        "cloud_cover",
        "cloud cover",
        None,
        "0 (clear) to 1 (overcast, no sun)",
        _field("cloud_cover", 0.0, 1.0),
        lambda work: _daylight(work).cloud_cover,
    ),
)
