"""One scene and one camera, ready to render views: the entry point of this package.

Use: ``with Renderer(flat, CameraConfig(), RenderConfig(), scene_key) as renderer: renderer.render(pose, 0, ("color", "depth"))``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.annotator import Annotator
from renderer.cache.cached_integrator import CachedIntegrator
from renderer.cache.config import CacheConfig
from renderer.camera.camera_rays import CENTRE
from renderer.camera.cameras import PosedCamera, pose_camera
from renderer.camera.config import CameraConfig, SensorConfig
from renderer.camera.rig import is_in_the_middle
from renderer.camera.shutter import in_motion
from renderer.camera.thin_lens import focus_on_centre
from renderer.color_sensor import read_color
from renderer.core.arrays import empty_together
from renderer.core.embree import EmbreeScene, SceneHandle
from renderer.core.errors import RenderError
from renderer.core.random_numbers import make_frame_key
from renderer.core.workers import Workers, thread_count
from renderer.film.denoise import Denoiser, is_asked
from renderer.film.frame import Frame
from renderer.film.layers import (
    COLOR_LAYERS,
    GEOMETRIC_LAYERS,
    HIT_LAYERS,
    LAYERS,
    PICTURES,
    SAMPLED_LAYERS,
    SENSED_LAYERS,
    check_names,
)
from renderer.film.tone import Exposure, to_display, white_luminance
from renderer.film.white_balance import white_of_kelvin
from renderer.geometry.mesh import Mesh
from renderer.ground_truth.hit_layers import hit_layers
from renderer.ground_truth.hit_view import HitView, TracedScene
from renderer.path.clipping import share_clipped
from renderer.path.config import IntegratorName, RenderConfig
from renderer.path.film_update import blocked_share, indirect_part
from renderer.path.ground_truth import GeometricImages, Hits, hit_record_shapes, make_labels, trace_geometry
from renderer.path.integrator import trace_paths
from renderer.path.lights import build_lights
from renderer.path.queues import WAVE, WAVE_EDGE
from renderer.path.records import Film, Transport, Work, make_scratch
from renderer.path.stopping import is_clean, next_round, variance_of_mean
from renderer.path.sun_patches import find_sun_patches
from renderer.path.surface_tables import build_surfaces
from renderer.scene.flat_scene import FlatScene, PartTable, Sky, tabulate_materials
from renderer.scene.scene_check import check_scene
from renderer.sensors.config import DepthSensorConfig
from renderer.sensors.depth_sensor import DepthSensor
from renderer.standpoint import seen_around
from scene_description import Material
from scene_description.poses import look_at
from scene_description.types import CameraPose

PATHS_PER_PIECE = 8192
"""How much colour a thread computes at a time, some 10 ms: threads end together, small images have work for all, and stopping is prompt."""

IDEAL = SensorConfig()
"""A sensor that reads light as it is."""

IDEAL_DEPTH = DepthSensorConfig()
"""A depth sensor that reads the true depth."""


class Renderer:
    """Renders views of one scene; a context manager that releases threads and Embree's memory.

    Images depend on the scene, the camera, ``scene_key`` and the frame index only, byte for byte: not on threads, order, or what was
    rendered before; with a time budget, colour depends on the time too.  One view at a time: calls of :meth:`render` must not overlap.
    """

    def __init__(
        self,
        flat: FlatScene,
        camera: CameraConfig,
        config: RenderConfig,
        scene_key: int,
        *,
        sensor: SensorConfig = IDEAL,
        depth_sensor: DepthSensorConfig = IDEAL_DEPTH,
        paths_per_piece: int = PATHS_PER_PIECE,
    ) -> None:
        """Check a scene and build what rays need; ``scene_key`` (>= 0) seeds the noise of all its frames.

        Raises:
            RenderError: the scene is faulty, the key negative, or Embree missing.
        """
        check_scene(flat)
        if scene_key < 0 or paths_per_piece < 1:
            raise RenderError(f"renderer: expected scene_key >= 0 and paths_per_piece >= 1, got {scene_key} and {paths_per_piece}")
        self._camera, self._config, self._scene_key, self._paths_per_piece = camera, config, scene_key, paths_per_piece
        self._sensor, self._depth_config = sensor, depth_sensor
        self.flat = flat
        """What is rendered."""
        parts = flat.parts
        self._labels = make_labels(flat.face_part, parts.label, parts.object_id)
        self._lights = build_lights(flat)
        self._surfaces = build_surfaces(flat)
        self._embree = self._build_tree(watertight=True)
        self._lights = self._lights._replace(patches=find_sun_patches(flat, self._lights.infinite, self._embree.handle))
        self._for_light: EmbreeScene | None = None
        self._denoiser: Denoiser | None = None
        self._depth_sensor: DepthSensor | None = None
        self._integrator: CachedIntegrator | None = None
        self._workers = Workers(thread_count(config.threads))
        self._scratch = [make_scratch(len(self._lights.groups.area), len(self._lights.patches)) for _ in range(self._workers.count)]
        self._scene = TracedScene(
            flat, np.ascontiguousarray(parts.label), self._surfaces, self._lights, self._embree.handle, self._workers, self._scratch
        )

    def _build_tree(self, *, watertight: bool) -> EmbreeScene:
        panes = self.flat.parts.portal[self.flat.face_part]
        mesh, portable = self.flat.mesh, self._config.portable
        return EmbreeScene(
            mesh.vertices, mesh.faces, panes=panes, watertight=watertight, portable=portable, steady=watertight and self.flat.steady
        )

    @property
    def tree(self) -> SceneHandle:
        """The scene's triangles, for other sensors; valid until the renderer is closed."""
        return self._embree.handle

    def in_this_thread(self) -> AbstractContextManager[None]:
        """Return a context within which everything is computed in the calling thread alone; the same bytes."""
        return self._workers.in_this_thread()

    def prepare(self, pose: CameraPose, path: Sequence[CameraPose] = (), cancelled: Callable[[], bool] | None = None) -> int:
        """Compute what colour of a view needs and other views share; return how many points of the irradiance cache were new.

        Frames are the same without, the first ones later.  Arguments and errors are those of :meth:`render`.
        """
        self._light_tree()
        if self._config.integrator != "cached":
            return 0
        view = self._view(pose, path)
        _, hits = self._trace_geometry(view, True)
        return self.cached().prepare(hits, cancelled)

    def render(
        self,
        pose: CameraPose,
        frame_index: int,
        layers: Collection[str],
        *,
        exposure: Exposure | None = None,
        path: Sequence[CameraPose] = (),
        cancelled: Callable[[], bool] | None = None,
        annotator: Annotator | None = None,
    ) -> Frame:
        """Render the named layers of one view.

        ``exposure`` replaces the configured one, without which white balance ``auto`` is that of the display, as nothing was metered;
        ``path``: what the camera moves along, for its shutter; a pose that is none of the path's is seen at rest.  ``cancelled`` is asked
        every 50 ms or so.  ``annotator``, of the same scene and camera, tells of the objects in the frame's ``annotations``.

        Raises:
            RenderError: unknown layers, a faulty pose, a negative frame index, or a denoiser that is asked for but not installed.
            RenderCancelled: ``cancelled`` returned True.
        """
        check_names(layers)
        if frame_index < 0:
            raise RenderError(f"render: expected a frame index >= 0, got {frame_index}")
        view = self._view(pose, path)
        images: dict[str, NDArray[np.generic]] = {}
        radiance, annotations, samples, rays = None, None, 0, 0
        sampling_s = denoising_s = filling_s = 0.0
        sensed, ideal = any(name in SENSED_LAYERS for name in layers), self._depth_config.model == "ideal"
        looked_up = self._config.integrator == "cached" and any(name in PICTURES for name in layers)
        recorded = any(name in GEOMETRIC_LAYERS or name in HIT_LAYERS for name in layers)
        shown = exposure or self._configured_exposure()
        for scratch in self._scratch:
            scratch.traced[0] = 0
        if annotator is not None or recorded or looked_up or (sensed and ideal):
            geometry, hits = self._trace_geometry(view, any(name in HIT_LAYERS for name in layers) or looked_up)
            images |= geometry._asdict()
            images |= self._hit_layers(view, geometry, hits, layers, pose, path)
            rays = view.width * view.height
            if annotator is not None:
                annotations = annotator.annotate(geometry.instance, pose, view, self._embree.handle, self._workers)
            if looked_up:
                began = time.perf_counter()
                radiance = self.cached().radiance(view, geometry.range, hits, self._frame_key(frame_index), cancelled)
                sampling_s, filling_s = time.perf_counter() - began, self.cached().filling_s
                self._show(images, layers, view, frame_index, shown, radiance, radiance)
        if sensed:
            images["depth_sensed"] = images["depth"] if ideal else self._read_depth(view, frame_index)
        sampled = [name for name in layers if name in SAMPLED_LAYERS and name not in images]
        if sampled:
            denoised = any(name in PICTURES for name in sampled) and is_asked(self._config.denoise)
            began = time.perf_counter()
            film, samples = self._expose_film(view, frame_index, shown.ev100, sampled, denoised, cancelled)
            sampling_s += time.perf_counter() - began
            images |= {name: image for name, image in film._asdict().items() if name in sampled}
            if len(film.direct):
                images["indirect"] = indirect_part(film.light, film.direct)
            if len(film.arriving):
                images["shadow"] = blocked_share(film.arriving)
            images["samples"] = np.full((view.height, view.width), min(samples, 65_535), np.uint16)
            if len(film.squares):
                images["variance"] = variance_of_mean(film.light, film.squares, samples)
            if radiance is None and any(name in COLOR_LAYERS for name in sampled):
                began = time.perf_counter()
                radiance = self._denoise(film) if denoised else film.light
                denoising_s = time.perf_counter() - began if denoised else 0.0
                self._show(images, layers, view, frame_index, shown, radiance, film.light)
        if radiance is not None or sampled:
            rays += sum(int(scratch.traced[0]) for scratch in self._scratch)
        shown_layers = {name: images[name] for name in LAYERS if name in layers}
        return Frame(shown_layers, radiance, samples, rays, sampling_s, denoising_s, annotations, filling_s)

    def _read_depth(self, view: PosedCamera, frame_index: int) -> NDArray[np.float32]:
        if self._depth_sensor is None:
            self._depth_sensor = DepthSensor(self._depth_config, self._embree.handle, self._surfaces, self._workers)
        return self._depth_sensor.read(view, self._frame_key(frame_index))

    def _frame_key(self, frame_index: int) -> np.uint32:
        """Return the key of a frame's random numbers; cameras of a rig have noise of their own."""
        apart = np.frombuffer(np.array([*self._camera.mount_m, *self._camera.mount_rotation_rad]).tobytes(), np.uint32)
        return make_frame_key(self._scene_key, frame_index, () if is_in_the_middle(self._camera) else tuple(int(word) for word in apart))

    def _view(self, pose: CameraPose, path: Sequence[CameraPose]) -> PosedCamera:
        view = pose_camera(self._camera, pose)
        if self._camera.f_stop and not self._camera.focus_distance_m:
            view = view._replace(focus_m=np.float32(focus_on_centre(self._embree.handle, view, self._scratch[0].rays)))
        return in_motion(view, self._camera, pose, path)

    def _configured_exposure(self) -> Exposure:
        config = self._config
        if config.white_balance == "kelvin":
            return Exposure(config.exposure_ev100, white_of_kelvin(config.white_balance_k))
        return Exposure(config.exposure_ev100)

    def _show(
        self,
        images: dict[str, NDArray[np.generic]],
        layers: Collection[str],
        view: PosedCamera,
        frame_index: int,
        shown: Exposure,
        radiance: NDArray[np.float32],
        noisy: NDArray[np.float32],
    ) -> None:
        """Add the pictures that are asked for to ``images``, with the radiance that they show; ``noisy``: the same before denoising."""
        images["radiance"] = radiance
        for name, light in (("color", radiance), ("color_noisy", noisy)):
            if name in layers:
                images[name] = to_display(light, shown, self._config.tone_curve)
        if "color_sensed" in layers:
            key = self._frame_key(frame_index)
            images["color_sensed"] = read_color(radiance, view, self._sensor, shown, self._config.tone_curve, key)

    def cached(self) -> CachedIntegrator:
        """Return the room's irradiance cache, whatever the configured integrator; the first call solves its light."""
        if self._integrator is None:
            config = self._config
            fine = CacheConfig(spacing_m=config.cache_spacing_m, gather_rays=config.cache_rays, light_samples=config.cache_light_samples)
            self._integrator = CachedIntegrator(self._scene, self._light_tree(), self._scene_key, fine)
        return self._integrator

    def _light_tree(self) -> SceneHandle:
        if self._for_light is None:
            self._for_light = self._build_tree(watertight=False)
        return self._for_light.handle

    def _trace_geometry(self, view: PosedCamera, recorded: bool) -> tuple[GeometricImages, Hits]:
        """Return the basic layers, and the hit record if it is asked for."""
        shapes = [(LAYERS[name].shape(view.height, view.width), LAYERS[name].dtype) for name in GEOMETRIC_LAYERS]
        memory = empty_together([*shapes, *hit_record_shapes(view.height if recorded else 0, view.width)])
        images = GeometricImages(**dict(zip(GEOMETRIC_LAYERS, memory, strict=False)))
        hits = Hits(*memory[len(shapes) :])
        step = self._workers.count

        def trace(worker: int, first: int) -> None:
            packet = self._scratch[worker].rays
            trace_geometry(self._embree.handle, self._labels, view, packet, CENTRE, images, hits, first, step)

        self._workers.run(trace, range(step))
        return images, hits

    def _hit_layers(
        self,
        view: PosedCamera,
        images: GeometricImages,
        hits: Hits,
        layers: Collection[str],
        pose: CameraPose,
        path: Sequence[CameraPose],
    ) -> dict[str, NDArray[np.generic]]:
        """Return what the hit record gives of the layers that are asked for."""
        if not any(name in HIT_LAYERS for name in layers):
            return {}
        return hit_layers(HitView(self._scene, self._camera, view, images, hits, pose, path, layers))

    def _expose_film(
        self,
        view: PosedCamera,
        frame_index: int,
        ev100: float,
        layers: Collection[str],
        aov: bool,
        cancelled: Callable[[], bool] | None,
    ) -> tuple[Film, int]:
        """Return the means of the samples, and how many there are; without colour paths end where they hit first."""
        size, config, white = (view.height, view.width), self._config, white_luminance(ev100)
        in_color = any(name in COLOR_LAYERS for name in layers)
        film = Film(
            np.zeros((*size, 3), np.float32),
            np.zeros((*size, 3) if "albedo" in layers else (0, 0, 3), np.float32),
            np.zeros((*size, 6) if aov else (0, 0, 6), np.float32),
            np.zeros((*size, 3) if "variance" in layers else (0, 0, 3), np.float32),
            np.zeros((*size, 3) if config.clamp or "direct" in layers or "indirect" in layers else (0, 0, 3), np.float32),
            np.zeros((*size, 2) if "shadow" in layers else (0, 0, 2), np.float32),
            np.zeros((*size, 3) if config.clamp else (0, 0, 3), np.float32),
        )
        transport = Transport(
            self._frame_key(frame_index),
            config.max_depth if in_color else min(config.max_depth, 2 if "shadow" in layers else 1),
            np.float32(config.clamp * white or np.inf),
            np.float32(config.caustic_blur),
            np.float32(np.inf) if config.blur_textures else np.float32(1.0) / view.focal_px,
        )

        tree = self._light_tree()

        def trace(worker: int, work: Work) -> None:
            trace_paths(tree, self._surfaces, self._lights, view, transport, work, self._scratch[worker], film)

        began, done = time.monotonic(), 0
        while count := next_round(config, done, time.monotonic() - began):
            before = film.light.copy() if config.noise_target else film.light
            for pieces in self._color_pieces(view, done, done + count):
                self._workers.run(trace, pieces, cancelled)
            done += count
            if is_clean(config, before, film.light, done, white):
                break
        for image in film:
            image *= np.float32(1.0 / done)
        if config.clamp:
            share_clipped(film)
        return film, done

    def _denoise(self, film: Film) -> NDArray[np.float32]:
        if self._denoiser is None:
            self._denoiser = Denoiser(self._workers.count)
        albedo, normals = np.minimum(film.aov[:, :, :3], np.float32(1.0)), film.aov[:, :, 3:]
        return self._denoiser.clean(film.light, albedo, normals)

    def _color_pieces(self, view: PosedCamera, begin: int, end: int) -> Iterator[list[Work]]:
        """Yield rounds of pieces for samples [begin, end); pieces of one round share no pixel, so they may run at the same time."""
        tiles = -(-view.width // WAVE_EDGE) * -(-view.height // WAVE_EDGE)
        chunk = min(end - begin, max(1, self._paths_per_piece // WAVE))
        step = max(1, self._paths_per_piece // (WAVE * chunk))
        for first in range(begin, end, chunk):
            last = min(first + chunk, end)
            yield [Work(tile, min(tile + step, tiles), first, last) for tile in range(0, tiles, step)]

    def close(self) -> None:
        """Release threads and memory; harmless when repeated."""
        self._workers.close()
        if self._denoiser is not None:
            self._denoiser.close()
            self._denoiser = None
        if self._for_light is not None:
            self._for_light.close()
        self._embree.close()

    def __enter__(self) -> Renderer:
        """Return the renderer itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Release everything."""
        self.close()


WARM_LAYERS = (*GEOMETRIC_LAYERS, *SAMPLED_LAYERS)
"""Layers whose kernels are ready after :func:`warm_up`; each of the others has its own, compiled when it is first asked for."""


def warm_up(
    layers: Collection[str] = WARM_LAYERS, depth_sensor: DepthSensorConfig = IDEAL_DEPTH, integrator: IntegratorName = "path"
) -> None:
    """Compile the kernels of some layers, or load them from numba's cache, by rendering one pixel of a lone pane in the sun.

    Those that look for the patches where the sun falls and for where a camera stands are among them.

    ``depth_sensor``: the one that ``depth_sensed`` is to be ready for; ``integrator``: as of ``RenderConfig``.

    Raises:
        RenderError: Embree is missing.
    """
    corners = np.array([[1, -1, -1], [1, 0, 1], [1, 1, -1]], np.float32)
    mesh = Mesh(corners, np.tile(np.array([[-1, 0, 0]], np.float32), (3, 1)), np.array([[0, 1, 2]], np.uint32), corners[:, 1:].copy())
    parts = PartTable(
        np.zeros(1, np.uint16), np.zeros(1, np.uint8), np.zeros(1, np.int32), np.zeros((1, 3), np.float32), np.ones(1, np.bool_)
    )
    dark = np.zeros(3, np.float32)
    sky = Sky(dark, dark, dark, sun=np.array([1, 0, 0, 1e-5, 1, 1, 1], np.float32))
    flat = FlatScene(
        mesh,
        np.zeros(1, np.int32),
        parts,
        ("0/pane",),
        tabulate_materials([Material(id="m", family="m", base_color=(0.5, 0.5, 0.5))]),
        sky,
    )
    pose = CameraPose(stamp_ns=0, position_m=(0.0, 0.0, 0.0), orientation=look_at((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    camera, config = CameraConfig(width=1, height=1), RenderConfig(integrator=integrator, samples_per_pixel=1, threads=1)
    with Renderer(flat, camera, config, 0, depth_sensor=depth_sensor) as renderer:
        seen_around(renderer.tree, flat, pose.position_m)
        renderer.render(pose, 0, layers, path=(pose, replace(pose, stamp_ns=1)), exposure=Exposure(0.0, white_of_kelvin(4000.0)))
