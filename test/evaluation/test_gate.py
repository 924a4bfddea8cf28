"""The gate: ten seeded regressions are caught, ten clean reruns are not, and what cannot be compared is told."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evaluation.core.errors import EvaluationError
from evaluation.evaluation_file import FrameKey
from evaluation.gate import FEWEST_ROOMS, compare, gate_table, half_width
from evaluation.metrics.poses import Trajectory
from evaluation.summary import MeasuredFrame, make_evaluation
from evaluation.tasks import TASKS

ROOMS, FRAMES, SHAPE = 12, 4, (24, 32)


@cache
def truth_of(room, frame):
    """Return a frame of blocks at several depths, with their normals and classes; their sides lie at odd rows and columns."""
    rng = np.random.default_rng([room, frame])
    normals = rng.normal((0.0, 0.0, -2.0), 1.0, (4, 4, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    blocks = {"depth": rng.uniform(1.0, 4.0, (4, 4)), "semantic": rng.integers(1, 6, (4, 4)), "normals": normals}
    return {name: np.roll(block.repeat(6, axis=0).repeat(8, axis=1), (1, 1), axis=(0, 1)) for name, block in blocks.items()}


def path_of(room):
    rng = np.random.default_rng(room)
    turns = Rotation.from_euler("z", np.cumsum(rng.normal(0.0, 0.2, FRAMES))[:, None])
    positions = np.cumsum(rng.normal(0.0, 0.3, (FRAMES, 3)), axis=0)
    return Trajectory(stamps_ns=np.arange(FRAMES), positions_m=positions, orientations=turns.as_quat())


def estimate_of(room, frame, seed):
    """Return what an imperfect algorithm says of a frame; another seed is another run of it."""
    truth, rng = truth_of(room, frame), np.random.default_rng([room, frame, seed])
    semantic = np.where(rng.random(SHAPE) < 0.9, truth["semantic"], rng.integers(1, 6, SHAPE))
    return {
        "depth": truth["depth"] * rng.normal(1.0, 0.03, SHAPE),
        "semantic": semantic,
        "normals": truth["normals"] + rng.normal(0.0, 0.05, (*SHAPE, 3)),
    }


def path_estimate(room, seed):
    path, rng = path_of(room), np.random.default_rng([room, seed])
    return dataclasses.replace(path, positions_m=path.positions_m + rng.normal(0.0, 0.01, (FRAMES, 3)))


def run(
    seed, change=lambda estimates, room, frame: estimates, change_path=lambda path: path, tasks=("depth", "semantic", "normals", "poses")
):
    """Return the evaluation of one run; ``change`` makes the estimates of a frame worse."""
    measured = []
    for room in range(ROOMS):
        for frame in range(FRAMES):
            key = FrameKey(bag="bag", room=room, room_type="bedroom", seed=1, frame=frame, stamp_ns=frame)
            estimates = change(estimate_of(room, frame, seed), room, frame)
            for name in tasks[:3]:
                found = estimates.get(name)
                measurement = None if found is None else TASKS[name].measure(truth_of(room, frame), found)
                measured.append(MeasuredFrame(key=key, task=name, measurement=measurement))
        key = FrameKey(bag="bag", room=room, room_type="bedroom", seed=1, frame=0, stamp_ns=0)
        measurement = TASKS["poses"].measure({"poses": path_of(room)}, change_path(path_estimate(room, seed)))
        measured.append(MeasuredFrame(key=key, task="poses", measurement=measurement))
    return make_evaluation(measured, title="t", algorithm="a", created_with="c", seed=0, draws=10)


def only(name, function):
    return lambda estimates, room, frame: {**estimates, name: function(estimates[name])}


def with_holes(depth):
    holed = depth.copy()
    holed[::10] = np.nan
    return holed


def half_resolution(depth):
    return np.kron(depth[::2, ::2], np.ones((2, 2)))


def shifted(semantic):
    return np.roll(semantic, 1, axis=1)


def swapped_stamps(estimates, room, frame):
    """Return those of the next frame for even frames and of the one before for odd ones."""
    return estimate_of(room, frame + 1 - 2 * (frame % 2), 77)


def wrong_frame(path):
    """Return poses of the body (x forward) where those of the optical frame (z forward) were due."""
    turns = Rotation.from_quat(path.orientations) * Rotation.from_quat([0.5, -0.5, 0.5, 0.5])
    back = dataclasses.replace(path, orientations=turns.as_quat())
    return back


REGRESSIONS = {
    "depth scale": ("depth", {"change": only("depth", lambda depth: 1.02 * depth)}),
    "swapped stamps": ("depth", {"change": swapped_stamps}),
    "wrong frame": ("poses", {"change_path": wrong_frame}),
    "half resolution": ("depth", {"change": only("depth", half_resolution)}),
    "dropped class": ("semantic", {"change": only("semantic", lambda ids: np.where(ids == 3, 0, ids))}),
    "shifted by a pixel": ("semantic", {"change": only("semantic", shifted)}),
    "noise": ("depth", {"change": only("depth", lambda depth: depth * np.random.default_rng(5).normal(1.0, 0.02, SHAPE))}),
    "holes": ("depth", {"change": only("depth", with_holes)}),
    "normals in another frame": ("normals", {"change": only("normals", lambda normals: normals * [1.0, -1.0, -1.0])}),
    "class ids permuted": ("semantic", {"change": only("semantic", lambda ids: np.where(ids > 3, 9 - ids, ids))}),
}


@pytest.fixture(scope="module")
def baseline():
    return run(0)


@pytest.mark.parametrize("name", REGRESSIONS)
def test_regressions_are_caught(baseline, name):
    task, changes = REGRESSIONS[name]
    report = compare(baseline, run(1, **changes))
    worse = {verdict.task for verdict in report.verdicts if verdict.verdict == "worse"}
    assert not report.passed
    assert task in worse


@pytest.mark.parametrize("seed", range(1, 11))
def test_clean_reruns_pass(baseline, seed):
    report = compare(baseline, run(seed), seed=seed)
    assert report.passed
    assert {verdict.verdict for verdict in report.verdicts} == {"same"}


def test_what_is_computed_again_has_no_differences(baseline):
    report = compare(baseline, baseline)
    assert report.passed
    assert {(verdict.difference, verdict.low, verdict.high) for verdict in report.verdicts} == {(0.0, 0.0, 0.0)}
    count = sum(len(task.metrics) for task in baseline.tasks)
    assert gate_table(report) == f"same    {count} of {count} metrics"


def test_what_becomes_better_is_told_and_passes(baseline):
    report = compare(baseline, run(1, change=lambda estimates, room, frame: truth_of(room, frame)))
    assert report.passed
    verdict = next(verdict for verdict in report.verdicts if (verdict.task, verdict.metric) == ("semantic", "miou"))
    assert (verdict.verdict, verdict.new, verdict.units) == ("better", 1.0, "12 rooms")
    assert "better  semantic.miou: " in gate_table(report)


def without(evaluation, task=None, frames=()):
    rows = tuple(row for row in evaluation.frames if row.task != task and row.key.frame not in frames)
    return dataclasses.replace(evaluation, frames=rows, tasks=tuple(row for row in evaluation.tasks if row.name != task))


def test_lost_tasks_frames_and_values_fail(baseline):
    report = compare(baseline, without(baseline, "normals"))
    assert (report.passed, report.losses) == (False, ("normals: the baseline has this task, the new evaluation has not",))
    report = compare(baseline, without(baseline, frames=[3]))
    assert report.losses[0] == "depth: 12 of 48 frames that the baseline has values for have none"
    silent = run(0, change=lambda estimates, room, frame: estimates if room else {})
    assert compare(baseline, silent).losses[0] == "depth: 4 of 48 frames that the baseline has values for have none"
    rows = [dataclasses.replace(row, metrics={**row.metrics, "miou": None}) if row.task == "semantic" else row for row in baseline.frames]
    report = compare(baseline, dataclasses.replace(baseline, frames=tuple(rows)))
    assert report.losses == ("semantic: miou has no value in 48 of 48 frames that the baseline has one for",)
    assert gate_table(report).startswith("lost    semantic: miou has no value")
    assert compare(without(baseline, "normals"), baseline).passed, "more than the baseline is no loss"


def test_other_frames_are_no_comparison(baseline):
    late = [dataclasses.replace(row, key=dataclasses.replace(row.key, stamp_ns=row.key.stamp_ns + 7)) for row in baseline.frames]
    with pytest.raises(
        EvaluationError, match=r"^depth: expected the frames of the baseline, got others: 48 of the baseline's 48 are missing"
    ):
        compare(baseline, dataclasses.replace(baseline, frames=tuple(late)))
    with pytest.raises(
        EvaluationError, match=r"^new evaluation: expected each frame once in depth, got frame 0 at 0 ns of bedroom 0 \(seed 1\) twice"
    ):
        compare(baseline, dataclasses.replace(baseline, frames=(*baseline.frames, baseline.frames[0])))
    metrics = tuple(dataclasses.replace(metric, better="higher") for metric in baseline.tasks[0].metrics)
    other = dataclasses.replace(baseline, tasks=(dataclasses.replace(baseline.tasks[0], metrics=metrics), *baseline.tasks[1:]))
    with pytest.raises(EvaluationError, match=r"^depth\.abs_rel: expected the baseline's unit '', lower is better, got unit '', higher"):
        compare(baseline, other)


def test_the_interval_is_that_of_student():
    """Of many rooms that differ by chance the bootstrap's width is t times the standard error."""
    differences = np.random.default_rng(0).normal(0.2, 1.0, 40)
    width = half_width(differences, np.ones(40, int), seed=1, draws=20_000, level=0.95)
    assert width == pytest.approx(2.0227 * differences.std(ddof=1) / np.sqrt(40), rel=0.02)
    assert half_width(np.full(12, 0.3), np.ones(12, int), seed=1, draws=100, level=0.95) == 0.0
    assert FEWEST_ROOMS <= ROOMS


def test_a_single_difference_cannot_be_judged(baseline):
    rows = tuple(row for row in baseline.frames if row.task == "poses" and row.key.room == 0)
    one = dataclasses.replace(baseline, tasks=baseline.tasks[-1:], frames=rows)
    longer = {name: 2.0 * value for name, value in rows[0].metrics.items()}
    report = compare(one, dataclasses.replace(one, frames=(dataclasses.replace(rows[0], metrics=longer),)))
    assert report.passed
    assert gate_table(report).startswith("unsure  poses.ate_rmse: ")
    assert compare(one, one).verdicts[0].high == 0.0
