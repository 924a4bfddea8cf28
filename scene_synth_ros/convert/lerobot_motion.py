"""Episodes for LeRobot: unbroken runs of a camera's path at an even rate, and the motion from frame to frame as action."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scene_synth_ros.convert.errors import ConvertError

_TOLERANCE = 1e-4
"""Of a rate, relative: stamps are whole nanoseconds."""


def whole_rate(stamps: Sequence[Sequence[int]]) -> int:
    """Return the frames a second at which most frames of some sequences follow each other; 1 where none follows another.

    Args:
        stamps: of each sequence, ns, ascending.

    Raises:
        ConvertError: it is no whole number.
    """
    periods = Counter(after - before for sequence in stamps for before, after in pairwise(sequence))
    if not periods:
        return 1
    most = max(periods.values())
    period = min(period for period, count in periods.items() if count == most)
    rate = 1e9 / period
    if round(rate) < 1 or abs(round(rate) - rate) > _TOLERANCE * rate:
        raise ConvertError(
            f"lerobot: expected a whole number of frames a second, got {rate:g}; take every N-th frame (--every N), "
            "or record at another rate (grammar_node.rate_hz)"
        )
    return round(rate)


def runs(stamps: Sequence[int], fps: int) -> list[slice]:
    """Return the runs of a sequence's frames in which each follows the one before at the rate, to a tenth of the period."""
    period = 1e9 / fps
    breaks = [n for n, (before, after) in enumerate(pairwise(stamps), 1) if abs(after - before - period) > 0.1 * period]
    return [slice(first, end) for first, end in pairwise([0, *breaks, len(stamps)])]


def camera_twists(world_from_optical: NDArray[np.float64], fps: int) -> NDArray[np.float64]:
    """Return the constant velocities that take each pose to the next: linear (m/s), then angular (rad/s), both in the optical frame.

    The angular velocity is the rotation vector of ``R_k^T R_{k+1}`` over the period; the linear one is the way between the places over the
    period, seen from frame k.  The last frame has zeros.

    Args:
        world_from_optical: (frames, 4, 4).
        fps: frames a second.
    """
    twists = np.zeros((len(world_from_optical), 6))
    rotations, places = world_from_optical[:, :3, :3], world_from_optical[:, :3, 3]
    twists[:-1, :3] = np.einsum("kji,kj->ki", rotations[:-1], np.diff(places, axis=0)) * fps
    for number, (before, after) in enumerate(pairwise(rotations)):
        twists[number, 3:] = rotation_vector(before.T @ after) * fps
    return twists


def rotation_vector(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return axis times angle (rad) of a rotation matrix (3, 3) that turns by less than half a turn."""
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    sine, cosine = float(np.linalg.norm(axis)) / 2.0, (float(np.trace(rotation)) - 1.0) / 2.0
    angle = float(np.arctan2(sine, cosine))
    return axis / 2.0 * (angle / sine if sine > 1e-12 else 1.0)
