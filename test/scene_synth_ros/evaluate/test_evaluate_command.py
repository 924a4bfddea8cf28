"""``scene_synth evaluate`` on a tiny bag: known errors come out exactly, bad input is one line, regressions fail the gate."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from estimate_bags import REGRESSIONS, noisy_frames, summary_values, write_estimates
from rclpy.serialization import serialize_message
from room_bag import CAMERA, RoomBag, write_room_bag
from sensor_msgs.msg import CameraInfo

from evaluation.evaluation_file import TruthRecord, read_evaluation
from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.bags.run_info import PARAMETERS_NAME, parameters_file
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.messages.conversions import camera_info_to_msg

TASKS = "depth,normals,semantic"
ALGORITHM = """
import numpy as np

class Scaled:
    inputs = ("color", "depth", "pose")

    def __init__(self):
        self.frames = 0

    def __call__(self, frame):
        self.frames += 1
        assert frame.K[0, 0] > 0 and frame.images["color"].shape == (frame.height, frame.width, 3) == (24, 32, 3)
        assert frame.world_from_camera.shape == (4, 4) and self.frames <= 2, "a new object for each room"
        return {"depth": frame.images["depth"] * 1.1, "poses": frame.world_from_camera} if self.frames == 1 else None

def broken(frame):
    return {"depth": 1 / 0}

def small(frame):
    return {"depth": np.ones((12, 16))}

def words(frame):
    return "depth"
