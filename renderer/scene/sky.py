"""A room's environment -> the sky that kernels take; what stands outside is drawn when light is asked for, as it takes half a second."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.core.errors import FlattenError, MeshFileError
from renderer.scene.daylight_sky import daylight_map, gradient_map
from renderer.scene.environment_map import load_environment_map
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.surroundings.view import surroundings_map
from scene_description import Environment


def build_sky(environment: Environment, catalog_dir: Path | None = None) -> Sky:
    """Return the environment without what stands there.

    Raises:
        FlattenError: a map that cannot be used.
    """
    plain = Sky(*(np.array(color, np.float32) for color in (environment.zenith, environment.horizon, environment.ground)))
    if environment.map is not None:
        if catalog_dir is None:
            raise FlattenError(f"environment: expected a catalogue folder for map '{environment.map.file}', got none; name one")
        try:
            return plain._replace(**load_environment_map(environment.map, catalog_dir)._asdict())
        except MeshFileError as error:
            raise FlattenError(f"environment: {error}") from error
    return plain if environment.daylight is None else plain._replace(**daylight_map(environment.daylight)._asdict())


def sky_of(flat: FlatScene) -> Sky:
    """Return the sky of a scene with what stands outside its windows."""
    return flat.sky if flat.outside is None else flat.sky._replace(table=_surroundings_table(flat.outside))


@lru_cache(maxsize=1)
def _surroundings_table(environment: Environment) -> NDArray[np.float32]:
    """Return the map of an environment with surroundings; the last one is kept, as rooms that differ in one thing share it."""
    assert environment.surroundings is not None
    sky = build_sky(environment)
    level = sky.table if sky.table.size else gradient_map(sky.zenith, sky.horizon, sky.ground)
    cover = environment.daylight.cloud_cover if environment.daylight else 0.0
    return surroundings_map(environment.surroundings, level, sky.sun, cover)
