"""Runs of real processes beside publishers that stamp as they like: the run ends, and every frame is logged at its own time."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from scene_synth_ros_suite import Child, announced_often, environment, run_suite, stop, wait_until

from scene_synth_ros.bags.bag_reader import BagReader
from scene_synth_ros.cli.processes.supervisor import NODES

STRANGER = """
import sys, time
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped
from rclpy.node import Node
topic, period_s, seconds = sys.argv[1], float(sys.argv[2]), sys.argv[3]
rclpy.init()
node = Node("stranger", namespace="/synth")
publisher = node.create_publisher(PointStamped, topic, 100)
print("here", flush=True)
while rclpy.ok():
    message = PointStamped()
    now = time.time_ns()
    message.header.stamp = Time(sec=int(seconds)) if seconds != "wall" else Time(sec=now // 10**9, nanosec=now % 10**9)
    publisher.publish(message)
    time.sleep(period_s)
"""
FRAMES = 15
LINE = "/synth/renderer_node is in this namespace, but no renderer of this run: its frames are left out"
WORDS = ("--rooms", 1, "--frames", FRAMES, "-p", "grammar_node.scene.room_type:=hallway")


@contextmanager
def stranger(env: dict[str, str], topic: str, period_s: float, seconds: object) -> Iterator[None]:
    """Publish a PointStamped on a topic, stamped with so many seconds or ``wall`` time, as long as the block lasts."""
    process = subprocess.Popen(
        [sys.executable, "-c", STRANGER, topic, str(period_s), str(seconds)], env=announced_often(env), stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None and process.stdout.readline() == "here\n"
        yield
    finally:
        process.terminate()
        process.communicate()


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
    with stranger(env, "/other/point", 0.002, -5):
        process = run_suite(tmp_path / "bag", *WORDS, "-p", "recorder_node.extra_topics:=['/other/*']", env=env, timeout_s=600)
    assert process.returncode == 0, process.stderr
    assert "/other/point: a message was refused: expected a stamp from 0 to 9223372036 s, got -5.000000000 s" in process.stderr
    assert "Traceback" not in process.stderr
    assert_frames_at_their_own_time(tmp_path / "bag")


def test_wall_time_from_inside_the_namespace_drags_no_frame_along(tmp_path: Path) -> None:
    env = environment()
    with stranger(env, "/synth/stranger", 0.01, "wall"):
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
