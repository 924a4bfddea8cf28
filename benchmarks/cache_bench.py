"""What the settings of the irradiance cache trade: time of a frame and of a new room against the path tracer's light, in sampled rooms.

Times are those of the clock at 640x480, by as many threads as there are processors, of colour and the four basic layers: *first picture* is
from a renderer that knows nothing yet; *on the way* are the frames of a camera that goes on along its path, which compute light for what
comes into view; *again* are the same frames once more.  Pictures are compared at 160x120 with denoised ones of exact transport.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.color_bench import mean_flip
from benchmarks.presets_bench import CAMERA, EXACT, ROOM_TYPES, SEED
from benchmarks.table import Row
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, FlatScene, Frame, RenderConfig, Renderer, warm_up
from renderer.core.color import LUMINANCE
from renderer.exposure import exposed, meter
from renderer.film.tone import Exposure
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, from_mapping
from scene_synth_ros.cli.render_settings import preset_settings

LAYERS = ("color", "depth", "normals", "semantic", "instance")
LARGE = CameraConfig(width=640, height=480)
TIMES = CameraTimes(frames=150, start_ns=10**9, rate_hz=15.0)
FRAMES = 30
CHANGES: dict[str, dict[str, float | int]] = {
    "realtime": {},
    "stream": {},
    "stream, spacing 0.02 m": {"cache_spacing_m": 0.02},
    "stream, spacing 0.08 m": {"cache_spacing_m": 0.08},
    "stream, 16 rays": {"cache_rays": 16},
    "stream, 256 rays": {"cache_rays": 256},
    "stream, 8 light samples": {"cache_light_samples": 8},
    "stream, 128 light samples": {"cache_light_samples": 128},
}
"""Name, which begins with a preset -> what is changed of that."""


class Figures(NamedTuple):
    """One room with one setting: milliseconds, seconds, and shares."""

    again_ms: float
    on_the_way_ms: float
    first_s: float
    mean: float
    flip: float


def measure() -> list[Row]:
    """Return the rows of every setting: medians of the rooms, and the mean luminance that is farthest from the exact one."""
    warm_up(integrator="cached")
    synthesizer = SceneSynthesizer.from_config()
    found: dict[str, list[Figures]] = {name: [] for name in CHANGES}
    for room_type in ROOM_TYPES:
        scene = synthesizer.synthesize(SceneRequest(room_type=room_type), SEED, 0, TIMES)
        flat, path = flatten(scene), scene.camera_path
        shown = exposed(RenderConfig(auto_exposure=True), meter(flat, CAMERA, EXACT, scene_key(scene), path))
        truth = _picture(flat, replace(EXACT, denoise="auto"), path[0], shown)
        for name, changes in CHANGES.items():
            config = from_mapping(RenderConfig, preset_settings(name.partition(",")[0]) | changes)
            found[name].append(_compare(flat, config, path, shown, truth))
    rows = []
    for name, figures in found.items():
        columns = Figures(*(np.array(column) for column in zip(*figures, strict=True)))
        rows += [
            Row(f"{name}: frame again", float(np.median(columns.again_ms)), "ms"),
            Row(f"{name}: frame on the way", float(np.median(columns.on_the_way_ms)), "ms"),
            Row(f"{name}: first picture of a room", float(np.median(columns.first_s)), "s"),
            Row(f"{name}: mean over the exact one, farthest", float(columns.mean[np.argmax(np.abs(columns.mean - 1.0))]), ""),
            Row(f"{name}: FLIP", float(np.median(columns.flip)), ""),
        ]
    return rows


def _compare(flat: FlatScene, config: RenderConfig, path: tuple[CameraPose, ...], shown: Exposure, truth: Frame) -> Figures:
    with Renderer(flat, LARGE, config, SEED) as renderer:
        first_s = _seconds(renderer, path, 0, shown)
        on_the_way = [_seconds(renderer, path, index, shown) for index in range(1, FRAMES)]
        again = [_seconds(renderer, path, index, shown) for index in range(1, FRAMES)]
    frame = _picture(flat, config, path[0], shown)
    assert frame.radiance is not None and truth.radiance is not None
    mean = float((frame.radiance @ LUMINANCE).mean() / (truth.radiance @ LUMINANCE).mean())
    flip = mean_flip(np.asarray(truth.layers["color"], np.uint8), np.asarray(frame.layers["color"], np.uint8))
    return Figures(1e3 * float(np.median(again)), 1e3 * float(np.median(on_the_way)), first_s, mean, flip)


def _seconds(renderer: Renderer, path: tuple[CameraPose, ...], index: int, shown: Exposure) -> float:
    began = time.perf_counter()
    renderer.render(path[index], index, LAYERS, exposure=shown)
    return time.perf_counter() - began


def _picture(flat: FlatScene, config: RenderConfig, pose: CameraPose, shown: Exposure) -> Frame:
    with Renderer(flat, CAMERA, config, SEED) as renderer:
        return renderer.render(pose, 0, ("color",), exposure=shown)
