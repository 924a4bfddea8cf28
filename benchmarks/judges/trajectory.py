"""The error of a trajectory, by evo (M. Grupp, https://github.com/MichaelGrupp/evo): absolute, after the best rotation and shift."""

import math
from typing import NamedTuple

import numpy as np
from evo.core import metrics, sync
from evo.core.geometry import GeometryException
from evo.core.trajectory import PoseTrajectory3D
from numpy.typing import NDArray

_APART_S = 0.002


class Judged(NamedTuple):
    """What evo says of a trajectory: root mean square error (m), its scale by the truth's, poses that were compared."""

    ate_m: float
    scale: float
    poses: int


def judge(said: PoseTrajectory3D, true: PoseTrajectory3D, *, scaled: bool = False) -> Judged:
    """Return the error of ``said`` after the best rotation and shift, and scale where it is ``scaled``, which is told anyway.

    What truly stands still, or goes along a line, has several best rotations, of which one is taken, and no scale (NaN).

    Raises:
        evo.core.sync.SyncException: no stamp of one is within 2 ms of one of the other.
    """
    true, said = sync.associate_trajectories(true, said, max_diff=_APART_S)
    whole = PoseTrajectory3D(true.positions_xyz, true.orientations_quat_wxyz, true.timestamps)
    try:
        scale = float(whole.align(said, correct_scale=True)[2])  # the truth scaled to what is said: errors of that make it no larger
        said.align(true, correct_scale=scaled)
    except GeometryException:
        scale = math.nan
        middles = said.positions_xyz.mean(axis=0), true.positions_xyz.mean(axis=0)
        u, _, v = np.linalg.svd((true.positions_xyz - middles[1]).T @ (said.positions_xyz - middles[0]))
        turn = u @ np.diag((1.0, 1.0, np.linalg.det(u @ v))) @ v
        said = places_only(said.timestamps, (said.positions_xyz - middles[0]) @ turn.T + middles[1])
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((true, said))
    return Judged(float(error.get_statistic(metrics.StatisticsType.rmse)), scale, len(said.timestamps))


def places_only(stamps_s: NDArray[np.float64], places: NDArray[np.float64]) -> PoseTrajectory3D:
    """Return a trajectory of positions (n, 3) at stamps (n,), without orientations."""
    return PoseTrajectory3D(places, np.tile((1.0, 0.0, 0.0, 0.0), (len(places), 1)), stamps_s)
