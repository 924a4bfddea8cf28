"""What a page shows of a bag, read by a second pass over it: scenes, maps, labels, poses, lenses and images of the frames chosen."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo

from renderer import LAYERS
from renderer.film.false_color import OBJECTS
from scene_description import FieldError, SceneSynthError, scene_from_json
from scene_synth_ros.bags.bag_reader import BagMessage, BagReader
from scene_synth_ros.bags.indexed_bag import IndexedBag, open_files
from scene_synth_ros.cli.page.bag_index import OTHERS, PageIndex
from scene_synth_ros.cli.page.page_images import PageImageError, form_of, page_image
from scene_synth_ros.cli.page.room_plan import camera_pose, map_picture, object_rows, room_facts, room_plan
from scene_synth_ros.messages.cdr import json_object, read_text
from scene_synth_ros.messages.poses import read_pose
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.messages.streams import INFO, LABELS, MAP, POSE, SCENE, find_streams

MAX_NOTES = 40
MAX_LABELS = 70_000
_UNREADABLE = (SceneSynthError, OSError, RuntimeError, ValueError, KeyError, IndexError, TypeError, OverflowError)
"""What a message that was damaged, or made to do harm, may raise while it is read."""


class BagContents:
    """Rooms and frames of a bag as JSON values, taken from ``topics``; what could not be read is told in ``notes``, lines for people."""

    def __init__(self, reader: BagReader, index: PageIndex, max_size: int, max_bytes: int, progress: Callable[[int], None]) -> None:
        self.notes: list[str] = []
        self._index, self._max_size, self._left = index, max_size, max_bytes
        self._place = {stamp: (r, f) for r, room in enumerate(index.rooms) for f, stamp in enumerate(room.stamps_ns)}
        self._room_of_start = {room.start_ns: r for r, room in enumerate(index.rooms)}
        self.rooms: list[dict[str, Any]] = [
            {
                "start": room.start_ns,
                "found": room.frames,
                "facts": [],
                "plan": None,
                "map": None,
                "objects": [],
                "labels": {},
                "frames": [{"stamp": str(stamp), "cameras": {}} for stamp in room.stamps_ns],
            }
            for room in index.rooms
        ]
        self._cameras = {stream.camera for stream in index.streams.values()} - {OTHERS}
        takers = {SCENE: self._take_scene, MAP: self._take_map, LABELS: self._take_labels, POSE: self._take_pose, INFO: self._take_lens}
        streams = find_streams(reader.types, *takers)
        self._streams = {topic: stream for topic, stream in streams.items() if stream.role.of == "run" or stream.base in self._cameras}
        self._readers: dict[str, Callable[[BagMessage, int | None], None]] = {
            topic: takers[stream.role] for topic, stream in self._streams.items()
        }
        self.topics = frozenset((*index.streams, *self._readers))
        number = 0
        for number, message in enumerate(reader.messages(self._readers.keys())):
            stamp = stamp_ns(message.type_name, message.data)
            self._try(message.topic, self._readers[message.topic], message, stamp)
            if number % 16 == 0:
                progress(number)
        self._take_images(open_files(reader, self.note), lambda images: progress(number + images))
        for room in self.rooms:
            color_ids(room)

    def cameras(self) -> list[dict[str, Any]]:
        """Return the cameras with their layers, each with form, topic and meaning, in the order of the table of layers."""
        order = list(LAYERS)
        found: dict[str, list[tuple[str, str]]] = {}
        for topic, stream in self._index.streams.items():
            found.setdefault(stream.camera, []).append((stream.layer, topic))
        return [
            {
                "name": camera,
                "layers": [_layer_row(layer, topic) for layer, topic in sorted(layers, key=lambda item: _rank(order, item[0]))],
            }
            for camera, layers in sorted(found.items(), key=lambda item: (item[0] == OTHERS, item[0]))
        ]

    def _try(self, topic: str, take: Callable[..., None], *arguments: Any) -> None:
        try:
            take(*arguments)
        except _UNREADABLE as error:
            self.note(f"{topic}: a message cannot be shown ({' '.join(str(error).split())[:200] or type(error).__name__})")

    def note(self, line: str) -> None:
        """Keep a line for people, once."""
        if line not in self.notes and len(self.notes) < MAX_NOTES:
            self.notes.append(line)

    def _camera_at(self, stamp: int | None, camera: str) -> dict[str, Any] | None:
        place = self._place.get(stamp) if stamp is not None else None
        if place is None:
            return None
        cameras: dict[str, dict[str, Any]] = self.rooms[place[0]]["frames"][place[1]]["cameras"]
        return cameras.setdefault(camera, {"pose": None, "lens": None, "images": {}})

    def _take_scene(self, message: BagMessage, stamp: int | None) -> None:
        place = self._room_of_start.get(min(message.log_ns, 2**63 - 1) if stamp is None else stamp)
        if place is None or self.rooms[place]["plan"] is not None:
            return
        try:
            scene = scene_from_json(read_text(message.data))
        except FieldError as error:
            self.note(
                f"{message.topic}: room {place + 1} of this page has no plan and no objects, its description is refused: {error}"[:400]
            )
            return
        room = self.rooms[place]
        room |= {"facts": room_facts(scene), "plan": room_plan(scene), "objects": object_rows(scene)}
        room["labels"] |= {
            name: label_rows(row.labels(scene)) for name, row in LAYERS.items() if row.labels is not None and name not in room["labels"]
        }

    def _take_map(self, message: BagMessage, stamp: int | None) -> None:
        place = self._room_of_start.get(stamp, self._room_of_start.get(None))
        if place is not None and self.rooms[place]["map"] is None:
            self.rooms[place]["map"] = map_picture(deserialize_message(message.data, OccupancyGrid))

    def _take_labels(self, message: BagMessage, stamp: int | None) -> None:
        if stamp is not None and stamp not in self._place:
            return
        table = json_object(message.data).get("labels")
        if not isinstance(table, Mapping) or len(table) > MAX_LABELS:
            raise PageImageError("expected JSON with 'labels', id -> name and colour")
        layer = self._streams[message.topic].layer
        for room in self.rooms if stamp is None else [self.rooms[self._place[stamp][0]]]:
            room["labels"][layer] = label_rows({int(key): value for key, value in table.items()})

    def _take_pose(self, message: BagMessage, stamp: int | None) -> None:
        camera = self._camera_at(stamp, self._streams[message.topic].base)
        if camera is not None:
            pose = read_pose(message.data)
            camera["pose"] = camera_pose(pose.position_m, pose.quaternion)

    def _take_lens(self, message: BagMessage, stamp: int | None) -> None:
        camera = self._camera_at(stamp, self._streams[message.topic].base)
        if camera is not None and camera["lens"] is None:
            info = deserialize_message(message.data, CameraInfo)
            numbers = [float(info.k[place]) for place in (0, 4, 2, 5)]
            straight = info.distortion_model in ("", "plumb_bob", "rational_polynomial") and not any(info.d)
            if straight and all(map(math.isfinite, numbers)) and numbers[0] > 0.0 and numbers[1] > 0.0:
                camera["lens"] = {"k": numbers, "width": info.width, "height": info.height}

    def _take_images(self, bag: IndexedBag, progress: Callable[[int], None]) -> None:
        topics = sorted(self._index.streams, key=lambda topic: _rank(list(LAYERS), self._index.streams[topic].layer))
        bag.prepare(topics)
        for number, stamp in enumerate(self._place):
            for topic in topics:
                if (topic, stamp) in bag:
                    self._try(topic, self._take_image, bag, topic, stamp)
            progress(number)

    def _take_image(self, bag: IndexedBag, topic: str, stamp: int) -> None:
        if self._left <= 0:
            self.note(
                "the page has its largest size; frames from here on have no images: give --frames, --rooms or --max-size a smaller number"
            )
            return
        stream = self._index.streams[topic]
        camera = self._camera_at(stamp, stream.camera)
        if camera is None or stream.layer in camera["images"]:
            return
        pixels = bag.image(topic, stamp).pixels
        other = "picture" if pixels.dtype == np.uint8 else "distance"
        form = other if stream.camera == OTHERS else form_of(LAYERS[stream.layer])
        image = page_image(pixels, form, LAYERS.get(stream.layer), self._max_size) | {"form": form}
        self._left -= len(image["data"])
        camera["images"][stream.layer] = image


def _layer_row(layer: str, topic: str) -> dict[str, str]:
    row = LAYERS.get(layer)
    return {"name": layer, "topic": topic, "meaning": row.meaning if row is not None else "", "unit": row.unit if row is not None else ""}


def _rank(order: list[str], layer: str) -> tuple[int, str]:
    return (order.index(layer) if layer in order else len(order)), layer


MAX_NAME = 120


def label_rows(table: Mapping[int, Any]) -> dict[int, dict[str, Any]]:
    """Return id -> name and colour of a table of unknown origin: texts are cut, colours made three bytes."""
    rows: dict[int, dict[str, Any]] = {}
    for key, value in table.items():
        row = value if isinstance(value, Mapping) else {"name": value}
        rows[key] = {"name": str(row.get("name", ""))[:MAX_NAME]}
        color = row.get("color")
        if isinstance(color, list | tuple) and len(color) == 3 and all(isinstance(c, int) and 0 <= c <= 255 for c in color):
            rows[key]["color"] = [int(c) for c in color]
    return rows


def color_ids(room: dict[str, Any]) -> None:
    """Give a row to every id that an image of the room has, and a colour to every row."""
    for frame in room["frames"]:
        for camera in frame["cameras"].values():
            for layer, image in camera["images"].items():
                table = room["labels"].setdefault(layer, {}) if image["form"] == "ids" else {}
                for key in image.get("counts", ()):
                    table.setdefault(key, {"name": ""})
    for table in room["labels"].values():
        for key, row in table.items():
            if "color" not in row:
                row["color"] = [int(value) for value in OBJECTS.of(np.array([key % 65536], np.uint16))[0]]
