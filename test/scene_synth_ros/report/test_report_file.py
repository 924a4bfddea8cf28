"""A report tells what the evaluations say: curves, ranking, comparison, worst frames with their pictures, and what is missing."""

import base64
import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from evaluation_files import METRICS, document, frame, write
from html_page import parse
from PIL import Image as Picture
from report_bag import ERROR_M, write_sweep
from room_bag import write as write_message
from room_bag import write_room_bag

from evaluation.core.errors import EvaluationError
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.messages.conversions import image_to_msg
from scene_synth_ros.messages.streams import IMAGE_TYPE
from scene_synth_ros.report import report_file
from scene_synth_ros.report.error_images import DIVERGING
from scene_synth_ros.report.frame_pictures import estimate_topics, truth_topics
from scene_synth_ros.report.places import NOT_KEPT
from scene_synth_ros.report.report_file import ReportError, ReportSummary, write_report

EVIL = "</script><script>window.owned = 1</script><img src=x onerror='window.owned = 2'>\u2028&amp;{{data}}"


def report_of(*paths: Path, worst: int = 2, **more: Any) -> tuple[ReportSummary, dict[str, Any]]:
    page = paths[0].with_suffix(".html")
    options = {"bag_root": None, "estimates": None, "max_size": 64, "progress": lambda _what: None} | more
    summary = write_report(paths, page, worst=worst, **options)
    assert summary.size == page.stat().st_size
    return summary, json.loads(parse(page).scripts[0])


def pixels(address: str) -> np.ndarray:
    return np.asarray(Picture.open(io.BytesIO(base64.b64decode(address.split(",")[1])))).astype(int)


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sweep(tmp_path_factory.mktemp("sweep"))


def test_curves_and_ranking_are_those_of_the_frames(sweep: Path) -> None:
    summary, data = report_of(sweep)
    assert summary[:4] == (1, 1, 2, 2) and summary.notes == ()
    assert (data["design"], data["title"]) == ("one at a time", "SGBM") and "all others at their base" in data["how"]
    light, finish = data["factors"]
    assert (light["unit"], light["places"], light["base"], light["base_value"]) == ("lx", [0.5, 1.0, 2.0], 1, 1.0)
    assert (finish["columns"], finish["places"], finish["base"]) == (["paint", "brick"], [], 0)
    (task,) = data["tasks"]
    curves = task["curves"]["0"]["abs_rel"]
    # Rooms lie 0.5 to both sides of the mean: half of t(1) = 12.7062 above it, and no error is below 0.
    expected = [[mean, 0.0, mean + 6.3531, 2, 6] for mean in (1.701, 1.501, 1.601)]
    np.testing.assert_allclose(curves["light"]["points"], expected, rtol=1e-4)
    np.testing.assert_allclose(curves["finish"]["points"], [expected[1], [1.451, 0.0, 1.451 + 6.3531, 2, 6]], rtol=1e-4)
    rows = task["ranking"]["0"]["abs_rel"]["rows"]
    assert [(row["factor"], row["least"], row["most"]) for row in rows] == [("light", "1", "0.5"), ("finish", "brick", "paint")]
    np.testing.assert_allclose([row["effect"] for row in rows], [[0.2] * 3, [0.05] * 3], rtol=1e-5)
    np.testing.assert_allclose([row["share"] for row in rows], [0.2 / 1.501, 0.05 / 1.501], rtol=1e-5)
    found = task["breakdowns"]["abs_rel"]
    assert [row["key"] for row in found["class"]] == ["sofa", "wall"], "the worst first"
    assert [row["key"] for row in found["distance"]] == ["0 to 1 m", "1 to 2 m"], "in their order"
    assert found["class"][0]["values"]["0"] == [4.0, 0.5, 9.0, 2, 24]
    told = dict(data["evaluations"][0]["facts"])
    assert (told["rooms"], told["room types"], told["frames"], told["frames without an estimate"]) == ("2", "office, study", "6", "2")


