"""Bad input and dying processes: one clear line, nothing lost that was recorded, no process left behind."""

import os
import random
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from scene_synth_ros_suite import Child, command, environment, node_pids, record_command, stop, wait_until

from grammar.synthesize import CameraTimes, SceneSynthesizer
from scene_synth_ros.bags.bag_inspect import inspect_bag
from scene_synth_ros.bags.bag_reader import BagReader, BagReadError
from scene_synth_ros.bags.bag_repair import repair_bag
from scene_synth_ros.bags.bag_writer import BagWriter
from scene_synth_ros.cli.command_line import main
from scene_synth_ros.cli.parameters.run_parameters import RunWords, run_parameters
from scene_synth_ros.cli.processes.supervisor import NODES
from scene_synth_ros.offline.offline_bag import OfflineBag
from scene_synth_ros.offline.settings import read_settings

pytestmark = pytest.mark.slow

HALLWAY = ("-p", "grammar_node.scene.room_type:=hallway")


def run_briefly(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(*words), env=environment(), capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["-p", "grammar_node.scene.room_width_m:=0.1"], "grammar_node: scene.room_width_m: expected 0."),
        (["-p", "king_node.rooms:=3"], "unknown node 'king_node'; known: grammar_node, renderer_node, recorder_node"),
        (
            ["--params", "nowhere.yaml"],
            "nowhere.yaml: expected a parameter file, or the name of a shipped one: demo, ground_truth, live, main, ",
        ),
    ],
)
def test_bad_settings_end_the_run_with_one_line(tmp_path: Path, words: list[str], line: str) -> None:
    process = run_briefly("run", "--record", tmp_path / "new" / "bag", "--rooms", 1, *words)
    assert process.returncode != 0
    assert line in process.stderr
    assert "Traceback" not in process.stderr
    assert "faults" not in process.stdout
    assert not list(tmp_path.iterdir()), "the next try finds what this one found"


@pytest.mark.parametrize(
    ("node", "setting", "line"),
    [
        ("grammar_node", "scene.room_type:=dungeon", "grammar_node: scene.room_type: expected one of bathroom, bedroom, "),
        ("grammar_node", "rate_hz:=fast", "parameter rate_hz: expected a number in [0.1, 1000.0] Hz, got 'fast'"),
        ("renderer_node", "camera.widht:=3", "renderer_node: unknown parameter 'camera.widht'; did you mean 'camera.width'?"),
    ],
)
def test_bad_settings_end_a_node_with_one_line(node: str, setting: str, line: str) -> None:
    words = [sys.executable, "-m", NODES[node].module, "--ros-args", "-r", "__ns:=/synth", "-p", setting]
    process = subprocess.run(words, env=environment(), capture_output=True, text=True, timeout=300, check=False)
    assert process.returncode != 0
    (said,) = process.stderr.splitlines()
    assert line in said


def test_an_existing_folder_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "precious").write_text("kept")
    process = run_briefly("run", "--record", tmp_path / "bag", "--rooms", 1)
    assert process.returncode == 2
    assert "exists already; choose another folder or remove it" in process.stderr
    assert [path.name for path in (tmp_path / "bag").iterdir()] == ["precious"]


def start_long_run(bag: Path) -> tuple[Child, str]:
    """Start a run of many small frames; return it and a marker of its processes."""
    env = environment()
    marker = f"SCENE_SYNTH_TEST={os.getpid()}-{bag}"
    env["SCENE_SYNTH_TEST"] = marker.partition("=")[2]
    return Child(record_command(bag, "--rooms", 50, "--frames", 40, *HALLWAY), env=env, start_new_session=True), marker


def wait_for_frames(bag: Path, child: Child) -> None:
    """Wait until the bag's file has grown beyond its first chunk, so that frames are on disk."""
    files = lambda: [path for path in bag.glob("*.mcap.active") if path.stat().st_size > 100_000]  # noqa: E731
    wait_until(files, 300, "frames in the bag", child)


