"""Camera poses of a whole room: absolute and relative errors of a trajectory, as in Sturm et al. (IROS 2012).

Poses are compared at equal stamps.  ATE is the RMSE of the positions after the rigid motion that takes the estimate to the truth best by
least squares (Umeyama, PAMI 1991, without scale).  RPE is the RMSE of the error of the motion from each pose to the next that both have,
its translation in m and its rotation in degrees; no alignment changes it.  Coverage is the share of true poses with an estimate.

Over several rooms the squares of all poses are averaged.  Two poses or fewer have no ATE: they can always be aligned.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evaluation.core.errors import EvaluationError
from evaluation.core.sums import Sums, sums_tallying
from evaluation.core.task import Measurement, Metric, Task, Truth
from scene_description import CameraPose
from scene_description.poses import rotation_from_quaternion

_STURM = "Sturm et al., IROS 2012"
METRICS = (
    Metric(name="ate_rmse", unit="m", source=_STURM),
    Metric(name="rpe_translation", unit="m", source=_STURM),
    Metric(name="rpe_rotation", unit="deg", source=_STURM),
    Metric(name="coverage", better="higher"),
)
_FEWEST_POSES = 3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory:
    """Poses of the camera's optical frame in a world.

    Attributes:
        stamps_ns: (n,) int64, rising.
        positions_m: (n, 3) float64.
        orientations: (n, 4) float64 quaternions x, y, z, w of any length above 0.
    """

    stamps_ns: NDArray[np.int64]
    positions_m: NDArray[np.float64]
    orientations: NDArray[np.float64]


def trajectory_of(poses: Iterable[CameraPose]) -> Trajectory:
    """Return poses as a trajectory, by ascending stamps."""
    ordered = sorted(poses, key=lambda pose: pose.stamp_ns)
    return Trajectory(
        stamps_ns=np.array([pose.stamp_ns for pose in ordered], np.int64),
        positions_m=np.array([pose.position_m for pose in ordered], np.float64).reshape(-1, 3),
        orientations=np.array([pose.orientation for pose in ordered], np.float64).reshape(-1, 4),
    )


def _poses(given: object, whose: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return (n,) stamps and (n, 4, 4) world from camera."""
    if not isinstance(given, Trajectory):
        raise EvaluationError(f"{whose} of poses: expected a Trajectory, got {type(given).__name__}")
    stamps = np.asarray(given.stamps_ns, np.int64)
    positions, orientations = np.asarray(given.positions_m, np.float64), np.asarray(given.orientations, np.float64)
    count = len(stamps)
    if positions.shape != (count, 3) or orientations.shape != (count, 4):
        got = f"{positions.shape} and {orientations.shape}"
        raise EvaluationError(f"{whose} of poses: expected positions ({count}, 3) and orientations ({count}, 4), got {got}")
    if (np.diff(stamps) <= 0).any():
        i = int(np.flatnonzero(np.diff(stamps) <= 0)[0])
        raise EvaluationError(f"{whose} of poses: expected rising stamps, got {stamps[i + 1]} after {stamps[i]} ns; sort them, each once")
    lengths = np.linalg.norm(orientations, axis=1)
    if not (np.isfinite(positions).all() and np.isfinite(lengths).all() and (lengths > 0).all()):
        raise EvaluationError(f"{whose} of poses: expected finite positions and quaternions that are not zero, got others")
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, 3] = positions
    for pose, (x, y, z, w) in zip(poses, orientations / lengths[:, None], strict=True):
        pose[:3, :3] = rotation_from_quaternion((x, y, z, w))
    return stamps, poses


def best_rigid_motion(source_m: NDArray[np.float64], target_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the 4x4 rigid motion that takes (n, 3) points to (n, 3) others best by least squares (Umeyama, PAMI 1991, c = 1).

    Points on a line leave a turn about it free; any of these is returned, and all leave the same errors.
    """
    source_mean, target_mean = source_m.mean(axis=0), target_m.mean(axis=0)
    u, _, v = np.linalg.svd((target_m - target_mean).T @ (source_m - source_mean))
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(v))])
    motion = np.eye(4)
    motion[:3, :3] = u @ mirror @ v
    motion[:3, 3] = target_mean - motion[:3, :3] @ source_mean
    return motion


def step_errors(true: NDArray[np.float64], found: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far each motion from a pose to the next is off, (n - 1,) m and (n - 1,) degrees: RPE of Sturm et al., one pose apart.

    ``true``, ``found``: (n, 4, 4) world from camera, each in a world of its own.
    """
    off = np.linalg.inv(np.linalg.inv(true[:-1]) @ true[1:]) @ np.linalg.inv(found[:-1]) @ found[1:]
    # The angle of a rotation by its sine and cosine, which is exact for small ones too.
    r = off[:, :3, :3]
    axis = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    angle = np.arctan2(np.linalg.norm(axis, axis=1), np.trace(r, axis1=1, axis2=2) - 1.0)
    return np.linalg.norm(off[:, :3, 3], axis=1), np.degrees(angle)


def _measure(truth: Truth, estimate: object) -> Measurement:
    """Return the measurement of one room."""
    if truth.get("poses") is None:
        raise EvaluationError("truth of poses: expected the camera's trajectory, got none; record the topic <camera>/pose")
    true_stamps, true = _poses(truth["poses"], "truth")
    stamps, found = _poses(estimate, "estimate")
    common, of_true, of_found = np.intersect1d(true_stamps, stamps, assume_unique=True, return_indices=True)
    sums = np.array([len(true_stamps), len(common), 0.0, 0.0, 0.0, 0.0, 0.0])
    if len(common):
        true, found = true[of_true], found[of_found]
        motion = best_rigid_motion(found[:, :3, 3], true[:, :3, 3])
        aligned_m = found[:, :3, 3] @ motion[:3, :3].T + motion[:3, 3]
        if len(common) >= _FEWEST_POSES:
            sums[2:4] = len(common), ((aligned_m - true[:, :3, 3]) ** 2).sum()
        steps_m, steps_deg = step_errors(true, found)
        sums[4:] = len(steps_m), steps_m @ steps_m, steps_deg @ steps_deg
    return Measurement(whole=sums, by_class={}, by_distance={})


def _formula(sums: Sums) -> Sums:
    ate, steps_m, steps_deg = sums[:, 3] / sums[:, 2], sums[:, 5] / sums[:, 4], sums[:, 6] / sums[:, 4]
    return np.column_stack([np.sqrt(ate), np.sqrt(steps_m), np.sqrt(steps_deg), sums[:, 1] / sums[:, 0]])


POSES = Task(
    name="poses",
    truth=("poses",),
    estimate="Trajectory of the camera's optical frame in any world, of a whole room",
    metrics=METRICS,
    measure=_measure,
    tallying=sums_tallying(_formula),
    whole_rooms=True,
)
