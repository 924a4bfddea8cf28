"""What the body of the room at work senses: which samples are due, and the message of each, in the order of time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import String

from renderer.body.config import stamps_up_to
from renderer.body.imu import read_imu
from renderer.body.wheels import read_wheels
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
    """A message of a body, with its stamp (ns) and, of its true pose, the transform that says the same."""

    topic: str
    message: Any
    stamp_ns: int
    transform: Any = None


class _Track(NamedTuple):
    """One stream: when its messages are due (ns), and what makes the k-th."""

    topic: str
    stamps_ns: NDArray[np.int64]
    make: Callable[[int], Any]


class RoomBody:
    """Gives the messages of a room's body, up to one frame after the other.

    Nothing comes of a body whose camera is driven by hand: where it goes is not known ahead.

    Threading: the rendering thread.

    Attributes:
        frames: the fixed frames that the renderer knows of; none where there is no body.

    Args:
        lidar: returns the lidar of the room whenever it sweeps; of no use where there is none.

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
    ) -> None:
        self._scene, self._streams, self._senses, self._lidar = scene, streams, senses, lidar
        self._swept: tuple[int, Sweep] | None = None
        self._path = {pose.stamp_ns: pose for pose in scene.camera_path}
        self._next: dict[str, int] = {}
        self._driven = False
        self.frames: tuple[RigFrame, ...] = ()
        if senses.body.enabled:
            self._motion = motion_of(scene)
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

    def due(self, stamp_ns: int, wanted: Callable[[str], bool] = lambda _: True) -> Iterator[BodyMessage]:
        """Yield every message up to a frame's stamp that has not come yet and is wanted; the clock's last tick comes with the frame."""
        if self._driven or not self._senses.tells_body:
            return
        rows = []
        for order, track in enumerate(self.tracks):
            begin = self._next.get(track.topic, 0)
            end = int(np.searchsorted(track.stamps_ns, stamp_ns, side="left" if track.topic == CLOCK else "right"))
            self._next[track.topic] = max(begin, end)
            if wanted(track.topic):
                rows += [(stamp, order, begin + k) for k, stamp in enumerate(track.stamps_ns[begin:end].tolist())]
        for stamp, order, index in sorted(rows):
            track = self.tracks[order]
            message = track.make(index)
            transform = odometry_transform(message) if track.topic == ODOM_IDEAL else None
            yield BodyMessage(track.topic, message, stamp, transform)

    @cached_property
    def bursts(self) -> dict[str, int]:
        """Topic -> how many messages of it come with a frame at most."""
        if not self._senses.tells_body:
            return {}
        frames = np.array(sorted(self._path), np.int64)
        return {track.topic: int(np.diff(np.searchsorted(track.stamps_ns, frames, side="right"), prepend=0).max()) for track in self.tracks}

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
        senses, motion = self._senses, self._motion
        path, key = self._scene.camera_path, scene_key(self._scene)
        start_ns, end_ns = path[0].stamp_ns, path[-1].stamp_ns
        ticks = _stamps(senses.clock_rate_hz, start_ns, end_ns)
        tracks = [_Track(CLOCK, ticks, lambda k: clock_to_msg(int(ticks[k])))] if self._streams.publish_clock else []
        prefix = self._streams.frame_prefix
        odom, base, device = f"{prefix}{ODOM_FRAME}", base_frame(motion, prefix), f"{prefix}{IMU_FRAME}"
        if senses.imu.enabled:
            read = read_imu(motion, senses.imu, start_ns, end_ns, key)
            told = read.stamps_ns + round(senses.imu.clock_offset_s * 1e9)  # by the device's clock
            tracks.append(_Track(IMU_DATA, told, lambda k: imu_to_msg(read, k, int(told[k]), senses.imu, device)))
            tracks.append(_Track(IMU_IDEAL, read.stamps_ns, lambda k: ideal_imu_to_msg(read, k, device)))
        if senses.wheels.enabled:
            rolled = read_wheels(motion, senses.wheels, start_ns, end_ns, key)
            tracks.append(_Track(JOINT_STATES, rolled.stamps_ns, lambda k: joint_states_to_msg(rolled, k, prefix)))
            tracks.append(_Track(ODOM, rolled.stamps_ns, lambda k: odometry_to_msg(rolled, k, odom, base)))
        tracks += self._lidar_tracks(start_ns, end_ns)
        stamps = np.union1d(_stamps(senses.body.rate_hz, start_ns, end_ns), np.array(sorted(self._path), np.int64))
        at = kinematics(motion, (stamps - start_ns) * 1e-9)
        tracks.append(_Track(ODOM_IDEAL, stamps, lambda k: ideal_odometry_to_msg(at, k, int(stamps[k]), odom, base)))
        return tuple(tracks)

    def _lidar_tracks(self, start_ns: int, end_ns: int) -> list[_Track]:
        """Return the streams of the lidar: of sweeps that end within the motion."""
        config, frame_id = self._senses.lidar, f"{self._streams.frame_prefix}{LIDAR_FRAME}"
        if not config.enabled or self._lidar is None:
            return []
        stamps = _stamps(config.rate_hz, start_ns, max(end_ns - round(1e9 / config.rate_hz), start_ns))
        return [
            _Track(topic, stamps, partial(self._sweep_message, to_msg, stamps, frame_id))
            for topic, to_msg in ((LIDAR_POINTS, sweep_to_msg), (LIDAR_IDEAL, ideal_sweep_to_msg))
        ]

    def _sweep_message(self, to_msg: Callable[..., Any], stamps: NDArray[np.int64], frame_id: str, number: int) -> Any:
        """Return a message of a sweep; the last one is kept for its other message."""
        config = self._senses.lidar
        if self._swept is None or self._swept[0] != number:
            assert self._lidar is not None
            self._swept = number, self._lidar(config, self._motion).sweep(number)
        return to_msg(self._swept[1], config, int(stamps[number]), frame_id)


def _stamps(rate_hz: float, start_ns: int, end_ns: int) -> NDArray[np.int64]:
    return np.array(stamps_up_to(rate_hz, start_ns, end_ns), np.int64)
