"""Colour by the irradiance cache in sampled rooms of every type: frames a second, a room's first frame, memory, error.

python -m benchmarks.camera_rate_bench [--rooms N] [--reference-samples N] [--pictures DIR]

Rates are of colour, depth, normals, semantic and instance ids together, in one process, along the rooms' own camera paths.  Errors are
against the path tracer with so many samples, both as it is and denoised: FLIP (Andersson et al. 2020, by its authors' package) of what is
displayed, and mean luminance.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import flip_evaluator
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.table import Row, at_least, at_most, render_table
from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, RenderConfig, Renderer, warm_up
from renderer.camera.rig import mounted_path
from renderer.core.color import LUMINANCE
from renderer.exposure import exposed, meter
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import SceneDescription

LAYERS = ("color", "depth", "normals", "semantic", "instance")
SEED, FRAMES, REFERENCE_DEPTH = 7, 12, 32
LARGE, SMALL = (640, 480), (320, 240)


class Figures(NamedTuple):
    """Of one room: frames/s at either size, seconds to the first frame, cache in MB; FLIP denoised and raw, share of the mean luminance."""

    name: str
    rate: float
    small_rate: float
    first_s: float
    memory_mb: float
    flip: float
    raw_flip: float
    light: float


def measure(rooms: int = 1, samples: int = 0, pictures: Path | None = None) -> list[Row]:
    """Return the table of ``rooms`` rooms of each type; without ``samples`` no errors."""
    warm_up(integrator="cached")
    synthesizer, times = SceneSynthesizer.from_config(), CameraTimes(frames=FRAMES, start_ns=0, rate_hz=15.0)
    found = []
    for room_type in room_types():
        for index in range(rooms):
            scene = synthesizer.synthesize(SceneRequest(room_type=room_type), SEED, index, times)
            found.append(_measure_room(f"{room_type} {index}", scene, samples, pictures))
            print(" ".join(f"{value:.4g}" if isinstance(value, float) else value for value in found[-1]), flush=True)
    rate, small, first, memory = (np.array([getattr(item, name) for item in found]) for name in Figures._fields[1:5])
    rows = [
        at_least(f"{len(found)} rooms, 640x480, median", float(np.median(rate)), "frames/s", 15.0),
        at_least(f"  slowest, {found[int(rate.argmin())].name}", float(rate.min()), "frames/s", 10.0),
        at_least("320x240, median", float(np.median(small)), "frames/s", 30.0),
        at_most("a new room to its first frame, median", float(np.median(first)), "s", 2.5),
        at_most(f"  slowest, {found[int(first.argmax())].name}", float(first.max()), "s", 4.0),
        at_most("memory of a room's cache, most", float(memory.max()), "MB", 100.0),
    ]
    if samples:
        flip, raw, light = (np.array([getattr(item, name) for item in found]) for name in Figures._fields[5:])
        rows += [
            at_most(f"FLIP against {samples} samples, denoised, median", float(np.median(flip)), "", 0.08),
            at_most("  90th percentile", float(np.quantile(flip, 0.9)), "", 0.11),
            Row("  against the raw samples, median", float(np.median(raw)), ""),
            at_most("mean luminance off by, most", float(np.abs(light - 1.0).max()), "", 0.03),
        ]
    return rows


def _measure_room(name: str, scene: SceneDescription, samples: int, pictures: Path | None) -> Figures:
    flat, key = flatten(scene, Path.cwd()), scene_key(scene)
    large, small = (CameraConfig(width=width, height=height) for width, height in (LARGE, SMALL))
    path, config = mounted_path(large, scene.camera_path), RenderConfig(integrator="cached")
    exposure = exposed(RenderConfig(auto_exposure=True), meter(flat, large, config, key, scene.camera_path))
    began = time.perf_counter()
    with Renderer(flat, large, config, key) as renderer:
        first = renderer.render(path[0], 0, LAYERS, exposure=exposure, path=path)
        first_s = time.perf_counter() - began
        rate = _rate(renderer, path, exposure)
        memory_mb = renderer.cached().size_bytes / 1e6
    with Renderer(flat, small, config, key) as renderer:
        renderer.render(path[0], 0, LAYERS, exposure=exposure, path=path)
        small_rate = _rate(renderer, path, exposure)
    flip = raw_flip = light = float("nan")
    if samples:
        exact = RenderConfig(samples_per_pixel=samples, max_depth=REFERENCE_DEPTH, blur_textures=False, denoise="oidn")
        with Renderer(flat, large, exact, key) as renderer:
            truth = renderer.render(path[0], 0, ("color", "color_noisy"), exposure=exposure)
        picture, denoised = first.layers["color"], truth.layers["color"]
        flip, raw_flip = _flip(denoised, picture), _flip(truth.layers["color_noisy"], picture)
        light = _mean(first.radiance) / _mean(truth.radiance)
        if pictures is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            Image.fromarray(np.concatenate([picture, denoised], axis=1)).save(pictures / f"{name.replace(' ', '_')}.png")
    return Figures(name, rate, small_rate, first_s, memory_mb, flip, raw_flip, light)


def _rate(renderer: Renderer, path, exposure) -> float:  # type: ignore[no-untyped-def]
    """Return the frames a second along a path, once its nodes are known."""
    seconds = []
    for turn in range(2):
        for index, pose in enumerate(path):
            began = time.perf_counter()
            renderer.render(pose, index, LAYERS, exposure=exposure, path=path)
            if turn:
                seconds.append(time.perf_counter() - began)
    return float(1.0 / np.median(seconds))


def _flip(truth: NDArray[np.generic], picture: NDArray[np.generic]) -> float:
    scaled = [np.asarray(image, np.float32) / np.float32(255.0) for image in (truth, picture)]
    return float(flip_evaluator.evaluate(*scaled, "LDR")[1])


def _mean(radiance: NDArray[np.float32] | None) -> float:
    assert radiance is not None
    return float((radiance.astype(np.float64) @ LUMINANCE).mean())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.camera_rate_bench")
    parser.add_argument("--rooms", type=int, default=1, help="of each type (default: %(default)s)")
    parser.add_argument("--reference-samples", type=int, default=0, metavar="N", help="of the path tracer's frames; 0 for no errors")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="write the frames, the path tracer's beside them")
    arguments = parser.parse_args()
    print(render_table("Colour by the cache", measure(arguments.rooms, arguments.reference_samples, arguments.pictures)))


if __name__ == "__main__":
    main()
