"""Spots let into the ceiling: a grid of them in rooms that have any, all alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from scene_description import Limits, Luminaire, Room, SceneObject
from scene_description.color_temperature import color_of_temperature

Probability = Annotated[float, Limits(ge=0.0, le=1.0)]
Metres = Annotated[float, Limits(ge=0.1, le=10.0, unit="m")]
Flux = Annotated[float, Limits(ge=1.0, le=1e5, unit="lm")]
Kelvin = Annotated[float, Limits(ge=1700.0, le=20000.0, unit="K")]
Angle = Annotated[float, Limits(ge=1.0, le=89.0, unit="deg")]

MAX_SPOTS = 64
RADIUS_M = 0.03
_CLEAR_OF_LAMPS_M = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class DownlightConfig:
    """Spots of one room type: how often it has them, distances, and ranges of flux, colour temperature and half angles of their cones.

    ``beam_deg`` is full; ``field_over_beam`` times it is where the light ends.
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
    """Sample the spots in a ceiling; none where the room type has none or chance leaves them out.

    They stand in rows along x and y, evenly over the room's outline, off its walls and off hanging lamps.

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
    outline = np.array(room.polygon_m)
    hanging = [item.position_m[:2] for item in objects if item.support.kind == "ceiling"]
    places = []
    for x in _even(outline[:, 0], spacing, config.from_wall_m):
        for y in _even(outline[:, 1], spacing, config.from_wall_m):
            clear = all(math.dist((x, y), place) > _CLEAR_OF_LAMPS_M for place in hanging)
            if clear and _depth_inside(outline, np.array([x, y])) >= 0.9 * config.from_wall_m:
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


def _even(coordinates: np.ndarray, spacing: float, margin: float) -> list[float]:
    """Return places along an axis, ``margin`` off the ends and about ``spacing`` apart."""
    low, high = float(coordinates.min()) + margin, float(coordinates.max()) - margin
    if high <= low:
        return [0.5 * (low + high)]
    return [float(place) for place in np.linspace(low, high, round((high - low) / spacing) + 1)]


def _depth_inside(outline: np.ndarray, point: np.ndarray) -> float:
    """Return the distance from a point to the outline (n, 2), negative outside."""
    ends = np.roll(outline, -1, axis=0)
    along, away = ends - outline, point - outline
    share = np.clip((away * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    distance = float(np.linalg.norm(away - share[:, None] * along, axis=1).min())
    crosses = (outline[:, 1] > point[1]) != (ends[:, 1] > point[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = outline[:, 0] + (point[1] - outline[:, 1]) * along[:, 0] / along[:, 1]
    return distance if np.count_nonzero(crosses & (at > point[0])) % 2 else -distance
