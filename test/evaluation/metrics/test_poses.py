"""Errors of trajectories: equal to formulas written out by hand and to evo's, exact for known errors."""

import numpy as np
import pytest
from evo.core import metrics
from evo.core.trajectory import PosePath3D
from scipy.spatial.transform import Rotation

from evaluation.core.errors import EvaluationError
from evaluation.metrics.poses import Trajectory
from evaluation.tasks import TASKS

POSES = TASKS["poses"]
STAMPS = np.arange(12) * 100_000_000


def path(rng):
    turns = Rotation.from_euler("zyx", np.cumsum(rng.normal(0.0, 0.1, (12, 3)), axis=0))
    return Trajectory(stamps_ns=STAMPS, positions_m=np.cumsum(rng.normal(0.0, 0.2, (12, 3)), axis=0), orientations=turns.as_quat())


def with_noise(rng, truth):
    turns = Rotation.from_quat(truth.orientations) * Rotation.from_rotvec(rng.normal(0.0, 0.02, (12, 3)))
    return Trajectory(stamps_ns=STAMPS, positions_m=truth.positions_m + rng.normal(0.0, 0.03, (12, 3)), orientations=turns.as_quat())


def moved(given, motion):
    turn, shift = motion
    positions = turn.apply(given.positions_m) + shift
    return Trajectory(
        stamps_ns=given.stamps_ns, positions_m=positions, orientations=(turn * Rotation.from_quat(given.orientations)).as_quat()
    )


def matrices(given):
    poses = np.tile(np.eye(4), (len(given.stamps_ns), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = Rotation.from_quat(given.orientations).as_matrix(), given.positions_m
    return poses


def by_hand(truth, estimate):
    true, found = matrices(truth), matrices(estimate)
    x, y = found[:, :3, 3] - found[:, :3, 3].mean(axis=0), true[:, :3, 3] - true[:, :3, 3].mean(axis=0)
    best = Rotation.align_vectors(y, x)[0]
    ate = np.sqrt(np.mean(np.sum((best.apply(x) - y) ** 2, axis=1)))
    steps = [np.linalg.inv(np.linalg.inv(true[i]) @ true[i + 1]) @ np.linalg.inv(found[i]) @ found[i + 1] for i in range(len(true) - 1)]
    degrees = np.degrees([Rotation.from_matrix(step[:3, :3]).magnitude() for step in steps])
    translation = np.sqrt(np.mean([step[:3, 3] @ step[:3, 3] for step in steps]))
    return {"ate_rmse": ate, "rpe_translation": translation, "rpe_rotation": np.sqrt(np.mean(degrees**2)), "coverage": 1.0}


def test_errors_are_those_of_the_formulas_and_of_evo():
    rng = np.random.default_rng(0)
    truth = path(rng)
    estimate = moved(with_noise(rng, truth), (Rotation.from_euler("xyz", [0.4, -1.0, 2.0]), [3.0, -2.0, 1.0]))
    score = POSES.score([POSES.measure({"poses": truth}, estimate)])
    assert score == pytest.approx(by_hand(truth, estimate), abs=1e-6)
    true, found = PosePath3D(poses_se3=list(matrices(truth))), PosePath3D(poses_se3=list(matrices(estimate)))
    found.align(true)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((true, found))
    assert score["ate_rmse"] == pytest.approx(ape.get_statistic(metrics.StatisticsType.rmse), abs=1e-9)
    for name, relation in (
        ("rpe_translation", metrics.PoseRelation.translation_part),
        ("rpe_rotation", metrics.PoseRelation.rotation_angle_deg),
    ):
        rpe = metrics.RPE(relation, delta=1, delta_unit=metrics.Unit.frames)
        rpe.process_data((true, found))
        assert score[name] == pytest.approx(rpe.get_statistic(metrics.StatisticsType.rmse), abs=1e-9)


def test_the_truth_is_perfect_wherever_its_world_lies_and_on_a_straight_line():
    truth = path(np.random.default_rng(1))
    straight = Trajectory(stamps_ns=STAMPS, positions_m=np.outer(STAMPS / 1e9, [1.0, 2.0, 0.0]), orientations=truth.orientations)
    for poses in (truth, straight):
        estimate = moved(poses, (Rotation.from_euler("z", 1.0), [1.0, 2.0, 3.0]))
        score = POSES.score([POSES.measure({"poses": poses}, estimate)])
        assert score == pytest.approx({"ate_rmse": 0.0, "rpe_translation": 0.0, "rpe_rotation": 0.0, "coverage": 1.0}, abs=1e-5)


def test_known_errors_are_found_exactly():
    """A path along x that is a tenth too long, whose camera turns a degree too far with each step."""
    still = np.tile([0.0, 0.0, 0.0, 1.0], (12, 1))
    x = np.arange(12.0)
    truth = Trajectory(stamps_ns=STAMPS, positions_m=np.outer(x, [1.0, 0.0, 0.0]), orientations=still)
    turning = Rotation.from_euler("x", np.radians(x)[:, None])
    estimate = Trajectory(stamps_ns=STAMPS, positions_m=np.outer(1.1 * x, [1.0, 0.0, 0.0]), orientations=turning.as_quat())
    score = POSES.score([POSES.measure({"poses": truth}, estimate)])
    assert score == pytest.approx({"ate_rmse": 0.1 * np.std(x), "rpe_translation": 0.1, "rpe_rotation": 1.0, "coverage": 1.0}, abs=1e-6)


def test_poses_are_compared_at_equal_stamps():
    truth = path(np.random.default_rng(2))
    some = Trajectory(stamps_ns=STAMPS[::3], positions_m=truth.positions_m[::3], orientations=truth.orientations[::3])
    late = Trajectory(stamps_ns=STAMPS + 7, positions_m=truth.positions_m, orientations=truth.orientations)
    score = POSES.score([POSES.measure({"poses": truth}, some)])
    assert (score["ate_rmse"], score["coverage"]) == (pytest.approx(0.0, abs=1e-9), pytest.approx(1 / 3))
    score = POSES.score([POSES.measure({"poses": truth}, late)])
    assert score.pop("coverage") == 0.0
    assert all(np.isnan(value) for value in score.values())


def test_what_does_not_fit_is_told():
    truth = path(np.random.default_rng(3))
    twice = Trajectory(stamps_ns=np.zeros(12, int), positions_m=truth.positions_m, orientations=truth.orientations)
    with pytest.raises(EvaluationError, match=r"^estimate of poses: expected rising stamps, got 0 after 0 ns; sort them, each once$"):
        POSES.measure({"poses": truth}, twice)
    zero = Trajectory(stamps_ns=STAMPS, positions_m=truth.positions_m, orientations=np.zeros((12, 4)))
    with pytest.raises(EvaluationError, match=r"^estimate of poses: expected finite positions and quaternions that are not zero"):
        POSES.measure({"poses": truth}, zero)