"""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> RoomBag:
    folder = tmp_path_factory.mktemp("evaluate")
    (folder / "algorithms.py").write_text(ALGORITHM)
    bag = write_room_bag(folder / "bag", rooms=6, frames=2, size=(24, 32))
    write_estimates(folder / "estimates", noisy_frames(bag))
    return bag


def call(*words: str | Path) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["evaluate", *map(str, words)])
    return int(ended.value.code or 0)


def own_topics(*tasks: str) -> list[str]:
    return [word for task in tasks for word in ("--task", task, "--topic", f"{task}:={CAMERA}/{task}/image_raw")]


def test_the_truth_as_estimate_is_perfect(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "e.json"
    words = [*own_topics("depth", "normals", "semantic", "instance"), "--task", "poses", "--topic", f"poses:={CAMERA}/pose"]
    assert call(bag.path, *words, "--json", out, "--csv", tmp_path / "e.csv", "--by", "class") == 0
    found = read_evaluation(out)
    perfect = {"depth": ("abs_rel", 0.0), "normals": ("mean", 0.0), "semantic": ("miou", 1.0), "instance": ("coverage", 1.0)}
    for task, (metric, value) in {**perfect, "poses": ("rpe_translation", 0.0)}.items():
        assert summary_values(found, task)["all"][metric] == pytest.approx(value, abs=1e-3 if task == "normals" else 1e-9)
        assert summary_values(found, task)["all"]["coverage"] == 1.0
    assert found.missing["frames without an estimate"] == 0
    assert {row.key.bag for row in found.frames} == {str(Path("..") / bag.path.parent.name / "bag")} or len(found.frames) == 4 * 12 + 6
    assert "chair" in summary_values(found, "semantic", "class")
    printed = capsys.readouterr().out
    assert "abs_rel" in printed and "chair" in printed and "note:" not in printed
    assert (tmp_path / "e.csv").read_text().count("\n") > 20


def test_an_algorithm_gets_its_inputs_and_its_known_error_comes_out(
    bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = bag.path.parent, tmp_path / "e.json"
    words = ["--task", "depth,depth_aligned,poses", "--algorithm", f"{folder}/algorithms.py:Scaled", "--json", out]
    assert call(bag.path, *words, "--estimates-out", tmp_path / "est") == 0
    found = read_evaluation(out)
    assert summary_values(found, "depth")["all"]["abs_rel"] == pytest.approx(0.1, abs=1e-7)
    assert summary_values(found, "depth_aligned")["all"]["abs_rel"] == pytest.approx(0.0, abs=1e-7)
    assert found.missing["frames without an estimate"] == 6, "of three tasks"
    assert summary_values(found, "depth")["all"]["coverage"] == pytest.approx(0.5)
    assert "note: depth: 6 frames without an estimate" in capsys.readouterr().out
    with BagReader(tmp_path / "est") as reader:
        written = [message.log_ns for message in reader.messages()]
    assert sorted(set(written)) == sorted(bag.images)[::2] and len(written) == 2 * 6, "a depth and a pose each"
    again = tmp_path / "again.json"
    assert call(bag.path, "--task", "depth", "--estimates", tmp_path / "est", "--json", again) == 0
    assert summary_values(read_evaluation(again), "depth") == summary_values(found, "depth")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "--task: expected at least one of depth"),
        (["--task", "height"], "--task height: expected one of depth"),
        (["--task", "depth"], "expected estimates of depth on /estimates/depth/image_raw, got /synth/camera/color/image_raw"),
        (["--task", "depth", "--topic", "depth"], "--topic depth: expected TASK:=/TOPIC"),
        (["--task", "depth", "--topic", "depth:=/no"], "expected estimates of depth on /no"),
        (["--task", "depth", "--topic", f"depth:={CAMERA}/pose"], "expected sensor_msgs/msg/Image or"),
        (["--task", "flow"], "expected truth of flow on <camera>/flow/image_raw"),
        (["--task", "depth", "--estimates", "/nowhere"], "/nowhere: not found"),
        (["--task", "depth", "--algorithm", "{folder}/algorithms.py:nobody"], "got Scaled, broken, small, words"),
        (["--task", "depth", "--algorithm", "{folder}/algorithms.py:broken"], "ZeroDivisionError: division by zero in line 17"),
        (["--task", "depth", "--algorithm", "{folder}/algorithms.py:words"], 'expected a mapping such as {"depth": array}'),
        (["--task", "depth", "--estimates", "{folder}/estimates", "--baseline", "{folder}/algorithms.py"], "an evaluation as JSON"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(bag: RoomBag, words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(bag.path, *(word.replace("{folder}", str(bag.path.parent)) for word in words)) == 2
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1


def test_estimates_of_another_size_and_stamp_are_told_and_missing(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frames = {stamp + (5 if i == 0 else 0): images for i, (stamp, images) in enumerate(noisy_frames(bag).items())}
    frames[max(frames)]["depth"] = frames[max(frames)]["depth"][::2, ::2]
    assert call(bag.path, "--task", "depth", "--estimates", write_estimates(tmp_path / "odd", frames)) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note:")]
    assert "got 1 of 12 stamps that no truth has, the first 1000000005 ns" in notes[0]
    assert "expected an image of 32x24 pixels as the truth is, got 16x12" in notes[1]
    assert notes[2] == "note: depth: 2 frames without an estimate"


def test_the_variants_of_a_sweep_are_told_apart_by_their_factors(bag: RoomBag, tmp_path: Path) -> None:
    base = {"room_type": "bedroom", "seed": 3, "index": 0, "file": "room.json"}
    rows = []
    for number, scale in enumerate((1.0, 1.2)):
        truth = write_room_bag(tmp_path / "variants" / f"000{number}", rooms=1, frames=1, size=(24, 32))
        frames = {stamp: {"depth": images["depth"] * np.float32(scale)} for stamp, images in truth.images.items()}
        write_estimates(tmp_path / "est" / f"000{number}", frames)
        rows.append(
            {
                "id": f"000{number}",
                "bag": f"variants/000{number}",
                "base": base,
                "factors": {"light": scale, "color": [0.5, scale]},
                "changed": [],
            }
        )
    (tmp_path / "sweep.json").write_text(json.dumps({"schema": "scene_synth_sweep/1", "factors": [], "variants": rows}))
    out = tmp_path / "e.json"
    assert call(tmp_path, "--task", "depth", "--estimates", tmp_path / "est", "--json", out, "--by", "light") == 0
    found = read_evaluation(out)
    assert {row.key.bag for row in found.frames} == {"variants/0000", "variants/0001"}
    assert {(row.key.room_type, row.key.seed) for row in found.frames} == {("bedroom", 3)}
    assert set(summary_values(found, "depth", "color")) == {"[0.5, 1.0]", "[0.5, 1.2]"}
    assert found.created_with.count("--topic depth:=/estimates/depth/image_raw") == 1
    by_light = {key: round(values["abs_rel"] or 0.0, 6) for key, values in summary_values(found, "depth", "light").items()}
    assert by_light == {1.0: 0.0, 1.2: 0.2}


def test_the_command_that_an_evaluation_names_makes_it_again(bag: RoomBag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever way it was written: abbreviated, repeated, behind ``--``, with spaces, quotes and words that begin with a dash."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my bags").symlink_to(bag.path.parent)
    with BagWriter(tmp_path / "both") as writer:
        for path in (bag.path.parent / "estimates", bag.path):
            with BagReader(path) as reader:
                for message in reader.messages([topic for topic in reader.types if "/depth/image_raw" in topic]):
                    writer.add_topic(message.topic, message.type_name)
                    writer.write(message.topic, message.data, message.log_ns, message.log_ns)
    truth = f"depth_aligned:={CAMERA}/depth/image_raw"
    words = ["--tit=-it's", "--task", "depth", "--task", "depth,depth_aligned", "--topic", truth, "--estimates", "none"]
    assert call(*words, "--estimates", "both", "--json=e.json", "--", "my bags/bag") == 0
    first = read_evaluation(tmp_path / "e.json")
    assert first.created_with == (
        "scene_synth evaluate 'my bags/bag' --task depth --task depth_aligned --estimates both "
        f"--topic {truth} --topic depth:=/estimates/depth/image_raw --json e.json '--title=-it'\"'\"'s'"
    )
    errors = [summary_values(first, task)["all"]["abs_rel"] for task in ("depth", "depth_aligned")]
    assert errors == [pytest.approx(0.016, abs=0.002), 0.0], "the topics of the two tasks differ"
    (tmp_path / "e.json").unlink()
    assert call(*shlex.split(first.created_with)[2:]) == 0
    assert read_evaluation(tmp_path / "e.json") == first


def test_a_baseline_of_another_truth_is_refused(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def parameters(seed: int, grammar_file: str = "grammars/my.yaml") -> dict[str, bytes]:
        grammar = {"seed": seed, "scene.room_type": "bedroom,office", "grammar_file": grammar_file}
        return {PARAMETERS_NAME: parameters_file({"/synth/grammar_node": grammar, "/synth/renderer_node": {"seed": 9}})}

    baseline, small = tmp_path / "baseline.json", {"rooms": 1, "frames": 1, "size": (24, 32)}
    first = write_room_bag(tmp_path / "first", **small, attachments=parameters(3))
    assert call(first.path, *own_topics("depth", "semantic"), "--json", baseline) == 0
    info = camera_info_to_msg(first.camera, 0, "eye")
    assert read_evaluation(baseline).truth == TruthRecord(
        image_width=32,
        image_height=24,
        camera_model="plumb_bob",
        intrinsics=tuple(round(info.k[place], 2) for place in (0, 4, 2, 5)),
        distortion=tuple(info.d),
        label_standard="nyu40",
        seed=3,
        grammar="my.yaml",
        room_types="bedroom,office",
    )
    assert call(first.path, *own_topics("depth", "semantic"), "--baseline", baseline) == 0
    others = {
        "seed 3, got 4": write_room_bag(tmp_path / "seed", **small, attachments=parameters(4)),
        "grammar my.yaml, got that of the program": write_room_bag(tmp_path / "grammar", **small, attachments=parameters(3, "")),
        "image width 32, got 64": write_room_bag(tmp_path / "size", **{**small, "size": (48, 64)}, attachments=parameters(3)),
    }
    for said, other in others.items():
        capsys.readouterr()
        assert call(other.path, *own_topics("depth", "semantic"), "--baseline", baseline) == 2
        told = capsys.readouterr().err
        assert f"truth: expected the baseline's {said}; " in told and told.count("\n") == 1


def test_what_a_strange_bag_tells_of_its_truth_is_left_out_or_made_printable(tmp_path: Path) -> None:
    grammar = b'{"/synth/grammar_node": {"ros__parameters": {"seed": true, "scene.room_type": [1], "grammar_file": "\\a"}}}'
    source = write_room_bag(tmp_path / "source", rooms=1, frames=1, size=(24, 32), attachments={PARAMETERS_NAME: grammar})
    with BagWriter(tmp_path / "bag") as writer, BagReader(source.path) as reader:
        writer.set_attachment(PARAMETERS_NAME, grammar)
        for message in reader.messages():
            data, info = message.data, "camera_info" in message.topic
            if info:
                data = bytes(serialize_message(CameraInfo(width=32, height=24, k=[float("nan")] * 9)))
            writer.add_topic(message.topic, message.type_name)
            writer.write(message.topic, data, message.log_ns, message.log_ns)
    assert call(tmp_path / "bag", *own_topics("depth"), "--json", tmp_path / "e.json") == 0
    assert read_evaluation(tmp_path / "e.json").truth == TruthRecord(label_standard="nyu40", room_types="[1]", grammar="?")


def test_every_regression_fails_the_gate_and_no_clean_rerun_does(bag: RoomBag, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, baseline = bag.path.parent, tmp_path / "baseline.json"
    assert call(bag.path, "--task", TASKS, "--estimates", folder / "estimates", "--json", baseline) == 0
    codes = {}
    for number, (name, change) in enumerate(REGRESSIONS.items()):
        estimates = write_estimates(tmp_path / f"regression_{number}", change(noisy_frames(bag)))
        codes[name] = call(bag.path, "--task", TASKS, "--estimates", estimates, "--baseline", baseline)
    wrong_frame = write_estimates(tmp_path / "wrong_frame", noisy_frames(bag), frame_id="map")
    codes["normals are said to be in another frame"] = call(bag.path, "--task", TASKS, "--estimates", wrong_frame, "--baseline", baseline)
    assert codes == dict.fromkeys(codes, 1)
    capsys.readouterr()
    again = write_estimates(tmp_path / "clean", noisy_frames(bag))
    for _ in range(10):
        assert call(bag.path, "--task", TASKS, "--estimates", again, "--baseline", baseline) == 0, capsys.readouterr().out
