"""Checks of inertial measurement units and of the body's own motion."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.spatial.transform import Rotation

from scene_synth_ros.messages import streams as roles
from scene_synth_ros.prove.decode import ImuRows, cut, imu_rows
from scene_synth_ros.prove.evidence import NS, Evidence, Floats, Room
from scene_synth_ros.prove.verdict import Verdict, at_most

GRAVITY_M_S2 = 9.80665
_WINDOW_S = 1.0
_FEWEST = 40
_RATIO = 1.5


def motion(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether the velocities of ``odom/ideal`` are the derivatives of its poses."""
    body = room.body
    if body is None or len(body.stamps) < _FEWEST:
        return
    topic, times, inside = evidence.first(roles.ODOM_IDEAL), (body.stamps - body.stamps[0]) * NS, slice(3, -3)
    turn = Rotation.from_quat(body.quaternion)
    velocity = turn.inv().apply(CubicSpline(times, body.place)(times, 1)) - body.velocity
    spin = _spin(times, body.quaternion) - body.spin
    for off, detail, limit, unit in ((velocity, "velocity", 0.02, "m/s"), (spin, "angular velocity", 0.05, "rad/s")):
        sizes = np.linalg.norm(off, axis=1)[inside]
        yield at_most("motion", topic, f"{detail} that is not the derivative of the poses", sizes, limit, unit, body.stamps[inside])


