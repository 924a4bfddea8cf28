"""Lamps: how much they shine, in which colour, and whether they are on."""

import math
from collections.abc import Callable
from dataclasses import replace

from grammar.counterfactual.change import ChangeError, Outcome, Work
from grammar.counterfactual.targets import chosen_lamps
from grammar.counterfactual.values import number, truth
from scene_description import Daylight, Light, Luminaire
from scene_description.color_temperature import color_of_temperature
from scene_description.sun_position import SunPosition, direction_of, sun_position_at

_MOST_LM = 1e6
_COLDEST_K, _HOTTEST_K = 1667.0, 20000.0
"""Where the chromaticity of black bodies is known, and what scene descriptions hold."""

Lamp = Light | Luminaire

_BRIGHTEST_CD_M2 = 1e6


def _each(work: Work, changed: Callable[[Lamp], dict[str, object]]) -> Outcome:
    """Return the scene with some fields of the targeted lamps replaced."""
    scene = work.scene
    lights, luminaires = chosen_lamps(scene, work.change)
    new_lights = tuple(replace(lamp, **changed(lamp)) if k in lights else lamp for k, lamp in enumerate(scene.lights))  # type: ignore[arg-type]
    new_luminaires = tuple(
        replace(lamp, **changed(lamp)) if k in luminaires else lamp  # type: ignore[arg-type]
        for k, lamp in enumerate(scene.luminaires)
    )
    touched = tuple(sorted({scene.lights[k].object for k in lights}))
    return Outcome(replace(scene, lights=new_lights, luminaires=new_luminaires), objects=touched)


def targeted_lamps(work: Work) -> list[Lamp]:
    """Return the lamps and luminaires that the target means."""
    lights, luminaires = chosen_lamps(work.scene, work.change)
    return [*(work.scene.lights[k] for k in lights), *(work.scene.luminaires[k] for k in luminaires)]


def scale_intensity(work: Work) -> Outcome:
    """Multiply the luminous flux of lamps."""
    factor = number(work.change, 0.0, 1e6)
    brightest = max(lamp.flux_lm for lamp in targeted_lamps(work))
    if factor * brightest > _MOST_LM:
        raise ChangeError(
            f"{work.change}: value: expected at most {_MOST_LM / brightest:g}, which makes a lamp shine 1e6 lm, got {factor:g}"
        )
    return _each(work, lambda lamp: {"flux_lm": lamp.flux_lm * factor})


def set_temperature(work: Work) -> Outcome:
    """Give lamps the colour of a black body; their flux, which is photometric, stays."""
    kelvin = number(work.change, _COLDEST_K, _HOTTEST_K, "K")
    return _each(work, lambda lamp: {"color_temperature_k": kelvin, "color": color_of_temperature(kelvin)})


def switch(work: Work) -> Outcome:
    """Switch lamps on or off."""
    on = truth(work.change)
    return _each(work, lambda lamp: {"on": on})


def shared_by_lamps(read: Callable[[Lamp], object]) -> Callable[[Work], object]:
    """Return a function that returns what all targeted lamps have in common, or None."""

    def current(work: Work) -> object:
        values = {read(lamp) for lamp in targeted_lamps(work)}
        return values.pop() if len(values) == 1 else None

    return current


def daylight_of(work: Work) -> Daylight:
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


def sun_of(daylight: Daylight) -> SunPosition:
    """Return where the sun of a scene stands, by its direction."""
    x, y, z = daylight.sun_direction
    azimuth = (daylight.north_yaw_rad - math.atan2(y, x)) % (2.0 * math.pi)
    return SunPosition(math.asin(max(-1.0, min(z, 1.0))), azimuth, daylight.sun_distance_au)


def _put_sun(work: Work, sun: SunPosition) -> Outcome:
    daylight = daylight_of(work)
    note = "the sun is put there; day, hour and latitude beside it are those of the scene before"
    return _with(work, replace(daylight, sun_direction=direction_of(sun, daylight.north_yaw_rad)), note)


def set_elevation(work: Work) -> Outcome:
    """Raise or lower the sun; its azimuth stays."""
    return _put_sun(work, sun_of(daylight_of(work))._replace(elevation_rad=math.radians(number(work.change, 0.0, 90.0, "deg"))))


def set_azimuth(work: Work) -> Outcome:
    """Turn the sun round the room; its elevation stays."""
    return _put_sun(work, sun_of(daylight_of(work))._replace(azimuth_rad=math.radians(number(work.change, -360.0, 360.0, "deg"))))


def set_hour(work: Work) -> Outcome:
    """Move the sun along its way over the sky of that day and place."""
    daylight, hour = daylight_of(work), number(work.change, 0.0, 24.0, "h")
    sun = sun_position_at(daylight.day_of_year, hour, daylight.latitude_rad)
    if sun.elevation_rad < 0.0:
        raise ChangeError(f"{work.change}: value: expected an hour of the day at that latitude, got {hour:g} h, when the sun is down")
    direction = direction_of(sun, daylight.north_yaw_rad)
    return _with(work, replace(daylight, solar_hour=hour, sun_direction=direction, sun_distance_au=sun.distance_au))


def set_daylight(name: str, low: float, high: float) -> Callable[[Work], Outcome]:
    """Return a function that sets one number of the daylight."""

    def make(work: Work) -> Outcome:
        return _with(work, replace(daylight_of(work), **{name: number(work.change, low, high)}))  # type: ignore[arg-type]

    return make


def scale_sun(work: Work) -> Outcome:
    """Multiply the light of the sun."""
    daylight, factor = daylight_of(work), number(work.change, 0.0, 100.0)
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