def test_evaluations_are_compared_within_rooms(sweep: Path) -> None:
    other = write_sweep(sweep.parent, shift=0.25, title="wider")
    summary, data = report_of(sweep, other)
    assert summary.evaluations == 2 and data["title"] == "SGBM and wider"
    scores = data["tasks"][0]["scores"]["abs_rel"]
    assert scores["0"] == {"score": [1.0, 0.5, 9.0], "difference": None}
    np.testing.assert_allclose(scores["1"]["difference"], [0.25] * 3)
    assert [row["evaluation"] for row in data["frames"]] == [0, 0, 1, 1]


def test_worst_frames_have_their_pictures_and_commands(sweep: Path) -> None:
    _, data = report_of(sweep, worst=3)
    rows = data["frames"]
    assert [(row["value"], row["room_type"]) for row in rows] == [(2.202, "study"), (2.201, "study"), (1.202, "office")]
    assert rows[0]["place"] == "bag, room 1, frame 2" and rows[0]["command"] == "scene_synth sweep s.yaml --only 0001"
    assert rows[0]["factors"] == [["light", "lx", "0.5"], ["finish", "", "paint"]]
    assert list(rows[0]["images"]) == ["color", "truth", "estimate", "error"]
    assert all(pixels(image).shape == (48, 64, 3) for image in rows[0]["images"].values())
    assert data["legends"]["depth"]["ticks"] == [f"≤ -{ERROR_M} m", "0 m", f"≥ {ERROR_M} m"]
    error = pixels(rows[0]["images"]["error"])[8:40, 8:56].reshape(-1, 3)
    assert np.abs(np.median(error, axis=0) - 255.0 * np.array(DIVERGING[-1])).max() < 6.0, "0.1 m too far is the end of the scale"
    assert report_of(sweep, worst=0)[1]["frames"] == []


