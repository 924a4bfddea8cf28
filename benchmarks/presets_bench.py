"""What presets lose: the mean luminance of sampled rooms beside 1,024 samples of exact transport, and how long samples take.

Presets take 256 samples for their means, whatever they take for a frame: what they lose does not depend on it, and is above the noise then.
Means are of what the camera sees at 160x120 from the middle pose of the path, before denoising; times are those of the processor.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from benchmarks.table import Row, at_least
from grammar import SceneRequest
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, FlatScene, RenderConfig, Renderer
from renderer.core.color import LUMINANCE
from renderer.exposure import exposed, meter
from renderer.film.tone import Exposure
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, from_mapping
from scene_synth_ros.cli.parameters.render_settings import PRESETS, preset_settings

ROOM_TYPES, SEED = ("bedroom", "kitchen", "living_room", "bathroom"), 1
EXACT = RenderConfig(samples_per_pixel=1024, max_depth=32, blur_textures=False)
MEAN_SAMPLES = 256
CAMERA = CameraConfig(width=160, height=120)
TIMES = CameraTimes(frames=3, start_ns=10**9, rate_hz=10.0)
LEAST = 0.98
TRACED = [name for name in PRESETS if preset_settings(name)["integrator"] == "path"]
"""The presets that trace paths; ``cache_bench`` has the others."""


def measure() -> list[Row]:
    """Return, for every room, each preset's share of the exact mean, and its seconds for a million samples."""
    synthesizer = SceneSynthesizer.from_config()
    rows = []
    for room_type in ROOM_TYPES:
        scene = synthesizer.synthesize(SceneRequest(room_type=room_type), SEED, 0, TIMES)
        flat, pose = flatten(scene), scene.camera_path[1]
        shown = exposed(RenderConfig(auto_exposure=True), meter(flat, CAMERA, EXACT, scene_key(scene), scene.camera_path))
        exact, _ = mean_and_seconds(flat, pose, EXACT, shown)
        for preset in TRACED:
            config = replace(from_mapping(RenderConfig, preset_settings(preset, MEAN_SAMPLES)), denoise="none")
            mean, seconds = mean_and_seconds(flat, pose, config, shown)
            rows.append(at_least(f"{room_type}, {preset}, mean over the exact one", mean / exact, "", LEAST))
            rows.append(
                Row(f"{room_type}, {preset}, a million samples", 1e6 * seconds / (MEAN_SAMPLES * CAMERA.width * CAMERA.height), "s")
            )
    return rows


def mean_and_seconds(flat: FlatScene, pose: CameraPose, config: RenderConfig, shown: Exposure) -> tuple[float, float]:
    """Return the mean luminance (cd/m2) of one frame, and the processor time it took."""
    with Renderer(flat, CAMERA, config, SEED) as renderer:
        renderer.render(pose, 0, ("albedo",), exposure=shown)  # builds the tree
        began = time.process_time()
        frame = renderer.render(pose, 0, ("color",), exposure=shown)
    seconds = time.process_time() - began
    assert frame.radiance is not None
    return float((frame.radiance.astype(np.float64) @ LUMINANCE).mean()), seconds
