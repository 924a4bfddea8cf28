"""Pose, velocity and acceleration of a body at any time of its motion, by the derivatives of its curves: no differences.

Sines and cosines are those of the C library, one by one, because numpy chooses its own by processor; nothing here calls BLAS.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_description.motion import DEGREE, Drive, Harmonic, Motion
from scene_description.strict import FieldError

Floats = NDArray[np.float64]

_BASIS = (
    np.array(
        [
            [1, -5, 10, -10, 5, -1],
            [26, -50, 20, 20, -20, 5],
            [66, 0, -60, 0, 30, -10],
            [26, 50, 20, -20, -20, 10],
            [1, 5, 10, 10, 5, -5],
            [0, 0, 0, 0, 0, 1],
        ],
        np.float64,
    )
    / 120.0
)
"""Row j: coefficients of 1, u, ... u^5 of the uniform B-spline that belongs to control point i + j, u in [0, 1] of segment i."""
_ROUNDING = 1e-6
"""Share of the time between knots by which a time may lie beyond a curve's end and still be its end."""
GAUSS = {
    5: ((0.0, 0.5688888888888889), (0.5384693101056831, 0.47862867049936647), (0.906179845938664, 0.23692688505618908)),
    8: (
        (0.1834346424956498, 0.362683783378362),
        (0.525532409916329, 0.31370664587788727),
        (0.7966664774136267, 0.22238103445337448),
        (0.9602898564975363, 0.10122853629037626),
    ),
}
"""Nodes in [-1, 1], those that are not negative, and weights of Gauss-Legendre quadrature (M. Abramowitz and I. A. Stegun, "Handbook of
Mathematical Functions", 1964, table 25.4).  Numpy finds them by eigenvalues, whose last digits depend on the processor."""


class Kinematics(NamedTuple):
    """How a body, or what is fixed to it, moves at n times; float64.

    Attributes:
        position_m: (n, 3) in the world.
        quaternion: (n, 4) unit, x, y, z, w: takes the body to the world.
        velocity_m_s: (n, 3) in the world.
        acceleration_m_s2: (n, 3) in the world.
        rate_rad_s: (n, 3) angular velocity, in the body.
        rate_change_rad_s2: (n, 3) its derivative, in the body.
    """

    position_m: Floats
    quaternion: Floats
    velocity_m_s: Floats
    acceleration_m_s2: Floats
    rate_rad_s: Floats
    rate_change_rad_s2: Floats


def kinematics(motion: Motion, times_s: ArrayLike) -> Kinematics:
    """Return how a body moves at times (n,) since its motion began; before and after that it rests."""
    times = np.asarray(times_s, np.float64)
    if motion.drive is not None:
        smooth = _driven(motion.drive, motion.spacing_s, times)
    else:
        place = _curve(np.array(motion.positions_m), motion.spacing_s, times)
        turn = _curve(np.array(motion.turns), motion.spacing_s, times)
        smooth = Kinematics(place[0], *_rotation(turn)[:1], place[1], place[2], *_rotation(turn)[1:])
    return _shaken(motion, smooth, times) if motion.tremor else smooth


def gauss_nodes(count: int) -> tuple[tuple[float, float], ...]:
    """Return nodes in [-1, 1] and weights of Gauss-Legendre quadrature with 5 or 8 nodes, in ascending order."""
    half = GAUSS[count]
    return (*((-node, weight) for node, weight in half[::-1] if node), *half)


def camera_kinematics(motion: Motion, times_s: ArrayLike) -> Kinematics:
    """Return how the camera path's frame, optical, moves."""
    return mounted_kinematics(kinematics(motion, times_s), motion.camera_m, motion.camera_turn)


def driven_way(drive: Drive, spacing_s: float, times_s: ArrayLike) -> tuple[Floats, Floats]:
    """Return distance gone (m) and heading (rad) of a base, (n, 2), and their rates."""
    value, rate, _ = _curve(_controls(drive), spacing_s, np.asarray(times_s, np.float64), drive.first_knot or 0)
    return value, rate


@lru_cache(maxsize=4)
def knot_places(drive: Drive) -> Floats:
    """Return where a base is at the knots of its drive, (segments + 1, 2), world; those of a part of a drive are those of the whole.

    They are remembered, as a lidar asks for its way in each sweep, and may not be written.
    """
    controls, begin, count = _controls(drive), drive.first_knot or 0, len(drive.distances_m) - DEGREE
    ways = _travelled(controls, begin, begin + np.arange(count), np.ones(count))
    return _read_only(np.cumsum(np.concatenate([[drive.start_m], ways]), axis=0))