def test_ctrl_c_ends_everything_and_leaves_a_whole_bag(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    process, marker = start_long_run(bag)
    try:
        wait_for_frames(bag, process)
        assert set(node_pids(marker)) >= {"grammar_node", "renderer_node", "recorder_node"}
        os.killpg(process.pid, signal.SIGINT)
        output, errors = process.communicate(timeout=60)
        assert process.returncode == 130, errors
        assert "Traceback" not in errors
        assert not node_pids(marker)
        report = inspect_bag(bag)
        assert not report.faults, report.faults
        assert "interrupted" in output
    finally:
        stop(process)


@pytest.mark.parametrize(("node", "number"), [("renderer_node", signal.SIGKILL), ("recorder_node", signal.SIGTERM)])
def test_a_node_that_somebody_ends_ends_the_run_and_the_bag_is_whole(tmp_path: Path, node: str, number: signal.Signals) -> None:
    bag = tmp_path / "bag"
    process, marker = start_long_run(bag)
    try:
        wait_for_frames(bag, process)
        os.kill(node_pids(marker)[node], number)
        output, errors = process.communicate(timeout=60)
        assert process.returncode == 1
        assert f"run: {node} was ended by {number.name}" in output
        assert "Traceback" not in errors
        assert not node_pids(marker)
        with BagReader(bag) as reader:
            assert reader.summary.finished
            assert sum(1 for _ in reader.messages(["/synth/camera/depth/image_raw"])) > 0
    finally:
        stop(process)


def test_a_full_disk_ends_the_run_with_one_line_and_a_whole_bag(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    limit = 24_000_000  # no file may grow beyond it, as if the disk were full; Fast DDS's shared memory needs less
    overrides = ["-p", "recorder_node.compression:=none", "-p", "renderer_node.render.samples_per_pixel:=1"]
    process = subprocess.run(
        command("run", "--record", bag, "--rooms", 5, "--frames", 10, *HALLWAY, *overrides),
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert process.returncode == 1
    (line,) = (line for line in process.stderr.splitlines() if "the bag is whole with" in line and "recorder_node]" in line)
    assert str(bag) in line
    assert "Traceback" not in process.stderr
    with BagReader(bag) as reader:
        assert reader.summary.finished
        assert sum(1 for _ in reader.messages(["/synth/camera/depth/image_raw"])) >= 1


def test_a_truncated_bag_is_told_and_replayed_as_far_as_it_goes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut.mcap"
    size = ("renderer_node.camera.width:=320", "renderer_node.camera.height:=240", "renderer_node.render.samples_per_pixel:=1")
    settings = read_settings(run_parameters(RunWords(rooms=1, frames=8, record=whole, overrides=(HALLWAY[1], *size))))
    synthesizer, times = SceneSynthesizer.from_config(), CameraTimes(frames=8, start_ns=10**9, rate_hz=10.0)
    with OfflineBag(whole, settings, synthesizer.floor_map) as bag:
        bag.add_room(synthesizer.synthesize(settings.grammar["scene"], 1, 0, times))
    data = next(whole.glob("*.mcap")).read_bytes()
    cut.write_bytes(data[: len(data) * 3 // 4])
    assert inspected(cut) == 1
    assert "fault: " in capsys.readouterr().out
    replayed = run_briefly("replay", cut, "--rate", 10)
    assert replayed.returncode == 0, replayed.stderr
    junk = tmp_path / "junk.mcap"
    junk.write_bytes(b"no bag at all" * 100)
    refused = run_briefly("replay", junk)
    assert refused.returncode != 0
    assert "Traceback" not in replayed.stderr + refused.stderr
    for bag in (junk, tmp_path / "nowhere"):
        assert inspected(bag) != 0
        assert "Traceback" not in capsys.readouterr().err
    for compression in ("none", "zstd"):
        small = rechunked(whole, tmp_path / compression, compression)
        draw = random.Random(compression)
        for number in range(8):
            check_repair(small, draw.randrange(len(small)), tmp_path / f"{compression}{number}")


def inspected(bag: Path) -> object:
    """Return the exit status of ``scene_synth inspect``."""
    with pytest.raises(SystemExit) as end:
        main(["inspect", str(bag)])
    return end.value.code


def rechunked(bag: Path, out: Path, compression: str) -> bytes:
    """Return the file of a bag, written again in small chunks."""
    with BagReader(bag) as reader, BagWriter(out, compression=compression, chunk_size=50_000) as writer:
        for topic in reader.summary.topics:
            writer.add_topic(topic.name, topic.type_name, topic.qos, reader.summary.definitions[topic.type_name])
        for message in reader.messages(file_order=True):
            writer.write(message.topic, message.data, message.log_ns, message.publish_ns)
    return next(out.glob("*.mcap")).read_bytes()


def check_repair(data: bytes, size: int, folder: Path) -> None:
    """Cut a bag at a byte: what is repaired of it has no faults; only where no whole frame is left there is nothing to repair."""
    folder.mkdir()
    (folder / "bag_0.mcap.active").write_bytes(data[:size])
    try:
        report = repair_bag(folder, folder.with_name(f"{folder.name}_repaired"), compression="none")
    except BagReadError:
        assert size < 0.2 * len(data)
        return
    assert inspect_bag(report.bag).faults == (), f"cut at {size} of {len(data)}"


def test_killing_the_run_itself_leaves_no_process(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    process, marker = start_long_run(bag)
    try:
        wait_for_frames(bag, process)
        process.kill()
        wait_until(lambda: not node_pids(marker), 60, "the nodes to end")
        assert not inspect_bag(bag).faults
    finally:
        stop(process)
