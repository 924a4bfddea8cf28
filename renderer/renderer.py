"""One scene and one camera, ready to render views: the entry point of this package.

Use: ``with Renderer(flat, CameraConfig(), RenderConfig(), scene_key) as renderer: renderer.render(pose, 0, ("color", "depth"))``.
"""

import time
from collections.abc import Callable, Collection, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import cached_property
from types import TracebackType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.annotations.annotator import Annotator
from renderer.cached_frames.cached_integrator import CachedIntegrator
from renderer.camera.camera_rays import CENTRE
from renderer.camera.cameras import PosedCamera, pose_camera
from renderer.camera.config import CameraConfig, SensorConfig
from renderer.camera.rig import is_in_the_middle
from renderer.camera.shutter import in_motion
from renderer.camera.thin_lens import focus_on_centre
from renderer.color_sensor import read_color
from renderer.core.embree import SceneHandle
from renderer.core.errors import RenderError
from renderer.core.image_memory import ImageMemory
from renderer.core.random_numbers import make_frame_key
from renderer.core.ray_packet import make_packet
from renderer.core.workers import Workers, thread_count
from renderer.film.denoise import Denoiser, is_asked
from renderer.film.frame import Frame
from renderer.film.grain import add_grain
from renderer.film.layers import COLOR_LAYERS, GEOMETRIC_LAYERS, HIT_LAYERS, LAYERS, PICTURES, SAMPLED_LAYERS, SENSED_LAYERS, check_names
from renderer.film.tone import Exposure, to_display
from renderer.film.white_balance import white_of_kelvin
from renderer.film_exposer import PATHS_PER_PIECE, FilmExposer
from renderer.ground_truth.hit_layers import hit_layers
from renderer.ground_truth.hit_view import HitView, TracedScene
from renderer.irradiance_cache.cache import IrradianceCache, RoomLight
from renderer.irradiance_cache.cache_geometry import CacheConfig
from renderer.path.config import RenderConfig
from renderer.path.film_sums import blocked_share, indirect_part
from renderer.path.ground_truth import GeometricImages, Hits, TracedView, hit_record_shapes, label_scene, trace_geometry
from renderer.path.guide import NO_GUIDE
from renderer.path.guide_probes import RoomGuide
from renderer.path.light_nodes import NOTHING_KNOWN, KnownLight
from renderer.path.light_tables import LightTables
from renderer.path.records import Film, make_scratch
from renderer.path.stopping import variance_of_mean
from renderer.scene.flat_scene import FlatScene
from renderer.scene.scene_check import check_scene
from renderer.scene.scene_trees import SceneTrees
from renderer.sensors.depth_sensor import DepthSensor
from renderer.sensors.devices import DepthSensorConfig
from scene_description.types import CameraPose

IDEAL = SensorConfig()
"""A sensor that reads light as it is."""

IDEAL_DEPTH = DepthSensorConfig()
"""A depth sensor that reads the true depth."""


