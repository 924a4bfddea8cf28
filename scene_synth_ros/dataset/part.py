"""One bag of a dataset: which frames it has, and where their messages are."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.bags.indexed_bag import IndexedBag, MessageReadError
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.rooms import UNKNOWN_ROOM, RoomInfo, room_of_scene
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.mcap.message_places import BlockCache
from scene_synth_ros.mcap.stored_file import StoredFile
from scene_synth_ros.messages.streams import ANNOTATIONS, INFO, LABELS, POSE, SCENE, SETTINGS, Role, Stream, find_images, find_streams

USUAL = ("color", "depth", "semantic")
Layers = Sequence[str] | Literal["usual"] | None
"""Layers that are asked for: these, those of ``USUAL`` that there are, or all."""


@dataclass(slots=True, kw_only=True)
class CameraTopics:
    """The topics of one camera: layer -> image, layer -> camera info, layer -> labels; "" where there is none; all settings."""

    images: dict[str, str] = field(default_factory=dict)
    infos: dict[str, str] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)
    pose: str = ""
    annotations: str = ""
    settings: tuple[str, ...] = ()


def find_cameras(types: Mapping[str, str]) -> dict[str, CameraTopics]:
    """Return the cameras of a bag by their names with namespace (``/synth/camera``), in the order of these."""
    cameras: dict[str, CameraTopics] = {}
    for image, topic in find_images(types).items():
        if image.camera:
            cameras.setdefault(image.base, CameraTopics()).images[image.layer] = topic
    there = set(find_streams(types, INFO, LABELS, POSE, ANNOTATIONS).values())
    settings = tuple(sorted(find_streams(types, SETTINGS)))

    def of_layers(camera: str, role: Role) -> dict[str, str]:
        streams = [Stream(camera, role, layer) for layer in cameras[camera].images]
        return {stream.layer: stream.topic for stream in streams if stream in there}

    for camera, topics in cameras.items():
        topics.infos, topics.labels, topics.settings = of_layers(camera, INFO), of_layers(camera, LABELS), settings
        pose, annotations = Stream(camera, POSE), Stream(camera, ANNOTATIONS)
        topics.pose = pose.topic if pose in there else ""
        topics.annotations = annotations.topic if annotations in there else ""
    return dict(sorted(cameras.items()))


class Part:
    """An open bag of a dataset; holds no open file.

    ``layers`` and ``camera`` are chosen as :func:`open_dataset` says; ``report`` gets one line for everything that is wrong.

    Attributes:
        bag: its messages.
        camera: with its namespace.
        cameras: all of the bag.
        topics: of the camera.
        layers: that every frame has.
        stamps: (frames,) int64 nanoseconds, ascending: those at which every layer has an image.
        starts: (rooms,) int64, stamps of the rooms' descriptions; the first room has what comes before it, too.
        rooms: in their order.

    Raises:
        DatasetError: nothing can be read, or no camera has the layers.
    """

    def __init__(
        self,
        name: str,
        files: Sequence[StoredFile],
        layers: Layers,
        camera: str | None,
        cache: BlockCache,
        report: Callable[[str], None],
    ) -> None:
        faults: list[str] = []
        self._name, self._report = name, report

        def tell(line: str) -> None:
            faults.append(line)
            report(line)

        try:
            self.bag = IndexedBag(files, cache, tell, lambda types: self._take_topics(types, name, layers, camera))
        except McapReadError as error:
            raise DatasetError(str(error)) from None
        except DatasetError as error:
            raise DatasetError("; ".join((str(error), *faults[-1:]))) from None
        self.stamps = self._frames(name, report)
        scene_topics = sorted(find_streams(self.bag.types, SCENE), reverse=True)
        self._scenes = {int(stamp): topic for topic in scene_topics for stamp in self.bag.stamps(topic)}
        self.starts = np.array(sorted(self._scenes), np.int64)

    def _take_topics(self, types: Mapping[str, str], name: str, layers: Layers, camera: str | None) -> list[str]:
        """Choose camera and layers; return the topics that every reading needs."""
        self.cameras = find_cameras(types)
        self.camera, self.topics = self._choose(name, layers, camera)
        found = [layer for layer in USUAL if layer in self.topics.images] if layers == "usual" else layers
        self.layers = tuple(found or self.topics.images)
        if layers == "usual" and len(self.layers) < len(USUAL):
            lacking = [layer for layer in USUAL if layer not in self.layers]
            self._report(f"{name}: {', '.join(lacking)} of {self.camera} not recorded; frames have {', '.join(self.layers)}")
        infos = [self.topics.infos[layer] for layer in self.layers if layer in self.topics.infos]
        return [*(self.topics.images[layer] for layer in self.layers), *infos, *sorted(find_streams(types, SCENE))]

    def _choose(self, name: str, layers: Layers, camera: str | None) -> tuple[str, CameraTopics]:
        fitting = {key: row for key, row in self.cameras.items() if camera in (None, key, key.rsplit("/", 1)[-1])}
        if not fitting:
            got = ", ".join(self.cameras) or "no camera with images"
            raise DatasetError(f"{name}: expected {f'camera {camera!r}' if camera else 'images of a camera'}, got {got}")
        asked = USUAL if layers == "usual" else layers or ()
        lacking = {key: [layer for layer in asked if layer not in row.images] for key, row in fitting.items()}
        best = min(fitting, key=lambda key: len(lacking[key]))
        if lacking[best] and layers != "usual":
            got = "; ".join(f"{key} has {', '.join(row.images)}" for key, row in fitting.items())
            raise DatasetError(f"{name}: expected layers {', '.join(lacking[best])}, got none; {got}")
        return best, fitting[best]

    def _frames(self, name: str, report: Callable[[str], None]) -> NDArray[np.int64]:
        stamps = [self.bag.stamps(self.topics.images[layer]) for layer in self.layers]
        found, counts = np.unique(np.concatenate(stamps), return_counts=True)
        whole: NDArray[np.int64] = found[counts == len(stamps)]
        if len(whole) < len(found):
            report(f"{name}: {len(found) - len(whole)} of {len(found)} frames lack one of {', '.join(self.layers)} and are left out")
        return whole

    def room_positions(self) -> NDArray[np.int64]:
        """Return the position in ``rooms`` of each frame."""
        return np.maximum(np.searchsorted(self.starts, self.stamps, side="right") - 1, 0)

    def read_rooms(self) -> list[RoomInfo]:
        """Return the rooms in their order with what their descriptions say; one unknown room where there is no description."""
        counts = np.bincount(self.room_positions(), minlength=max(len(self.starts), 1))
        rooms = [self._room(int(start), number) for number, start in enumerate(self.starts)] or [UNKNOWN_ROOM]
        return [replace(room, frames=int(count)) for room, count in zip(rooms, counts, strict=True)]

    def _room(self, start: int, number: int) -> RoomInfo:
        try:
            room = room_of_scene(self.scene_message(start), number)
            fault = "" if room.scene_id else f"{self._name}: room {number}: expected a scene description in JSON, got other text"
        except MessageReadError as error:
            room, fault = replace(UNKNOWN_ROOM, index=number), str(error)
        if fault:
            self._report(f"{fault}; the type of the room is unknown")
        return room

    def scene_message(self, start: int) -> memoryview:
        """Return the serialised description of the room that begins at a stamp.

        Raises:
            MessageReadError: it cannot be read.
        """
        return self.bag.read(self._scenes[start], start)
