"""A room's environment -> the sky that kernels take; what stands outside is drawn when light is asked for, as it takes half a second."""

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderer.core.equirectangular import map_directions
from renderer.core.errors import FlattenError, MeshFileError
from renderer.scene.daylight_sky import daylight_map, gradient_map
from renderer.scene.environment_map import load_environment_map
from renderer.scene.flat_scene import FlatScene, Sky
from renderer.surroundings.panorama import COLUMNS
from renderer.surroundings.view import surroundings_map
from scene_description import Environment

_UPRIGHT = 0.01
"""Least slope of a pane that is not upright, and a margin about the columns that upright ones show."""


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
    """Return the sky of a scene with what its windows show of what stands outside."""
    return flat.sky if flat.outside is None else flat.sky._replace(table=_surroundings_table(flat.outside, shown_columns(flat).tobytes()))


def shown_columns(flat: FlatScene) -> NDArray[np.bool_]:
    """Return which columns (COLUMNS,) of a map of the world windows may show: those less than a right angle from a way out."""
    a, b, c = (flat.mesh.vertices[flat.mesh.faces[flat.parts.portal[flat.face_part], k]].astype(np.float64) for k in range(3))
    inward = np.cross(b - a, c - a)
    if (np.abs(inward[:, 2]) > _UPRIGHT * np.abs(inward).max(axis=1)).any():
        return np.ones(COLUMNS, np.bool_)
    ways = np.unique(np.round(inward / np.maximum(np.abs(inward).max(axis=1, keepdims=True), 1e-30), 3), axis=0)
    along = map_directions(1, COLUMNS)[0]
    return np.asarray((-along[:, 0] * ways[:, :1] - along[:, 1] * ways[:, 1:2] > -_UPRIGHT).any(axis=0))


@lru_cache(maxsize=1)
def _surroundings_table(environment: Environment, shown: bytes) -> NDArray[np.float32]:
    """Return the map of an environment with surroundings; the last one is kept, as rooms that differ in one thing share it."""
    assert environment.surroundings is not None
    sky = build_sky(environment)
    level = sky.table if sky.table.size else gradient_map(sky.zenith, sky.horizon, sky.ground)
    cover = environment.daylight.cloud_cover if environment.daylight else 0.0
    return surroundings_map(environment.surroundings, level, sky.sun, cover, np.frombuffer(shown, np.bool_))
