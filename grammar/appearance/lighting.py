"""The state of a room's lamps, spots let into its ceiling, and the daylight outside.  Light is photometric."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from shapely import Point, Polygon

from grammar.appearance.daylight import (
    NO_DAYLIGHT_REQUEST,
    DaylightRequest,
    Moment,
    MomentConfig,
    draw_moment,
    fitting_conditions,
    make_daylight,
)
from grammar.spec.rules import GrammarError
from scene_description import Environment, FieldError, Light, Limits, Luminaire, Room, SceneObject, Surroundings, from_mapping
from scene_description.ceilings import ceiling_planes
from scene_description.color_temperature import color_of_temperature, luminance_rgb
from scene_description.types import Setting
from scene_description.yaml_text import read_yaml

SpotMetres = Annotated[float, Limits(ge=0.1, le=10.0, unit="m")]
SpotFlux = Annotated[float, Limits(ge=1.0, le=1e5, unit="lm")]
Angle = Annotated[float, Limits(ge=1.0, le=89.0, unit="deg")]

MAX_SPOTS = 64
RADIUS_M = 0.03
_CLEAR_OF_LAMPS_M = 0.4
_CLEAR_OF_SLOPES_M = 0.1
"""So much higher are the planes of slopes over a spot."""
Flux = Annotated[float, Limits(ge=1.0, le=1e6, unit="lm")]
Kelvin = Annotated[float, Limits(ge=1700.0, le=20000.0, unit="K")]
SkyLuminance = Annotated[float, Limits(ge=1e-6, le=1e5, unit="cd/m2")]
Ratio = Annotated[float, Limits(ge=0.0, le=10.0)]
Probability = Annotated[float, Limits(ge=0.0, le=1.0)]
FloorHeight = Annotated[float, Limits(ge=0.0, le=100.0, unit="m")]
Elevation = Annotated[float, Limits(ge=-90.0, le=90.0, unit="deg")]

_NO_RANGES = ("probability", "dark", "cloud_cover")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lamp:
    """One lamp category: the part that shines, ranges of flux and colour temperature, probabilities to be on by day and in the dark."""

    part: str
    flux_lm: tuple[Flux, Flux]
    color_temperature_k: tuple[Kelvin, Kelvin]
    on_by_day: Probability
    on_in_dark: Probability


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """One condition outside: whether lamps are needed, ranges of luminance and colour temperature of zenith, horizon and ground.

    ``elevation_deg`` bounds the sun's elevation.  Where ``cloud_cover`` has a range, sun and sky follow from the moment in place of these
    luminances.
    """

    probability: Probability
    dark: bool
    zenith_cd_m2: tuple[SkyLuminance, SkyLuminance]
    horizon_ratio: tuple[Ratio, Ratio]
    ground_ratio: tuple[Ratio, Ratio]
    zenith_k: tuple[Kelvin, Kelvin]
    horizon_k: tuple[Kelvin, Kelvin]
    ground_k: tuple[Kelvin, Kelvin]
    elevation_deg: tuple[Elevation, Elevation] = (-90.0, 90.0)
    cloud_cover: tuple[Probability, Probability] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingConfig:
    """One setting outside the windows: its probability, and the heights above the ground that floors have there, equally likely."""

    probability: Probability
    floors_m: Annotated[tuple[FloorHeight, ...], Limits(min_length=1, max_length=32)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LightingConfig:
    """Lamps by category and daylight by condition; ``config/lighting.yaml`` explains each number."""

    lamps: Annotated[Mapping[str, Lamp], Limits(max_length=256)]
    daylight: Annotated[Mapping[str, Condition], Limits(min_length=1, max_length=64)]
    moment: MomentConfig | None = None
    downlights: "Annotated[Mapping[str, DownlightConfig], Limits(max_length=256)]" = field(default_factory=dict)
    surroundings: Annotated[Mapping[Setting, SettingConfig], Limits(max_length=16)] = field(default_factory=dict)


def read_lighting_config(path: Path) -> LightingConfig:
    """Read and check the settings of lighting, for example ``config_path("lighting.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit; one line with file and field.
    """
    try:
        config = from_mapping(LightingConfig, read_yaml(path, GrammarError))
        _check_config(config)
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return config


def _check_config(config: LightingConfig) -> None:
    for name, lamp in config.lamps.items():
        _check_order(f"lamps.{name}", {"flux_lm": lamp.flux_lm, "color_temperature_k": lamp.color_temperature_k})
    for name, sky in config.daylight.items():
        _check_order(f"daylight.{name}", {f.name: getattr(sky, f.name) for f in fields(sky) if f.name not in _NO_RANGES})
        if sky.cloud_cover is not None:
            _check_order(f"daylight.{name}", {"cloud_cover": sky.cloud_cover})
            if config.moment is None:
                raise FieldError(f"daylight.{name}.cloud_cover", "a section 'moment' for its sun", "none")
    for name, spots in config.downlights.items():
        ranges = ("spacing_m", "flux_lm", "color_temperature_k", "beam_deg")
        _check_order(f"downlights.{name}", {key: getattr(spots, key) for key in ranges})
    if config.moment is not None:
        _check_order("moment", {f.name: getattr(config.moment, f.name) for f in fields(config.moment) if f.name != "ground_color"})
    for name, rows in (("daylight", config.daylight), ("surroundings", config.surroundings)):
        total = math.fsum(row.probability for row in rows.values())
        if rows and abs(total - 1.0) > 1e-6:
            raise FieldError(name, "probabilities that sum to 1", f"{total:.6g}")
    if all(sky.dark for sky in config.daylight.values() if sky.probability > 0.0):
        raise FieldError("daylight", "at least one condition that is not dark, for rooms without lamps", "none")


def sample_lighting(
    rng: np.random.Generator,
    config: LightingConfig,
    objects: Sequence[SceneObject],
    *,
    windows: bool = True,
    request: DaylightRequest = NO_DAYLIGHT_REQUEST,
) -> tuple[tuple[Light, ...], Environment]:
    """Sample which lamps are lit and what is outside, with the daylight as far as ``request`` fixes it; ``windows``: whether any gets in.

    Returns:
        One light for each lamp, lit or not, in the order of the objects; the environment.

    Raises:
        GrammarError: a lamp lacks the part that should shine, or the daylight asked for does not come about.
    """
    lamps = [item for item in objects if item.category in config.lamps]
    sky, moment = _sample_condition(rng, config, bool(lamps), request)
    dark = sky.dark or not windows
    lights = [_sample_light(rng, config.lamps[lamp.category], lamp, dark) for lamp in lamps]
    if dark and lights and not any(light.on for light in lights):
        brightest = max(range(len(lights)), key=lambda i: lights[i].flux_lm)
        lights[brightest] = replace(lights[brightest], on=True)
    return tuple(lights), _sample_environment(rng, config, sky, moment, request)


def _sample_condition(
    rng: np.random.Generator, config: LightingConfig, lamps: bool, request: DaylightRequest
) -> tuple[Condition, Moment | None]:
    """Return the condition outside, and the moment if that is drawn first."""
    skies = {name: sky for name, sky in config.daylight.items() if lamps or not sky.dark}
    moment = None
    if request.condition is not None:
        if request.condition not in config.daylight:
            raise GrammarError(f"daylight: expected one of {', '.join(config.daylight)}, got '{request.condition}'")
        return config.daylight[request.condition], None
    if request.solar_hour is not None and config.moment is not None:
        moment = draw_moment(rng, config.moment, request, (-90.0, 90.0))
        fitting = fitting_conditions(moment, {name: sky.elevation_deg for name, sky in config.daylight.items()})
        skies = {name: config.daylight[name] for name in fitting}
    odds = np.array([sky.probability for sky in skies.values()])
    if not odds.sum() > 0.0:
        raise GrammarError(f"daylight: expected a condition that fits solar_hour {request.solar_hour}, got none; widen elevation_deg")
    return list(skies.values())[int(rng.choice(len(odds), p=odds / odds.sum()))], moment


def _sample_light(rng: np.random.Generator, lamp: Lamp, item: SceneObject, dark: bool) -> Light:
    if lamp.part not in {part.name for part in item.parts}:
        names = ", ".join(part.name for part in item.parts) or "none"
        raise GrammarError(f"lamps.{item.category}.part: expected a part of object {item.id} ({names}), got '{lamp.part}'")
    flux_lm = _log_uniform(rng, lamp.flux_lm)
    temperature_k = float(rng.uniform(*lamp.color_temperature_k))
    on = bool(rng.random() < (lamp.on_in_dark if dark else lamp.on_by_day))
    color = color_of_temperature(temperature_k)
    return Light(object=item.id, part=lamp.part, flux_lm=flux_lm, color_temperature_k=temperature_k, color=color, on=on)


def _sample_environment(
    rng: np.random.Generator, config: LightingConfig, sky: Condition, moment: Moment | None, request: DaylightRequest
) -> Environment:
    zenith_cd_m2 = _log_uniform(rng, sky.zenith_cd_m2)
    horizon_cd_m2 = zenith_cd_m2 * float(rng.uniform(*sky.horizon_ratio))
    ground_cd_m2 = zenith_cd_m2 * float(rng.uniform(*sky.ground_ratio))
    plain = Environment(
        zenith=luminance_rgb(float(rng.uniform(*sky.zenith_k)), zenith_cd_m2),
        horizon=luminance_rgb(float(rng.uniform(*sky.horizon_k)), horizon_cd_m2),
        ground=luminance_rgb(float(rng.uniform(*sky.ground_k)), ground_cd_m2),
    )
    if sky.cloud_cover is None or config.moment is None:
        return plain
    moment = moment or draw_moment(rng, config.moment, request, sky.elevation_deg)
    cover = float(rng.uniform(*sky.cloud_cover)) if request.cloud_cover is None else request.cloud_cover
    return replace(plain, daylight=make_daylight(moment, cover, config.moment.ground_color))


def sample_surroundings(
    rng: np.random.Generator, config: LightingConfig, asked: Setting | Literal["any", "none"] = "any"
) -> Surroundings | None:
    """Sample what stands outside; None where nothing is asked for, or the settings have nothing.

    Raises:
        GrammarError: the setting that is asked for is not among them.
    """
    if asked == "none" or not config.surroundings:
        return None
    if asked != "any" and asked not in config.surroundings:
        raise GrammarError(f"surroundings: expected one of {', '.join(config.surroundings)}, got '{asked}'")
    names = list(config.surroundings)
    drawn = names[int(rng.choice(len(names), p=[row.probability for row in config.surroundings.values()]))]
    setting = drawn if asked == "any" else asked
    floors = config.surroundings[setting].floors_m
    return Surroundings(
        setting=setting,
        seed=int(rng.integers(2**53)),
        floor_above_ground_m=floors[int(rng.integers(len(floors)))],
        quarter_turns=int(rng.integers(4)),
    )


def _log_uniform(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Draw a number whose logarithm is uniform."""
    return math.exp(rng.uniform(math.log(bounds[0]), math.log(bounds[1])))


def _check_order(path: str, ranges: Mapping[str, tuple[float, float]]) -> None:
    for name, (low, high) in ranges.items():
        if low > high:
            raise FieldError(f"{path}.{name}", "low <= high", f"[{low}, {high}]")


@dataclass(frozen=True, slots=True, kw_only=True)
class DownlightConfig:
    """Spots of one room type: the probability that it has them, distances, and ranges of flux, colour temperature and cones.

    ``beam_deg`` is the half angle within which the light is full; it ends at ``field_over_beam`` times that.
    """

    probability: Probability
    spacing_m: tuple[SpotMetres, SpotMetres]
    from_wall_m: SpotMetres
    flux_lm: tuple[SpotFlux, SpotFlux]
    color_temperature_k: tuple[Kelvin, Kelvin]
    beam_deg: tuple[Angle, Angle]
    field_over_beam: Annotated[float, Limits(ge=1.0, le=3.0)]
    on_by_day: Probability
    on_in_dark: Probability


def sample_downlights(
    rng: np.random.Generator, config: DownlightConfig | None, room: Room, objects: Sequence[SceneObject], *, dark: bool
) -> tuple[Luminaire, ...]:
    """Sample the spots in a ceiling, where it is flat; none where the room type has none or the draw leaves them out.

    They lie on a grid along x and y over the room's outline, off its walls and off hanging lamps.
    """
    if config is None or rng.random() >= config.probability:
        return ()
    spacing, flux_lm = float(rng.uniform(*config.spacing_m)), _log_uniform(rng, config.flux_lm)
    temperature_k, beam = float(rng.uniform(*config.color_temperature_k)), math.radians(float(rng.uniform(*config.beam_deg)))
    on = bool(rng.random() < (config.on_in_dark if dark else config.on_by_day))
    # keep the points of a grid that are off the walls and off hanging lamps
    floor = Polygon(room.polygon_m)
    hanging = [item.position_m[:2] for item in objects if item.support.kind == "ceiling"]
    x_low, y_low, x_high, y_high = floor.bounds
    planes = ceiling_planes(room).tolist()
    places = []
    for x in _grid(x_low, x_high, spacing, config.from_wall_m):
        for y in _grid(y_low, y_high, spacing, config.from_wall_m):
            off_lamps = all(math.dist((x, y), place) > _CLEAR_OF_LAMPS_M for place in hanging)
            point = Point(x, y)
            flat = all(a * x + b * y + c > room.height_m + _CLEAR_OF_SLOPES_M for a, b, c in planes)
            if flat and off_lamps and floor.contains(point) and floor.exterior.distance(point) >= 0.9 * config.from_wall_m:
                places.append((x, y))
    return tuple(
        Luminaire(
            kind="spot",
            position_m=(x, y, room.height_m - 0.2 * RADIUS_M),
            flux_lm=flux_lm,
            color_temperature_k=temperature_k,
            color=color_of_temperature(temperature_k),
            on=on,
            beam_rad=beam,
            field_rad=min(config.field_over_beam * beam, math.radians(89.0)),
            radius_m=RADIUS_M,
        )
        for x, y in places[:MAX_SPOTS]
    )


def _grid(low: float, high: float, spacing: float, margin: float) -> list[float]:
    """Return points along an axis, ``margin`` off the ends and about ``spacing`` apart."""
    low, high = low + margin, high - margin
    if high <= low:
        return [0.5 * (low + high)]
    return [float(point) for point in np.linspace(low, high, round((high - low) / spacing) + 1)]
