"""Flow in both directions: algorithms see both frames, occlusion is that of the direction, and a wrong direction is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from estimate_bags import summary_values
from room_bag import write_room_bag

from evaluation.evaluation_file import read_evaluation
from scene_synth_ros.cli.command_line import main

FRAMES, SIZE = 4, (24, 32)
ALGORITHMS = """
import numpy as np

def motion(number):
    return np.broadcast_to(np.float32([4.0 + 3.0 * (number % 4), 1.0 - 2.0 * (number % 2)]), (24, 32, 2)).copy()

def number(frame, name):
    return int(frame.images[name][0, 0, 0]) // 40

def ahead(frame):
    this = number(frame, "color")
    assert number(frame, "color@next") == this + 1 and "color@previous" not in frame.images
    return {"flow": motion(this)}
ahead.inputs = ("color", "color@next")

def back(frame):
    this = number(frame, "color")
    assert number(frame, "color@previous") == this - 1
    return {"flow_backward": -motion(this - 1)}
back.inputs = ("color", "color@previous")

def back_as_flow(frame):
    return {"flow": back(frame)["flow_backward"]}
back_as_flow.inputs = back.inputs

def late(frame):
    return {"flow": motion(number(frame, "color") - 1)}
late.inputs = back.inputs

def turned(frame):
    return {"flow": -motion(number(frame, "color"))}

def noisy(frame):
    return {"flow": motion(number(frame, "color")) + np.random.default_rng(0).normal(0.0, 9.0, (24, 32, 2))}

def half(frame):
    found = motion(number(frame, "color"))
    found[:, :8] += (12.0, 0.0)
    return {"flow": found}

def later(frame):
    return None
later.inputs = ("color@later",)
"""


def motion(frame: int) -> np.ndarray:
    """Return the motion from a frame of a room to the next, pixels."""
    return np.broadcast_to(np.float32([4.0 + 3.0 * frame, 1.0 - 2.0 * (frame % 2)]), (*SIZE, 2)).copy()


def layers(frame: int) -> dict[str, np.ndarray]:
    nothing, hidden = np.full((*SIZE, 2), np.nan, np.float32), np.zeros(SIZE, np.uint8)
    hidden[:, :8] = 1
    return {
        "flow": nothing if frame == FRAMES - 1 else motion(frame),
        "flow_backward": -motion(frame - 1) if frame else nothing,
        "occlusion": hidden,
        "occlusion_backward": hidden[:, ::-1].copy(),
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("flow")
    (found / "a.py").write_text(ALGORITHMS)
    write_room_bag(found / "bag", rooms=1, frames=FRAMES, size=SIZE, layers=("color",), more=layers)
    write_room_bag(
        found / "ahead", rooms=1, frames=FRAMES, size=SIZE, layers=("color",), more=lambda frame: {"flow": layers(frame)["flow"]}
    )
    return found


def judge(folder: Path, name: str, task: str, out: Path, bag: str = "bag") -> int:
    with pytest.raises(SystemExit) as ended:
        main(["evaluate", str(folder / bag), "--task", task, "--algorithm", f"{folder}/a.py:{name}", "--json", str(out)])
    return int(ended.value.code or 0)


@pytest.mark.parametrize(("name", "task"), [("ahead", "flow"), ("back", "flow_backward")])
def test_an_algorithm_that_sees_both_frames_is_right_in_its_direction(
    folder: Path, tmp_path: Path, name: str, task: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "e.json"
    assert judge(folder, name, task, out) == 0
    found = read_evaluation(out)
    assert summary_values(found, task)["all"] == {"epe": 0.0, "fl": 0.0, "epe_noc": 0.0, "fl_noc": 0.0, "coverage": 1.0}
    assert len(found.frames) == FRAMES - 1 and found.missing["frames without an estimate"] == 0, "the path's end has no truth"
    assert "note:" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "bag", "said"),
    [
        ("back_as_flow", "bag", "the motion to the frame before, the truth of flow_backward; judge them with --task flow_backward"),
        ("late", "bag", "the motion at the stamp before; give each estimate the stamp of the image whose pixels it is of"),
        ("turned", "ahead", "the motion with its sign turned; flow is where a pixel is in the next frame less where it is"),
        ("noisy", "bag", ""),
    ],
)  # fmt: skip
def test_a_method_that_answers_another_question_is_told_so(
    folder: Path, tmp_path: Path, name: str, bag: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judge(folder, name, "flow", tmp_path / "e.json", bag) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if "expected the motion to" in line]
    assert (len(notes), said in "".join(notes)) == (bool(said), True)


def test_pixels_that_the_other_frame_hides_count_in_all_but_noc(folder: Path, tmp_path: Path) -> None:
    assert judge(folder, "half", "flow", tmp_path / "e.json") == 0
    values = summary_values(read_evaluation(tmp_path / "e.json"), "flow")["all"]
    assert values == pytest.approx({"epe": 3.0, "fl": 0.25, "epe_noc": 0.0, "fl_noc": 0.0, "coverage": 1.0}, abs=1e-6)
    assert judge(folder, "half", "flow", tmp_path / "n.json", "ahead") == 0
    assert summary_values(read_evaluation(tmp_path / "n.json"), "flow")["all"]["epe_noc"] is None, "without the layer of occlusion"


def test_an_input_of_no_neighbour_is_refused(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert judge(folder, "later", "flow", tmp_path / "e.json") == 2
    assert "inputs: expected color@next or color@previous for a neighbouring frame, got 'color@later'" in capsys.readouterr().err
