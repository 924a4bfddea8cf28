"""The environment outside a room's windows with what stands there: table of :class:`renderer.scene.flat_scene.Sky`."""

import math
from contextlib import closing
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderer.core.color import LUMINANCE
from renderer.core.equirectangular import map_directions, pixel_solid_angles
from renderer.core.workers import Workers, thread_count
from renderer.surroundings.neighbourhood import SETTINGS, Neighbourhood, make_neighbourhood
from renderer.surroundings.panorama import ALL_AROUND, COLUMNS, ROWS, TILE, OutsideLight, draw_rows, tile_lists
from scene_description.color_temperature import luminance_rgb
from scene_description.products import matmul
from scene_description.types import Surroundings

EYE_M = 1.5
"""Height of the eye above the room's floor."""
DARK_LX = 150.0
"""Below this horizontal illuminance street lamps and windows are lit."""
_LAMP_CD, _LAMP_K = 900.0, 2700.0
_PANE_CD_M2, _PANE_K = 14.0, 2800.0


def surroundings_map(
    surroundings: Surroundings,
    sky: NDArray[np.float32],
    sun: NDArray[np.float32],
    cloud_cover: float,
    shown: NDArray[np.bool_] = ALL_AROUND,
) -> NDArray[np.float32]:
    """Return luminance (ROWS, COLUMNS, 3) float32 in cd/m2 all around, as an equirectangular map of the world.

    Args:
        surroundings: what stands there.
        sky: (h, w, 3) float32, equirectangular map of the sky and level ground alone; w a multiple of four.
        sun: as in ``Sky``, empty without one.
        cloud_cover: 0 clear to 1 overcast; clouds vary the sky's luminance about what it is.
        shown: (COLUMNS,) of the map; the others have sky and level ground alone.
    """
    turns = surroundings.quarter_turns
    turned = np.roll(sky, turns * sky.shape[1] // 4, axis=1)
    to_sun = _turned_back(sun[:3].astype(np.float64), turns) if len(sun) else None
    place = make_neighbourhood(
        np.random.default_rng(surroundings.seed), SETTINGS[surroundings.setting], None if to_sun is None else to_sun.tolist()
    )
    beam = sun[4:7].astype(np.float64) * (2.0 * math.pi * float(sun[3])) if len(sun) else np.zeros(3)
    light = light_of(turned, np.zeros(3) if to_sun is None else to_sun, beam, cloud_cover)
    image = panorama_of(place, light, surroundings.floor_above_ground_m + EYE_M, np.roll(shown, turns * COLUMNS // 4))
    return np.ascontiguousarray(np.roll(image, -turns * COLUMNS // 4, axis=1))


def _turned_back(direction: NDArray[np.float64], turns: int) -> NDArray[np.float64]:
    """Return a direction (3,) of the world in a frame that is turned by quarters about z."""
    x, y, z = direction
    return np.array([(x, y, z), (y, -x, z), (-x, -y, z), (-y, x, z)][turns])


def light_of(sky: NDArray[np.float32], to_sun: NDArray[np.float64], beam: NDArray[np.float64], cloud_cover: float) -> OutsideLight:
    """Return what lights a neighbourhood; lamps and windows where it is dark."""
    directions = map_directions(*sky.shape[:2])
    angle = pixel_solid_angles(*sky.shape[:2])[:, None]
    level = (sky.astype(np.float64) * (np.maximum(directions[..., 2], 0.0) * angle)[..., None]).sum(axis=(0, 1))
    lux = float(matmul(level + beam * max(float(to_sun[2]), 0.0), LUMINANCE))
    dark = 1.0 if lux < DARK_LX else 0.0
    arrays = (
        sky,
        to_sun,
        beam,
        sky_harmonics(sky),
        dark * np.array(luminance_rgb(_LAMP_K, _LAMP_CD)),
        dark * np.array(luminance_rgb(_PANE_K, _PANE_CD_M2)),
        (1.0 - dark) * min(3.0 * cloud_cover, 1.0) * (1.0 - 0.4 * cloud_cover) * np.array([1.8, 0.45]),
    )
    return OutsideLight(*(np.ascontiguousarray(array, np.float32) for array in arrays))


def sky_harmonics(sky: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the products (9, 3) of an equirectangular map with the real spherical harmonics up to order two, by solid angle."""
    directions = map_directions(*sky.shape[:2])
    x, y, z = directions[..., 0], directions[..., 1], directions[..., 2]
    basis = (
        0.282095 + 0.0 * x,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3.0 * z * z - 1.0),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    )
    weighted = sky.astype(np.float64) * pixel_solid_angles(*sky.shape[:2])[:, None, None]
    return np.array([(weighted * row[..., None]).sum(axis=(0, 1)) for row in basis])


@lru_cache(maxsize=1)
def _directions() -> NDArray[np.float32]:
    return np.ascontiguousarray(map_directions(ROWS, COLUMNS), np.float32)


def panorama_of(place: Neighbourhood, light: OutsideLight, eye_m: float, shown: NDArray[np.bool_] = ALL_AROUND) -> NDArray[np.float32]:
    """Return the view all around (ROWS, COLUMNS, 3), in the neighbourhood's frame, from ``eye_m`` above ground; ``shown``: its columns."""
    directions, image = _directions(), np.zeros((ROWS, COLUMNS, 3), np.float32)
    tiles = tile_lists(place, eye_m)

    def draw(_: int, first: int) -> None:
        draw_rows(place, light, tiles, np.float32(eye_m), (directions, shown), image, np.zeros(2, np.float32), first)

    with closing(Workers(thread_count(0))) as workers:
        workers.run(draw, range(0, ROWS, TILE))
    return image
