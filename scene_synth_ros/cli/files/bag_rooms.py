"""The rooms of a bag: their descriptions, the maps that were published of them, and the poses that cameras had in them."""

import zlib
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message

from grammar.synthesize import FloorMap
from scene_description import CameraPose, SceneDescription, scene_from_json
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.files.truth_files import floor_of_message
from scene_synth_ros.cli.options import UsageError
from scene_synth_ros.messages.cdr import read_text
from scene_synth_ros.messages.poses import read_pose
from scene_synth_ros.messages.stamps import stamp_ns
from scene_synth_ros.messages.streams import MAP, POSE, SCENE, find_streams


@dataclass(slots=True, kw_only=True)
class BagRoom:
    """A room of a bag; ``floor`` is None where no map of it was recorded; ``poses``: camera -> poses, each stamp once, in their order."""

    start_ns: int
    text: bytes
    floor: FloorMap | None = None
    poses: dict[str, dict[int, CameraPose]] = field(default_factory=dict)

    @property
    def scene(self) -> SceneDescription:
        """The description, read again from its text: a bag may have thousands of rooms."""
        return scene_from_json(zlib.decompress(self.text).decode())

    def trajectories(self) -> dict[str, tuple[CameraPose, ...]]:
        """Return camera -> its poses by time."""
        return {camera: tuple(poses[stamp] for stamp in sorted(poses)) for camera, poses in sorted(self.poses.items())}


def read_rooms(bag: Path) -> list[BagRoom]:
    """Return the rooms of a bag by their first stamp; a description that files repeat is one room.

    Raises:
        BagReadError: the bag cannot be read at all.
        UsageError: it has no room.
        SceneSynthError: a room's description or map is refused.
    """
    with BagReader(bag) as reader:
        streams = find_streams(reader.types, SCENE, MAP, POSE)
        rooms, poses, maps = {}, [], {}
        for message in reader.messages(streams, file_order=True):
            stamp = stamp_ns(message.type_name, message.data)
            start = message.log_ns if stamp is None else stamp
            stream = streams[message.topic]
            if stream.role is SCENE:
                rooms[start] = BagRoom(start_ns=start, text=zlib.compress(read_text(message.data).encode(), 1))
            elif stream.role is MAP:
                maps[start] = message.data
            else:
                poses.append((stream.camera or "camera", read_pose(message.data).camera_pose))
    if not rooms:
        got = ", ".join(sorted(reader.types)) or "no topic"
        raise UsageError(f"{bag}: expected scene descriptions on a topic that ends in /scene, got {got}")
    starts = sorted(rooms)
    for start in rooms.keys() & maps.keys():
        rooms[start].floor = floor_of_message(deserialize_message(maps[start], OccupancyGrid))
    for camera, pose in poses:
        place = bisect_right(starts, pose.stamp_ns) - 1
        if place >= 0:
            rooms[starts[place]].poses.setdefault(camera, {})[pose.stamp_ns] = pose
    return [rooms[start] for start in starts]


def room_names(rooms: list[BagRoom]) -> Iterator[tuple[str, SceneDescription, BagRoom]]:
    """Yield a name for each room, of its index in the run, with its description; a second room of an index has a number after it."""
    counts: dict[int, int] = {}
    for room in rooms:
        scene = room.scene
        counts[scene.index] = counts.get(scene.index, 0) + 1
        again = f"_{counts[scene.index]}" if counts[scene.index] > 1 else ""
        yield f"room_{scene.index:04d}{again}", scene, room