def imu(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether ``imu/ideal`` integrates to the poses of the body, at the place where the device is fixed to it."""
    topic = evidence.first(roles.IMU_IDEAL)
    rows: ImuRows | None = room.table(topic, imu_rows, ImuRows)
    mount = None if rows is None else evidence.mount(str(rows.frames[0]))
    if rows is None or mount is None or room.curve is None or len(rows.stamps) < _FEWEST or (np.diff(rows.stamps) <= 0).any():
        return
    rows = cut(rows, room.curve.covers(rows.stamps))
    times = (rows.stamps - rows.stamps[0]) * NS
    place, turn = mount.on(*room.curve.at(int(rows.stamps[0]), times))
    away = np.degrees((turn.inv() * Rotation.from_quat(rows.quaternion)).magnitude())
    yield at_most("imu", topic, "orientation off that of the body", away, 0.05, "deg", rows.stamps)
    mean = room.group("imu").get("samples") == "mean"
    at = times - 0.5 * float(np.median(np.diff(times))) if mean else times  # the middle of the interval that they are means of
    turned, moved = _integrate(at, times, turn, place, rows)
    loose = 20.0 if mean else 1.0
    yield at_most("imu", topic, "rotation of a second, integrated, off that of the body", turned[0], 0.05 * loose, "deg", turned[1])
    yield at_most("imu", topic, "way of a second, integrated, off that of the body", moved[0], 0.002 * loose, "m", moved[1])


_Found = tuple[list[float], list[int]]


def _integrate(at: Floats, times: Floats, turn: Rotation, place: Floats, rows: ImuRows) -> tuple[_Found, _Found]:
    """Return by how much each second of integration is off, with its stamp: degrees, and metres once velocity is fitted.

    ``at``: when the readings are of; ``times``: when poses are.  Rotations by Magnus's series to fourth order (S. Blanes et al., "The
    Magnus expansion and some of its applications", Physics Reports 470, 2009), places by the antiderivatives of splines.
    """
    rate, step = make_interp_spline(at, rows.rate, 5), np.diff(times)[:, None]
    a, b = (rate(np.clip(times[:-1] + share * step[:, 0], at[0], at[-1])) for share in (0.5 - np.sqrt(3) / 6, 0.5 + np.sqrt(3) / 6))
    steps = Rotation.from_rotvec(0.5 * step * (a + b) - np.sqrt(3) / 12 * step * step * np.cross(b, a))
    force = make_interp_spline(at, rows.force, 5)(np.clip(times, at[0], at[-1]))
    twice = make_interp_spline(times, turn.apply(force) - (0.0, 0.0, GRAVITY_M_S2), 5).antiderivative(2)(times)
    size = max(int(_WINDOW_S / float(np.median(step))), 8)
    turned: _Found = ([], [])
    moved: _Found = ([], [])
    for first in range(0, len(times) - size, size):
        part = slice(first, first + size + 1)
        gone = _product(steps[first : first + size])
        turned[0].append(float(np.degrees((gone.inv() * (turn[first].inv() * turn[first + size])).magnitude())))
        line = np.column_stack([np.ones(size + 1), times[part]])
        off = place[part] - twice[part]
        off = off - line @ np.linalg.lstsq(line, off, rcond=None)[0]
        moved[0].append(float(np.linalg.norm(off, axis=1).max()))
        for found in (turned, moved):
            found[1].append(int(rows.stamps[first]))
    return turned, moved


def _product(turns: Rotation) -> Rotation:
    """Return the product of rotations, in their order: neighbours are joined until one is left."""
    while len(turns) > 1:
        even = len(turns) // 2 * 2
        joined = turns[0:even:2] * turns[1:even:2]
        turns = joined if even == len(turns) else Rotation.concatenate([joined, turns[even:]])
    return turns[0]


def imu_noise(evidence: Evidence, room: Room) -> Iterator[Verdict]:
    """Yield whether ``imu/data`` follows ``imu/ideal``, with the white noise that its covariances say."""
    topic = evidence.first(roles.IMU_DATA)
    data, ideal = (room.table(role, imu_rows, ImuRows) for role in (roles.IMU_DATA, roles.IMU_IDEAL))
    if data is None or ideal is None or len(data.stamps) < _FEWEST:
        return
    told = data.stamps - round(float(room.group("imu").get("clock_offset_s", 0.0)) / NS)
    _, mine, its = np.intersect1d(told, ideal.stamps, return_indices=True)
    yield at_most("imu_noise", topic, "share of readings without a true one", [1.0 - len(mine) / len(told)], 0.05)
    if len(mine) < _FEWEST:
        return
    for name, unit, most in (("rate", "rad/s", 0.3), ("force", "m/s2", 3.0)):
        read, true = getattr(data, name)[mine], getattr(ideal, name)[its]
        variance = getattr(data, f"{name}_covariance")[mine][:, [0, 4, 8]]
        error = read - true
        yield at_most("imu_noise", topic, f"mean error of {name}", np.abs(error.mean(axis=0)), most, unit)
        yield at_most("imu_noise", topic, f"error of the gain of {name}", _gains(read, true, variance), 0.1)
        second = error[2:] - 2.0 * error[1:-1] + error[:-2]
        ratio = np.sqrt((second**2).mean(axis=0) / 6.0 / np.maximum(variance.mean(axis=0), 1e-18))
        off = np.where(variance.mean(axis=0) > 1e-11, np.maximum(ratio, 1.0 / np.maximum(ratio, 1e-9)), 1.0)
        yield at_most("imu_noise", topic, f"noise of {name} over what its covariance says, or under", off, _RATIO)


def _gains(read: Floats, true: Floats, variance: Floats) -> Floats:
    """Return by how much readings, as a line of what is true, differ from it, of the axes that move enough to tell."""
    about = true - true.mean(axis=0)
    moves = about.std(axis=0) > 10.0 * np.sqrt(variance.mean(axis=0) / len(true)) + 0.02
    slope = (about * read).sum(axis=0) / np.maximum((about**2).sum(axis=0), 1e-18)
    return np.asarray(np.abs(slope - 1.0)[moves])


def _spin(times: Floats, quaternion: NDArray[np.float64]) -> Floats:
    """Return the angular velocity (n, 3) in the body of orientations (n, 4), by the derivative of a spline through them."""
    side = np.cumprod(np.concatenate([[1.0], np.where((quaternion[1:] * quaternion[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)]))
    curve = CubicSpline(times, quaternion * side[:, None])
    q, p = curve(times), curve(times, 1)
    vector, dot = q[:, :3], p[:, :3]
    return np.asarray(2.0 * (q[:, 3:] * dot - p[:, 3:] * vector - np.cross(vector, dot)) / (q**2).sum(axis=1, keepdims=True))
