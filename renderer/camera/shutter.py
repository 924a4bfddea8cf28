"""The camera's motion while a frame is exposed: motion blur, and the skew of a rolling shutter.

Row v is exposed about the time stamp + v row_time, for shutter seconds, half of it before; so the stamp of a frame is the middle of the
first row's exposure, and with a global shutter (row_time 0) that of the whole frame.  A camera that a body carries is where the body's
motion says; else positions go straight on between the poses of the path, and beyond its ends, and rotations evenly about one axis (slerp;
K. Shoemake, "Animating Rotation with Quaternion Curves", 1985).
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.camera.camera_rays import aim_tile
from renderer.camera.cameras import PosedCamera
from renderer.camera.config import CameraConfig
from renderer.camera.rig import CarriedPath
from renderer.core import ray_packet as ray
from renderer.core.kernel import inlined, kernel
from renderer.core.ray_packet import LANES, Packet
from scene_description.poses import conjugate_quaternion, multiply_quaternions, rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose

KNOTS = 65
_SECOND_NS = 1_000_000_000

_ONE, _HALF = np.float32(1.0), np.float32(0.5)

MIDDLE = np.full(LANES, 0.5, np.float32)
"""Times of rays in the middle of their rows' exposure."""


class Motion(NamedTuple):
    """``motion``, ``row_step`` and ``shutter_step`` of ``PosedCamera``."""

    knots: NDArray[np.float32]
    row_step: np.float32
    shutter_step: np.float32


def motion_during(camera: CameraConfig, pose: CameraPose, path: Sequence[CameraPose]) -> Motion | None:
    """Return how the camera moves while it takes the frame of a pose; None where it stands still.

    It does where shutter and row time are 0, the path is a single pose, or the pose is none of the path's.
    """
    rows_s = (camera.height - 1) * camera.row_time_s
    span_s = rows_s + camera.shutter_s
    index = bisect_left(path, pose.stamp_ns, key=lambda item: item.stamp_ns)
    if span_s <= 0.0 or len(path) < 2 or index == len(path) or path[index] != pose:
        return None
    times_s = np.linspace(-0.5 * camera.shutter_s, rows_s + 0.5 * camera.shutter_s, KNOTS)
    knots = np.zeros((KNOTS, 12), np.float32)
    home = rotation_from_quaternion(pose.orientation)
    for row, there in zip(knots, _poses_during(path, pose.stamp_ns, times_s), strict=True):
        row[:9] = matmul(rotation_from_quaternion(there.orientation), home.T).ravel()
        row[9:] = there.position_m
    per_knot = span_s / (KNOTS - 1)
    return Motion(knots, np.float32(camera.row_time_s / per_knot), np.float32(camera.shutter_s / per_knot))


def _poses_during(path: Sequence[CameraPose], stamp_ns: int, times_s: NDArray[np.float64]) -> Sequence[CameraPose]:
    """Return where the camera is at some times after a stamp: where its body is then, if one is known."""
    if isinstance(path, CarriedPath):
        return path.between(stamp_ns, times_s)
    return [pose_at(path, stamp_ns + time_s * _SECOND_NS) for time_s in times_s]


def in_motion(view: PosedCamera, camera: CameraConfig, pose: CameraPose, path: Sequence[CameraPose]) -> PosedCamera:
    """Return a posed camera with its motion along the path while it takes the frame of a pose."""
    motion = motion_during(camera, pose, path)
    if motion is None:
        return view
    return view._replace(motion=motion.knots, row_step=motion.row_step, shutter_step=motion.shutter_step)


def pose_at(path: Sequence[CameraPose], stamp_ns: float) -> CameraPose:
    """Return where a camera that follows a path (two poses or more) is at a time, also a little before and after it."""
    after = min(max(bisect_left(path, stamp_ns, key=lambda item: item.stamp_ns), 1), len(path) - 1)
    a, b = path[after - 1], path[after]
    share = (stamp_ns - a.stamp_ns) / (b.stamp_ns - a.stamp_ns)
    x, y, z = (p + share * (q - p) for p, q in zip(a.position_m, b.position_m, strict=True))
    turn = multiply_quaternions(b.orientation, conjugate_quaternion(a.orientation))
    turn = turn if turn[3] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
    half, sine = math.atan2(math.hypot(*turn[:3]), turn[3]), math.hypot(*turn[:3])
    scale = math.sin(share * half) / sine if sine > 1e-12 else share
    part = (turn[0] * scale, turn[1] * scale, turn[2] * scale, math.cos(share * half))
    return CameraPose(stamp_ns=max(round(stamp_ns), 0), position_m=(x, y, z), orientation=multiply_quaternions(part, a.orientation))


