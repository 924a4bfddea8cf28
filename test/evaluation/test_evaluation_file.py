"""The file of an evaluation: what is written is read, and what does not fit is refused with its path."""

import json
from dataclasses import replace

import pytest

from evaluation.confidence import Interval
from evaluation.core.errors import EvaluationError
from evaluation.evaluation_file import (
    SCHEMA,
    Evaluation,
    FrameKey,
    FrameRow,
    MetricRow,
    SummaryRow,
    TaskRow,
    TruthRecord,
    common_truth,
    evaluation_to_mapping,
    read_evaluation,
    write_evaluation,
)
from evaluation.tables import summary_csv

KEY = FrameKey(
    bag="variants/0001", variant="0001", room=0, room_type="bedroom", seed=2**63, frame=3, stamp_ns=7, factors={"light": 2, "sun": True}
)
EVALUATION = Evaluation(
    title="a title",
    algorithm="mine.py:Mine",
    created_with="scene_synth evaluate",
    tasks=(TaskRow(name="depth", metrics=(MetricRow(name="rmse", unit="m", better="lower"), MetricRow(name="coverage", better="higher"))),),
    frames=(
        FrameRow(key=KEY, task="depth", metrics={"rmse": 0.25, "coverage": 1.0}),
        FrameRow(
            key=FrameKey(bag="b", room=1, room_type="gym", seed=1, frame=0, stamp_ns=0),
            task="depth",
            metrics={"rmse": None, "coverage": 0.0},
        ),
    ),
    summary=(
        SummaryRow(
            task="depth",
            by="all",
            key="all",
            metrics={"rmse": Interval(value=0.25, low=0.2, high=0.3), "coverage": Interval(value=None)},
            rooms=2,
            frames=2,
        ),
        SummaryRow(
            task="depth", by="light", key=0.5, metrics={"rmse": Interval(value=0.125), "coverage": Interval(value=1.0)}, rooms=1, frames=1
        ),
    ),
    missing={"frames without an estimate": 1},
)


def test_what_is_written_is_read(tmp_path):
    path = tmp_path / "evaluation.json"
    write_evaluation(path, EVALUATION)
    assert read_evaluation(path) == EVALUATION
    assert [file.name for file in tmp_path.iterdir()] == ["evaluation.json"]


def test_the_record_of_the_truth_is_read_and_old_files_have_none(tmp_path):
    path, record = tmp_path / "evaluation.json", TruthRecord(image_width=64, intrinsics=(55.0, 55.5, 32.0, 24.0), seed=2**63)
    write_evaluation(path, replace(EVALUATION, truth=record))
    assert json.loads(path.read_text())["truth"] == {"image_width": 64, "intrinsics": [55.0, 55.5, 32.0, 24.0], "seed": 2**63}
    assert read_evaluation(path).truth == record
    assert "truth" not in evaluation_to_mapping(EVALUATION) and EVALUATION.truth is None


def test_several_bags_have_the_facts_in_common_that_all_tell_alike():
    bags = [TruthRecord(image_width=64, seed=seed, camera_model="plumb_bob") for seed in (1, 2)]
    assert common_truth(bags) == TruthRecord(image_width=64, camera_model="plumb_bob")
    assert common_truth([*bags, TruthRecord(image_width=64)]) == TruthRecord(image_width=64)
    assert common_truth([TruthRecord()]) is None


def test_the_file_has_the_keys_that_readers_of_other_languages_rely_on():
    data = evaluation_to_mapping(EVALUATION)
    assert data["schema"] == SCHEMA == "scene_synth_evaluation/1"
    assert data["tasks"][0]["metrics"][0] == {"name": "rmse", "unit": "m", "better": "lower"}
    assert data["frames"][1] == {
        "bag": "b",
        "variant": None,
        "room": 1,
        "room_type": "gym",
        "seed": 1,
        "frame": 0,
        "stamp_ns": 0,
        "factors": {},
        "task": "depth",
        "metrics": {"rmse": None, "coverage": 0.0},
    }
    assert data["summary"][0]["metrics"]["rmse"] == {"value": 0.25, "low": 0.2, "high": 0.3}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data.update(schema="other/1"), "schema: expected 'scene_synth_evaluation/1', got 'other/1'"),
        (lambda data: data.pop("frames"), "frames: expected a list, got nothing (the key is missing)"),
        (lambda data: data.update(extra=1), "extra: expected one of algorithm, "),
        (lambda data: data["frames"][1].update(seed="1"), "frames[1].seed: expected an integer in [0, inf], got '1'"),
        (lambda data: data["frames"][0].pop("task"), "frames[0].task: expected a value, got nothing"),
        (lambda data: data["frames"][0].update(task="flow"), "frames[0].task: expected one of depth (tasks), got 'flow'"),
        (lambda data: data["frames"][0]["factors"].update(light=[1]), "frames[0].factors.light: expected a string, a number, "),
        (lambda data: data["frames"][0]["metrics"].update(rmse="0.1"), "frames[0].metrics.rmse: expected a number, got '0.1'"),
        (lambda data: data["frames"][0]["metrics"].pop("rmse"), "frames[0].metrics.rmse: expected the metrics that tasks lists of depth"),
        (lambda data: data["summary"][0].update(frame=1), "summary[0].frame: expected one of by, "),
        (lambda data: data["summary"][1].pop("key"), "summary[1].key: expected a value, got nothing"),
        (
            lambda data: data["summary"][0]["metrics"]["rmse"].update(low=float("nan")),
            "summary[0].metrics.rmse.low: expected a number, got nan",
        ),
        (lambda data: data["tasks"][0]["metrics"][0].update(better="up"), "tasks[0].metrics[0].better: expected one of 'lower', 'higher'"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_path(tmp_path, change, message):
    data = json.loads(json.dumps(evaluation_to_mapping(EVALUATION)))
    change(data)
    path = tmp_path / "evaluation.json"
    path.write_text(json.dumps(data))
    with pytest.raises(EvaluationError) as caught:
        read_evaluation(path)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["{", "[" * 100_000, "\x00", '"a"'])
def test_what_is_no_json_of_an_evaluation_is_refused(tmp_path, text):
    path = tmp_path / "evaluation.json"
    path.write_text(text)
    with pytest.raises(EvaluationError, match=r"evaluation\.json: .*expected an? "):
        read_evaluation(path)


def test_csv_has_a_line_for_each_metric():
    assert summary_csv(EVALUATION).splitlines() == [
        "task,by,key,rooms,frames,metric,unit,value,low,high",
        "depth,all,all,2,2,rmse,m,0.25,0.2,0.3",
        "depth,all,all,2,2,coverage,,,,",
        "depth,light,0.5,1,1,rmse,m,0.125,,",
        "depth,light,0.5,1,1,coverage,,1.0,,",
    ]


def test_a_text_that_is_too_long_to_be_read_again_is_cut_and_told(tmp_path):
    long = replace(EVALUATION, created_with="scene_synth evaluate " + "--topic depth:=/a " * 2000, algorithm="x" * 10_000)
    write_evaluation(tmp_path / "e.json", long)
    read = read_evaluation(tmp_path / "e.json")
    assert len(read.created_with) == 10_000 and read.created_with.endswith(f" ... (cut: {len(long.created_with)} characters)")
    assert read.algorithm == long.algorithm
