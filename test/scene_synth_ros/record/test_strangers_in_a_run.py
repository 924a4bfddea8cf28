"""Runs of real processes beside publishers that stamp as they like: the run ends, and every frame is logged at its own time."""

import sys
from pathlib import Path

import pytest
from scene_synth_ros_suite import Child, environment, run_suite, stop, wait_until
from strangers import stranger

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.processes.supervisor import NODES

pytestmark = pytest.mark.slow

FRAMES, POINT = 15, "geometry_msgs/PointStamped"
LINE = "/synth/renderer_node is in this namespace, but no renderer of this run: its frames are left out"
WORDS = ("--rooms", 1, "--frames", FRAMES, "-p", "grammar_node.scene.room_type:=hallway")


def assert_frames_at_their_own_time(bag: Path) -> None:
    with BagReader(bag) as reader:
        frames = [message for message in reader.messages(["/synth/camera/depth/image_raw"], file_order=True)]
        clock = [message.log_ns for message in reader.messages(["/clock"], file_order=True)]
    assert len(frames) == FRAMES
    assert [message.log_ns for message in frames] == clock
    stamps = [int.from_bytes(message.data[4:8], "little") * 10**9 + int.from_bytes(message.data[8:12], "little") for message in frames]
    assert [message.log_ns for message in frames] == stamps


def test_a_negative_stamp_is_refused_and_the_run_ends(tmp_path: Path) -> None:
    env = environment()
    with stranger(env, {"/other/point": POINT}, [-5], period_s=0.002):
        process = run_suite(tmp_path / "bag", *WORDS, "-p", "recorder_node.extra_topics:=['/other/*']", env=env, timeout_s=600)
    assert process.returncode == 0, process.stderr
    assert "/other/point: a message was refused: expected a stamp from 0 to 9223372036 s, got -5.000000000 s" in process.stderr
    assert "Traceback" not in process.stderr
    assert_frames_at_their_own_time(tmp_path / "bag")


def test_wall_time_from_inside_the_namespace_drags_no_frame_along(tmp_path: Path) -> None:
    env = environment()
    with stranger(env, {"/synth/stranger": POINT}, ["wall"]):
        process = run_suite(tmp_path / "bag", *WORDS, env=env, timeout_s=600)
    assert process.returncode == 0, process.stderr
    assert_frames_at_their_own_time(tmp_path / "bag")
    with BagReader(tmp_path / "bag") as reader:
        strange = [message.log_ns for message in reader.messages(["/synth/stranger"])]
        assert strange and reader.summary.end_ns - reader.summary.start_ns < 60 * 10**9, "one message at wall time would make it decades"


def test_a_forgotten_renderer_of_the_same_name_is_told_and_adds_no_frame(tmp_path: Path) -> None:
    env = environment()
    small = ["-p", "camera.width:=48", "-p", "camera.height:=36", "-p", "render.samples_per_pixel:=1"]
    forgotten = Child([sys.executable, "-m", NODES["renderer_node"].module, "--ros-args", "-r", "__ns:=/synth", *small], env=env)
    try:
        wait_until(lambda: "kernels are ready" in forgotten.said()[1], 180, "the forgotten renderer", forgotten)
        process = run_suite(tmp_path / "bag", *WORDS, env=env, timeout_s=600)
        assert process.returncode == 0, process.stderr
        assert process.stderr.count(LINE) == 3, "each node says it once"
        assert "the run of another command is in this namespace; its rooms are left alone" in forgotten.said()[1]
    finally:
        stop(forgotten)
    assert_frames_at_their_own_time(tmp_path / "bag")
    with BagReader(tmp_path / "bag") as reader:
        sizes = {len(message.data) // (96 * 72) for message in reader.messages(["/synth/camera/color/image_raw"])}
    assert sizes == {3}, "every image is of the run's own camera"
