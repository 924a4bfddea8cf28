"""Spots let into the ceiling: a grid of them in rooms that have any, all alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from shapely import Point, Polygon

from scene_description import Limits, Luminaire, Room, SceneObject
from scene_description.ceilings import ceiling_planes
from scene_description.color_temperature import color_of_temperature

Probability = Annotated[float, Limits(ge=0.0, le=1.0)]
Metres = Annotated[float, Limits(ge=0.1, le=10.0, unit="m")]
Flux = Annotated[float, Limits(ge=1.0, le=1e5, unit="lm")]
Kelvin = Annotated[float, Limits(ge=1700.0, le=20000.0, unit="K")]
Angle = Annotated[float, Limits(ge=1.0, le=89.0, unit="deg")]

MAX_SPOTS = 64
RADIUS_M = 0.03
_CLEAR_OF_LAMPS_M = 0.4
_CLEAR_OF_SLOPES_M = 0.1
"""So much higher are the planes of slopes over a spot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DownlightConfig:
    """Spots of one room type: the probability that it has them, distances, and ranges of flux, colour temperature and cones.

    ``beam_deg`` is the half angle within which the light is full; it ends at ``field_over_beam`` times that.
    """

    probability: Probability
    spacing_m: tuple[Metres, Metres]
    from_wall_m: Metres
    flux_lm: tuple[Flux, Flux]
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

    Args:
        rng: the only source of randomness.
        config: of the room type.
        room: outline and height.
        objects: of which those that hang from the ceiling are kept clear.
        dark: whether lamps are needed.
    """
    if config is None or rng.random() >= config.probability:
        return ()
    spacing, flux_lm = float(rng.uniform(*config.spacing_m)), float(np.exp(rng.uniform(*np.log(config.flux_lm))))
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
