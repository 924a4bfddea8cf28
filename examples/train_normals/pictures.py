"""Small pictures of rooms with their true normals; a room that was rendered before is read from its file."""

import hashlib
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from examples.train_normals.rooms import VIEWS
from renderer import CameraConfig, RenderConfig, Renderer, SensorConfig
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import SceneDescription, scene_to_json
from scene_description.whole import whole_file

CAMERA = CameraConfig(width=96, height=64)
RENDER = RenderConfig(
    integrator="cached", cache_spacing_m=0.06, cache_rays=32, cache_light_samples=16, samples_per_pixel=1, auto_exposure=True, threads=1
)
SENSOR = SensorConfig(full_well_e=1500.0, read_noise_e=12.0, bits=8)
"""A small pixel at high gain: 375 electrons where the picture is white (two stops below 1500), of which noise is 6 %; 20 % of mid grey."""


class Views(NamedTuple):
    """Views of one room: color and noisy (n, h, w, 3) uint8, normals (n, h, w, 3) float16 in the optical frame, 0 where there is none."""

    color: NDArray[np.uint8]
    noisy: NDArray[np.uint8]
    normals: NDArray[np.float16]


def render_rooms(scenes: Sequence[SceneDescription], folder: Path, workers: int = 2) -> list[Views]:
    """Return the views of each room, rendered in so many processes where the folder does not have them."""
    folder.mkdir(parents=True, exist_ok=True)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        return [read_views(path) for path in pool.map(partial(keep_room, folder=folder), scenes)]


def keep_room(scene: SceneDescription, folder: Path) -> Path:
    """Return the file of a room's views, named after all that they depend on but the program itself; render it if it is not there."""
    asked = f"{scene_to_json(scene)}{CAMERA}{RENDER}{SENSOR}{VIEWS}"
    path = folder / f"{hashlib.sha256(asked.encode()).hexdigest()[:24]}.npz"
    if not path.exists():
        views = render_room(scene)
        with whole_file(path) as unfinished, unfinished.open("wb") as file:
            np.savez(file, **views._asdict())
    return path


def read_views(path: Path) -> Views:
    """Return the views that a file has."""
    with np.load(path) as arrays:
        return Views(**{name: arrays[name] for name in Views._fields})


def render_room(scene: SceneDescription) -> Views:
    """Render ``VIEWS`` frames of the camera path."""
    flat, key, path = flatten(scene), scene_key(scene), scene.camera_path
    exposure = exposed(RENDER, meter(flat, CAMERA, RENDER, key, path))
    chosen = [round(place) for place in np.linspace(0, len(path) - 1, VIEWS)]
    with Renderer(flat, CAMERA, RENDER, key, sensor=SENSOR) as renderer:
        frames = [renderer.render(path[k], k, ("color", "color_sensed", "normals"), exposure=exposure).layers for k in chosen]
    color, noisy, normals = (np.stack([frame[name] for frame in frames]) for name in ("color", "color_sensed", "normals"))
    return Views(color.astype(np.uint8), noisy.astype(np.uint8), normals.astype(np.float16))
