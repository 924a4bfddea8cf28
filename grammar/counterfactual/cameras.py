"""The camera's path: height, tilt, speed, how far it goes, where it is, or another one through the same room."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from grammar.camera.camera_path import CameraSpace, CameraTimes, sample_camera_path
from grammar.camera.sights import find_sights
from grammar.counterfactual.change import ChangeError, Outcome, Work, random_numbers
from grammar.counterfactual.gate import camera_checked, categories_of
from grammar.counterfactual.values import number, whole
from grammar.geometry.slopes import roof_boxes
from grammar.geometry.solids import object_solids
from scene_description import CameraPose
from scene_description.poses import Quaternion, multiply_quaternions, rotation_from_quaternion
from scene_description.types import MAX_POSES

_STEEPEST_RAD = math.radians(89.0)
_SECOND_NS = 1_000_000_000


def lens_positions(work: Work) -> NDArray[np.float64]:
    """Return where the lens is at each pose, (n, 3)."""
    return np.array([pose.position_m for pose in work.scene.camera_path])


def _moved(work: Work, positions: NDArray[np.float64]) -> Outcome:
    """Return the scene with the camera at other places (n, 3), if these are free."""
    poses = tuple(replace(pose, position_m=(x, y, z)) for pose, (x, y, z) in zip(work.scene.camera_path, positions.tolist(), strict=True))
    return Outcome(camera_checked(work.rules(), work.scene, replace(work.scene, camera_path=poses, motion=None), work.change))


def set_height(work: Work) -> Outcome:
    """Raise or lower the whole path so that its mean height is the value."""
    height, positions = number(work.change, 0.05, 20.0, "m"), lens_positions(work)
    return _moved(work, positions + np.array([0.0, 0.0, height - float(positions[:, 2].mean())]))


def scale_path(work: Work) -> Outcome:
    """Scale the path about its middle pose; times and directions of view stay."""
    factor, positions = number(work.change, 0.0, 10.0), lens_positions(work)
    middle = positions[len(positions) // 2]
    return _moved(work, positions if factor == 1.0 else middle + factor * (positions - middle))


def shift_path(work: Work) -> Outcome:
    """Move every pose to its own right, as the second camera of a stereo rig is."""
    offset = number(work.change, -10.0, 10.0, "m")
    right = np.array([rotation_from_quaternion(pose.orientation)[:, 0] for pose in work.scene.camera_path])
    return _moved(work, lens_positions(work) + offset * right)


def _turned(work: Work, turn: Quaternion) -> Outcome:
    """Return the scene with every pose turned in its own optical frame; no turn changes no bit."""
    if turn[3] == 1.0:
        return Outcome(work.scene)
    poses = tuple(replace(pose, orientation=_unit(multiply_quaternions(pose.orientation, turn))) for pose in work.scene.camera_path)
    motion = work.scene.motion
    if motion is not None:
        motion = replace(motion, camera_turn=_unit(multiply_quaternions(motion.camera_turn, turn)))
    return Outcome(replace(work.scene, camera_path=poses, motion=motion))


def _unit(quaternion: Quaternion) -> Quaternion:
    length = math.hypot(*quaternion)
    x, y, z, w = (value / length for value in quaternion)
    return (x, y, z, w)


def add_pitch(work: Work) -> Outcome:
    """Tilt every view, upwards where positive, about the optical frame's x axis."""
    pitch = math.radians(number(work.change, -89.0, 89.0, "deg"))
    elevations = [math.asin(float(rotation_from_quaternion(pose.orientation)[2, 2])) for pose in work.scene.camera_path]
    low, high = min(elevations) + pitch, max(elevations) + pitch
    if max(high, -low) > _STEEPEST_RAD:
        least, most = (math.degrees(side) for side in (-_STEEPEST_RAD - min(elevations), _STEEPEST_RAD - max(elevations)))
        raise ChangeError(f"{work.change}: value: expected a tilt in [{least:.1f}, {most:.1f}] deg for this path, got {work.change.value}")
    return _turned(work, (math.sin(0.5 * pitch), 0.0, 0.0, math.cos(0.5 * pitch)))


