"""One frame of a dataset: its layers as arrays, decoded when they are asked for, and all that is known of it beside them."""

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import lru_cache
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from scene_description import SceneDescription, SceneSynthError, error_line, scene_from_json
from scene_description.annotations import FrameAnnotations, annotations_from_json
from scene_description.labels import LabelTable
from scene_description.poses import world_from_optical
from scene_synth_ros.bags.bag_images import has_channels
from scene_synth_ros.bags.indexed_bag import MessageReadError
from scene_synth_ros.dataset.camera import Camera, Pose, read_camera, read_pose
from scene_synth_ros.dataset.errors import DatasetError
from scene_synth_ros.dataset.part import Part
from scene_synth_ros.dataset.rooms import RoomInfo
from scene_synth_ros.mcap.contents import McapReadError
from scene_synth_ros.messages.cdr import CdrReadError, read_text
from scene_synth_ros.messages.image_reader import CodecError, read_compressed
from scene_synth_ros.messages.poses import PoseReadError
from scene_synth_ros.messages.streams import COMPRESSED, POSE, Stream, parse

Value = TypeVar("Value")

_FORMS = {b"\x89PNG": "png", b"\xff\xd8\xff": "jpeg"}
"""First bytes of a file -> its form."""
_MILLIMETRES = np.float32(1000.0)
"""Of a metre."""


class FrameSource(Protocol):
    """What a frame is read from; it can be pickled."""

    @property
    def source(self) -> str:
        """Where it is, for messages."""

    @property
    def layers(self) -> tuple[str, ...]:
        """Layers that were asked for."""

    def part(self, number: int) -> Part:
        """Return one of its bags."""