class _Request(NamedTuple):
    """What is asked for of one frame; ``key``: of its random numbers."""

    view: PosedCamera
    key: np.uint32
    layers: Collection[str]
    exposure: Exposure


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
        like: "Renderer | None" = None,
        coarse: bool = False,
    ) -> None:
        """Check a scene and build what rays need; ``scene_key`` (>= 0) seeds the noise of all its frames.

        ``like``: another renderer, whose trees, guide, nodes of the irradiance cache and what is known of their light are shared where the
        scenes have them in common; images are the same without it.  ``coarse``: colour by the irradiance cache reads the nodes by which a
        room's light is solved, which are all known then: enough for a meter.

        Raises:
            RenderError: the scene is faulty, the key negative, or Embree missing.
        """
        check_scene(flat)
        if scene_key < 0 or paths_per_piece < 1:
            raise RenderError(f"renderer: expected scene_key >= 0 and paths_per_piece >= 1, got {scene_key} and {paths_per_piece}")
        self._camera, self._config, self._scene_key, self._paths_per_piece = camera, config, scene_key, paths_per_piece
        self._sensor, self._depth_config, self._coarse = sensor, depth_sensor, coarse
        self.flat = flat
        """What is rendered."""
        parts, portable = flat.parts, config.portable
        self._trees: SceneTrees = (like._trees.shared(flat, portable=portable) if like else None) or SceneTrees(flat, portable=portable)
        self._labelled = label_scene(self.tree, flat.face_part, parts.label, parts.object_id)
        same = like if like is not None and like.flat is flat and like._trees is self._trees else None
        self._tables: LightTables = same._tables if same else LightTables(flat, self.tree)
        self._guide: RoomGuide = same._guide if same else RoomGuide(flat)
        self._room_light: RoomLight = self._find_room_light(like, same)
        self._closed = False
        self._denoiser: Denoiser | None = None
        self._depth_sensor: DepthSensor | None = None
        self._workers = Workers(thread_count(config.threads))
        self._memory = ImageMemory()
        self._packets = [make_packet() for _ in range(self._workers.count)]
        self._light: IrradianceCache | None = None
        self._integrator: CachedIntegrator | None = None
        self._known: KnownLight | None = None

    @cached_property
    def _scene(self) -> TracedScene:
        """What light is traced in, and what follows from hit records beside the basic layers; these alone need nothing of it."""
        lights = self._tables.lights
        scratch = [make_scratch(len(lights.groups.area), len(lights.patches)) for _ in range(self._workers.count)]
        label = np.ascontiguousarray(self.flat.parts.label)
        return TracedScene(self.flat, label, self._tables.surfaces, lights, self.tree, self._workers, scratch, self._memory)

    def _find_room_light(self, like: "Renderer | None", same: "Renderer | None") -> RoomLight:
        """Return the light of ``same``, which is of the same scene, if it is computed in the same way, else with the nodes of ``like``."""
        config = self._config
        fine = CacheConfig(spacing_m=config.cache_spacing_m, gather_rays=config.cache_rays, light_samples=config.cache_light_samples)
        light = same._room_light if same else None
        if light is not None and (light.scene_key, light.config) == (self._scene_key, fine):
            return light
        return RoomLight(self._scene_key, fine, like._room_light.geometry if like else None)

    @property
    def tree(self) -> SceneHandle:
        """The scene's triangles, for other sensors; valid until the renderer is closed."""
        return self._trees.precise

    def in_this_thread(self) -> AbstractContextManager[None]:
        """Return a context within which everything is computed in the calling thread alone; the same bytes."""
        return self._workers.in_this_thread()

    def prepare(self, pose: CameraPose, path: Sequence[CameraPose] = (), cancelled: Callable[[], bool] | None = None) -> int:
        """Compute what colour of a view needs and other views share; return how many points of the irradiance cache were new.

        Frames are the same without, the first ones later.  Arguments and errors are those of :meth:`render`.
        """
        self._trees.for_light()
        if self._config.integrator != "cached":
            self._exposer(True, cancelled)
            return 0
        view = self._view(pose, path)
        _, hits = self._trace_geometry(view, True)
        return self.cached(cancelled).prepare(hits, cancelled)

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
        request = _Request(view, self._frame_key(frame_index), layers, exposure or self._configured_exposure())
        images: dict[str, NDArray[np.generic]] = {}
        frame = Frame(images, None)
        looked_up = self._is_looked_up(layers)
        scratch = self._scene.scratch if looked_up or any(name in SAMPLED_LAYERS for name in layers) else []
        for memory in scratch:
            memory.traced[0] = 0
        # Rays through the pixel centres, and what follows from their hits: ground truth, annotations, colour that is looked up.
        if annotator is not None or self._needs_hits(layers):
            recorded = looked_up or any(name in HIT_LAYERS for name in layers)
            geometric, hits = self._trace_geometry(view, recorded)
            images |= geometric._asdict()
            frame = frame._replace(rays=view.width * view.height)
            if annotator is not None:
                annotations = annotator.annotate(geometric.instance, pose, view, self.tree, self._workers)
                frame = frame._replace(annotations=annotations)
            if recorded:
                seen = HitView(self._scene, self._camera, view, geometric, hits, pose, path, layers)
                images |= hit_layers(seen)
                if looked_up:
                    frame = self._look_up(request, seen.traced, frame, cancelled)
        if "depth_sensed" in layers:
            images["depth_sensed"] = images["depth"] if self._depth_config.model == "ideal" else self._read_depth(request)
        # Paths, for what is not there yet.
        sampled = [name for name in layers if name in SAMPLED_LAYERS and name not in images]
        if sampled:
            frame = self._sample(request, sampled, frame, cancelled)
        frame = frame._replace(rays=frame.rays + sum(int(memory.traced[0]) for memory in scratch))
        return frame._replace(layers={name: images[name] for name in LAYERS if name in layers})

    def _is_looked_up(self, layers: Collection[str]) -> bool:
        """Return whether colour is looked up in the irradiance cache."""
        return self._config.integrator == "cached" and any(name in PICTURES for name in layers)

    def _needs_hits(self, layers: Collection[str]) -> bool:
        """Return whether some layer follows from primary rays."""
        geometric = any(name in GEOMETRIC_LAYERS or name in HIT_LAYERS for name in layers)
        ideal_depth = self._depth_config.model == "ideal" and any(name in SENSED_LAYERS for name in layers)
        return geometric or ideal_depth or self._is_looked_up(layers)

    def _look_up(self, request: _Request, seen: TracedView, frame: Frame, cancelled: Callable[[], bool] | None) -> Frame:
        """Add colour by the irradiance cache."""
        began = time.perf_counter()
        integrator = self.cached(cancelled)
        radiance = integrator.radiance(seen, request.key, cancelled)
        sampling_s = time.perf_counter() - began
        self._show(request, radiance, radiance, frame.layers)
        return frame._replace(radiance=radiance, sampling_s=sampling_s, filling_s=integrator.filling_s)

    def _sample(self, request: _Request, sampled: Collection[str], frame: Frame, cancelled: Callable[[], bool] | None) -> Frame:
        """Add the layers that paths are traced for: colour, unless it is there already, and its parts."""
        denoised = any(name in PICTURES for name in sampled) and is_asked(self._config.denoise)
        began, images, view = time.perf_counter(), frame.layers, request.view
        exposer = self._exposer(any(name in COLOR_LAYERS for name in sampled), cancelled)
        film, samples = exposer.expose(view, request.key, request.exposure.ev100, sampled, denoised, cancelled)
        frame = frame._replace(samples=samples, sampling_s=frame.sampling_s + time.perf_counter() - began)
        images |= {name: image for name, image in film._asdict().items() if name in sampled}
        if len(film.direct):
            images["indirect"] = indirect_part(film.light, film.direct)
        if len(film.arriving):
            images["shadow"] = blocked_share(film.arriving)
        images["samples"] = np.full((view.height, view.width), min(samples, 65_535), np.uint16)
        if len(film.squares):
            images["variance"] = variance_of_mean(film.light, film.squares, samples)
        if frame.radiance is None and any(name in COLOR_LAYERS for name in sampled):
            began = time.perf_counter()
            radiance = self._denoise(film) if denoised else film.light
            frame = frame._replace(radiance=radiance, denoising_s=time.perf_counter() - began if denoised else 0.0)
            self._show(request, radiance, film.light, images)
        return frame

    def _read_depth(self, request: _Request) -> NDArray[np.float32]:
        if self._depth_sensor is None:
            self._depth_sensor = DepthSensor(self._depth_config, self.tree, self._tables.surfaces, self._workers)
        return self._depth_sensor.read(request.view, request.key)

    def _frame_key(self, frame_index: int) -> np.uint32:
        """Return the key of a frame's random numbers; cameras of a rig have noise of their own."""
        apart = np.frombuffer(np.array([*self._camera.mount_m, *self._camera.mount_rotation_rad]).tobytes(), np.uint32)
        return make_frame_key(self._scene_key, frame_index, () if is_in_the_middle(self._camera) else tuple(int(word) for word in apart))

    def _view(self, pose: CameraPose, path: Sequence[CameraPose]) -> PosedCamera:
        view = pose_camera(self._camera, pose)
        if self._camera.f_stop and not self._camera.focus_distance_m:
            view = view._replace(focus_m=np.float32(focus_on_centre(self.tree, view, self._packets[0])))
        return in_motion(view, self._camera, pose, path)

    def _configured_exposure(self) -> Exposure:
        config = self._config
        if config.white_balance == "kelvin":
            return Exposure(config.exposure_ev100, white_of_kelvin(config.white_balance_k))
        return Exposure(config.exposure_ev100)

    def _show(
        self, request: _Request, radiance: NDArray[np.float32], noisy: NDArray[np.float32], images: dict[str, NDArray[np.generic]]
    ) -> None:
        """Add the pictures that are asked for, with the radiance that they show; ``noisy``: the same before denoising."""
        asked, exposure, curve, local_stops = request.layers, request.exposure, self._config.tone_curve, self._config.local_tone_stops
        images["radiance"] = radiance
        if "color_noisy" in asked:
            images["color_noisy"] = to_display(noisy, exposure, curve, local_stops)
        sensed = "color_sensed" in asked
        if "color" in asked or (sensed and self._sensor == IDEAL):
            images["color"] = self._develop(request, radiance)
        if sensed and self._sensor == IDEAL:
            images["color_sensed"] = images["color"]
        elif sensed:
            images["color_sensed"] = read_color(radiance, request.view, self._sensor, exposure, curve, request.key, local_stops)

    def _develop(self, request: _Request, radiance: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Return what the camera shows of radiance; bands of rows by themselves, unless their tones depend on each other."""
        config, height, codes = self._config, len(radiance), np.empty(radiance.shape, np.uint8)
        band = height if config.local_tone_stops else -(-height // self._workers.count)

        def develop(_: int, first: int) -> None:
            shown = to_display(radiance[first : first + band], request.exposure, config.tone_curve, config.local_tone_stops)
            codes[first : first + band] = add_grain(shown, config.grain, request.key, first) if config.grain else shown

        self._workers.run(develop, range(0, height, band))
        return codes

    def cached(self, cancelled: Callable[[], bool] | None = None) -> CachedIntegrator:
        """Return the room's irradiance cache, whatever the configured integrator; the first call solves its light.

        Raises:
            RenderCancelled: ``cancelled`` returned True; what was computed stays known.
        """
        if self._integrator is None:
            light = self._irradiance_cache()
            light.solve(cancelled)
            self._integrator = CachedIntegrator(self._scene, self._trees.for_light(), light, coarse=self._coarse)
        return self._integrator

    def _irradiance_cache(self) -> IrradianceCache:
        if self._light is None:
            self._light = self._room_light.cache(replace(self._scene, tree=self._trees.for_light()))
        return self._light

    def _trace_geometry(self, view: PosedCamera, recorded: bool) -> tuple[GeometricImages, Hits]:
        """Return the basic layers, and the hit record if it is asked for."""
        shapes = [(LAYERS[name].shape(view.height, view.width), LAYERS[name].dtype) for name in GEOMETRIC_LAYERS]
        memory = self._memory.empty([*shapes, *hit_record_shapes(view.height if recorded else 0, view.width)])
        images = GeometricImages(**dict(zip(GEOMETRIC_LAYERS, memory, strict=False)))
        hits = Hits(*memory[len(shapes) :])
        step = self._workers.count

        def trace(worker: int, first: int) -> None:
            trace_geometry(self._labelled, view, self._packets[worker], CENTRE, images, hits, first, step)

        self._workers.run(trace, range(step))
        return images, hits

    def _exposer(self, in_color: bool, cancelled: Callable[[], bool] | None) -> FilmExposer:
        tree, config = self._trees.for_light(), self._config
        lit = self._scene.lit._replace(tree=tree)
        guide = self._guide.read(lit, self._scene.scratch, self._workers, cancelled) if in_color and config.guiding else NO_GUIDE
        known = self._known_light(cancelled) if in_color and config.final_gathering else NOTHING_KNOWN
        return FilmExposer(self._scene, tree, config, self._paths_per_piece, guide, known)

    def _known_light(self, cancelled: Callable[[], bool] | None) -> KnownLight:
        if self._known is None:
            self._known = self._irradiance_cache().known_light(cancelled)
        return self._known

    def _denoise(self, film: Film) -> NDArray[np.float32]:
        if self._denoiser is None:
            self._denoiser = Denoiser(self._workers.count)
        albedo, normals = np.minimum(film.aov[:, :, :3], np.float32(1.0)), film.aov[:, :, 3:]
        return self._denoiser.clean(film.light, albedo, normals)

    def close(self) -> None:
        """Release threads and memory; harmless when repeated."""
        self._workers.close()
        if self._denoiser is not None:
            self._denoiser.close()
            self._denoiser = None
        if not self._closed:
            self._trees.close()
        self._closed = True

    def __enter__(self) -> "Renderer":
        """Return the renderer itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Release everything."""
        self.close()