def add_roll(work: Work) -> Outcome:
    """Turn every view clockwise about the optical axis, so that the picture turns the other way."""
    roll = math.radians(number(work.change, -180.0, 180.0, "deg"))
    return _turned(work, (0.0, 0.0, math.sin(0.5 * roll), math.cos(0.5 * roll)))


def drive_faster(work: Work) -> Outcome:
    """Drive along the same path at another speed, with frames at the same rate: fewer frames where it is faster, more where slower.

    Places between the path's poses lie on a cubic spline through them, directions on the shortest arc.
    """
    from scipy.interpolate import CubicSpline  # as long to import as the rest of scipy

    factor, path = number(work.change, 0.05, 20.0), work.scene.camera_path
    count = math.floor((len(path) - 1) / factor + 1e-9) + 1
    if count > MAX_POSES:
        raise ChangeError(f"{work.change}: value: expected at most {MAX_POSES} poses, got {count}; drive faster")
    times = [_stamp(path, k) for k in range(count)]
    spline = CubicSpline(np.arange(len(path)), lens_positions(work)) if len(path) > 1 else None
    poses = []
    for k in range(count):
        along = min(factor * k, len(path) - 1.0)
        before = min(math.floor(along + 1e-9), len(path) - 1)
        share = along - before
        if abs(share) < 1e-9 or spline is None:
            poses.append(replace(path[before], stamp_ns=times[k]))
            continue
        x, y, z = (float(value) for value in spline(along))
        orientation = _between(path[before].orientation, path[before + 1].orientation, share)
        poses.append(CameraPose(stamp_ns=times[k], position_m=(x, y, z), orientation=orientation))
    note = f"{count} frames of the same rate in place of {len(path)}"
    return Outcome(replace(work.scene, camera_path=tuple(poses), motion=None), note=note)


def _stamp(path: tuple[CameraPose, ...], k: int) -> int:
    """Return the time of frame ``k``, beyond the path's end at its mean rate."""
    if k < len(path):
        return path[k].stamp_ns
    return path[0].stamp_ns + round(k * (path[-1].stamp_ns - path[0].stamp_ns) / (len(path) - 1))


def _between(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """Return the rotation at a share of the shortest arc from ``a`` to ``b`` (slerp; Shoemake, SIGGRAPH 1985)."""
    cosine = sum(x * y for x, y in zip(a, b, strict=True))
    angle = math.acos(min(abs(cosine), 1.0))
    if angle < 1e-6:
        weights = (1.0 - share, share)
    else:
        weights = (math.sin((1.0 - share) * angle) / math.sin(angle), math.sin(share * angle) / math.sin(angle))
    sign = math.copysign(1.0, cosine)
    x, y, z, w = (weights[0] * p + sign * weights[1] * q for p, q in zip(a, b, strict=True))
    return _unit((x, y, z, w))


def take_another_path(work: Work) -> Outcome:
    """Sample another walk through the room, by seed, with the same frames at the same times."""
    seed, scene, rules = whole(work.change, 0, 2**31 - 1), work.scene, work.rules()
    path = scene.camera_path
    span = path[-1].stamp_ns - path[0].stamp_ns
    rate_hz = (len(path) - 1) * _SECOND_NS / span if span else 10.0
    boxes, owners = object_solids(categories_of(rules, scene), scene.objects)
    rng, room = random_numbers(scene, work.change, seed), scene.room
    space, times = (
        CameraSpace(room.polygon_m, room.height_m, boxes, roof_boxes(room), find_sights(room, owners, scene.lights)),
        CameraTimes(frames=len(path), start_ns=0, rate_hz=rate_hz),
    )
    sampled = sample_camera_path(rng, rules.camera, space, times)
    poses = tuple(replace(new, stamp_ns=old.stamp_ns) for new, old in zip(sampled, path, strict=True))
    return Outcome(replace(scene, camera_path=poses, motion=None))
