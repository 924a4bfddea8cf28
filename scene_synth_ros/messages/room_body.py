"""What the body of the room at work senses: which samples are due, and the message of each, in the order of time."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import String

from renderer.body.config import stamps_up_to
from renderer.body.imu import ImuReader
from renderer.body.wheels import WheelReader
from renderer.camera.config import CameraConfig
from renderer.lidar.lidar import Lidar, Sweep
from renderer.lidar.sweep_config import LidarConfig
from renderer.scene.scene_key import scene_key
from scene_description import CameraPose, SceneDescription
from scene_description.kinematics import kinematics
from scene_description.motion import Motion
from scene_description.motion_of_poses import motion_of
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.body_messages import (
    IMU_DATA,
    IMU_IDEAL,
    JOINT_STATES,
    ODOM,
    ODOM_IDEAL,
    ROBOT_DESCRIPTION,
    ideal_imu_to_msg,
    ideal_odometry_to_msg,
    imu_to_msg,
    joint_states_to_msg,
    odometry_to_msg,
    odometry_transform,
)
from scene_synth_ros.messages.conversions import clock_to_msg
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.lidar_messages import LIDAR_IDEAL, LIDAR_POINTS, ideal_sweep_to_msg, sweep_to_msg
from scene_synth_ros.messages.rig_frames import IMU_FRAME, LIDAR_FRAME, ODOM_FRAME, RigFrame, base_frame, rig_frames, robot_description
from scene_synth_ros.messages.senses import Senses
from scene_synth_ros.messages.streams import Stream

CLOCK = Stream("/", roles.CLOCK).topic


class BodyMessage(NamedTuple):
    """A message of a body or its scanner, with its stamp (ns) and, of a true pose, the transform that says the same."""

    topic: str
    message: Any
    stamp_ns: int
    transform: Any = None


class _Track(NamedTuple):
    """One stream: when its messages are due (ns), and what makes the k-th."""

    topic: str
    stamps_ns: NDArray[np.int64]
    make: Callable[[int], Any]


_Row = tuple[int, int, _Track, int]
"""A message that is due: its stamp (ns), the order of its stream among those of one stamp, the stream, and its place there."""


class Way(NamedTuple):
    """How a body moved through a room, as far as that is known, and the stamps (ns) of the frames that were seen from it.

    ``driven``: it goes on after the last of them.
    """

    motion: Motion
    stamps_ns: Sequence[int]
    driven: bool = False


class RoomBody:
    """Gives the messages of a room's body, up to one frame after the other.

    Nothing comes of a body whose camera is driven by hand: only of a base it is known where it is between frames (:meth:`follow`).

    Threading: the rendering thread.

    Attributes:
        frames: the fixed frames that the renderer knows of; none where there is no body.

    Args:
        lidar: returns the lidar of the room whenever it sweeps; of no use where there is none.
        way: how the body moved, where that is not as the room says.

    Raises:
        SceneSynthError: what moves has no wheels, and shall.
    """

    def __init__(
        self,
        scene: SceneDescription,
        camera: CameraConfig,
        streams: StreamConfig,
        senses: Senses,
        lidar: Callable[[LidarConfig, Motion], Lidar] | None = None,
        way: Way | None = None,
    ) -> None:
        self._scene, self._streams, self._senses, self._lidar = scene, streams, senses, lidar
        self._swept: tuple[int, Sweep] | None = None
        self._path = {pose.stamp_ns: pose for pose in scene.camera_path}
        self._start_ns = scene.camera_path[0].stamp_ns
        self._next: dict[str, int] = {}
        self._read: dict[str, int] = {}
        self._imu = ImuReader(senses.imu, self._start_ns, scene_key(scene))
        self._wheels = WheelReader(senses.wheels, self._start_ns, scene_key(scene))
        self._waiting: list[_Row] | None = None
        self._driven = False
        self.frames: tuple[RigFrame, ...] = ()
        if senses.body.enabled:
            self._way = way or Way(motion_of(scene), sorted(self._path))
            self._motion = self._way.motion
            self.frames = rig_frames(self._motion, camera, streams, senses)

    @property
    def description(self) -> BodyMessage | None:
        """The robot's description, to be published before the room's first frame; None where the body is not published."""
        if not self._senses.tells_body:
            return None
        text = robot_description(self._motion, self.frames, self._streams, self._senses)
        return BodyMessage(ROBOT_DESCRIPTION, String(data=text), self._scene.camera_path[0].stamp_ns)

    def go(self, pose: CameraPose) -> None:
        """Take where the camera's rig is; in the order of time."""
        self._driven = self._driven or self._path.get(pose.stamp_ns) != pose

    def follow(self, motion: Motion, stamp_ns: int) -> None:
        """Take what is known of the motion of a base that is driven: from the frame before up to one, and as far beyond as is sensed."""
        self._motion = motion
        self._waiting = self._waiting or []
        for order, track in enumerate(self._tracks(Way(motion, [stamp_ns], driven=True))):
            self._waiting += [(stamp, order, track, k) for k, stamp in enumerate(track.stamps_ns.tolist())]

    def due(self, stamp_ns: int, wanted: Callable[[str], bool] = lambda _: True) -> Iterator[BodyMessage]:
        """Yield every message up to a frame's stamp that has not come yet and is wanted; the clock's last tick comes with the frame."""
        if self._driven or not self._senses.tells_body:
            return
        for stamp, _, track, index in sorted(self._due_rows(stamp_ns, wanted), key=lambda row: row[:2]):
            message = track.make(index)
            transform = odometry_transform(message) if track.topic == ODOM_IDEAL else None
            yield BodyMessage(track.topic, message, stamp, transform)

    def _due_rows(self, stamp_ns: int, wanted: Callable[[str], bool]) -> list[_Row]:
        """Return what is due up to a frame and wanted; what is due counts as given."""
        if self._waiting is not None:
            due = [row for row in self._waiting if row[0] + (row[2].topic == CLOCK) <= stamp_ns]
            self._waiting = [row for row in self._waiting if row[0] + (row[2].topic == CLOCK) > stamp_ns]
            return [row for row in due if wanted(row[2].topic)]
        rows: list[_Row] = []
        for order, track in enumerate(self.tracks):
            begin = self._next.get(track.topic, 0)
            end = int(np.searchsorted(track.stamps_ns, stamp_ns, side="left" if track.topic == CLOCK else "right"))
            self._next[track.topic] = max(begin, end)
            if wanted(track.topic):
                rows += [(stamp, order, track, begin + k) for k, stamp in enumerate(track.stamps_ns[begin:end].tolist())]
        return rows

    @cached_property
    def bursts(self) -> dict[str, int]:
        """Topic -> how many messages of it come with a frame at most."""
        if not self._senses.tells_body:
            return {}
        frames = np.array(sorted(self._path), np.int64)
        longest_s = float(np.diff(frames).max(initial=0)) * 1e-9
        rates = {topic: rate_hz for topic, rate_hz in self._rates().items() if rate_hz}
        return {topic: math.ceil(longest_s * rate_hz - 1e-6) + (topic == ODOM_IDEAL) for topic, rate_hz in rates.items()}

    def _rates(self) -> dict[str, float]:
        """Return topic -> rate (Hz); of a topic that is not published 0."""
        senses = self._senses
        odd = {CLOCK: senses.clock_rate_hz * self._streams.publish_clock, ODOM_IDEAL: senses.body.rate_hz}
        told = ((senses.imu, (IMU_DATA, IMU_IDEAL)), (senses.wheels, (JOINT_STATES, ODOM)), (senses.lidar, (LIDAR_POINTS, LIDAR_IDEAL)))
        return odd | {topic: sense.rate_hz * sense.enabled for sense, topics in told for topic in topics}

    def message_at(self, topic: str, stamp_ns: int) -> Any:
        """Return the message of a topic with a stamp; None if there is none."""
        for track in self.tracks:
            index = int(np.searchsorted(track.stamps_ns, stamp_ns))
            if track.topic == topic and index < len(track.stamps_ns) and track.stamps_ns[index] == stamp_ns:
                return track.make(index)
        return None

    @cached_property
    def tracks(self) -> tuple[_Track, ...]:
        """All streams of the body, each whole."""
        return self._tracks(self._way)

    def _tracks(self, way: Way) -> tuple[_Track, ...]:
        """Return what comes up to the last frame of a way and was not read yet, of all streams."""
        senses, motion, start_ns, end_ns = self._senses, way.motion, self._start_ns, way.stamps_ns[-1]
        ticks = self._stamps(CLOCK, senses.clock_rate_hz, end_ns - way.driven)
        tracks = [_Track(CLOCK, ticks, lambda k: clock_to_msg(int(ticks[k])))] if self._streams.publish_clock else []
        prefix = self._streams.frame_prefix
        odom, base, device = f"{prefix}{ODOM_FRAME}", base_frame(motion, prefix), f"{prefix}{IMU_FRAME}"
        if senses.imu.enabled:
            offset_ns = round(senses.imu.clock_offset_s * 1e9)  # by the device's clock
            read = self._imu.read(motion, end_ns + way.driven * max(-offset_ns, 0))
            told = read.stamps_ns + offset_ns
            tracks.append(_Track(IMU_DATA, told, lambda k: imu_to_msg(read, k, int(told[k]), senses.imu, device)))
            tracks.append(_Track(IMU_IDEAL, read.stamps_ns, lambda k: ideal_imu_to_msg(read, k, device)))
        if senses.wheels.enabled:
            rolled = self._wheels.read(motion, end_ns)
            tracks.append(_Track(JOINT_STATES, rolled.stamps_ns, lambda k: joint_states_to_msg(rolled, k, prefix)))
            tracks.append(_Track(ODOM, rolled.stamps_ns, lambda k: odometry_to_msg(rolled, k, odom, base)))
        tracks += self._lidar_tracks(way)
        stamps = np.union1d(self._stamps(ODOM_IDEAL, senses.body.rate_hz, end_ns), np.array(way.stamps_ns, np.int64))
        at = kinematics(motion, (stamps - start_ns) * 1e-9)
        tracks.append(_Track(ODOM_IDEAL, stamps, lambda k: ideal_odometry_to_msg(at, k, int(stamps[k]), odom, base)))
        return tuple(tracks)

    def _lidar_tracks(self, way: Way) -> list[_Track]:
        """Return the streams of the lidar: of sweeps that end within the motion, or begin within it where it goes on."""
        config, frame_id = self._senses.lidar, f"{self._streams.frame_prefix}{LIDAR_FRAME}"
        if not config.enabled or self._lidar is None:
            return []
        first, end_ns = self._read.get(LIDAR_POINTS, 0), way.stamps_ns[-1]
        if not way.driven:
            end_ns = max(end_ns - round(1e9 / config.rate_hz), self._start_ns)
        stamps = self._stamps(LIDAR_POINTS, config.rate_hz, end_ns)
        return [
            _Track(topic, stamps, partial(self._sweep_message, to_msg, stamps, first, frame_id))
            for topic, to_msg in ((LIDAR_POINTS, sweep_to_msg), (LIDAR_IDEAL, ideal_sweep_to_msg))
        ]

    def _sweep_message(self, to_msg: Callable[..., Any], stamps: NDArray[np.int64], first: int, frame_id: str, index: int) -> Any:
        """Return a message of a sweep, whose number is ``first`` + ``index``; the last one is kept for its other message."""
        config, number = self._senses.lidar, first + index
        if self._swept is None or self._swept[0] != number:
            assert self._lidar is not None
            self._swept = number, self._lidar(config, self._motion).sweep(number)
        return to_msg(self._swept[1], config, int(stamps[index]), frame_id)

    def _stamps(self, topic: str, rate_hz: float, end_ns: int) -> NDArray[np.int64]:
        """Return the stamps of an even stream up to a time, without those that were read."""
        first = self._read.get(topic, 0)
        stamps = np.array(stamps_up_to(rate_hz, self._start_ns, end_ns, first), np.int64)
        self._read[topic] = first + len(stamps)
        return stamps
