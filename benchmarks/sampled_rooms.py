"""Rooms, path-traced references of their views, walks through them, and how far a picture is from another.

FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020) is computed by its authors' package ``flip-evaluator``
on what is displayed, at 67 pixels a degree.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import flip_evaluator
import numpy as np
from numpy.typing import NDArray

from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, FlatScene, RenderConfig, Renderer
from renderer.camera.rig import mounted_path
from renderer.core.color import LUMINANCE
from renderer.exposure import exposed, meter
from renderer.film.tone import Exposure
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, from_mapping
from scene_synth_ros.cli.parameters.render_settings import preset_settings


def mean_flip(reference: NDArray[np.generic], picture: NDArray[np.generic]) -> float:
    """Return the mean FLIP of two sRGB pictures (h, w, 3) uint8, 0 where they are equal and at most 1."""
    return float(flip_evaluator.evaluate(_unit(reference), _unit(picture), "LDR", applyMagma=False)[1])


def flip_map(reference: NDArray[np.generic], picture: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return FLIP of each pixel as a colour, (h, w, 3) uint8: from black, 0, by violet and orange to pale yellow, 1 (the map *magma*)."""
    colors = flip_evaluator.evaluate(_unit(reference), _unit(picture), "LDR", applyMagma=True)[0]
    return np.asarray(np.rint(255.0 * np.clip(colors, 0.0, 1.0)), np.uint8)


def mean_luminance(radiance: NDArray[np.generic] | None) -> float:
    """Return the mean luminance of a linear picture (h, w, 3), cd/m2."""
    assert radiance is not None
    return float((np.asarray(radiance, np.float64) @ LUMINANCE).mean())


def _unit(picture: NDArray[np.generic]) -> NDArray[np.float32]:
    return np.ascontiguousarray(picture, np.float32) / np.float32(255.0)


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


class Reference(NamedTuple):
    """One view by the path tracer: color and color_noisy, (h, w, 3) uint8, after and before the denoiser; radiance, (h, w, 3) float32."""

    color: NDArray[np.uint8]
    color_noisy: NDArray[np.uint8]
    radiance: NDArray[np.float32]


class References:
    """References of the preset ``photo`` (exact textures, 32 segments, no limit, denoised) with so many samples a pixel.

    A file of the folder is one view; its name tells room, scene key, camera pose, size and samples, and it is rendered anew where the
    exposure of the room has changed since.
    """

    def __init__(self, folder: Path | None, samples: int) -> None:
        """Keep pictures in ``folder``; None keeps none."""
        self._folder, self.samples = folder, samples
        self._config = preset_config("photo", samples_per_pixel=samples, denoise="oidn")

    def path_of(self, room: SampledRoom, view: int, size: tuple[int, int]) -> Path | None:
        """Return where the picture of a view is kept."""
        if self._folder is None:
            return None
        shape = f"{size[0]}x{size[1]}"
        return self._folder / f"{room.name.replace(' ', '_')}_{room.key:016x}_{_digest(room.path[view])}_{shape}_{self.samples}.npz"

    def view(self, room: SampledRoom, view: int, size: tuple[int, int]) -> Reference:
        """Return the picture of a room from the pose ``view`` of its path, of (width, height) pixels; rendered if it is not kept."""
        path = self.path_of(room, view, size)
        if path is not None and path.exists():
            with np.load(path) as kept:
                if kept["ev100"] == room.exposure.ev100 and np.array_equal(kept["white_xy"], room.exposure.white_xy):
                    return Reference(kept["color"], kept["color_noisy"], kept["radiance"])
        with Renderer(room.flat, camera_of(size), self._config, room.key) as renderer:
            frame = renderer.render(room.path[view], view, ("color", "color_noisy"), exposure=room.exposure)
        assert frame.radiance is not None
        found = Reference(np.asarray(frame.layers["color"]), np.asarray(frame.layers["color_noisy"]), frame.radiance)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            part = path.with_suffix(".part.npz")
            np.savez_compressed(part, **found._asdict(), ev100=room.exposure.ev100, white_xy=np.array(room.exposure.white_xy))
            os.replace(part, path)
        return found


def _digest(pose: CameraPose) -> str:
    return hashlib.blake2b(np.array([*pose.position_m, *pose.orientation]).tobytes(), digest_size=4).hexdigest()


ROOM_TYPES, SIZE = ("bedroom", "kitchen", "living_room"), (320, 240)
TRUTH = ("depth", "flow", "flow_backward", "occlusion", "occlusion_backward", "instance", "part", "material", "roughness", "metallic")
"""Layers that tell of the motion, and which pixels are matt."""


class Walk(NamedTuple):
    """Frames of one room.

    Attributes:
        room: with as many poses as there are frames.
        traced, cached: pictures, (h, w, 3) uint8 each, by the path tracer, denoised, and by the cache.
        truth: layers of ``TRUTH``.
    """

    room: SampledRoom
    traced: list[NDArray[np.uint8]]
    cached: list[NDArray[np.uint8]]
    truth: list[dict[str, NDArray[Any]]]


def walks(types: tuple[str, ...], frames: int, preset: str, references: References) -> Iterator[Walk]:
    """Yield a walk of so many frames, 15 a second at 0.5 m/s, through the first room of each type."""
    synthesizer = SceneSynthesizer.from_config()
    for room_type in types:
        room = sample_room(synthesizer, room_type, 0, SLOW)
        room = room._replace(path=room.path[:frames])
        cached, truth = [], []
        with Renderer(room.flat, camera_of(SIZE), preset_config(preset), room.key) as renderer:
            for index, pose in enumerate(room.path):
                frame = renderer.render(pose, index, ("color", *TRUTH), exposure=room.exposure, path=room.path)
                cached.append(np.array(frame.layers["color"]))
                truth.append({name: np.array(frame.layers[name]) for name in TRUTH})
        yield Walk(room, [references.view(room, index, SIZE).color for index in range(len(room.path))], cached, truth)
