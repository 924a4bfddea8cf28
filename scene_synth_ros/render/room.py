"""One room and what its frames are made with."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from threading import Event
from typing import Any

from renderer import CameraConfig, DepthSensorConfig, RenderCancelled, RenderConfig, Renderer, SensorConfig
from renderer.annotations import Annotator
from renderer.camera.rig import mounted_path
from renderer.exposure import meter, needs_meter
from renderer.film.layers import PHOTOGRAPHS
from renderer.film.tone import Exposure
from renderer.scene.flat_scene import FlatScene
from renderer.scene.flatten import flatten
from renderer.scene.scene_key import scene_key
from renderer.scene.semantic_classes import with_classes
from scene_description import SceneDescription
from scene_description.label_standards import StandardName
from scene_synth_ros.messages.detections import ANNOTATIONS
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.suite.heap import trim_heap
from scene_synth_ros.suite.parameters import Parameters

_REST = 2.0
"""Seconds of rest for each that went into a view: frames find most light by themselves, and shall not wait for what they need not yet."""
_VIEWS = 64
"""Most views of a path for which light is computed ahead: those between them read little else."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomSettings:
    """What a room is rendered with; a change of any of them needs everything of :class:`Room` made anew."""

    camera: CameraConfig
    render: RenderConfig
    sensor: SensorConfig
    depth_sensor: DepthSensorConfig
    semantic_classes: StandardName
    annotation_masks: bool
    catalog_dir: Path | None


def room_settings(values: Mapping[str, Any] | Parameters, catalog_dir: Path | None) -> RoomSettings:
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


class Room:
    """A room's geometry, renderer, annotator and metered exposure, each made when it is first asked for, until it is closed.

    Threading: one thread at a time.

    Args:
        scene: the room.
        settings: what it is rendered with.
    """

    def __init__(self, scene: SceneDescription, settings: RoomSettings) -> None:
        self.scene, self.settings = scene, settings
        self._held = ExitStack()
        self._one_thread = False

    @cached_property
    def flat(self) -> FlatScene:
        """The geometry."""
        return with_classes(flatten(self.scene, self.settings.catalog_dir), self.scene, self.settings.semantic_classes)

    @cached_property
    def renderer(self) -> Renderer:
        """The renderer.

        Raises:
            SceneSynthError: the room cannot be made.
        """
        settings = self.settings
        sensors = {"sensor": settings.sensor, "depth_sensor": settings.depth_sensor}
        renderer = self._held.enter_context(Renderer(self.flat, settings.camera, settings.render, scene_key(self.scene), **sensors))
        trim_heap()
        return renderer

    @cached_property
    def annotator(self) -> Annotator:
        """What tells of the objects in a frame."""
        settings = self.settings
        masks, portable, classes = settings.annotation_masks, settings.render.portable, settings.semantic_classes
        return self._held.enter_context(Annotator(self.flat, self.scene, settings.camera, masks=masks, portable=portable, classes=classes))

    @cached_property
    def metered(self) -> Exposure:
        """The exposure as it is metered."""
        settings = self.settings
        render = replace(settings.render, threads=1) if self._one_thread else settings.render
        exposure = meter(self.flat, settings.camera, render, scene_key(self.scene), self.scene.camera_path)
        trim_heap()
        return exposure

    def prepare(self, layers: Collection[str], enough: Event, cancelled: Callable[[], bool]) -> None:
        """Make what some layers need in the calling thread alone, then colour's light for view after view of the path, with rests between.

        Args:
            layers: that will be asked for.
            enough: set when the first view will do.
            cancelled: as of ``Renderer.render``; the room is of no use then.

        Raises:
            SceneSynthError: the room cannot be made.
            RenderCancelled: ``cancelled`` returned True.
        """
        self._one_thread = True
        with self.renderer.in_this_thread():
            if ANNOTATIONS in layers:
                assert self.annotator is not None
            if any(layer in PHOTOGRAPHS for layer in layers):
                if needs_meter(self.settings.render):
                    assert self.metered is not None
                path = mounted_path(self.settings.camera, self.scene.camera_path)
                for index in range(0, len(path), -(-len(path) // _VIEWS)):
                    began = time.perf_counter()
                    try:
                        self.renderer.prepare(path[index], path, (lambda: enough.is_set() or cancelled()) if index else cancelled)
                    except RenderCancelled:
                        if cancelled():
                            raise
                    if enough.wait(_REST * (time.perf_counter() - began)):
                        break
        self._one_thread = False

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
