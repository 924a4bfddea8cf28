"""One bag of a dataset: which frames it has, and where their messages are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.bags.indexed_bag import IndexedBag, MessageReadError
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.rooms import UNKNOWN_ROOM, RoomInfo, room_of_scene
from scene_synth_ros.dataset.topics import CameraTopics, find_cameras
from scene_synth_ros.mcap.block_cache import BlockCache
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.mcap.stored_file import StoredFile
from scene_synth_ros.messages.streams import SCENE, find_streams


class Part:
    """An open bag of a dataset; holds no open file.

    Args:
        name: of the bag, for messages.
        files: of it.
        layers: that every frame has; None for all of the camera.
        camera: its name, alone or with its namespace; None for the first that has all layers.
        cache: of decompressed chunks.
        report: called with one line for everything that is wrong.

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
        layers: Sequence[str] | None,
        camera: str | None,
        cache: BlockCache,
        report: Callable[[str], None],
    ) -> None:
        faults: list[str] = []

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

    def _take_topics(self, types: Mapping[str, str], name: str, layers: Sequence[str] | None, camera: str | None) -> list[str]:
        """Choose camera and layers; return the topics that every reading needs."""
        self.cameras = find_cameras(types)
        self.camera, self.topics = self._choose(name, layers, camera)
        self.layers = tuple(self.topics.images if layers is None else layers)
        return [*(self.topics.images[layer] for layer in self.layers), *sorted(find_streams(types, SCENE))]

    def _choose(self, name: str, layers: Sequence[str] | None, camera: str | None) -> tuple[str, CameraTopics]:
        fitting = {key: row for key, row in self.cameras.items() if camera in (None, key, key.rsplit("/", 1)[-1])}
        if not fitting:
            got = ", ".join(self.cameras) or "no camera with images"
            raise DatasetError(f"{name}: expected {f'camera {camera!r}' if camera else 'images of a camera'}, got {got}")
        lacking = {key: [layer for layer in layers or () if layer not in row.images] for key, row in fitting.items()}
        best = min(fitting, key=lambda key: len(lacking[key]))
        if lacking[best]:
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
            return room_of_scene(self.scene_message(start), number)
        except MessageReadError:
            return replace(UNKNOWN_ROOM, index=number)

    def scene_message(self, start: int) -> memoryview:
        """Return the serialised description of the room that begins at a stamp.

        Raises:
            MessageReadError: it cannot be read.
        """
        return self.bag.read(self._scenes[start], start)
