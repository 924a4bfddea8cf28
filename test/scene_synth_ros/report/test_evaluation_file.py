"""Files of evaluations: what is read of them, and the one line that refuses others."""

import json
from pathlib import Path
from typing import Any

import pytest
from evaluation_files import document, frame, write

from scene_synth_ros.report.evaluation_file import ReportError, read_evaluation
from scene_synth_ros.report.sweep_file import find_sweep, read_sweep

FRAME = frame("0001", 3, {"light": 2, "color": [1, 0.5], "lamp": True}, {"abs_rel": 0.25, "delta_1": None})


def test_frames_and_summary_are_read(tmp_path: Path) -> None:
    summary = [
        {"task": "depth", "by": "all", "key": "", "metrics": {"abs_rel": {"value": 1, "low": None, "high": 2}}, "rooms": 4, "frames": 9}
    ]
    found = read_evaluation(write(tmp_path / "a.json", document([FRAME], summary, estimates="est", further=1)))
    (row,), (score,) = found.frames, found.summary
    assert (row.bag, row.variant, row.room, row.stamp_ns, row.task) == ("variants/0001", "0001", 3, 5, "depth")
    assert row.factors == {"light": 2.0, "color": "[1, 0.5]", "lamp": True} and row.metrics == {"abs_rel": 0.25}
    assert (score.by, score.metrics, score.rooms) == ("all", {"abs_rel": (1.0, None, 2.0)}, 4)
    assert (found.title, found.estimates, found.missing) == ("SGBM", "est", {"frames without an estimate": 2})
    assert [metric.lower_is_better for metric in found.tasks[0].metrics] == [True, False]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"schema": "scene_synth_sweep/1"},
            "schema: expected 'scene_synth_evaluation/1'; give a file that scene_synth evaluate wrote, got",
        ),
        ({"frames": 5}, "frames: expected a value of type list, got 5"),
        ({"frames": [[]]}, r"frames.0: expected a mapping, got \[\]"),
        ({"frames": [FRAME | {"task": "sound"}]}, "frames.0.task: expected one of depth, got 'sound'"),
        ({"frames": [FRAME | {"metrics": {"abs_rel": "low"}}]}, "frames.0.metrics.abs_rel: expected a number or null, got 'low'"),
        ({"frames": [{"bag": "x"}]}, r"expected a value, got nothing \(the key is missing\)"),
        ({"tasks": [{"name": "depth", "metrics": [{"name": "a", "better": "more"}]}]}, "tasks.0.metrics.0.better: expected 'lower' or"),
    ],
)
def test_what_is_no_evaluation_is_refused_in_a_line(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    with pytest.raises(ReportError, match=message) as caught:
        read_evaluation(write(tmp_path / "a.json", document([FRAME]) | change))
    assert str(caught.value).startswith(f"{tmp_path / 'a.json'}: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, "[]", "\x00", '{"schema": "scene_synth_evaluation/1"}'])
def test_what_is_no_json_is_refused_in_a_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text, encoding="utf-8")
    with pytest.raises(ReportError) as caught:
        read_evaluation(tmp_path / "a.json")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_a_sweep_is_found_beside_its_variants(tmp_path: Path) -> None:
    variants = [{"id": "0001", "base": {"room_type": "office", "seed": 4, "index": 2}, "command": "scene_synth sweep x"}]
    factors = [{"name": "light", "label": "light", "unit": None, "values": [1, 2], "base": 1}]
    content = {"schema": "scene_synth_sweep/1", "spec": {"design": "grid"}, "factors": factors, "variants": variants}
    path = write(tmp_path / "sweep.json", content)
    assert find_sweep(tmp_path / "variants" / "0001") == path == find_sweep(tmp_path / "bag")
    sweep, note = read_sweep(path)
    assert (sweep.design, note, sweep.commands, sweep.bases) == ("grid", "", {"0001": "scene_synth sweep x"}, {"0001": ("office", 4, 2)})
    assert (sweep.factors["light"].unit, sweep.factors["light"].values, sweep.factors["light"].base) == ("", (1.0, 2.0), 1.0)
    for text in ("{", json.dumps(content | {"factors": [5]}), json.dumps(content | {"schema": "x"})):
        path.write_text(text, encoding="utf-8")
        sweep, note = read_sweep(path)
        assert not sweep.commands and note.startswith("sweep.json: ") and note.endswith("labels and commands of the variants are missing")
