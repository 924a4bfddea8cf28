"""Rigid poses: quaternions (x, y, z, w) and 4x4 matrices ``a_from_b``, so that neighbouring frame names cancel."""

import math

import numpy as np
from numpy.typing import NDArray

from scene_description.products import norm

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

LINK_FROM_OPTICAL: Quaternion = (-0.5, 0.5, -0.5, 0.5)
"""Takes the optical frame (x right, y down, z forward) to its camera body frame, the link (x forward, y left, z up), REP 103."""


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    """Return the rotation by ``yaw_rad`` about z."""
    return (0.0, 0.0, math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad))


def rotation_from_quaternion(quaternion: Quaternion) -> NDArray[np.float64]:
    """Return the 3x3 rotation matrix of a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_rotation(rotation: NDArray[np.float64]) -> Quaternion:
    """Return the unit quaternion (x, y, z, w), w >= 0, of a 3x3 rotation matrix (Shepperd's method)."""
    r = rotation
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    candidates = np.array([r[0, 0], r[1, 1], r[2, 2], trace])
    best = int(np.argmax(candidates))
    if best == 3:
        q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + trace])
    else:
        i, j, k = best, (best + 1) % 3, (best + 2) % 3
        q = np.empty(4)
        q[i] = 1.0 + 2.0 * r[i, i] - trace
        q[j] = r[j, i] + r[i, j]
        q[k] = r[k, i] + r[i, k]
        q[3] = r[k, j] - r[j, k]
    q /= norm(q)
    if q[3] < 0.0:
        q = -q
    return (float(q[0]), float(q[1]), float(q[2]), float(q[3]))


def multiply_quaternions(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation ``a`` after ``b``."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def quaternion_from_rpy(roll_pitch_yaw: Vec3) -> Quaternion:
    """Return the rotation about the fixed x, then y, then z axis, as of URDF's rpy."""
    result: Quaternion = (0.0, 0.0, 0.0, 1.0)
    for axis, angle in enumerate(roll_pitch_yaw):
        part = [0.0, 0.0, 0.0, math.cos(0.5 * angle)]
        part[axis] = math.sin(0.5 * angle)
        result = multiply_quaternions((part[0], part[1], part[2], part[3]), result)
    return result


def conjugate_quaternion(quaternion: Quaternion) -> Quaternion:
    """Return the inverse rotation of a unit quaternion."""
    x, y, z, w = quaternion
    return (-x, -y, -z, w)


def world_from_optical(position_m: Vec3, quaternion: Quaternion) -> NDArray[np.float64]:
    """Return the 4x4 matrix that takes points of the optical frame to the world."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_from_quaternion(quaternion)
    matrix[:3, 3] = position_m
    return matrix


def look_at(position_m: Vec3, target_m: Vec3) -> Quaternion:
    """Return the rotation of an optical frame at ``position_m`` that looks at ``target_m`` with an upright horizon.

    Raises:
        ValueError: the two points coincide or lie on one vertical line, where no horizon is defined.
    """
    forward = np.subtract(target_m, position_m).astype(np.float64)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    if norm(right) < 1e-9:
        raise ValueError(f"look_at: no horizon from {position_m} to {target_m}; got a vertical or zero direction")
    forward /= norm(forward)
    right /= norm(right)
    return quaternion_from_rotation(np.column_stack([right, np.cross(forward, right), forward]))