class Frame(Mapping[str, NDArray[Any]]):
    """A frame: a mapping from layer to pixels, (height, width) or (height, width, channels), which are decoded once, when asked for.

    Iterating gives the layers that the dataset was opened with; others that were recorded can be asked for all the same.  Depth in
    whole millimetres comes as float32 metres too, NaN where it is 0, which is unknown.  Arrays are the caller's own and may be written to.

    Attributes:
        index: its number in the dataset.
        number: its number in its room, from 0 on.
        stamp_ns: simulated time.
        info: what is known of its room.
    """

    __slots__ = ("_dataset", "_decoded", "_part", "index", "info", "number", "stamp_ns")

    def __init__(self, dataset: FrameSource, part: int, stamp_ns: int, index: int, number: int, info: RoomInfo) -> None:
        self._dataset, self._part = dataset, part
        self.stamp_ns, self.index, self.number, self.info = stamp_ns, index, number, info
        self._decoded: dict[str, NDArray[Any]] = {}

    def __getitem__(self, layer: str) -> NDArray[Any]:
        """Return the pixels of a layer.

        Raises:
            KeyError: no such layer was recorded of the camera; the message says which there are.
            DatasetError: the image is damaged, is none of its layer, or was not recorded at this stamp.
        """
        if layer not in self._decoded:
            part = self._open()
            if layer not in part.topics.images:
                raise KeyError(f"{self}: expected one of {', '.join(part.topics.images)}, got layer '{layer}'")
            topic = part.topics.images[layer]
            try:
                image = part.bag.image(topic, self.stamp_ns)
            except CodecError as error:
                raise DatasetError(f"{self}, layer {layer}: {error}") from None
            except (MessageReadError, McapReadError, OSError) as error:
                raise DatasetError(f"{self}: {error_line(error)}") from None
            row = LAYERS.get(layer)
            if row is not None and not (has_channels(image.pixels, layer) and (row.dtype == "float32" or image.pixels.dtype.kind != "f")):
                expected = f"{row.channels} channel{'s' * (row.channels > 1)} of {row.dtype}"
                raise DatasetError(f"{self}, layer {layer}: expected {expected}, got an image encoded as {image.encoding[:40]}")
            self._decoded[layer] = _metres(image.pixels) if layer.startswith("depth") else image.pixels
        return self._decoded[layer]

    def __iter__(self) -> Iterator[str]:
        return iter(self._dataset.layers)

    def __len__(self) -> int:
        return len(self._dataset.layers)

    def __contains__(self, layer: object) -> bool:
        return layer in self._open().topics.images

    def __str__(self) -> str:
        return f"{self._dataset.source}: frame {self.index} (room {self.room}, stamp {self.stamp_ns} ns)"

    __repr__ = __str__
    __eq__, __hash__ = object.__eq__, object.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle with the layers that were decoded; the others are read where it is unpickled."""
        state = (self._dataset, self._part, self.stamp_ns, self.index, self.number, self.info)
        return _unpickled, (state, self._decoded)

    @property
    def room(self) -> int:
        """Number of its room in the run that made it."""
        return self.info.index

    @property
    def room_type(self) -> str:
        """Type of its room."""
        return self.info.room_type

    @property
    def seed(self) -> int:
        """Seed of the run that made its room."""
        return self.info.seed

    @property
    def camera(self) -> Camera:
        """The camera.

        Raises:
            DatasetError: no camera info was recorded.
        """
        part = self._open()
        infos = part.topics.infos
        layer = next((layer for layer in self._dataset.layers if layer in infos), next(iter(infos), None))
        if layer is None:
            raise DatasetError(f"{self}: expected a camera_info beside its images, got none; record that stream")
        return self._decode(infos[layer], lambda data: read_camera(part.camera, data))

    @property
    def pose(self) -> Pose:
        """Pose of the camera's optical frame in the map.

        Raises:
            DatasetError: it was not recorded.
        """
        topic = self._open().topics.pose
        if not topic:
            raise DatasetError(f"{self}: expected {Stream(self._open().camera, POSE).topic}, got none; record that stream")
        return self._decode(topic, read_pose)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """(4, 4), takes points of the optical frame to the map; metres."""
        pose = self.pose
        return world_from_optical(tuple(pose.position_m), tuple(pose.quaternion_xyzw))  # type: ignore[arg-type]

    @property
    def labelled(self) -> Collection[str]:
        """Layers of the camera whose labels were recorded."""
        return self._open().topics.labels.keys()

    @property
    def has_scene(self) -> bool:
        """Whether descriptions of rooms were recorded."""
        return len(self._open().starts) > 0

    @property
    def scene(self) -> SceneDescription:
        """The description of its room.

        Raises:
            DatasetError: none was recorded, or it is refused.
        """
        part = self._open()
        place = max(int(np.searchsorted(part.starts, self.stamp_ns, side="right")) - 1, 0)
        if not len(part.starts):
            raise DatasetError(f"{self}: expected a scene description on a topic that ends in /scene, got none; record that topic")
        try:
            return _scene(read_text(part.scene_message(int(part.starts[place]))))
        except (CdrReadError, SceneSynthError) as error:
            raise DatasetError(f"{self}: scene description: {error}") from None

    def labels(self, layer: str) -> LabelTable:
        """Return what the ids of a layer mean: id -> ``name``, ``color`` and, of objects, ``class``.

        Raises:
            DatasetError: no labels of the layer were recorded.
        """
        part = self._open()
        topic = part.topics.labels.get(layer)
        if topic is None:
            raise DatasetError(f"{self}: expected labels of {layer}, got those of {', '.join(part.topics.labels) or 'no layer'}")
        stamps = part.bag.stamps(topic)
        place = max(int(np.searchsorted(stamps, self.stamp_ns, side="right")) - 1, 0)
        stamp = int(stamps[place]) if len(stamps) else self.stamp_ns
        try:
            table = json.loads(read_text(self._message(topic, stamp)))["labels"]
            return {int(key): dict(row) for key, row in table.items()}
        except (CdrReadError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise DatasetError(f"{self}, labels of {layer}: expected JSON with 'labels', id -> name, got other text") from None

    @property
    def detections(self) -> FrameAnnotations | None:
        """Boxes, key points and relations of the objects; None where no annotations were recorded.

        Raises:
            DatasetError: they are refused.
        """
        part = self._open()
        topic = part.topics.annotations
        if not topic or (topic, self.stamp_ns) not in part.bag:
            return None
        try:
            return annotations_from_json(read_text(self._message(topic)))
        except (CdrReadError, SceneSynthError) as error:
            raise DatasetError(f"{self}: annotations: {error}") from None

    @property
    def settings(self) -> Mapping[str, Any] | None:
        """What the frame was rendered with, the JSON of ``<renderer>/settings``: exposure, camera, streams; None where it was not recorded.

        Raises:
            DatasetError: it is no JSON of settings.
        """
        part = self._open()
        there = [topic for topic in part.topics.settings if (topic, self.stamp_ns) in part.bag]
        try:
            found = [json.loads(read_text(self._message(topic))) for topic in there]
            own = [told for told in found if told["streams"]["camera"] == part.camera.rsplit("/", 1)[-1]]
        except (CdrReadError, ValueError, KeyError, TypeError, RecursionError):
            raise DatasetError(f"{self}: expected JSON of settings on {' or '.join(there)}, got other text") from None
        return own[0] if own else None

    def encoded(self, layer: str) -> tuple[bytes, str] | None:
        """Return the file of a layer that was recorded as ``png`` or ``jpeg``, and which of the two it is; None of other layers.

        Raises:
            DatasetError: the image is damaged, or was not recorded at this stamp.
        """
        part = self._open()
        topic = part.topics.images.get(layer, "")
        stream = parse(topic, part.bag.types.get(topic, ""))
        if stream is None or stream.role is not COMPRESSED:
            return None
        data = self._decode(topic, read_compressed)
        form = next((form for start, form in _FORMS.items() if data.startswith(start)), None)
        return None if form is None else (data, form)

    def _open(self) -> Part:
        return self._dataset.part(self._part)

    def _message(self, topic: str, stamp: int | None = None) -> memoryview:
        try:
            return self._open().bag.read(topic, self.stamp_ns if stamp is None else stamp)
        except (MessageReadError, McapReadError, OSError) as error:
            raise DatasetError(f"{self}: {error_line(error)}") from None

    def _decode(self, topic: str, read: Callable[[memoryview], Value]) -> Value:
        try:
            return read(self._message(topic))
        except (CdrReadError, PoseReadError) as error:
            raise DatasetError(f"{self}: topic {topic}: {error}") from None


def _unpickled(state: tuple[Any, ...], decoded: dict[str, NDArray[Any]]) -> Frame:
    frame = Frame(*state)
    frame._decoded.update(decoded)
    return frame


def _metres(depth: NDArray[Any]) -> NDArray[Any]:
    if depth.dtype != np.uint16:
        return depth
    metres = depth / _MILLIMETRES
    metres[depth == 0] = np.nan
    return metres


@lru_cache(maxsize=16)
def _scene(text: str) -> SceneDescription:
    return scene_from_json(text)
