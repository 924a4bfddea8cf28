"""From frames to an evaluation: groups, rooms, intervals, frames without an estimate."""

from dataclasses import replace

import numpy as np
import pytest

from evaluation.evaluation_file import FrameKey
from evaluation.summary import WITHOUT_ESTIMATE, MeasuredFrame, make_evaluation
from evaluation.tasks import TASKS

SHAPE = (4, 6)


def measured(room, frame, error_m, room_type="bedroom", variant=None, light=1.0, estimated=True):
    key = FrameKey(
        bag="bag",
        variant=variant,
        room=room,
        room_type=room_type,
        seed=1,
        frame=frame,
        stamp_ns=frame,
        factors={"light": light, "sun": True},
    )
    depth = np.full(SHAPE, 0.5)
    depth[:, 3:] = 2.0
    semantic = np.where(depth < 1.0, 5, 1)
    measurement = TASKS["depth"].measure({"depth": depth, "semantic": semantic}, depth + error_m) if estimated else None
    return MeasuredFrame(key=key, task="depth", measurement=measurement)


@pytest.fixture(scope="module")
def evaluation():
    frames = [
        measured(0, 0, 0.1),
        measured(0, 1, 0.3),
        measured(1, 0, 0.2, room_type="kitchen"),
        measured(0, 0, 0.5, variant="0001", light=2.0),
        measured(1, 1, 0.0, room_type="kitchen", estimated=False),
    ]
    return make_evaluation(frames, title="t", algorithm="a", created_with="c", seed=0, draws=50, missing={"tasks without truth": 2})


def row_of(evaluation, by, key):
    (row,) = [row for row in evaluation.summary if (row.by, row.key) == (by, key)]
    return row


def test_each_frame_has_its_metrics(evaluation):
    assert [row.metrics["rmse"] for row in evaluation.frames] == pytest.approx([0.1, 0.3, 0.2, 0.5, None])
    assert evaluation.frames[0].metrics["abs_rel"] == pytest.approx((0.1 / 0.5 + 0.1 / 2.0) / 2)
    assert set(evaluation.frames[4].metrics.values()) == {None}
    assert evaluation.missing == {WITHOUT_ESTIMATE: 1, "tasks without truth": 2}
    assert [task.name for task in evaluation.tasks] == ["depth"]


def test_groups_are_those_of_all_room_types_classes_distances_and_factors(evaluation):
    groups = [(row.by, row.key, row.rooms, row.frames) for row in evaluation.summary]
    assert groups == [
        ("all", "all", 2, 4),
        ("room_type", "bedroom", 1, 3),
        ("room_type", "kitchen", 1, 1),
        ("class", "wall", 2, 4),
        ("class", "chair", 2, 4),
        ("distance", "0 to 1 m", 2, 4),
        ("distance", "2 to 3 m", 2, 4),
        ("light", 1.0, 2, 3),
        ("light", 2.0, 1, 1),
    ], "a room of two variants is one room, a factor of one value is none"


def test_groups_hold_the_metrics_of_their_frames_and_pixels(evaluation):
    errors = np.array([0.1, 0.3, 0.2, 0.5])
    rmse = row_of(evaluation, "all", "all").metrics["rmse"]
    assert rmse.value == pytest.approx(np.sqrt(np.mean(errors**2)))
    # Of two rooms the jackknife's pseudo-values are twice the whole less the other room.
    rooms = np.array([np.sqrt(np.mean(errors[[0, 1, 3]] ** 2)), 0.2])
    half = 12.7062 * (rooms.max() - rooms.min()) / 2.0
    assert rmse.low == 0.0 and rmse.high == pytest.approx(rmse.value + half, abs=1e-4)
    kitchen = row_of(evaluation, "room_type", "kitchen").metrics["rmse"]
    assert (kitchen.value, kitchen.low) == (pytest.approx(0.2), None)
    assert row_of(evaluation, "class", "chair").metrics["abs_rel"].value == pytest.approx(errors.mean() / 0.5)
    assert row_of(evaluation, "distance", "2 to 3 m").metrics["abs_rel"].value == pytest.approx(errors.mean() / 2.0)
    assert row_of(evaluation, "light", 2.0).metrics["rmse"].value == pytest.approx(0.5)


def test_dropped_frames_lower_coverage_of_all_room_types_and_factors(evaluation):
    """Estimates of 4 of 5 frames, of 1 of the kitchen's 2 and of 3 of the 4 with light 1 cover all that is true."""
    shares = {("all", "all"): 0.8, ("room_type", "bedroom"): 1.0, ("room_type", "kitchen"): 0.5, ("light", 1.0): 0.75, ("light", 2.0): 1.0}
    assert {key: row_of(evaluation, *key).metrics["coverage"].value for key in shares} == pytest.approx(shares)
    assert row_of(evaluation, "class", "wall").metrics["coverage"].value == 1.0, "of pixels in frames with an estimate"


def test_a_room_without_any_estimate_counts_in_coverage_alone():
    frames = [measured(room, 0, 0.1 * (room + 1), estimated=room < 7) for room in range(8)]
    metrics = make_evaluation(frames, title="t", algorithm="a", created_with="c", seed=0).summary[0].metrics
    known = make_evaluation(frames[:7], title="t", algorithm="a", created_with="c", seed=0).summary[0].metrics
    covered = metrics["coverage"]
    # Of seven times 1 and once 0 the mean is 0.875 and its standard error 0.125; t(7) = 2.364624.
    assert (covered.value, covered.low, covered.high) == pytest.approx((0.875, 0.875 - 2.364624 * 0.125, 1.0), abs=1e-6)
    assert {name: metrics[name] for name in metrics if name != "coverage"} == {name: known[name] for name in known if name != "coverage"}


def test_a_frame_without_an_estimate_is_counted_once_for_all_its_tasks():
    lost = measured(0, 0, 0.0, estimated=False)
    frames = [lost, replace(lost, task="semantic"), measured(0, 1, 0.0)]
    assert make_evaluation(frames, title="t", algorithm="a", created_with="c", seed=0).missing == {WITHOUT_ESTIMATE: 1}