@kernel
def move_rays(camera: PosedCamera, row: int, u: NDArray[np.float32], packet: Packet) -> None:
    """Move the rays of a tile that begins at ``row`` to where the camera is when they are exposed.

    ``u``: (16,) float32 or more, in [0, 1), when within the shutter's time; 0.5 is its middle.
    """
    real, knots, home = packet.real, camera.motion, camera.position
    for k in range(LANES):
        place = _HALF * camera.shutter_step + np.float32(row + (k >> 2)) * camera.row_step + (u[k] - _HALF) * camera.shutter_step
        i, s = _knot(place, len(knots))
        x, y, z = real[ray.ORG_X + k] - home[0], real[ray.ORG_Y + k] - home[1], real[ray.ORG_Z + k] - home[2]
        dx, dy, dz = real[ray.DIR_X + k], real[ray.DIR_Y + k], real[ray.DIR_Z + k]
        for axis in range(3):
            a, b, c = mixed(knots, i, s, 3 * axis), mixed(knots, i, s, 3 * axis + 1), mixed(knots, i, s, 3 * axis + 2)
            real[ray.ORG_X + LANES * axis + k] = mixed(knots, i, s, 9 + axis) + a * x + b * y + c * z
            real[ray.DIR_X + LANES * axis + k] = a * dx + b * dy + c * dz


@inlined
def aim_exposed_tile(camera: PosedCamera, column: int, row: int, jitter: NDArray[np.float32], packet: Packet) -> None:
    """Aim as :func:`renderer.camera.camera_rays.aim_tile` does, from where the camera is in the middle of each row's exposure."""
    aim_tile(camera, column, row, jitter, packet)
    if camera.row_step > np.float32(0.0):
        move_rays(camera, row, MIDDLE, packet)


@kernel
def unturn_rays(camera: PosedCamera, row: int, packet: Packet) -> None:
    """Turn directions and normals of a tile's rays, moved to the middle of their rows' exposure, back to the frame's own pose."""
    unturn_vectors(camera, row, ray.DIR_X, packet.real)
    unturn_vectors(camera, row, ray.NG_X, packet.real)


@kernel
def turn_vectors(camera: PosedCamera, row: int, field: int, numbers: NDArray[np.float32]) -> None:
    """Turn 16 vectors of a tile, three fields of ``numbers``, as the camera has turned from the frame's pose to that of each row."""
    knots = camera.motion
    for k in range(LANES):
        i, s = knot_of_row(camera, np.float32(row + (k >> 2)))
        x, y, z = numbers[field + k], numbers[field + LANES + k], numbers[field + 2 * LANES + k]
        for axis in range(3):
            a, b, c = mixed(knots, i, s, 3 * axis), mixed(knots, i, s, 3 * axis + 1), mixed(knots, i, s, 3 * axis + 2)
            numbers[field + LANES * axis + k] = a * x + b * y + c * z


@kernel
def unturn_vectors(camera: PosedCamera, row: int, field: int, numbers: NDArray[np.float32]) -> None:
    """Undo :func:`turn_vectors`."""
    knots = camera.motion
    for k in range(LANES):
        i, s = knot_of_row(camera, np.float32(row + (k >> 2)))
        x, y, z = numbers[field + k], numbers[field + LANES + k], numbers[field + 2 * LANES + k]
        for axis in range(3):
            a, b, c = mixed(knots, i, s, axis), mixed(knots, i, s, axis + 3), mixed(knots, i, s, axis + 6)
            numbers[field + LANES * axis + k] = a * x + b * y + c * z


@kernel
def carry_back(camera: PosedCamera, row: int, x: np.float32, y: np.float32, z: np.float32) -> tuple[np.float32, np.float32, np.float32]:
    """Return where a point of the optical frame in the middle of a row's exposure lies in the optical frame of the stamp."""
    knots, home, r = camera.motion, camera.position, camera.rotation
    i, s = knot_of_row(camera, np.float32(row))
    wx = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
    wy = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
    wz = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
    vx = mixed(knots, i, s, 0) * wx + mixed(knots, i, s, 1) * wy + mixed(knots, i, s, 2) * wz + mixed(knots, i, s, 9) - home[0]
    vy = mixed(knots, i, s, 3) * wx + mixed(knots, i, s, 4) * wy + mixed(knots, i, s, 5) * wz + mixed(knots, i, s, 10) - home[1]
    vz = mixed(knots, i, s, 6) * wx + mixed(knots, i, s, 7) * wy + mixed(knots, i, s, 8) * wz + mixed(knots, i, s, 11) - home[2]
    return (
        r[0, 0] * vx + r[1, 0] * vy + r[2, 0] * vz,
        r[0, 1] * vx + r[1, 1] * vy + r[2, 1] * vz,
        r[0, 2] * vx + r[1, 2] * vy + r[2, 2] * vz,
    )


@kernel
def knot_of_row(camera: PosedCamera, row: np.float32) -> tuple[int, np.float32]:
    """Return the knot of the camera's motion before the middle of a row's exposure, and the share of the way to the next one."""
    return _knot(_HALF * camera.shutter_step + row * camera.row_step, len(camera.motion))


@kernel
def _knot(place: np.float32, count: int) -> tuple[int, np.float32]:
    i = min(max(int(place), 0), count - 2)
    return i, place - np.float32(i)


@kernel
def mixed(knots: NDArray[np.float32], i: int, s: np.float32, column: int) -> np.float32:
    """Return a column of the motion a share ``s`` of the way from knot ``i`` to the next."""
    between: np.float32 = (_ONE - s) * knots[i, column] + s * knots[i + 1, column]
    return between
