"""Rooms, path-traced references of their views, how far a picture is from another, and what frames take.

FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020) is computed by its authors' package ``flip-evaluator``
on what is displayed, at 67 pixels a degree.
"""

import hashlib
import importlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import flip_evaluator
import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer_tables import cast_bare
from grammar import SceneRequest, room_types
from grammar.synthesize import CameraTimes, SceneSynthesizer
from renderer import CameraConfig, FlatScene, RenderConfig, Renderer
from renderer.camera.cameras import pose_camera
from renderer.camera.rig import mounted_path
from renderer.core.color import LUMINANCE
from renderer.core.embree import EmbreeScene
from renderer.core.ray_packet import make_packet
from renderer.exposure import LightMeter, exposed, meter
from renderer.film.tone import Exposure
from renderer.path.ground_truth import Hits
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, SceneDescription, from_mapping
from scene_description.whole import whole_file
from scene_synth_ros.cli.parameters.render_settings import preset_settings


def mean_flip(reference: NDArray[np.generic], picture: NDArray[np.generic]) -> float:
    """Return the mean FLIP of two sRGB pictures (h, w, 3) uint8, 0 where they are equal and at most 1."""
    return float(flip_evaluator.evaluate(_unit(reference), _unit(picture), "LDR", applyMagma=False)[1])


def flip_values(reference: NDArray[np.generic], picture: NDArray[np.generic]) -> NDArray[np.float32]:
    """Return FLIP of each pixel, (h, w) float32."""
    return np.asarray(flip_evaluator.evaluate(_unit(reference), _unit(picture), "LDR", applyMagma=False)[0], np.float32)[..., 0]


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

VIEW, LARGE, SMALL = 6, (640, 480), (320, 240)
"""Which view of a room is compared, and the sizes of pictures."""
SEED = 7
TIMES = CameraTimes(frames=12, start_ns=0, rate_hz=15.0)
"""Twelve views spread over a room."""
STILL = CameraTimes(frames=1, start_ns=0, rate_hz=15.0)
"""The best view of a room."""
SLOW = CameraTimes(frames=150, start_ns=0, rate_hz=15.0)
"""A walk of 0.5 m/s, 3.3 cm a frame."""


class SampledRoom(NamedTuple):
    """A room, ready to render: its key seeds noise, the exposure is metered along the path; scene: its description, if it has one."""

    name: str
    flat: FlatScene
    key: int
    path: tuple[CameraPose, ...]
    exposure: Exposure
    scene: SceneDescription | None = None


def sample_room(synthesizer: SceneSynthesizer, room_type: str, index: int, times: CameraTimes = TIMES, seed: int = SEED) -> SampledRoom:
    """Return a room of a type."""
    scene = synthesizer.synthesize(SceneRequest(room_type=room_type), seed, index, times)
    key, camera = scene_key(scene), camera_of((640, 480))
    flat = flatten(scene, Path.cwd())
    metered = meter(flat, camera, RenderConfig(), key, scene.camera_path)
    exposure = exposed(RenderConfig(auto_exposure=True), metered)
    return SampledRoom(f"{room_type} {index}", flat, key, mounted_path(camera, scene.camera_path), exposure, scene)


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
            with whole_file(path) as partial, partial.open("wb") as file:
                np.savez_compressed(file, **found._asdict(), ev100=room.exposure.ev100, white_xy=np.array(room.exposure.white_xy))
        return found


def _digest(pose: CameraPose) -> str:
    return hashlib.blake2b(np.array([*pose.position_m, *pose.orientation]).tobytes(), digest_size=4).hexdigest()


STAGES = {
    "primary rays: hit record, depth, normals, ids": (("renderer.renderer", "trace_geometry"),),
    "which nodes the view reads": tuple(("renderer.cached_frames.cached_integrator", name) for name in ("want_nodes", "want_shown")),
    "light of new nodes": tuple(
        ("renderer.irradiance_cache.cache", name) for name in ("widen", "light_nodes", "gather_nodes", "smooth_nodes")
    ),
    "shading: materials, light, sun and mirror rays": (("renderer.cached_frames.cached_integrator", "shade_hits"),),
    "gloss shared by neighbours": tuple(("renderer.cached_frames.cached_integrator", name) for name in ("sum_across", "mix_gloss")),
    "edges": tuple(("renderer.cached_frames.cached_integrator", name) for name in ("look_between", "smooth_edges", "lift_lone")),
    "exposure and tone": (("renderer.renderer", "to_display"),),
}
"""Stage -> (module, name) of what it calls, as the callers know it."""

REST = "Python and numpy"
"""What a frame takes beyond its stages."""


