"""The frames of a body and of what is fixed to it: as static transforms, and as the robot's description (URDF).

``map`` -> ``odom`` -> base (REP 105); both of the first are one place, because ``odom/ideal`` never drifts.  The base of a motion on wheels
is ``base_footprint``, on the floor between the wheels, with ``base_link`` in it; of any other it is ``base_link``.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np

from renderer.camera.config import CameraConfig
from renderer.camera.rig import mount_quaternion
from scene_description.motion import Motion
from scene_description.poses import (
    LINK_FROM_OPTICAL,
    Quaternion,
    Vec3,
    conjugate_quaternion,
    multiply_quaternions,
    quaternion_from_rpy,
    rotation_from_quaternion,
)
from scene_synth_ros.messages.body_messages import WHEEL_JOINTS
from scene_synth_ros.messages.frame_messages import StreamConfig
from scene_synth_ros.messages.senses import Senses
from scene_synth_ros.messages.streams import camera_frames

BASE_LINK, FOOTPRINT, ODOM_FRAME, IMU_FRAME, LIDAR_FRAME = "base_link", "base_footprint", "odom", "imu_link", "lidar_link"
_NO_TURN: Quaternion = (0.0, 0.0, 0.0, 1.0)
_WHEEL_WIDTH_SHARE, _SHELL_SHARE = 0.5, 1.25


@dataclass(frozen=True, slots=True, kw_only=True)
class RigFrame:
    """A frame that is fixed to another: the names of both, its place there (m) and the rotation that takes it to the other."""

    parent: str
    child: str
    place_m: Vec3 = (0.0, 0.0, 0.0)
    turn: Quaternion = _NO_TURN


def base_frame(motion: Motion, prefix: str) -> str:
    """Return the frame that the motion is of."""
    return f"{prefix}{BASE_LINK if motion.drive is None else FOOTPRINT}"


def rig_frames(motion: Motion, camera: CameraConfig, streams: StreamConfig, senses: Senses) -> tuple[RigFrame, ...]:
    """Return the fixed frames that a renderer knows of: those of its camera, and of the body where it publishes that."""
    prefix = streams.frame_prefix
    base, link = f"{prefix}{BASE_LINK}", camera_frames(streams.camera, prefix)
    frames = []
    if senses.tells_body:
        frames.append(RigFrame(parent=streams.world_frame, child=f"{prefix}{ODOM_FRAME}"))
        if motion.drive is not None:
            frames.append(RigFrame(parent=f"{prefix}{FOOTPRINT}", child=base))
    for sense, child in ((senses.imu, IMU_FRAME), (senses.lidar, LIDAR_FRAME)):
        if sense.enabled:
            turn = quaternion_from_rpy(sense.mount_rotation_rad)
            frames.append(RigFrame(parent=base, child=f"{prefix}{child}", place_m=sense.mount_m, turn=turn))
    x, y, z = (float(value) for value in np.array(motion.camera_m) + _turned(motion.camera_turn, camera.mount_m))
    optical = multiply_quaternions(motion.camera_turn, mount_quaternion(camera))
    turn = multiply_quaternions(optical, conjugate_quaternion(LINK_FROM_OPTICAL))
    frames.append(RigFrame(parent=base, child=link.link, place_m=(x, y, z), turn=turn))
    frames.append(RigFrame(parent=link.link, child=link.optical, turn=LINK_FROM_OPTICAL))
    return tuple(frames)


def _turned(quaternion: Quaternion, vector: Vec3) -> Vec3:
    """Return a vector turned, sums in a fixed order."""
    x, y, z = (float(sum(a * b for a, b in zip(row, vector, strict=True))) for row in rotation_from_quaternion(quaternion).tolist())
    return x, y, z


def robot_description(motion: Motion, frames: Iterable[RigFrame], streams: StreamConfig, senses: Senses) -> str:
    """Return the URDF of a body: a link for each frame from its base on, joints that are fixed, and wheels that turn."""
    prefix, wheels = streams.frame_prefix, senses.wheels
    root = base_frame(motion, prefix)
    outside = {streams.world_frame, f"{prefix}{ODOM_FRAME}"}
    fixed = [frame for frame in frames if frame.parent not in outside and frame.child not in outside]
    rolls = wheels.enabled and motion.drive is not None
    shells = {f"{prefix}{BASE_LINK}": _shell(senses)} if motion.drive is not None else {}
    parts = [_link(name, shells.get(name, "")) for name in (root, *(frame.child for frame in fixed))]
    parts += [_fixed_joint(frame) for frame in fixed]
    for name, side in zip(WHEEL_JOINTS if rolls else (), (1.0, -1.0), strict=False):
        link = f"{prefix}{name.replace('_joint', '_link')}"
        parts += [_link(link, _wheel(senses)), _wheel_joint(prefix, name, link, side * 0.5 * wheels.track_m, wheels.radius_m)]
    return f'<?xml version="1.0"?>\n<robot name={quoteattr(motion.kind)}>\n' + "".join(parts) + "</robot>\n"


def _link(name: str, visual: str) -> str:
    return f"  <link name={quoteattr(name)}>{visual}</link>\n" if visual else f"  <link name={quoteattr(name)}/>\n"


def _fixed_joint(frame: RigFrame) -> str:
    origin = _origin(frame.place_m, _rpy(frame.turn))
    ends = f"<parent link={quoteattr(frame.parent)}/><child link={quoteattr(frame.child)}/>"
    return f'  <joint name={quoteattr(frame.child + "_joint")} type="fixed">{origin}{ends}</joint>\n'


def _wheel_joint(prefix: str, name: str, link: str, left_m: float, radius_m: float) -> str:
    ends = f"<parent link={quoteattr(prefix + BASE_LINK)}/><child link={quoteattr(link)}/>"
    origin = _origin((0.0, left_m, radius_m), (0.0, 0.0, 0.0))
    return f'  <joint name={quoteattr(prefix + name)} type="continuous">{origin}{ends}<axis xyz="0 1 0"/></joint>\n'


def _shell(senses: Senses) -> str:
    radius, floor = 0.5 * _SHELL_SHARE * senses.wheels.track_m, senses.wheels.radius_m
    return _cylinder(radius, 2.0 * floor, _origin((0.0, 0.0, 1.5 * floor), (0.0, 0.0, 0.0)))


def _wheel(senses: Senses) -> str:
    radius = senses.wheels.radius_m
    return _cylinder(radius, _WHEEL_WIDTH_SHARE * radius, _origin((0.0, 0.0, 0.0), (0.5 * math.pi, 0.0, 0.0)))


def _cylinder(radius_m: float, length_m: float, origin: str) -> str:
    return f'<visual>{origin}<geometry><cylinder radius="{radius_m:.9g}" length="{length_m:.9g}"/></geometry></visual>'


def _origin(place_m: Vec3, rpy_rad: Vec3) -> str:
    xyz, rpy = (" ".join(f"{value:.12g}" for value in values) for values in (place_m, rpy_rad))
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def _rpy(quaternion: Quaternion) -> Vec3:
    """Return roll, pitch and yaw of a rotation, about the fixed axes."""
    r = rotation_from_quaternion(quaternion).tolist()
    level = math.hypot(r[0][0], r[1][0])
    if level < 1e-9:  # looks straight up or down: roll and yaw are one turn
        return math.atan2(-r[1][2], r[1][1]), math.atan2(-r[2][0], level), 0.0
    return math.atan2(r[2][1], r[2][2]), math.atan2(-r[2][0], level), math.atan2(r[1][0], r[0][0])
