"""One room and what its frames are made with."""

import time
from bisect import bisect_left
from collections.abc import Callable, Collection
from contextlib import ExitStack
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from threading import Event
from typing import Any

from renderer import CameraConfig, DepthSensorConfig, RenderCancelled, RenderConfig, Renderer, SensorConfig
from renderer.annotations import Annotator
from renderer.camera.rig import mounted_path
from renderer.exposure import LightMeter, LightReading, exposed, needs_meter, sensor_ev100
from renderer.film.frame import Frame
from renderer.film.layers import PHOTOGRAPHS
from renderer.film.tone import Exposure
from renderer.lidar.config import ScanConfig
from renderer.lidar.lidar import Lidar
from renderer.lidar.scanner import Scanner
from renderer.lidar.sweep_config import LidarConfig
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from renderer.scene.semantic_classes import with_classes
from renderer.standpoint import standpoint
from scene_description import CameraPose, SceneDescription
from scene_description.label_standards import StandardName
from scene_description.motion import Motion
from scene_synth_ros.messages.detections import ANNOTATIONS
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameters import Groups

OFF_PATH = 2**62
"""Frames beyond the camera path (on demand, driven by hand) are numbered from here on by their stamps."""


def frame_index(scene: SceneDescription, pose: CameraPose) -> int:
    """Return the index of a frame: its position in the camera path if it is one of its poses, else a number made of its stamp."""
    path = scene.camera_path
    index = bisect_left(path, pose.stamp_ns, key=lambda known: known.stamp_ns)
    return index if index < len(path) and path[index] == pose else OFF_PATH + pose.stamp_ns


_REST = 2.0
"""Seconds of rest for each that went into a view: frames find most light by themselves, and shall not wait for what they need not yet."""
_VIEWS = 64
"""Most views of a path for which light is computed ahead: those between them read little else."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomSettings:
    """What a room is rendered with; a change of any of them needs everything of :class:`RenderedRoom` made anew."""

    camera: CameraConfig
    render: RenderConfig
    sensor: SensorConfig
    depth_sensor: DepthSensorConfig
    semantic_classes: StandardName
    annotation_masks: bool
    catalog_dir: Path | None


def room_settings(values: Groups, catalog_dir: Path | None) -> RoomSettings:
    """Return what rooms are rendered with by a renderer's parameters, prefix -> dataclass."""
    streams: StreamConfig = values["streams"]
    return RoomSettings(
        camera=values["camera"],
        render=values["render"],
        sensor=values["sensor"],
        depth_sensor=values["depth_sensor"],
        semantic_classes=streams.semantic_classes,
        annotation_masks=streams.annotation_masks,
        catalog_dir=catalog_dir,
    )


def _made_of(settings: RoomSettings) -> tuple[Path | None, StandardName]:
    """Return what a scene's geometry depends on beside the scene."""
    return settings.catalog_dir, settings.semantic_classes


