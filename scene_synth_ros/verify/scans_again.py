"""Laser scans of a bag, made again from the settings of its frames."""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import NamedTuple

from renderer.camera.rig import rig_path
from renderer.lidar.config import ScanConfig
from renderer.lidar.scanner import scan_stamp_ns, scans_of_path
from scene_description import CameraPose, SceneDescription
from scene_synth_ros.messages.driven_base import DrivenRooms
from scene_synth_ros.messages.frame_settings import FrameSettings
from scene_synth_ros.messages.scan_messages import LASER_POSE, laser_pose_to_msgs, scan_to_msgs
from scene_synth_ros.messages.streams import laser_frame
from scene_synth_ros.render.room import RenderedRoom


class ScanPlace(NamedTuple):
    """Where a scan stands: its room by the settings of one of its frames, its number there."""

    settings: FrameSettings
    number: int


class ScansAgain:
    """Makes the messages of scans again.

    Rooms whose camera was driven alone, or asked for frames off its path, are left out: where the rig has gone is not in the bag.
    """

    def __init__(
        self, scene_of: Callable[[str], SceneDescription], room_of: Callable[[FrameSettings], RenderedRoom], drives: DrivenRooms
    ) -> None:
        self._scene_of, self._room_of, self._drives = scene_of, room_of, drives
        self._rooms: dict[tuple[str, ScanConfig], FrameSettings] = {}
        self._places: dict[int, ScanPlace] | None = None
        self._starts: list[int] = []
        self._made: tuple[int, dict[tuple[str, int], object]] = (-1, {})

    def take(self, settings: FrameSettings) -> None:
        """Take the settings of a frame."""
        if settings.scan.enabled:
            known = self._rooms.setdefault((settings.scene, settings.scan), settings)
            if settings.frame > known.frame:
                self._rooms[settings.scene, settings.scan] = settings

    def message(self, name: str, stamp_ns: int) -> tuple[object, ScanPlace] | None:
        """Return the message of a topic below the namespace at a stamp, and where its scan stands; None if it is of no scan."""
        places = self._find_places()
        index = bisect_right(self._starts, stamp_ns) - 1
        if index < 0:
            return None
        first_ns = self._starts[index]
        place = places[first_ns]
        if self._made[0] != first_ns:
            self._made = first_ns, self._make(place, first_ns)
        made = self._made[1].get((name, stamp_ns))
        return None if made is None else (made, place)

    def _find_places(self) -> dict[int, ScanPlace]:
        if self._places is None:
            self._places = {}
            for (scene_id, config), settings in self._rooms.items():
                path = self._scene_of(scene_id).camera_path
                for number in self._numbers(settings, config, path):
                    self._places[scan_stamp_ns(config, path[0].stamp_ns, number)] = ScanPlace(settings, number)
            self._starts = sorted(self._places)
        return self._places

    def _numbers(self, settings: FrameSettings, config: ScanConfig, path: Sequence[CameraPose]) -> Sequence[int]:
        """Return the numbers of the scans of a room: along its path, and of a driven base those that begin after it."""
        whole = scans_of_path(config, path)
        if settings.scene not in self._drives:
            return whole if settings.frame < len(path) else ()
        last_ns = self._drives.stamps_ns(settings.scene)[-1]
        count = math.floor((last_ns - path[0].stamp_ns) * config.rate_hz * 1e-9 + 1e-6) + 1
        begins = ((number, scan_stamp_ns(config, path[0].stamp_ns, number)) for number in range(count))
        return [number for number, begin_ns in begins if number in whole or path[-1].stamp_ns < begin_ns <= last_ns]

    def _make(self, place: ScanPlace, stamp_ns: int) -> dict[tuple[str, int], object]:
        """Return (topic below the namespace, stamp) -> message of one scan."""
        settings, streams = place.settings, place.settings.streams
        scene = self._scene_of(settings.scene)
        motion = self._drives.motion(scene) if scene.id in self._drives else scene.motion
        scan = self._room_of(settings).scanner(settings.scan).scan(place.number, stamp_ns, rig_path(scene.camera_path, motion))
        laser = laser_frame(streams.frame_prefix)
        made: dict[tuple[str, int], object] = {(name, stamp_ns): message for name, message in scan_to_msgs(scan, settings.scan, laser)}
        for pose in scan.poses:
            made[LASER_POSE, pose.stamp_ns] = laser_pose_to_msgs(pose, streams.world_frame, laser)[0]
        return made