def mounted_kinematics(body: Kinematics, position_m: Sequence[float], quaternion: Sequence[float]) -> Kinematics:
    """Return how a frame moves that is fixed to a body at a place (m), and turned by a quaternion that takes the frame to the body.

    Points of a rigid body: v + w x r, a + dw/dt x r + w x (w x r).
    """
    lever, turn = np.array(position_m, np.float64)[None, :], np.array(quaternion, np.float64)[None, :]
    swing = cross(body.rate_rad_s, lever)
    whirl = cross(body.rate_change_rad_s2, lever) + cross(body.rate_rad_s, swing)
    back = conjugate(turn)
    return Kinematics(
        body.position_m + rotate(body.quaternion, lever),
        multiply(body.quaternion, turn),
        body.velocity_m_s + rotate(body.quaternion, swing),
        body.acceleration_m_s2 + rotate(body.quaternion, whirl),
        rotate(back, body.rate_rad_s),
        rotate(back, body.rate_change_rad_s2),
    )


def check_motion(motion: Motion, path: str = "motion") -> None:
    """Check that the parts of a motion agree.

    Raises:
        FieldError: curves of unequal length, both kinds of curves or none, or an orientation that passes through zero.
    """
    if motion.drive is not None:
        if motion.positions_m or motion.turns:
            raise FieldError(f"{path}.positions_m", "none beside a drive", f"{len(motion.positions_m)}")
        counts = len(motion.drive.distances_m), len(motion.drive.headings_rad)
        where = f"{path}.drive.headings_rad"
    else:
        counts = len(motion.positions_m), len(motion.turns)
        where = f"{path}.turns"
        if counts[0] <= DEGREE:
            raise FieldError(f"{path}.positions_m", f"{DEGREE + 1} control points or more, or a drive", f"{counts[0]}")
    if counts[0] != counts[1]:
        raise FieldError(where, f"{counts[0]} control points", f"{counts[1]}")
    turns = np.array(motion.turns).reshape(-1, 4)
    for i, product in enumerate((turns[1:] * turns[:-1]).sum(axis=1).tolist()):
        if not product > 0.25:
            raise FieldError(f"{path}.turns[{i + 1}]", "a quaternion near the one before", f"a product of {product:.3g}")
    if abs(math.hypot(*motion.camera_turn) - 1.0) > 1e-4:
        raise FieldError(f"{path}.camera_turn", "a unit quaternion", f"length {math.hypot(*motion.camera_turn):.6g}")


def cross(a: Floats, b: Floats) -> Floats:
    """Return cross products of (n, 3)."""
    ax, ay, az, bx, by, bz = *np.moveaxis(a, -1, 0), *np.moveaxis(b, -1, 0)
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def multiply(a: Floats, b: Floats) -> Floats:
    """Return quaternion products of (n, 4), x, y, z, w."""
    ax, ay, az, aw, bx, by, bz, bw = *np.moveaxis(a, -1, 0), *np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def conjugate(quaternion: Floats) -> Floats:
    """Return the inverse rotations of unit quaternions (n, 4)."""
    return np.asarray(quaternion * np.array([-1.0, -1.0, -1.0, 1.0]))


def rotate(quaternion: Floats, vector: Floats) -> Floats:
    """Return vectors (n, 3) turned by unit quaternions (n, 4)."""
    axis, w = quaternion[..., :3], quaternion[..., 3:]
    twice = 2.0 * cross(axis, vector)
    return vector + w * twice + cross(axis, twice)


def sines(angles: Floats) -> tuple[Floats, Floats]:
    """Return sine and cosine."""
    flat = angles.ravel().tolist()
    shape = angles.shape
    return np.array([math.sin(x) for x in flat]).reshape(shape), np.array([math.cos(x) for x in flat]).reshape(shape)


def _curve(controls: Floats, spacing_s: float, times: Floats, first_knot: int = 0) -> tuple[Floats, Floats, Floats]:
    """Return value, first and second derivative of curves, controls (c, k), at times (n,): (n, k) each."""
    last = first_knot + len(controls) - DEGREE
    along = np.clip(times / spacing_s, first_knot, last)
    segment = np.minimum(along.astype(np.int64), last - 1)
    u = along - segment
    rests = np.abs(times / spacing_s - along) > _ROUNDING
    found = []
    basis = _BASIS
    for order in range(3):
        value = np.zeros((len(times), controls.shape[1]))
        for j in range(DEGREE + 1):
            weight = np.zeros(len(times))
            for coefficient in basis[j, ::-1].tolist():
                weight = weight * u + coefficient
            value = value + weight[:, None] * controls[segment - first_knot + j]
        if order:
            value = np.where(rests[:, None], 0.0, value / math.pow(spacing_s, order))
        found.append(value)
        basis = basis[:, 1:] * np.arange(1, basis.shape[1])
    return found[0], found[1], found[2]