class RenderedRoom:
    """A room's geometry, renderer, annotator and metered exposure, each made when it is first asked for, until it is closed.

    Threading: one thread at a time.

    Args:
        former: the room before, which may be closed at any time: its trees, its nodes and, of the same scene, its geometry and light are
            taken where they are the same.
    """

    def __init__(self, scene: SceneDescription, settings: RoomSettings, former: "RenderedRoom | None" = None) -> None:
        self.scene, self.settings = scene, settings
        self._held = ExitStack()
        self._former: RenderedRoom | None = former if former is None or former.made_renderer is not None else former._former
        self._cancelled: Callable[[], bool] | None = None
        self._lidar: tuple[LidarConfig, Lidar] | None = None
        self._scanner: tuple[ScanConfig, Scanner] | None = None

    @cached_property
    def flat(self) -> FlatScene:
        """The geometry."""
        former = self._former
        if former is not None and former.scene == self.scene and _made_of(former.settings) == _made_of(self.settings):
            return former.flat
        return with_classes(flatten(self.scene, self.settings.catalog_dir), self.scene, self.settings.semantic_classes)

    @cached_property
    def renderer(self) -> Renderer:
        """The renderer.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        settings, flat = self.settings, self.flat
        former, self._former = self._former, None
        renderer = Renderer(
            flat,
            settings.camera,
            settings.render,
            scene_key(self.scene),
            sensor=settings.sensor,
            depth_sensor=settings.depth_sensor,
            like=former.made_renderer if former else None,
        )
        self._held.enter_context(renderer)
        trim_heap()
        return renderer

    def make(self) -> None:
        """Make the renderer now.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        _ = self.renderer

    @property
    def made_renderer(self) -> Renderer | None:
        """The renderer, if it was made; may be asked for in any thread."""
        renderer: Renderer | None = self.__dict__.get("renderer")
        return renderer

    @cached_property
    def annotator(self) -> Annotator:
        """What tells of the objects in a frame."""
        settings = self.settings
        masks, portable, classes = settings.annotation_masks, settings.render.portable, settings.semantic_classes
        return self._held.enter_context(Annotator(self.flat, self.scene, settings.camera, masks=masks, portable=portable, classes=classes))

    @cached_property
    def _meter(self) -> LightMeter:
        return LightMeter(self.flat, self.settings.camera, self.settings.render, scene_key(self.scene), self.scene.camera_path)

    @cached_property
    def metered(self) -> LightReading:
        """What the meter tells of the room."""
        cancelled = self._cancelled
        reading = self._meter.read(1 if cancelled else self.settings.render.threads, like=self.renderer, cancelled=cancelled)
        trim_heap()
        return reading

    def scanner(self, config: ScanConfig) -> Scanner:
        """Return a laser scanner that stands in the room; the same for the same settings as before."""
        if self._scanner is None or self._scanner[0] != config:
            self._scanner = config, Scanner(self.renderer.tree, self.flat, config, scene_key(self.scene))
        return self._scanner[1]

    def lidar(self, config: LidarConfig, motion: Motion) -> Lidar:
        """Return a lidar that a body carries through the room; the same for the same settings as before, on its newest motion."""
        if self._lidar is None or self._lidar[0] != config:
            self._lidar = config, Lidar(self.renderer.tree, self.flat, config, motion, scene_key(self.scene))
        self._lidar[1].motion = motion
        return self._lidar[1]

    def standpoint(self, pose: CameraPose) -> str:
        """Return from where a pose sees the room, as ``renderer.standpoint`` says it; empty within the room's air."""
        return standpoint(self.renderer.tree, self.flat, self.scene, pose.position_m)

    def render(self, pose: CameraPose, frame_index: int, layers: Collection[str], **how: Any) -> Frame:
        """Do as ``Renderer.render``, with annotations if ``ANNOTATIONS`` is among the layers.

        Nothing is made for a frame without any layer: a live camera that nobody looks at costs next to nothing.

        Raises:
            SceneSynthError: the room cannot be made, or the frame cannot be rendered.
            RenderCancelled: as ``Renderer.render``.
        """
        if not layers:
            return Frame({}, None)
        renderer = self.renderer
        if ANNOTATIONS in layers:
            layers, how = tuple(layer for layer in layers if layer != ANNOTATIONS), how | {"annotator": self.annotator}
        return renderer.render(pose, frame_index, layers, **how)

    def prepare(self, layers: Collection[str], enough: Event, cancelled: Callable[[], bool]) -> None:
        """Make what some layers need in the calling thread alone, then colour's light for view after view of the path, with rests between.

        Args:
            layers: that will be asked for.
            enough: set when the room is wanted as it is: whoever takes it makes the rest with all threads.
            cancelled: as of ``Renderer.render``; the room is of no use then.

        Raises:
            SceneSynthError: the room cannot be made.
            RenderCancelled: ``cancelled`` returned True.
        """
        self._cancelled = lambda: enough.is_set() or cancelled()
        try:
            self._prepare(layers, enough, self._cancelled)
        except RenderCancelled:
            if cancelled():
                raise
        finally:
            self._cancelled = None

    def _prepare(self, layers: Collection[str], enough: Event, cancelled: Callable[[], bool]) -> None:
        assert self.flat is not None
        if cancelled():
            return
        with self.renderer.in_this_thread():
            if ANNOTATIONS in layers and not cancelled():
                assert self.annotator is not None
            if not any(layer in PHOTOGRAPHS for layer in layers) or cancelled():
                return
            if needs_meter(self.settings.render):
                assert self.metered is not None
            path = mounted_path(self.settings.camera, self.scene.camera_path, self.scene.motion)
            for index in range(0, len(path), -(-len(path) // _VIEWS)):
                began = time.perf_counter()
                self.renderer.prepare(path[index], path, cancelled)
                if enough.wait(_REST * (time.perf_counter() - began)):
                    return

    def shows(self, scene: SceneDescription) -> bool:
        """Return whether a description is of this room, seen from the same places, be it at other times."""
        return is_same_room(self.scene, scene)

    def close(self) -> None:
        """Release threads and memory."""
        self._held.close()


def is_same_room(one: SceneDescription, other: SceneDescription) -> bool:
    """Return whether two descriptions differ in the times of their camera paths at most."""
    names = (field.name for field in fields(SceneDescription) if field.name != "camera_path")
    places = ([(pose.position_m, pose.orientation) for pose in scene.camera_path] for scene in (one, other))
    return next(places) == next(places) and all(getattr(one, name) == getattr(other, name) for name in names)


class RoomMeter:
    """Meters the room at work.

    Threading: :meth:`begin_room` and :meth:`exposure` belong to the rendering thread; :meth:`known_exposure` may be asked by any: what it
    reads is replaced as a whole.

    Args:
        settings: ``camera``, ``sensor`` and ``render``; changes of the exposure take effect with the next frame.
    """

    def __init__(self, settings: Groups) -> None:
        self._settings = settings
        self._room: tuple[RenderConfig, Callable[[], LightReading]] | None = None
        self._metered: LightReading | None = None

    def begin_room(self, render: RenderConfig, meter: Callable[[], LightReading]) -> None:
        """Take a new room, which is not metered yet; ``meter`` does it, or returns what it has found before."""
        self._room, self._metered = (render, meter), None

    def exposure(self, color_wanted: bool) -> Exposure:
        """Return the exposure of the next frame.

        The room is metered when colour is first wanted: never while who wants it may not be connected yet.
        """
        if self._metered is None and color_wanted and self._room is not None and needs_meter(self._room[0]):
            self._metered = self._room[1]()
        return self.known_exposure()

    def known_exposure(self) -> Exposure:
        """Return the exposure as far as it is known: that of a frame without colour, until the room is metered."""
        fixed = sensor_ev100(self._settings["camera"], self._settings["sensor"])
        return exposed(self._settings["render"], self._metered, fixed)
