"""How long a camera's frames take in one room, by the clock, by the processor and by stage, and what a new room takes before them."""

from __future__ import annotations

import importlib
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from benchmarks.renderer_tables import cast_bare
from benchmarks.sampled_rooms import LAYERS, SampledRoom, camera_of
from renderer import FlatScene, RenderConfig, Renderer
from renderer.camera.cameras import pose_camera
from renderer.core.embree import EmbreeScene, make_packet
from renderer.path.ground_truth import Hits

STAGES = {
    "primary rays: hit record, depth, normals, ids": (("renderer.renderer", "trace_geometry"),),
    "which nodes the view reads": (("renderer.irradiance_cache.cached_integrator", "want_nodes"),),
    "light of new nodes": tuple(
        ("renderer.irradiance_cache.cache", name) for name in ("widen", "light_nodes", "gather_nodes", "smooth_nodes")
    ),
    "shading: materials, light, sun and mirror rays": (("renderer.irradiance_cache.cached_integrator", "shade_hits"),),
    "mirror images shared by neighbours": (("renderer.irradiance_cache.cached_integrator", "mix_mirrored"),),
    "edges": (("renderer.irradiance_cache.cached_integrator", "smooth_edges"),),
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
    """Return seconds by the clock from a room to its first frame, to where light is known everywhere in it, and its cache in MB."""
    began = time.perf_counter()
    with Renderer(room.flat, camera_of(size), config, room.key) as renderer:
        renderer.render(room.path[0], 0, LAYERS, exposure=room.exposure, path=room.path)
        first_s = time.perf_counter() - began
        hits = everywhere(room.flat, config.cache_spacing_m)
        began = time.perf_counter()
        renderer.cached().prepare(hits)
        filled_s = time.perf_counter() - began
        return first_s, first_s + filled_s, renderer.cached().size_bytes / 1e6
