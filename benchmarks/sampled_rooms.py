"""Sampled rooms with a camera's path and one exposure for all that is compared, and the settings of presets."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, FlatScene, RenderConfig
from renderer.camera.rig import mounted_path
from renderer.exposure import exposed, meter
from renderer.film.tone import Exposure
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, from_mapping
from scene_synth_ros.cli.parameters.render_settings import preset_settings

LAYERS = ("color", "depth", "normals", "semantic", "instance")
"""What a camera's stream has: colour and the four basic layers."""

SEED = 7
TIMES = CameraTimes(frames=12, start_ns=0, rate_hz=15.0)
"""Twelve views spread over a room."""
SLOW = CameraTimes(frames=150, start_ns=0, rate_hz=15.0)
"""A walk of 0.5 m/s, 3.3 cm a frame."""


class SampledRoom(NamedTuple):
    """A room, ready to render: its key seeds noise, the exposure is metered along the path; made_s: what mesh, textures and meter took."""

    name: str
    flat: FlatScene
    key: int
    path: tuple[CameraPose, ...]
    exposure: Exposure
    made_s: float


def sample_room(synthesizer: SceneSynthesizer, room_type: str, index: int, times: CameraTimes = TIMES, seed: int = SEED) -> SampledRoom:
    """Return a room of a type."""
    scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index, times)
    began, key, camera = time.perf_counter(), scene_key(scene), camera_of((640, 480))
    flat = flatten(scene, Path.cwd())
    metered = meter(flat, camera, RenderConfig(), key, scene.camera_path)
    exposure = exposed(RenderConfig(auto_exposure=True), metered)
    made_s = time.perf_counter() - began
    return SampledRoom(f"{room_type} {index}", flat, key, mounted_path(camera, scene.camera_path), exposure, made_s)


def sample_rooms(count: int, types: Sequence[str] = (), times: CameraTimes = TIMES) -> Iterator[SampledRoom]:
    """Yield ``count`` rooms of each type, or of those named."""
    synthesizer = SceneSynthesizer.from_config()
    for index in range(count):
        for room_type in types or room_types():
            yield sample_room(synthesizer, room_type, index, times)


def camera_of(size: tuple[int, int]) -> CameraConfig:
    """Return the ideal camera of an image size, (width, height)."""
    return CameraConfig(width=size[0], height=size[1])


def preset_config(name: str, **changes: Any) -> RenderConfig:
    """Return a preset's settings, some of them changed."""
    return from_mapping(RenderConfig, preset_settings(name) | changes)
