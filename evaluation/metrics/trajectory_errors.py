"""Errors of poses by evo (Grupp, github.com/MichaelGrupp/evo); the one place that knows it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evaluation.core.errors import EvaluationError


class PoseErrors(NamedTuple):
    """Errors of one trajectory: (n,) m of positions, (n - 1,) m and (n - 1,) degrees of the steps between neighbouring poses."""

    positions_m: NDArray[np.float64]
    steps_m: NDArray[np.float64]
    steps_deg: NDArray[np.float64]


def pose_errors(truth: NDArray[np.float64], aligned: NDArray[np.float64], estimate: NDArray[np.float64]) -> PoseErrors:
    """Return the errors of a trajectory.

    Args:
        truth: (n, 4, 4) world from camera.
        aligned: (n, 4, 4) the estimate, aligned with the truth; of it the positions are judged.
        estimate: (n, 4, 4) the estimate in its own world; of it the steps are judged.

    Raises:
        EvaluationError: evo is not installed.
    """
    try:
        from evo.core import metrics
        from evo.core.trajectory import PosePath3D
    except ImportError:
        raise EvaluationError(
            "poses: expected the library evo, got none installed; pip install 'scene_synth_ros[evaluate]' brings it"
        ) from None

    true = PosePath3D(poses_se3=list(truth))

    def errors(metric: metrics.PE, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        metric.process_data((true, PosePath3D(poses_se3=list(poses))))
        return np.asarray(metric.error, np.float64)

    positions = errors(metrics.APE(metrics.PoseRelation.translation_part), aligned)
    if len(truth) < 2:
        return PoseErrors(positions, np.zeros(0), np.zeros(0))
    steps_m = errors(metrics.RPE(metrics.PoseRelation.translation_part, delta=1, delta_unit=metrics.Unit.frames), estimate)
    steps_deg = errors(metrics.RPE(metrics.PoseRelation.rotation_angle_deg, delta=1, delta_unit=metrics.Unit.frames), estimate)
    return PoseErrors(positions, steps_m, steps_deg)
