"""The laser scans of the room at work: which are due, by where the rig has gone, and the messages of each."""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

from renderer.camera.rig import CarriedPath
from renderer.lidar.config import ScanConfig
from renderer.lidar.scan import Scan
from renderer.lidar.scanner import Scanner, scan_stamp_ns, scanner_poses, scans_of_path
from scene_description import CameraPose
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.room_body import BodyMessage
from scene_synth_ros.messages.scan_messages import LASER_POSE, SCAN, SCAN_IDEAL, laser_pose_to_msgs, scan_to_msgs
from scene_synth_ros.messages.streams import laser_frame

_POSES_KEPT = 16

DueScan = tuple[Sequence[CameraPose], "Scan | None"]
"""Where the scanner is meanwhile, and the scan itself if it is wanted."""


class RoomScans:
    """Casts scans in the order of their stamps.

    A rig that follows the room's path is known ahead: its scans are those of ``Scanner.along``, whole sweeps within the path.  One that is
    driven by hand is known up to the last frame: a scan that begins before that goes on as the rig moved last.  Where a base is driven
    that carries the rig is known for the whole of each scan (:meth:`follow`); only those are left out that a room's path ends in.

    Threading: the rendering thread.

    Args:
        make: returns the room's scanner, when it is first needed.
    """

    def __init__(self, config: ScanConfig, path: Sequence[CameraPose], make: Callable[[], Scanner]) -> None:
        self._config, self._path, self._make = config, path, make
        self._whole = scans_of_path(config, path)
        self._known = {pose.stamp_ns: pose for pose in path}
        self._gone: list[CameraPose] = []
        self._driven = self._follows = False
        self._next = 0

    @cached_property
    def _scanner(self) -> Scanner:
        return self._make()

    def go(self, pose: CameraPose) -> None:
        """Take where the rig is; in the order of time."""
        self._driven = self._driven or self._known.get(pose.stamp_ns) != pose
        self._gone = [*self._gone[1 - _POSES_KEPT :], pose]

    def follow(self, path: CarriedPath, pose: CameraPose) -> None:
        """Take where the rig of a base is that is driven, and what is known of its motion."""
        self._path, self._gone, self._follows = path, [pose], True

    def due(self, stamp_ns: int, wanted: Callable[[], bool]) -> Iterator[DueScan]:
        """Yield every scan up to a stamp that has not come yet.

        Nothing is cast for a scan that nobody wants; nor is there one behind where the rig has gone.
        """
        end_ns = min(stamp_ns, self._gone[-1].stamp_ns) if self._gone else -1
        path = self._gone if self._driven else self._path
        while (begin_ns := scan_stamp_ns(self._config, self._path[0].stamp_ns, self._next)) <= end_ns:
            number, self._next = self._next, self._next + 1
            if number not in self._whole and not (self._driven or (self._follows and begin_ns > self._path[-1].stamp_ns)):
                continue
            if wanted():
                scan = self._scanner.scan(number, begin_ns, path)
                yield scan.poses, scan
            else:
                yield scanner_poses(self._config, path, begin_ns), None


def scan_messages(due: DueScan, config: ScanConfig, streams: StreamConfig, is_wanted: Callable[[str], bool]) -> Iterator[BodyMessage]:
    """Yield what is published of a scan: where the scanner is, then the scan itself on the topics that are wanted."""
    poses, scan = due
    laser = laser_frame(streams.frame_prefix)
    for pose in poses:
        stamped, transform = laser_pose_to_msgs(pose, streams.world_frame, laser)
        yield BodyMessage(LASER_POSE, stamped, pose.stamp_ns, transform)
    if scan is not None:
        yield from (BodyMessage(topic, msg, scan.stamp_ns) for topic, msg in scan_to_msgs(scan, config, laser) if is_wanted(topic))


def scans_wanted(is_wanted: Callable[[str], bool]) -> bool:
    """Return whether scans must be cast."""
    return is_wanted(SCAN) or is_wanted(SCAN_IDEAL)
