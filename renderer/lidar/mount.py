"""Where the scanner is while its camera's rig moves along a path: poses of its frame (x forward, y left, z up) at many times at once.

Where a body carries the rig, its motion says where it is.  Else, between the poses of the path and beyond its ends, positions go straight
on and rotations evenly about one axis, as for the camera (``renderer.camera.shutter``; slerp: K. Shoemake, "Animating Rotation with
Quaternion Curves", 1985).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import kernel_cache.elementary as el
from renderer.camera.rig import CarriedPath
from renderer.lidar.config import ScanConfig
from scene_description.poses import LINK_FROM_OPTICAL, conjugate_quaternion, quaternion_from_rpy, rotation_from_quaternion
from scene_description.products import matmul
from scene_description.types import CameraPose

Floats = NDArray[np.float64]

_OPTICAL_FROM_LINK = rotation_from_quaternion(conjugate_quaternion(LINK_FROM_OPTICAL))
_SECOND_NS = 1e9
STEP_S = 0.001
"""A hand that trembles with 10 m/s2 is off a chord of this time by 1.3 micrometres."""


class Placement(NamedTuple):
    """World poses of a frame: positions (n, 3) in metres and world-from-frame rotations (n, 3, 3), float64."""

    position_m: Floats
    rotation: Floats


def along_path(path: Sequence[CameraPose], since_ns: int, times_s: Floats) -> Placement:
    """Return the path's own frame, optical, at ``since_ns`` + ``times_s`` (n,); a path of one pose rests there.

    Times are relative, because nanoseconds since 1970 do not fit a float64.  The curves of a motion are taken as straight for ``STEP_S``.
    """
    if isinstance(path, CarriedPath):
        path = path.between(since_ns, steps_over(times_s))
    if len(path) == 1:
        pose = path[0]
        count = len(times_s)
        return Placement(np.tile(pose.position_m, (count, 1)), np.tile(rotation_from_quaternion(pose.orientation), (count, 1, 1)))
    stamps_s = np.array([pose.stamp_ns - since_ns for pose in path]) / _SECOND_NS
    after = np.clip(np.searchsorted(stamps_s, times_s), 1, len(path) - 1)
    share = (times_s - stamps_s[after - 1]) / (stamps_s[after] - stamps_s[after - 1])
    positions = np.array([pose.position_m for pose in path])
    orientations = np.array([pose.orientation for pose in path])
    place = positions[after - 1] + share[:, None] * (positions[after] - positions[after - 1])
    return Placement(place, _rotations(_slerp(orientations[after - 1], orientations[after], share)))


def steps_over(times_s: Floats) -> Floats:
    """Return times ``STEP_S`` apart from before the first to after the last of ascending times (n,)."""
    first, last = math.floor(float(times_s[0]) / STEP_S), math.ceil(float(times_s[-1]) / STEP_S)
    return np.asarray(np.arange(first, max(last, first + 1) + 1) * STEP_S, np.float64)


def mounted_scanner(config: ScanConfig, rig: Placement) -> Placement:
    """Return the scanner's frame where the rig's optical frame is at ``rig``."""
    base = matmul(rig.rotation, _OPTICAL_FROM_LINK)
    place = rig.position_m
    mount = np.array(config.mount_m)
    if config.level:
        base = _upright(base)
        place = np.column_stack([place[:, :2], np.zeros(len(place))])
        mount = np.array([mount[0], mount[1], mount[2] + config.height_m])
    return Placement(place + matmul(base, mount), matmul(base, rotation_from_quaternion(quaternion_from_rpy(config.mount_rotation_rad))))


def _upright(rotation: Floats) -> Floats:
    """Return rotations (n, 3, 3) about the vertical with the heading of link rotations; of one that looks up or down, that of its top."""
    ahead, top = rotation[:, :2, 0], rotation[:, :2, 2] * -np.sign(rotation[:, 2, :1])
    heading = np.where(np.linalg.norm(ahead, axis=1, keepdims=True) > 1e-6, ahead, top)
    cosine, sine = (heading / np.linalg.norm(heading, axis=1, keepdims=True)).T
    zero, one = np.zeros_like(cosine), np.ones_like(cosine)
    return np.stack([cosine, -sine, zero, sine, cosine, zero, zero, zero, one], axis=1).reshape(-1, 3, 3)


def _slerp(a: Floats, b: Floats, share: Floats) -> Floats:
    """Return quaternions (n, 4) on the shorter arcs from ``a`` to ``b``, beyond them where ``share`` (n,) is not in [0, 1]."""
    cosine = np.sum(a * b, axis=1)
    b = np.where(cosine[:, None] < 0.0, -b, b)
    angle = 2.0 * el.arctan2(np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1))
    sine = el.sin(angle)
    near = sine < 1e-12
    safe = np.where(near, 1.0, sine)
    first = np.where(near, 1.0 - share, el.sin((1.0 - share) * angle) / safe)
    second = np.where(near, share, el.sin(share * angle) / safe)
    mixed = first[:, None] * a + second[:, None] * b
    unit: Floats = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return unit


def _rotations(quaternions: Floats) -> Floats:
    """Return the matrices (n, 3, 3) of unit quaternions (n, 4)."""
    return np.moveaxis(rotation_from_quaternion(tuple(quaternions.T)), -1, 0)  # type: ignore[arg-type]