def _rotation(curve: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    """Return the unit quaternion, angular velocity and its derivative in the body of a curve p of quaternions of any length.

    With q = p / |p|: w = 2 vec(p* p') / p.p, as the change of length adds to the scalar part only.
    """
    p, p1, p2 = curve
    square = (p * p).sum(axis=1, keepdims=True)
    first, second = multiply(conjugate(p), p1)[:, :3], multiply(conjugate(p), p2)[:, :3]
    rate = 2.0 * first / square
    change = 2.0 * second / square - rate * (2.0 * (p * p1).sum(axis=1, keepdims=True) / square)
    return p / np.sqrt(square), rate, change


def _driven(drive: Drive, spacing_s: float, times: Floats) -> Kinematics:
    """Return the kinematics of a base: its place is the integral of speed along its heading."""
    controls, begin = _controls(drive), drive.first_knot or 0
    (value, first, second), zero = _curve(controls, spacing_s, times, begin), np.zeros(len(times))
    end = begin + len(controls) - DEGREE
    along = np.clip(times / spacing_s, begin, end)
    segment = np.minimum(along.astype(np.int64), end - 1)
    place = knot_places(drive)[segment - begin] + _travelled(controls, begin, segment, along - segment)
    sine, cosine = sines(value[:, 1])
    half_sine, half_cosine = sines(0.5 * value[:, 1])
    speed, turning, gain = first[:, 0], first[:, 1], second[:, 0]
    return Kinematics(
        np.column_stack([place, zero]),
        np.column_stack([zero, zero, half_sine, half_cosine]),
        np.column_stack([speed * cosine, speed * sine, zero]),
        np.column_stack([gain * cosine - speed * turning * sine, gain * sine + speed * turning * cosine, zero]),
        np.column_stack([zero, zero, turning]),
        np.column_stack([zero, zero, second[:, 1]]),
    )


@lru_cache(maxsize=4)
def _controls(drive: Drive) -> Floats:
    return _read_only(np.column_stack([drive.distances_m, drive.headings_rad]))


def _read_only(values: Floats) -> Floats:
    values.setflags(write=False)
    return values


def _travelled(controls: Floats, begin: int, segment: NDArray[np.int64], share: Floats) -> Floats:
    """Return the way (n, 2) from the beginning of segments to a share of them, by Gauss-Legendre quadrature with eight nodes."""
    way = np.zeros((len(segment), 2))
    for node, weight in gauss_nodes(8):
        value, first, _ = _curve(controls, 1.0, segment + share * (0.5 + 0.5 * node), begin)
        sine, cosine = sines(value[:, 1])
        way = way + (0.5 * weight * share * first[:, 0])[:, None] * np.column_stack([cosine, sine])
    return way


def _shaken(motion: Motion, smooth: Kinematics, times: Floats) -> Kinematics:
    """Return kinematics with the tremor on top: places move along world axes, orientations turn about the body's."""
    ramp = _ramp(motion, times)
    shift, turn = ([np.zeros((len(times), 3)) for _ in range(3)] for _ in range(2))
    for harmonic in motion.tremor:
        for total, part in zip((shift, turn), _vibration(harmonic, times), strict=True):
            for order, value in enumerate(_product(ramp, part)):
                total[order] += value
    one = np.ones((len(times), 1))
    quaternion, rate, change = _rotation(
        (np.hstack([turn[0], one]), np.hstack([turn[1], 0.0 * one]), np.hstack([turn[2], 0.0 * one])),
    )
    # R = A B: w = B^T w_A + w_B, and its derivative
    back = conjugate(quaternion)
    carried = rotate(back, smooth.rate_rad_s)
    return Kinematics(
        smooth.position_m + shift[0],
        multiply(smooth.quaternion, quaternion),
        smooth.velocity_m_s + shift[1],
        smooth.acceleration_m_s2 + shift[2],
        carried + rate,
        rotate(back, smooth.rate_change_rad_s2) - cross(rate, carried) + change,
    )


_Three = tuple[Floats, Floats, Floats]
"""A function of time and its first two derivatives, (n, 1) or (n, 3) each."""


def _ramp(motion: Motion, times: Floats) -> _Three:
    """Return how strong the tremor is: 0, then a rise with three continuous derivatives, then 1."""
    x = np.clip((times - motion.tremor_from_s) / motion.tremor_ramp_s, 0.0, 1.0)[:, None]
    rise = x * x * x * x * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)))
    inside = x * (1.0 - x)
    slope = 140.0 * inside * inside * inside / motion.tremor_ramp_s
    bend = 420.0 * inside * inside * (1.0 - 2.0 * x) / motion.tremor_ramp_s**2
    return rise, slope, bend


def _vibration(harmonic: Harmonic, times: Floats) -> tuple[_Three, _Three]:
    """Return shift and turn of one line of the spectrum."""
    omega = 2.0 * math.pi * harmonic.frequency_hz

    def one(amplitudes: Sequence[float], phases: Sequence[float]) -> _Three:
        sine, cosine = sines(omega * times[:, None] + np.array(phases)[None, :])
        size = np.array(amplitudes)[None, :]
        return size * sine, size * omega * cosine, -size * omega * omega * sine

    return one(harmonic.shift_m, harmonic.shift_phase_rad), one(harmonic.turn, harmonic.turn_phase_rad)


def _product(a: _Three, b: _Three) -> _Three:
    """Return a product with its derivatives, by Leibniz's rule."""
    return a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]
