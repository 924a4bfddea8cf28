"""Which lamps shine, and what the sky outside looks like.  Light is photometric."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from grammar.grammar_file import read_yaml
from grammar.rules import GrammarError
from scene_description import Environment, FieldError, Light, Limits, SceneObject, from_mapping
from scene_description.color_temperature import color_of_temperature, luminance_rgb

Flux = Annotated[float, Limits(ge=1.0, le=1e6, unit="lm")]
Kelvin = Annotated[float, Limits(ge=1700.0, le=20000.0, unit="K")]
SkyLuminance = Annotated[float, Limits(ge=1e-6, le=1e5, unit="cd/m2")]
Ratio = Annotated[float, Limits(ge=0.0, le=10.0)]
Probability = Annotated[float, Limits(ge=0.0, le=1.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lamp:
    """One lamp category: the part that shines, ranges of flux and colour temperature, probability to be on by day and in the dark."""

    part: str
    flux_lm: tuple[Flux, Flux]
    color_temperature_k: tuple[Kelvin, Kelvin]
    on_by_day: Probability
    on_in_dark: Probability


@dataclass(frozen=True, slots=True, kw_only=True)
class Daylight:
    """One condition outside: whether lamps are needed, ranges of luminance and colour temperature of zenith, horizon and ground."""

    probability: Probability
    dark: bool
    zenith_cd_m2: tuple[SkyLuminance, SkyLuminance]
    horizon_ratio: tuple[Ratio, Ratio]
    ground_ratio: tuple[Ratio, Ratio]
    zenith_k: tuple[Kelvin, Kelvin]
    horizon_k: tuple[Kelvin, Kelvin]
    ground_k: tuple[Kelvin, Kelvin]


@dataclass(frozen=True, slots=True, kw_only=True)
class LightingConfig:
    """Lamps by category and daylight by condition; ``config/lighting.yaml`` explains each number."""

    lamps: Annotated[Mapping[str, Lamp], Limits(max_length=256)]
    daylight: Annotated[Mapping[str, Daylight], Limits(min_length=1, max_length=64)]


def read_lighting_config(path: Path) -> LightingConfig:
    """Read and check the settings of lighting, for example ``config_path("lighting.yaml")``.

    Raises:
        GrammarError: the file does not parse or a field does not fit; one line with file and field.
    """
    try:
        config = from_mapping(LightingConfig, read_yaml(path))
        for name, lamp in config.lamps.items():
            _check_order(f"lamps.{name}", {"flux_lm": lamp.flux_lm, "color_temperature_k": lamp.color_temperature_k})
        for name, sky in config.daylight.items():
            _check_order(f"daylight.{name}", {f.name: getattr(sky, f.name) for f in fields(sky) if f.name not in ("probability", "dark")})
        total = math.fsum(sky.probability for sky in config.daylight.values())
        if abs(total - 1.0) > 1e-6:
            raise FieldError("daylight", "probabilities that sum to 1", f"{total:.6g}")
        if all(sky.dark for sky in config.daylight.values() if sky.probability > 0.0):
            raise FieldError("daylight", "at least one condition that is not dark, for rooms without lamps", "none")
    except FieldError as error:
        raise GrammarError(f"{path}: {error}") from None
    return config


def sample_lighting(
    rng: np.random.Generator, config: LightingConfig, objects: Sequence[SceneObject], *, windows: bool = True
) -> tuple[tuple[Light, ...], Environment]:
    """Sample the state of all lamps of a room and the daylight outside.

    At night, and in a room without windows, at least one lamp is on: the one with the greatest flux if chance left all of them off.
    A room without lamps is never dark.

    Args:
        rng: the only source of randomness.
        config: ranges and probabilities.
        objects: the room's objects; those of a lamp category are lamps.
        windows: whether daylight gets in at all.

    Returns:
        One light for each lamp, lit or not, in the order of the objects; the environment.

    Raises:
        GrammarError: a lamp lacks the part that should shine.
    """
    lamps = [thing for thing in objects if thing.category in config.lamps]
    skies = [sky for sky in config.daylight.values() if lamps or not sky.dark]
    odds = np.array([sky.probability for sky in skies])
    sky = skies[int(rng.choice(len(skies), p=odds / odds.sum()))]
    dark = sky.dark or not windows
    lights = [_sample_light(rng, config.lamps[lamp.category], lamp, dark) for lamp in lamps]
    if dark and lights and not any(light.on for light in lights):
        brightest = max(range(len(lights)), key=lambda i: lights[i].flux_lm)
        lights[brightest] = replace(lights[brightest], on=True)
    return tuple(lights), _sample_environment(rng, sky)


def _sample_light(rng: np.random.Generator, lamp: Lamp, thing: SceneObject, dark: bool) -> Light:
    if lamp.part not in {part.name for part in thing.parts}:
        names = ", ".join(part.name for part in thing.parts) or "none"
        raise GrammarError(f"lamps.{thing.category}.part: expected a part of object {thing.id} ({names}), got '{lamp.part}'")
    flux_lm = _log_uniform(rng, lamp.flux_lm)
    temperature_k = float(rng.uniform(*lamp.color_temperature_k))
    on = bool(rng.random() < (lamp.on_in_dark if dark else lamp.on_by_day))
    color = color_of_temperature(temperature_k)
    return Light(object=thing.id, part=lamp.part, flux_lm=flux_lm, color_temperature_k=temperature_k, color=color, on=on)


def _sample_environment(rng: np.random.Generator, sky: Daylight) -> Environment:
    zenith_cd_m2 = _log_uniform(rng, sky.zenith_cd_m2)
    horizon_cd_m2 = zenith_cd_m2 * float(rng.uniform(*sky.horizon_ratio))
    ground_cd_m2 = zenith_cd_m2 * float(rng.uniform(*sky.ground_ratio))
    return Environment(
        zenith=luminance_rgb(float(rng.uniform(*sky.zenith_k)), zenith_cd_m2),
        horizon=luminance_rgb(float(rng.uniform(*sky.horizon_k)), horizon_cd_m2),
        ground=luminance_rgb(float(rng.uniform(*sky.ground_k)), ground_cd_m2),
    )


def _log_uniform(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(math.log(bounds[0]), math.log(bounds[1]))))


def _check_order(path: str, ranges: Mapping[str, tuple[float, float]]) -> None:
    for name, (low, high) in ranges.items():
        if low > high:
            raise FieldError(f"{path}.{name}", "low <= high", f"[{low}, {high}]")
