"""How node processes end."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from scene_synth_ros_suite import Child, environment, node_pids, stop, wait_until

from scene_synth_ros.bags.bag_reader import BagReader

TOPIC, COUNT = "/synth/burst", 80
SENDER = """
import sys, time
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from scene_synth_ros.suite.process import init_ros
from scene_synth_ros.suite.qos import stream_qos
init_ros([])  # as a node of the suite: what is lost on the way is sent again after 0.2 s
node = Node("sender")
publisher = node.create_publisher(String, sys.argv[1], stream_qos(int(sys.argv[2])))
while publisher.get_subscription_count() == 0:
    time.sleep(0.05)
time.sleep(1.5)  # the recorder has matched in its turn by then, on a busy machine too
print("connected", flush=True)
sys.stdin.readline()
for index in range(int(sys.argv[2])):
    publisher.publish(String(data=f"{index} " + 1000 * "x"))
print("sent", flush=True)
time.sleep(60)
"""
LAUNCH = """
import os, subprocess, sys, time
subprocess.Popen([sys.executable, *sys.argv[1:]], env=os.environ | {"SCENE_SYNTH_LAUNCH": str(os.getpid())})
time.sleep(60)
"""


def test_a_node_ends_with_its_launch_whatever_ends_that(tmp_path: Path) -> None:
    env = environment() | {"SCENE_SYNTH_TEST": str(tmp_path)}
    words = ["-m", "scene_synth_ros.record.recorder_node", "--ros-args", "-r", "__ns:=/synth", "-p", f"bag:={tmp_path / 'bag'}"]
    launch = Child([sys.executable, "-c", LAUNCH, *words], env=env)
    try:
        wait_until(lambda: "recording to" in launch.said()[1], 30, "the recorder", launch)
        launch.kill()
        wait_until(lambda: not node_pids(str(tmp_path)), 10, "the recorder to end", launch)
    finally:
        stop(launch)
        for pid in node_pids(str(tmp_path)).values():
            os.kill(pid, signal.SIGKILL)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_recorder_that_lags_behind_takes_what_was_sent_before_the_signal(tmp_path: Path, number: signal.Signals) -> None:
    env = environment()
    words = ["-m", "scene_synth_ros.record.recorder_node", "--ros-args", "-r", "__ns:=/synth", "-p", f"bag:={tmp_path / 'bag'}"]
    recorder = Child([sys.executable, *words], env=env)
    sender = subprocess.Popen(
        [sys.executable, "-c", SENDER, TOPIC, str(COUNT)], env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert sender.stdout.readline() == "connected\n"
        recorder.send_signal(signal.SIGSTOP)
        sender.stdin.write("send\n")
        sender.stdin.flush()
        assert sender.stdout.readline() == "sent\n"
        recorder.send_signal(number)
        recorder.send_signal(signal.SIGCONT)
        _, errors = recorder.communicate(timeout=180)
        assert recorder.returncode == 0 and "Traceback" not in errors, errors
    finally:
        stop(recorder)
        sender.kill()
        sender.communicate()
    with BagReader(tmp_path / "bag") as reader:
        assert sum(1 for _ in reader.messages([TOPIC])) == COUNT


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (None, "--params-file node.yaml: expected a parameter file, got none; check the path"),
        ("a: [1", "Couldn't parse params file: '--params-file node.yaml'"),
    ],
)
def test_a_parameter_file_that_cannot_be_read_ends_a_node_with_one_line(tmp_path: Path, text: str | None, line: str) -> None:
    if text is not None:
        (tmp_path / "node.yaml").write_text(text)
    words = ["-m", "scene_synth_ros.render.renderer_node", "--ros-args", "--params-file", "node.yaml"]
    process = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=300, check=False
    )
    assert process.returncode == 2
    assert line in process.stderr.splitlines()[-1] and ".c:" not in process.stderr.splitlines()[-1]


FAULTY = """
import sys
from rclpy.node import Node
from scene_synth_ros.suite.process import run_node

class Faulty(Node):
    exit_code = None

    def __init__(self):
        super().__init__("faulty")
        self.create_timer(0.01, self.work)
        self.mistake("make")

    def work(self):
        self.exit_code = 0
        self.mistake("work")

    def close(self):
        self.mistake("close")

    def mistake(self, when):
        if sys.argv[1] == when:
            raise ValueError(f"mistake in {when}")

run_node(Faulty, [])
"""


@pytest.mark.parametrize("when", ["make", "work", "close"])
def test_a_fault_of_the_program_ends_a_process_with_a_status_of_its_own(when: str) -> None:
    process = subprocess.run(
        [sys.executable, "-c", FAULTY, when], env=environment(), capture_output=True, text=True, timeout=300, check=False
    )
    assert process.returncode == 70
    assert process.stderr.count("Traceback") == 1 and f"ValueError: mistake in {when}; please report it" in process.stderr
