"""Checks of laser scanner and lidar: each ray from where its device is at its own time, against the room's mesh."""

import struct
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from scene_description import SceneSynthError
from scene_synth_ros.messages import streams as roles
from scene_synth_ros.messages.cdr import CdrReader
from scene_synth_ros.messages.streams import LASER, POSE
from scene_synth_ros.prove.decode import CloudRow, PoseRows, ScanRow, cloud_row, scan_row, xyz_of
from scene_synth_ros.prove.evidence import NS, Evidence, Floats, Reel, Room
from scene_synth_ros.prove.verdict import Verdict, at_most, share_off

SAMPLES = 150
"""Rays that are looked at in a scan or sweep."""
_EXACT_M, _EXACT_SHARE = 1e-3, 1e-4
_LOOSE = 2.0
_RUNS, _SWEEPS = 8, 5
"""Sweeps of a room whose points are compared with the true ones: so many in a row, so often; neighbours are decompressed together."""
_STRIDE = 4
"""Of their points, one of so many."""
_FEWEST, _FAR = 100, 10.0


def scan(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether the beams of ``scan_ideal`` end on the mesh, put in place by the poses of the scanner."""
    topic = evidence.first(roles.SCAN_IDEAL)
    pose_topic = next((topic for topic, stream in evidence.streams(POSE).items() if stream.camera == LASER), "")
    poses = room.poses(pose_topic) if pose_topic else None
    if not topic or poses is None or len(poses.stamps) < 2 or room.mesh is None:
        return
    beams = []
    for row in (scan_row(CdrReader(data)) for _, data in room.each(topic)):
        chosen = _some(len(row.ranges), row.stamp_ns)
        at_ns = row.stamp_ns + np.rint(chosen * row.time_increment / NS).astype(np.int64)
        beams.append((at_ns, row.angle_min + chosen * row.angle_increment, row.ranges[chosen], np.full(len(chosen), row.stamp_ns)))
    if beams:
        at_ns, angles, ranges, stamps = (np.concatenate(values) for values in zip(*beams, strict=True))
        origins, turn, known = _between(poses, at_ns)
        rays = np.column_stack([origins, turn.apply(np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles]))])
        yield from _on_mesh("scan", topic, room, rays[known], ranges[known], stamps[known])


def scan_noise(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether ``scan`` errs about ``scan_ideal`` as much as its settings say."""
    topic, ideal = evidence.first(roles.SCAN), evidence.first(roles.SCAN_IDEAL)
    if not topic or not ideal:
        return
    true = {row.stamp_ns: row for row in _scans(room, ideal)}
    pairs = [(row.ranges, true[row.stamp_ns].ranges) for row in _scans(room, topic) if row.stamp_ns in true]
    equal = [(read, known) for read, known in pairs if len(read) == len(known)]
    yield at_most("scan_noise", topic, "scans of another number of beams than the true one", [len(pairs) - len(equal)], 0.0)
    if equal:
        read, known = (np.concatenate(values) for values in zip(*equal, strict=True))
        yield from noise("scan_noise", topic, read, known, room.group("scan"))


def _scans(room: Room, topic: str) -> Iterator[ScanRow]:
    return (scan_row(CdrReader(data)) for _, data in room.each(topic))


def lidar(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether the points of ``lidar/points_ideal`` lie on the mesh, put in place by the body's motion at their own times."""
    topic = evidence.first(roles.LIDAR_IDEAL)
    if not topic or room.curve is None or room.mesh is None:
        return
    rays, ranges, stamps, angles = [], [], [], []
    for sweep in room.digested(topic):
        if isinstance(sweep, Exception):
            raise sweep
        mount, chosen = evidence.mount(sweep.frame), sweep.chosen
        if mount is None or not len(chosen):
            continue
        yield at_most("lidar", topic, "points before their stamp, or not in their order", [sweep.back_s], 1e-9, "s", [sweep.stamp_ns])
        if sweep.off_turn is not None:
            yield at_most("lidar", topic, "azimuth off a steady turn", [sweep.off_turn], 0.5, "deg", [sweep.stamp_ns])
        place, turn = mount.on(*room.curve.at(sweep.stamp_ns, chosen["time"].astype(np.float64)))
        xyz = xyz_of(chosen)
        far = np.maximum(np.linalg.norm(xyz, axis=1), 1e-9)
        rays.append(np.column_stack([place, turn.apply(xyz / far[:, None])]))
        ranges.append(far)
        stamps.append(np.full(len(far), sweep.stamp_ns))
        if "ring" in (chosen.dtype.names or ()):
            angles.append(np.column_stack([chosen["ring"], np.degrees(np.arcsin(xyz[:, 2] / far))]))
    if rays:
        yield from _on_mesh("lidar", topic, room, np.concatenate(rays), np.concatenate(ranges), np.concatenate(stamps))
    if angles:
        ring, elevation = np.concatenate(angles).T
        spread = [np.ptp(elevation[ring == number]) for number in np.unique(ring)]
        yield at_most("lidar", topic, "spread of elevations of a ring", spread, 0.05, "deg")


class Sweep(NamedTuple):
    """What is looked at of a cloud of true points.

    Attributes:
        stamp_ns, frame: as its header has them.
        chosen: some of its points.
        back_s: how far a point's time lies before that of the one ahead of it, or before the stamp; the most of them.
        off_turn: greatest angle (deg) between its beams and beams that turn steadily; None where they do not turn.
    """

    stamp_ns: int
    frame: str
    chosen: NDArray[Any]
    back_s: float
    off_turn: float | None


def read_sweep(data: memoryview) -> Sweep | Exception:
    """Return what is looked at of a PointCloud2, or why it cannot be read."""
    try:
        return _sweep(cloud_row(CdrReader(data)))
    except (ValueError, LookupError, TypeError, ArithmeticError, SceneSynthError, struct.error) as error:
        return error


def _sweep(cloud: CloudRow) -> Sweep:
    points = cloud.points.ravel()
    times, off = points["time"].astype(np.float64), None
    back_s = float(-np.diff(times, prepend=0.0).min(initial=0.0))
    if len(points) and "ring" in (points.dtype.names or ()):
        ring = np.flatnonzero(points["ring"] == points["ring"][0])
        azimuth = np.arctan2(points["y"][ring].astype(np.float64), points["x"][ring])
        if len(ring) > _FEWEST and np.ptp(np.unwrap(azimuth)) > 1.0:
            off = float(np.degrees(_off_turn(azimuth, times[ring]).max()))
    return Sweep(cloud.stamp_ns, cloud.frame, points[_some(len(points), cloud.stamp_ns)].copy(), back_s, off)


def _off_turn(azimuth: Floats, times: Floats) -> Floats:
    """Return by how much azimuths (n,) differ from those of a steady turn; gaps may be of any length."""
    step = np.diff(times)
    if not (step > 0.0).any():
        return np.full(len(azimuth), np.pi)
    rate = float(np.median(_wrapped(np.diff(azimuth)[step > 0.0]) / step[step > 0.0]))
    rest = azimuth - rate * (times - times[0])
    rest = _wrapped(rest - np.angle(np.exp(1j * rest).mean()))
    rest, about = rest - rest.mean(), times - times.mean()
    return np.asarray(np.abs(rest - about * (about @ rest) / (about @ about)))  # about the line of least squares


def _wrapped(angle: Floats) -> Floats:
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def lidar_noise(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether ``lidar/points`` err about ``lidar/points_ideal`` as much as their settings say."""
    topic, ideal = evidence.first(roles.LIDAR_POINTS), evidence.first(roles.LIDAR_IDEAL)
    if not topic or not ideal:
        return
    read, known = [np.zeros(0)], [np.zeros(0)]
    alone = aside = 0
    logged = room.heads(topic)[0].tolist()
    firsts = np.linspace(0, max(len(logged) - _SWEEPS, 0), _RUNS).astype(int).tolist()
    chosen = {log_ns for first in firsts for log_ns in logged[first : first + _SWEEPS]}
    true = Reel(room.each(ideal, chosen))
    for cloud in (cloud_row(CdrReader(data)) for _, data in room.each(topic, chosen)):
        beside = true.at(cloud.stamp_ns)
        if beside is None:
            alone += 1
            continue
        points, exact = cloud.points.ravel(), cloud_row(CdrReader(beside)).points.ravel()
        if "return" in (points.dtype.names or ()):
            points = points[points["return"] == 1]
        mine, its = _same_rays(points := points[::_STRIDE], exact)
        one, other = xyz_of(points[mine]), xyz_of(exact[its])
        lengths = np.linalg.norm(one, axis=1), np.linalg.norm(other, axis=1)
        aside += int((np.linalg.norm(np.cross(one, other), axis=1) > 1e-4 * lengths[0] * lengths[1]).sum())
        read.append(lengths[0])
        known.append(lengths[1])
    yield at_most("lidar_noise", topic, "sweeps without a true one", [alone], 0.0)
    yield at_most("lidar_noise", topic, "points that lie in another direction than the true ones", [aside], 0.0)
    yield from noise("lidar_noise", topic, np.concatenate(read), np.concatenate(known), room.group("lidar"))


def _same_rays(points: NDArray[Any], exact: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the places of rays that are in both clouds, in the one and in the other."""
    mine, its = _ray_numbers(points), _ray_numbers(exact)
    order = np.arange(len(its)) if (np.diff(its) >= 0).all() else np.argsort(its, kind="stable")
    place = order[np.minimum(np.searchsorted(its, mine, sorter=order), len(its) - 1)] if len(its) else np.zeros(len(mine), np.int64)
    found = np.flatnonzero(its[place] == mine) if len(its) else np.zeros(0, np.int64)
    return found, place[found]


def _ray_numbers(points: NDArray[Any]) -> NDArray[np.int64]:
    """Return a number for each ray, by its time in nanoseconds and its ring."""
    line = "ring" if "ring" in (points.dtype.names or ()) else "line"
    return np.asarray(np.rint(points["time"].astype(np.float64) / NS).astype(np.int64) * 1024 + points[line])


def _some(count: int, stamp_ns: int) -> NDArray[np.int64]:
    """Return up to ``SAMPLES`` of so many, ascending."""
    chosen = np.random.default_rng(stamp_ns % 2**32).choice(count, min(count, SAMPLES), replace=False)
    return np.sort(chosen)


def _between(poses: PoseRows, at_ns: NDArray[np.int64]) -> tuple[Floats, Rotation, NDArray[np.bool_]]:
    """Return where a frame is at times (n,) between its poses, and which lie between them; evenly from each to the next."""
    known = (at_ns >= poses.stamps[0]) & (at_ns <= poses.stamps[-1])
    times, at = (
        (poses.stamps - poses.stamps[0]) * NS,
        np.clip((at_ns - poses.stamps[0]) * NS, 0.0, (poses.stamps[-1] - poses.stamps[0]) * NS),
    )
    place = np.column_stack([np.interp(at, times, values) for values in poses.place.T])
    return place, Slerp(times, Rotation.from_quat(poses.quaternion))(at), known


def _on_mesh(check: str, topic: str, room: Room, rays: Floats, ranges: Floats, stamps: NDArray[np.int64]) -> Iterator[Verdict]:
    assert room.mesh is not None
    hits = room.mesh.cast(rays[:, :3], rays[:, 3:])
    seen = np.isfinite(ranges) & np.isfinite(hits.distance)
    off = np.abs(ranges - hits.distance)[seen] > _EXACT_M + _EXACT_SHARE * ranges[seen]
    yield from share_off(check, topic, "rays that end more than 1 mm off the exported mesh", off, stamps[seen])
    nothing = [np.isinf(hits.distance[np.isfinite(ranges)]).mean()] if np.isfinite(ranges).any() else []
    yield at_most(check, topic, "share of rays that end where nothing is", nothing, 0.01)


def noise(check: str, topic: str, read: Floats, true: Floats, said: Mapping[str, Any]) -> Iterator[Verdict]:
    """Yield whether the middle of the errors is that of the noise that settings say, without what glass, mirrors and edges do.

    Those are errors of more than ``_FAR`` times what is said, unless most are so.
    """
    both = np.isfinite(read) & np.isfinite(true)
    if both.sum() < _FEWEST or "noise_m" not in said:
        return
    step = float(said.get("resolution_m", 0.0))
    sigma = np.sqrt(said["noise_m"] ** 2 + (said.get("noise_share", 0.0) * true[both]) ** 2 + step**2 / 12.0 + 1e-12)
    errors = np.abs(read[both] - true[both]) / sigma
    near = errors < _FAR
    ratio = float(np.median(errors[near] if near.mean() > 0.5 else errors)) / 0.6745
    yield at_most(check, topic, "typical error over what the settings say", [ratio], 1.4)
    if float(said["noise_m"]) > 0.0:
        yield at_most(check, topic, "what the settings say over the typical error", [1.0 / max(ratio, 1e-9)], _LOOSE)