@contextmanager
def timed_stages() -> Iterator[dict[str, float]]:
    """Time what renderers do within the context; yield seconds of processor by stage, all threads together, which grow as it is used."""
    seconds, lock = dict.fromkeys(STAGES, 0.0), threading.Lock()

    def timed(stage: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def act(*arguments: Any, **named: Any) -> Any:
            began = time.thread_time()
            found = call(*arguments, **named)
            spent = time.thread_time() - began
            with lock:
                seconds[stage] += spent
            return found

        return act

    with ExitStack() as stack:
        for stage, calls in STAGES.items():
            for module, name in calls:
                place = importlib.import_module(module)
                stack.enter_context(mock.patch.object(place, name, timed(stage, getattr(place, name))))
        yield seconds


class FrameTimes(NamedTuple):
    """Medians of the frames along a path: seconds by the clock and of processor, all threads together."""

    clock_s: float
    processor_s: float


def frame_times(renderer: Renderer, room: SampledRoom) -> FrameTimes:
    """Render a frame at every pose of a room's path."""

    def frame(index: int) -> None:
        renderer.render(room.path[index], index, LAYERS, exposure=room.exposure, path=room.path)

    taken = [seconds(lambda index=index: frame(index)) for index in range(len(room.path))]
    return FrameTimes(*(float(value) for value in np.median(taken, axis=0)))


def seconds(act: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds that a call takes, by the clock and of processor."""
    clock, processor = time.perf_counter(), time.process_time()
    act()
    return time.perf_counter() - clock, time.process_time() - processor


def stage_times(renderer: Renderer, room: SampledRoom) -> dict[str, float]:
    """Return milliseconds of processor that a frame takes in the mean over a room's path, by stage."""
    with timed_stages() as stages:
        began = time.process_time()
        for index, pose in enumerate(room.path):
            renderer.render(pose, index, LAYERS, exposure=room.exposure, path=room.path)
        total = time.process_time() - began
    scale = 1e3 / len(room.path)
    return {name: scale * value for name, value in stages.items()} | {REST: scale * (total - sum(stages.values()))}


def bare_s(room: SampledRoom, size: tuple[int, int]) -> float:
    """Return the median seconds of processor, on one thread, of bare coherent packets for the pixels of a frame along a room's path."""
    packet, spent = make_packet(), []
    with EmbreeScene(room.flat.mesh.vertices, room.flat.mesh.faces) as scene:
        for pose in (room.path[0], *room.path):
            view = pose_camera(camera_of(size), pose)
            spent.append(seconds(lambda view=view: cast_bare(scene.handle, view, packet, 0, 1))[1])
    return float(np.median(spent[1:]))


def everywhere(flat: FlatScene, spacing_m: float) -> Hits:
    """Return hits, as of one long row of pixels, on every triangle: its middle, and points at most ``spacing_m`` apart."""
    corners = flat.mesh.vertices.astype(np.float64)[flat.mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    counts = np.maximum(np.ceil(longest / spacing_m), 1).astype(np.int64)
    face, u, v = [], [], []
    for count in np.unique(counts):
        faces = np.flatnonzero(counts == count).astype(np.int32)
        first, second = (grid.ravel() for grid in np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij"))
        inside = first + second <= count
        # A hair inwards, so that points of the rim lie within.
        weights = (np.stack([first[inside], second[inside]]) / count - 1.0 / 3.0) * 0.998 + 1.0 / 3.0
        face.append(np.repeat(faces, weights.shape[1]))
        for kept, weight in zip((u, v), weights, strict=True):
            kept.append(np.tile(weight, len(faces)))
    rows: list[NDArray[np.float32]] = [np.concatenate(part).astype(np.float32)[None] for part in (u, v)]
    return Hits(np.concatenate(face)[None], *rows)


def new_room_s(room: SampledRoom, size: tuple[int, int], config: RenderConfig) -> tuple[float, float, float]:
    """Return seconds by the clock from a description to its first frame, metered as nodes do, and to light everywhere; the cache's MB."""
    assert room.scene is not None
    began, camera, poses = time.perf_counter(), camera_of(size), room.scene.camera_path
    flat = flatten(room.scene, Path.cwd())
    with Renderer(flat, camera, config, room.key) as renderer:
        reading = LightMeter(flat, camera, config, room.key, poses).read(config.threads, like=renderer)
        exposure = exposed(replace(config, auto_exposure=True), reading)
        renderer.render(room.path[0], 0, LAYERS, exposure=exposure, path=room.path)
        first_s = time.perf_counter() - began
        hits = everywhere(flat, config.cache_spacing_m)
        began = time.perf_counter()
        renderer.cached().prepare(hits)
        filled_s = time.perf_counter() - began
        return first_s, first_s + filled_s, renderer.cached().size_bytes / 1e6