def test_pictures_are_reduced_and_bounded(sweep: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert pixels(report_of(sweep, max_size=16)[1]["frames"][0]["images"]["truth"]).shape == (12, 16, 3)
    monkeypatch.setattr(report_file, "MAX_PICTURE_BYTES", 100)
    summary, data = report_of(sweep)
    assert [bool(row["images"]) for row in data["frames"]] == [True, False] and summary.pictured == 1
    assert "give --worst or --max-size a smaller number" in summary.notes[-1]


def test_estimates_that_were_not_kept_are_said_to_be_and_no_other_stream_is_shown_for_them(sweep: Path, tmp_path: Path) -> None:
    """The bag has what its sensor has read; the algorithm's estimates were 30 % too far."""
    with BagWriter(tmp_path / "bag") as writer:
        for stamp, images in write_room_bag(tmp_path / "truth").images.items():
            for name in ("depth", "depth_sensed"):
                write_message(writer, f"/synth/camera/{name}/image_raw", image_to_msg(images["depth"], "32FC1", stamp, "eye"), stamp)
    content = json.loads(sweep.read_text())
    for command in ("scene_synth evaluate bag --task depth --algorithm far.py:Far", "scene_synth evaluate bag --task depth"):
        path = write(tmp_path / "evaluation.json", content | {"created_with": command})
        summary, data = report_of(path)
        assert [list(row["images"]) for row in data["frames"]] == [["truth"]] * 2
        algorithm = "--algorithm" in command
        assert [row["no_estimate"] for row in data["frames"]] == [NOT_KEPT if algorithm else ""] * 2
        assert summary.notes == ((f"{path}: {NOT_KEPT}",) if algorithm else ())
    assert NOT_KEPT == "the estimates were not kept: evaluate with --estimates-out"


def test_of_two_folders_that_the_command_may_mean_none_is_taken(sweep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command was run in another folder than that of its file, and both have a folder of that name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "estimates").mkdir()
    summary, data = report_of(sweep)
    said = f"estimates is a folder both of {sweep.parent} and of the working directory; give --estimates DIR"
    assert summary.notes == (f"{sweep}: {said}",)
    assert [(list(row["images"]), row["no_estimate"]) for row in data["frames"]] == [(["color", "truth"], said)] * 2
    assert "error" in report_of(sweep, estimates=sweep.parent / "estimates")[1]["frames"][0]["images"]


def test_evaluations_of_equal_titles_are_told_apart_by_algorithm_then_by_file(sweep: Path, tmp_path: Path) -> None:
    content = json.loads(sweep.read_text()) | {"title": "bag"}
    names = (("a", "far.py:Far"), ("b", "near.py:Near"), ("c", "near.py:Near"))
    paths = [write(tmp_path / f"{name}.json", content | {"algorithm": algorithm}) for name, algorithm in names]
    _, data = report_of(*paths[:2], bag_root=sweep.parent)
    assert [one["title"] for one in data["evaluations"]] == ["far.py:Far", "near.py:Near"]
    assert data["title"] == "far.py:Far and near.py:Near"
    _, data = report_of(*paths, bag_root=sweep.parent)
    assert [one["title"] for one in data["evaluations"]] == ["far.py:Far", str(paths[1]), str(paths[2])]


def test_estimates_are_found_in_the_bag_itself_or_where_they_are_said_to_be(sweep: Path, tmp_path: Path) -> None:
    content = json.loads(sweep.read_text()) | {"created_with": "scene_synth evaluate bag"}
    path = write(tmp_path / "moved" / "evaluation.json", content)
    summary, data = report_of(path, bag_root=sweep.parent)
    assert summary.notes == () and list(data["frames"][0]["images"]) == ["color", "truth"], "the bag has no topic of estimates"
    _, data = report_of(path, bag_root=sweep.parent, estimates=sweep.parent / "estimates")
    assert "error" in data["frames"][0]["images"]


def test_the_version_is_that_of_the_bags(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "variants" / "1") as writer:
        writer.set_record("scene_synth", {"version.scene_synth_ros": "0.1.0"})
    frames = [frame(name, 0, {}, {"abs_rel": 1.0, "delta_1": None}) for name in ("0", "1")]
    _, data = report_of(write(tmp_path / "a.json", document(frames)))
    assert dict(data["evaluations"][0]["facts"])["made with"] == "scene_synth_ros 0.1.0"


def test_topics_of_truth_and_estimates_are_told_apart() -> None:
    names = ["/estimates/depth", "/synth/left/depth", "/synth/left/depth_sensed", "/synth/right/depth", "/synth/right/depth_sensed"]
    types = {f"{name}/image_raw": IMAGE_TYPE for name in names}
    assert truth_topics("")(types)["depth"] == "/synth/left/depth/image_raw"
    assert truth_topics("right")(types)["depth"] == "/synth/right/depth/image_raw"
    assert estimate_topics("", "depth", same_bag=True)(types)["depth"] == "/estimates/depth/image_raw"
    assert estimate_topics("/mine", "depth", same_bag=True)(types) == {"depth": "/mine"}
    own = {name: kind for name, kind in types.items() if "estimates" not in name}
    assert "depth" not in estimate_topics("", "depth", same_bag=True)(own)
    assert estimate_topics("", "depth", same_bag=False)(own)["depth"] == "/synth/left/depth/image_raw"


def test_without_bags_there_is_a_report_without_pictures(sweep: Path, tmp_path: Path) -> None:
    shutil.copy(sweep, tmp_path / "evaluation.json")
    summary, data = report_of(tmp_path / "evaluation.json")
    assert summary.pictured == 0 and [row["images"] for row in data["frames"]] == [{}, {}]
    assert "1 of 1 bags not found, so no pictures of them: bag; give --bag-root DIR" in summary.notes
    assert data["frames"][0]["command"] == f"scene_synth verify {tmp_path / 'bag'}"
    assert data["tasks"][0]["ranking"]["0"]["abs_rel"]["rows"][0]["factor"] == "light"


def test_a_metric_of_whole_rooms_has_the_curves_that_the_evaluation_tells(tmp_path: Path) -> None:
    values = {"abs_rel": None, "delta_1": None}
    frames = [frame(str(speed), 0, {"speed": speed}, values) for speed in (1, 2)]
    score = {"abs_rel": {"value": 0.5, "low": 0.25, "high": 0.75}, "delta_1": {"value": None, "low": None, "high": None}}
    rows = [{"task": "depth", "by": "speed", "key": 2, "metrics": score, "rooms": 4, "frames": 4}]
    _, data = report_of(write(tmp_path / "a.json", document(frames, rows)))
    (task,) = data["tasks"]
    assert task["curves"]["0"] == {"abs_rel": {"speed": {"points": [None, [0.5, 0.25, 0.75, 4, 4]], "dots": []}}}
    assert task["ranking"]["0"] == {} and task["scores"] == {} and data["frames"] == []


def test_a_latin_hypercube_has_bins_dots_and_standardised_coefficients(tmp_path: Path) -> None:
    """The metric is 0.3 a - 0.4 b plus the room; a and b are 0 to 19 in orders that do not depend on each other much."""
    order = np.random.default_rng(2).permutation(20)
    frames = [
        frame(f"{k}", room, {"a": k, "b": int(order[k])}, {"abs_rel": 0.3 * k - 0.4 * int(order[k]) + 5.0 * room, "delta_1": None})
        for k in range(20)
        for room in range(2)
    ]
    _, data = report_of(write(tmp_path / "a.json", document(frames)))
    assert data["design"] == "latin hypercube" and data["factors"][0]["binned"] and len(data["factors"][0]["columns"]) == 6
    found = data["tasks"][0]["ranking"]["0"]["abs_rel"]
    slopes = {"a": 0.3, "b": -0.4}
    spread = np.std([0.3 * k - 0.4 * int(order[k]) for k in range(20)])
    expected = {name: slope * np.std(range(20)) / spread for name, slope in slopes.items()}
    assert {row["factor"]: row["effect"][0] for row in found["rows"]} == pytest.approx(expected, rel=1e-4)
    assert found["explained"] == pytest.approx(1.0)
    curve = data["tasks"][0]["curves"]["0"]["abs_rel"]["a"]
    assert len(curve["dots"]) == 40 and curve["points"][0][3:] == [2, 8]
    means = [sum(mean for value, mean in curve["dots"] if value == k) for k in (0, 19)]
    assert means == pytest.approx([2 * (0.3 * k - 0.4 * int(order[k]) + 2.5) for k in (0, 19)], abs=1e-4), "rooms are brought together"


def test_a_hostile_evaluation_stays_text(tmp_path: Path) -> None:
    tasks = [{"name": EVIL, "metrics": [METRICS[0] | {"name": EVIL, "unit": EVIL}]}]
    frames = [frame(EVIL, 0, {EVIL: value}, {EVIL: 1.0}, bag=EVIL, room_type=EVIL[:200], task=EVIL) for value in (EVIL, "b")]
    content = document(frames, tasks=tasks, title=EVIL, algorithm=EVIL, created_with=EVIL, missing={EVIL: 1})
    summary, data = report_of(write(tmp_path / "a.json", content))
    page = parse(tmp_path / "a.html")
    assert [name for name, _ in page.tags if name in ("script", "img", "iframe", "object")] == ["script", "script"]
    assert data["title"] == EVIL and data["tasks"][0]["name"] == EVIL and summary.pictured == 0
    policy = next(found["content"] for name, found in page.tags if name == "meta" and "http-equiv" in found)
    assert policy is not None and "default-src 'none'" in policy and "unsafe" not in policy
    assert not [found for _, found in page.tags for key in found if key.startswith("on") or key == "style"]


def test_bad_files_are_refused_in_a_line(sweep: Path, tmp_path: Path) -> None:
    empty = write(tmp_path / "empty.json", document([]))
    with pytest.raises(ReportError, match="expected frames or a summary, got neither; evaluate bags that hold estimates and truth"):
        report_of(empty)
    with pytest.raises(ReportError, match="expected 1 to 6 evaluation files, got 7"):
        report_of(*[sweep] * 7)
    with pytest.raises(ReportError, match="--estimates: expected one evaluation beside it, got several"):
        report_of(sweep, sweep, estimates=tmp_path)
    with pytest.raises(EvaluationError, match="schema: expected"):
        report_of(sweep.parent / "sweep.json")
    assert not (tmp_path / "empty.html").exists()
