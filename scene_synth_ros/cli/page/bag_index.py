"""What a page takes of a bag, found by reading it once without decoding images: cameras, rooms, the frames to show, counts of topics."""

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer import LAYERS
from scene_synth_ros.bags.bag_images import spread
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.messages.streams import IMAGE_TYPE, PICTURE, SCENE, find_images, find_streams

OTHERS = "other images"
"""Stands for the camera of images that belong to no layer."""


class ShownLayer(NamedTuple):
    """A topic of images: its camera, with its namespace, and its layer, or the whole topic where it is none of ours."""

    camera: str
    layer: str


class TopicCount(NamedTuple):
    """How many messages were found on a topic, and their bytes."""

    name: str
    type_name: str
    messages: int
    size: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ShownRoom:
    """A room: the stamp of its scene (None: frames without one), how many frames it has, the stamps of those to show."""

    start_ns: int | None
    frames: int
    stamps_ns: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PageIndex:
    """What is in a bag, and what of it is shown.

    ``rooms_found`` and ``frames_found`` count those too that are not shown; ``period_ns`` is the median distance of frames, 0 with less
    than two.
    """

    streams: Mapping[str, ShownLayer]
    topics: tuple[TopicCount, ...]
    rooms: tuple[ShownRoom, ...]
    rooms_found: int
    frames_found: int
    period_ns: int


def index_bag(reader: BagReader, max_rooms: int, max_frames: int, progress: Callable[[int], None]) -> PageIndex:
    """Read a bag and choose rooms and frames, evenly spread; rooms without frames are left out, unless no room has one."""
    types = reader.types
    streams, scenes = find_layers(types), find_streams(types, SCENE)
    counts, sizes = dict.fromkeys(types, 0), dict.fromkeys(types, 0)
    stamps, starts = array("q"), set()
    for number, message in enumerate(reader.messages(file_order=True)):
        counts[message.topic] += 1
        sizes[message.topic] += len(message.data)
        if message.topic in streams or message.topic in scenes:
            stamp = stamp_ns(message.type_name, message.data)
            if message.topic not in streams:
                starts.add(min(message.log_ns, 2**63 - 1) if stamp is None else stamp)
            elif stamp is not None:
                stamps.append(stamp)
        if number % 256 == 0:
            progress(number)
    frames = np.unique(np.frombuffer(stamps, np.int64))
    rooms = _rooms(frames, sorted(starts), max_frames)
    return PageIndex(
        streams=streams,
        topics=tuple(TopicCount(name, types[name], counts[name], sizes[name]) for name in sorted(types)),
        rooms=tuple(rooms[place] for place in spread(range(len(rooms)), max_rooms)),
        rooms_found=len(rooms),
        frames_found=frames.size,
        period_ns=int(np.median(np.diff(frames))) if frames.size > 1 else 0,
    )


def find_layers(types: Mapping[str, str]) -> dict[str, ShownLayer]:
    """Return the topics to show images of: layers of cameras, of several forms of one the first, and other images."""
    shown = {topic: ShownLayer(image.base, image.layer) for image, topic in find_images(types).items() if image.layer in LAYERS}
    pictures = find_streams(types, PICTURE)
    for name in sorted(types):
        if types[name] == IMAGE_TYPE and name not in shown and name not in pictures:
            shown[name] = ShownLayer(OTHERS, name)
    return shown


def _rooms(frames: NDArray[np.int64], starts: list[int], max_frames: int) -> list[ShownRoom]:
    ends = np.searchsorted(frames, starts)
    pieces = np.split(frames, ends)
    rooms = []
    for start, piece in zip([None, *starts], pieces, strict=True):
        own = [int(stamp) for stamp in piece]
        rooms.append(ShownRoom(start_ns=start, frames=len(own), stamps_ns=tuple(spread(own, max_frames))))
    return [room for room in rooms if room.frames] or [room for room in rooms if room.start_ns is not None]
